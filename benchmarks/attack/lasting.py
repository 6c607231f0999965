"""An hour of each shipped experiment: numbers stay finite, no command exceeds a limit, nothing grows."""

from __future__ import annotations

import resource
from dataclasses import dataclass

import numpy as np

CHUNK = 20_000


@dataclass(frozen=True)
class Lasted:
    """One experiment.

    Args:
        name: its own.
        seconds: simulated.
        finite: every number of every row is.
        over: the largest share of its limit that a torque reached.
        grown: what the process took more in the second half [MB].
    """

    name: str
    seconds: float
    finite: bool
    over: float
    grown: float

    @property
    def good(self) -> bool:
        """Whether it kept its promises."""
        return self.finite and self.over <= 1.0 and self.grown < 20.0


def lasted(name: str, seconds: float) -> Lasted:
    """Runs an experiment for so long, whatever becomes of its contact, and keeps no row."""
    from palpate.bench import build, load
    from palpate.bench.force_input import COLUMNS
    from palpate.bench.plant import compiled_march, start_at

    bench = build(load(name))
    loop, state = bench.loop, start_at(bench.loop, bench.q)
    limits = np.array(loop.conditioning.arm.limits)
    torque = [list(COLUMNS).index(f"torque{i}") for i in (1, 2, 3)]
    generator, rows = np.random.default_rng(0), np.empty((CHUNK, len(COLUMNS)))
    finite, over, half = True, 0.0, 0.0
    ticks = round(seconds / loop.tick)
    for k in range(0, ticks, CHUNK):
        state = compiled_march.run(None, loop, state, k, generator.standard_normal(CHUNK), rows)
        finite = finite and bool(np.isfinite(rows).all())
        over = max(over, float((np.abs(rows[:, torque]) / limits).max()))
        if k <= ticks // 2:
            half = _memory()
    return Lasted(name, seconds, finite, over, _memory() - half)


def _memory() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
