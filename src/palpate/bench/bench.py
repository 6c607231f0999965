"""The bench: an arm, a surface, a controller and estimators in one loop, run to a record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate._vector import Vec3
from palpate.bench.row import COLUMNS
from palpate.bench.sequence import CONTACT
from palpate.bench.tick import Loop, LoopState, compiled_march, march, start_at
from palpate.errors import InputError
from palpate.records import Record

CHUNK = 500
"""Ticks between two looks at the progress."""

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Bench:
    """A closed loop, ready to run.

    Args:
        loop: all its parts.
        q: joint angles at the start [rad].
        meta: what the record is to carry along.
    """

    loop: Loop
    q: Vec3
    meta: dict[str, Any] = field(default_factory=dict)

    def run(
        self,
        duration: float,
        seed: int = 0,
        *,
        press: float | None = None,
        compiled: bool = True,
        progress: Progress | None = None,
        waiting: Callable[[], None] | None = None,
    ) -> Record:
        """Runs from rest in the air.

        Args:
            duration: at most so long [s].
            seed: of the noise; the same seed gives the same record, bit for bit.
            press: ends so long after the first contact [s].
            compiled: False runs the same code a tick at a time in plain Python, for a debugger; the numbers are
                the same, it takes some 300 times as long.
            progress: called now and then with the time reached [s] and the phase.
            waiting: called when the loop has to be compiled first, which takes some ten seconds, once.

        Returns:
            One row a tick; ``meta["end"]`` says why the run ended: "done", "no contact", "diverged", or "interrupted"
            by the keyboard, with the rows so far.

        Raises:
            InputError: a duration that is not positive.
        """
        tick = self.loop.tick
        if not duration >= tick:
            raise InputError(f"duration must be at least one tick ({tick} s), got {duration}")
        total = round(duration / tick)
        rows, end = _Run(self.loop, seed, compiled, waiting).rows(
            start_at(self.loop, self.q), total, None if press is None else round(press / tick), progress
        )
        columns = {name: rows[:, i].copy() for i, name in enumerate(COLUMNS)}
        return Record(columns, COLUMNS, {**self.meta, "seed": seed, "end": end})


@dataclass
class _Run:
    loop: Loop
    seed: int
    compiled: bool
    waiting: Callable[[], None] | None

    def rows(
        self, state: LoopState, total: int, press: int | None, progress: Progress | None
    ) -> tuple[NDArray[np.float64], str]:
        """The rows of a run and why it ended."""
        generator = np.random.default_rng(self.seed)
        chunks: list[NDArray[np.float64]] = []
        done, first, stop, end = 0, None, total, ""
        while done < stop and not end:
            out = np.empty((min(CHUNK, stop - done), len(COLUMNS)))
            try:
                state = self._march(state, done, generator.standard_normal(len(out)), out)
            except KeyboardInterrupt:
                end = "interrupted"
                break
            finite = np.isfinite(out).all(axis=1)
            if not finite.all():
                end, out = "diverged", out[: int(np.argmin(finite))]
            chunks.append(out)
            if first is None and (out[:, 1] == CONTACT).any():
                first = done + int(np.argmax(out[:, 1] == CONTACT))
                stop = total if press is None else min(total, first + press)
            done += len(out)
            if progress is not None:
                progress(done * self.loop.tick, "approach" if first is None else "contact")
        rows = np.concatenate(chunks)[:stop] if chunks else np.empty((0, len(COLUMNS)))
        return rows, end or ("no contact" if first is None else "done")

    def _march(
        self, state: LoopState, k: int, noise: NDArray[np.float64], out: NDArray[np.float64]
    ) -> LoopState:
        if not self.compiled:
            return march(self.loop, state, k, noise, out)
        return compiled_march.run(self.waiting, self.loop, state, k, noise, out)
