"""Compile the kernels that many tests use, before the tests start: `python tests/warm_up.py`.

The processes of the tests share a cache: of those that need the same kernel one compiles it, and the others wait. Here
two processes compile different kernels, and each compiles the laws that its kernels have in common once.
"""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec


def bench() -> None:
    """The loop that most experiments share, and its estimators."""
    from palpate.bench import build, load

    build(load("foam-hybrid")).run(0.01)


def serial_arm() -> None:
    """A press with a serial arm, on palpate's own physics and on MuJoCo's."""
    from palpate.press.prepare import PressSpec, prepare_press, surface_of

    for physics in ("own", "mujoco") if find_spec("mujoco") else ("own",):
        question = PressSpec(arm="ur5e", force=20.0, surface=surface_of("K=5000,B=50"), seconds=0.1)
        prepare_press(replace(question, physics=physics)).run()


def slide() -> None:
    """A slide along a curved surface, and the loop of a press alone."""
    from msgspec import structs

    from palpate.force import SlidingLoop, load_arm
    from palpate.force.gains import gains_for
    from palpate.force.slide_table import Slide
    from palpate.force.sliding.paths import directions
    from palpate.slide.ground import ground_of
    from palpate.slide.world import simulate

    numbers = Slide(speed=0.03, mu_max=0.9, slope=0.04)
    gains = structs.replace(gains_for(load_arm("ur5e"), 15.0, cap=4e4), slide=numbers)
    simulate(gains, ground_of("sphere", 0.12, 2e4), directions("circle", 0.1, gains.arm.rate, 0.03, 0.04))
    SlidingLoop(gains).update([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0])


WORK: tuple[tuple[Callable[[], None], ...], ...] = ((bench,), (serial_arm, slide))
"""For each process, what it runs; as long as the other's."""


def main(words: list[str]) -> int:
    """Run the work of one process, or start all of them and wait; the exit code is that of the worst."""
    if words:
        for run in WORK[int(words[0])]:
            run()
        return 0
    started = [subprocess.Popen([sys.executable, __file__, str(number)]) for number in range(len(WORK))]
    return max(process.wait() for process in started)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
