"""The bench: an arm, a surface, a controller and estimators in one loop, run to a record."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate._vector import Vec3
from palpate.arrays import Array
from palpate.bench.estimators import Identifier, watch_run
from palpate.bench.force_input import COLUMNS, StopCondition
from palpate.bench.plant import Loop, start_at
from palpate.bench.simulation import Simulation
from palpate.bench.summary import DONE, INTERRUPTED, NO_CONTACT, Ending
from palpate.controllers.controller import controller
from palpate.errors import InputError
from palpate.records import Readable, Record

CHUNK = 500
"""Ticks between two looks at the progress."""

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Bench(Readable):
    """A closed loop, ready to run.

    Args:
        loop: all its parts.
        q: joint angles at the start [rad].
        meta: additional metadata of the record.
        losses: of contact after which a run ends; 0 ends it only at numbers that are not finite.
        identifier: makes the identifier that watches a run, a new one for each; None for none.
    """

    loop: Loop
    q: Vec3
    meta: dict[str, Any] = field(default_factory=dict)
    losses: int = 0
    identifier: Callable[[], Identifier] | None = None

    def __post_init__(self) -> None:
        controller(type(self.loop.controller))  # a user's own may have only start and step

    def with_surface(self, surface: Any) -> "Bench":
        """Replace the surface by one of `palpate.environments` or a part of your own; return a new bench.

        The surface's ``truth()``, {name: (value, unit)}, becomes the record's; without it the record has no truth.
        """
        plant = self.loop.plant._replace(surface=surface)
        truth = surface.truth() if hasattr(surface, "truth") else {}
        described = {name: {"value": value, "unit": unit} for name, (value, unit) in truth.items()}
        return replace(self, loop=self.loop._replace(plant=plant), meta={**self.meta, "truth": described})

    def with_controller(self, controller: Any) -> "Bench":
        """Replace the controller in contact, a part with ``start()`` and ``step``; return a new bench."""
        return replace(self, loop=self.loop._replace(controller=controller))

    def with_identifier(self, identifier: Callable[[], Identifier]) -> "Bench":
        """Add an identifier that watches; return a new bench, whose records have columns ``K_identifier`` and so on.

        Args:
            identifier: makes one at its start, as a class of `palpate.identifiers` or of your own does: it has
                ``update(regressor, force)`` and ``estimate()`` of the parameters (M, B, K).
        """
        return replace(self, identifier=identifier)

    def with_wave(self, wave: ArrayLike) -> "Bench":
        """Add a force on top of the desired levels and the sine; return a new bench.

        Args:
            wave: [N], one value a tick from contact on, shape (n,); zero after its end.

        Raises:
            InputError: not a list of finite numbers.
        """
        numbers = np.array(wave, dtype=np.float64)
        if numbers.ndim != 1 or not np.isfinite(numbers).all():
            raise InputError(f"wave must be finite numbers of shape (n,), got shape {numbers.shape}")
        schedule = self.loop.schedule._replace(wave=numbers, rate=1.0 / self.loop.tick)
        return replace(self, loop=self.loop._replace(schedule=schedule))

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
        """Run from rest in free motion.

        Args:
            duration: upper bound of the run [s].
            seed: of the noise; the same seed gives the same record, bit for bit.
            press: time from the first contact to the end [s].
            compiled: False runs the same code a tick at a time in plain Python, for a debugger; the numbers are
                the same, it takes some 300 times as long.
            progress: called now and then with the time reached [s] and the phase.
            waiting: called when the loop has to be compiled first, which takes some ten seconds, once.

        Returns:
            One row a tick; ``meta["end"]`` says why the run ended: "done", "no contact", "lost contact", "diverged",
            or "interrupted" by the keyboard, with the rows so far; ``meta["why"]`` says when and what, in a sentence.

        Raises:
            InputError: a duration or a press of less than a tick.
        """
        tick = self.loop.tick
        if not duration >= tick:
            raise InputError(f"duration must be at least one tick ({tick} s), got {duration}")
        if press is not None and not press >= tick:
            raise InputError(f"press must be at least one tick ({tick} s), got {press}")
        simulation = self.simulation(seed, compiled=compiled, waiting=waiting)
        total = round(duration / tick)
        rows, ending = self._rows(simulation, total, None if press is None else round(press / tick), progress)
        columns = {name: _column(rows, i) for i, name in enumerate(COLUMNS)}
        instruments = {
            "instruments": {
                "force": self.loop.force.description(),
                "position": {"lag_s": self.loop.encoder.lag},
            }
        }
        meta = {**self.meta, **instruments, "seed": seed, "end": ending.end, "why": ending.why}
        record = Record(columns, COLUMNS, meta)
        if self.identifier is None:
            return record
        return watch_run(record, self.identifier(), self.loop.estimators, compiled=compiled)

    def simulation(
        self, seed: int = 0, *, compiled: bool = True, waiting: Callable[[], None] | None = None
    ) -> Simulation:
        """The run at its start, to be marched a step at a time; arguments as of `run`."""
        return Simulation(self.loop, start_at(self.loop, self.q), seed, compiled, waiting)

    def _rows(
        self, simulation: Simulation, total: int, press: int | None, progress: Progress | None
    ) -> tuple[list[Array], Ending]:
        """The rows of a run, chunk after chunk, and why it ended."""
        chunks: list[Array] = []
        condition = StopCondition(self.losses)
        done, stop = 0, total
        end: Ending | None = None
        while done < stop and end is None:
            try:
                out = simulation.advance(min(CHUNK, stop - done))
                if simulation.contact is not None and press is not None:
                    stop = min(total, simulation.contact + press)
                # What comes after the stop is no part of the run, whatever it holds.
                out = out[: stop - done]
                keep, end = condition.judge(out, self.loop.controller.trouble(simulation.state.controller))
                chunks.append(out[:keep])
                done += keep
                if progress is not None:
                    progress(done * self.loop.tick, "approach" if simulation.contact is None else "contact")
            except KeyboardInterrupt:  # wherever in a round it comes
                end = Ending(INTERRUPTED, f"interrupted at {done * self.loop.tick:.3f} s")
        if end is None and simulation.contact is None:
            end = Ending(NO_CONTACT, self._no_contact(chunks, total * self.loop.tick))
        return chunks, end or Ending(DONE, "as asked for")

    def _no_contact(self, chunks: list[Array], seconds: float) -> str:
        """Reason why nothing was touched: the distance to the surface, and the time of the approach."""
        gap = -float(chunks[-1][-1, list(COLUMNS).index("penetration")])
        if not gap > 0.0:
            return f"no contact was detected in {seconds:g} s: the force stays below that of a contact"
        message = f"no contact was detected: after {seconds:g} s the tip is still {1e3 * gap:.3g} mm before the surface"
        approach, wall = (self.meta.get("experiment", {}).get(name, {}) for name in ("approach", "wall"))
        if not (approach.get("step", 0.0) > 0.0 and "x" in wall):
            return message
        needed = approach["hold"] + approach["period"] * (wall["x"] - approach["first"]) / approach["step"]
        if needed < seconds:
            return message
        remedy = "extend [run] duration, or begin nearer ([approach] first)"
        return f"{message}; the approach takes {needed:.3g} s: {remedy}"


def _column(rows: list[Array], i: int) -> Array:
    """One column of all chunks, without another copy of them all."""
    return np.concatenate([chunk[:, i] for chunk in rows]) if rows else np.empty(0)
