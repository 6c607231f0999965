"""`palpate` whose force law fails in its 40th tick of a press: `python faulty_press.py FAULT WORDS...`."""

import sys
import threading
import time

from palpate.cli import main
from palpate.force import ForceLoop

TICK = 40


def raised(error):
    raise error


FAULTS = {
    "the law raises": lambda _: raised(RuntimeError("a fault of the law")),
    "the memory is full": lambda _: raised(MemoryError("no room")),
    "the law gives NaN": lambda _: float("nan"),
    "the law gives 1e9 m/s": lambda _: 1e9,
    "the law gives infinity": lambda _: float("-inf"),
    "the law hangs for 1.5 s": lambda speed: time.sleep(1.5) or speed,
    "the law exits": lambda _: raised(SystemExit(3)),
    "a thread takes the interpreter": lambda speed: (
        threading.Thread(target=busy, daemon=True).start() or speed
    ),
}


def busy() -> None:
    """A thread that computes for ever."""
    while True:
        sum(range(1000))


def spoil(fault) -> None:
    """Put the fault behind the law."""
    update, ticks = ForceLoop.update, [0]

    def spoiled(self, force, position, missed=0.0):
        ticks[0] += 1
        speed = update(self, force, position, missed)
        return fault(speed) if ticks[0] == TICK else speed

    ForceLoop.update = spoiled


if __name__ == "__main__":
    spoil(FAULTS[sys.argv[1]])
    sys.argv = ["palpate", *sys.argv[2:]]
    sys.exit(main())
