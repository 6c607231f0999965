"""What one ForceLoop.update costs from Python.

python benchmarks/force/update.py
"""

from __future__ import annotations

import time

import numpy as np
from touches import Rig

from palpate.force import ForceLoop

TICKS = 100_000


class Nothing:
    """Takes what `update` takes."""

    def update(self, force: float, position: float, missed: float = 0.0) -> float:
        return 0.0


def a_call(loop: ForceLoop | Nothing, forces: list[float], positions: list[float]) -> float:
    """The least of five rounds [s]."""
    best = np.inf
    for _ in range(5):
        if isinstance(loop, ForceLoop):
            loop.reset()
        started = time.perf_counter()
        for force, position in zip(forces, positions, strict=True):
            loop.update(force, position)
        best = min(best, (time.perf_counter() - started) / TICKS)
    return float(best)


def main() -> None:
    for name in ("ur5e", "fr3"):
        loop = ForceLoop(Rig(name).gains(20.0, 0.1))
        rng = np.random.default_rng(0)
        for what, level, slope in (("in free motion", 0.0, 0.0), ("learning", 5.0, 2e4)):
            positions = (1e-6 * np.arange(TICKS) % 3e-4).tolist()
            forces = (level + slope * np.array(positions) + 0.1 * rng.standard_normal(TICKS)).tolist()
            best, plain = a_call(loop, forces, positions), a_call(Nothing(), forces, positions)
            print(
                f"{name}, {what:<12}{1e6 * best:6.2f} us a call, best of 5 x {TICKS}; {best / plain:.1f} times a call "
                "of a Python method that does nothing"
            )


if __name__ == "__main__":
    main()
