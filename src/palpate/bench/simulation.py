"""The one march through a run: tick after tick, for as long as it is asked to, and changed between ticks if need be."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from palpate._jit import NotCompiled
from palpate.arrays import Array
from palpate.bench.diagnosis import diagnosed
from palpate.bench.row import COLUMNS
from palpate.bench.sequence import CONTACT
from palpate.bench.tick import Loop, LoopState, compiled_march, march

PHASE = list(COLUMNS).index("phase")


@dataclass
class Simulation:
    """A loop on its way. The same seed gives the same rows, bit for bit, in steps of any size.

    Args:
        loop: all its parts; another one of the same types may take its place between ticks.
        state: what it is in; likewise.
        seed: of the noise.
        compiled: False runs the same code in plain Python.
        waiting: called when the loop has to be compiled first.
    """

    loop: Loop
    state: LoopState
    seed: int
    compiled: bool = True
    waiting: Callable[[], None] | None = None
    ticks: int = 0
    """So many have been run."""
    contact: int | None = None
    """The tick of the first contact; None before it."""
    _generator: np.random.Generator = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._generator = np.random.default_rng(self.seed)

    @property
    def since_contact(self) -> float:
        """Time since the first contact [s]; 0 before it."""
        return 0.0 if self.contact is None else (self.ticks - self.contact) * self.loop.tick

    def advance(self, ticks: int) -> Array:
        """Runs so many ticks; their rows in the order of `COLUMNS`, shape (ticks, columns).

        Raises:
            PartError: a part of the user's cannot be compiled, or fails.
        """
        out = np.empty((ticks, len(COLUMNS)))
        self._march(self._generator.standard_normal(ticks), out)
        pressing = out[:, PHASE] == CONTACT
        if self.contact is None and pressing.any():
            self.contact = self.ticks + int(np.argmax(pressing))
        self.ticks += ticks
        return out

    def _march(self, noise: Array, out: Array) -> None:
        if not self.compiled:
            self.state = _march_plain(self.loop, self.state, self.ticks, noise, out)
            return
        try:
            self.state = compiled_march.run(
                self.waiting or _compiling, self.loop, self.state, self.ticks, noise, out
            )
        except NotCompiled as error:
            found = diagnosed(self.loop, self.state)
            found.compiler = str(error.__cause__)
            # The compiler's account is a hundred lines on palpate's own code: whoever wants it asks for it.
            raise found from found.__cause__


def _compiling() -> None:
    """Says why nothing happens for a while, to whoever watches a script."""
    if sys.stderr.isatty():
        sys.stderr.write("palpate: compiling the loop: some ten seconds, once after installation\n")


def _march_plain(loop: Loop, state: LoopState, k: int, noise: Array, out: Array) -> LoopState:
    """As compiled also where numbers are none: plain Python raises there, after the row that has them."""
    out[:] = np.nan
    try:
        with np.errstate(all="ignore"):
            return march(loop, state, k, noise, out)
    except (ArithmeticError, ValueError):
        written = np.isfinite(out[:, 0])
        if np.isfinite(out[written]).all():
            raise
        return state
