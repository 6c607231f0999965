"""The experiments of chapters 4 and 6 in one laboratory, each run once and only when a sentence asks for it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

from palpate.bench import Experiment, build, with_values
from palpate.bench.summary import DONE, INTERRUPTED
from palpate.records import Record
from palpate_thesis.figures import fig_4_02, fig_4_04, fig_6_06, fig_6_10, fig_6_14, fig_6_15
from palpate_thesis.figures.fig_6_02_05 import by_ratios
from palpate_thesis.figures.fig_6_11_17 import (
    FOAM,
    JUDGED,
    RUBBER,
    RUBBER_SINE,
    SINE,
    SLOW,
    adapted_at,
    away_from_settled,
)
from palpate_thesis.force_control.tracking import Tracking, since_contact, tracking
from palpate_thesis.laboratory import Laboratory
from palpate_thesis.least_squares import press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates
from palpate_thesis.neural_identifier import network
from palpate_thesis.neural_identifier.network import NetworkAnswer, NetworkChoice, NetworkPress

T = TypeVar("T")

STEPS = 5
"""Steps of the physics in a tick during a search: a quarter of those of the figures, at half the cost. They change as
many verdicts as another draw of the noise does."""
SWITCHED = 4.0
"""Length of contact in figure 4.2 [s]."""
LARGEST_RATE = fig_6_06.RATES[-1]
UNSTUCK = with_values(FOAM.PARAMETERS, {"wall.side_friction": 0.0})
HYBRID = with_values(fig_6_10.PARAMETERS, {"run.press": 10.0})
"""One interval at each force."""


@dataclass(frozen=True)
class WatchedPress:
    """A press with its least-squares estimates."""

    estimates: PressEstimates
    spread: float  # 10 to 90 % range of the damping by single samples, over the true damping
    clean: bool  # the switch at 5 N kept contact and reached the desired force
    early: bool  # the switch came before the surface was touched
    half_range: float  # of the force's noise [N]
    network: NetworkPress  # the first four seconds, for the network


@dataclass(eq=False)
class Trial:
    """One laboratory and one seed of the noise, with the result of each experiment; None if contact was lost.

    Args:
        laboratory: in which the experiments run.
        seed: of the noise.
        steps: of the physics in a tick.
        stopped: polled between pieces of a run; True ends it with KeyboardInterrupt.
    """

    laboratory: Laboratory
    seed: int = 0
    steps: int = STEPS
    stopped: Callable[[], bool] = lambda: False

    def record(self, experiment: Experiment) -> Record:
        """Run an experiment up to the first loss of contact: no verdict changes after that."""
        e = with_values(self.laboratory.adapt(experiment), {"run.steps": self.steps, "run.losses": 1})
        record = build(e).run(e.run.duration, self.seed, press=e.run.press, progress=self._poll)
        if record.meta["end"] == INTERRUPTED:
            raise KeyboardInterrupt
        return record

    def measure(self, experiment: Experiment, measure: Callable[[Record], T]) -> T | None:
        """`measure` of the record of an experiment; None if contact was lost."""
        record = self.record(experiment)
        return measure(record) if _in_one_contact(record) else None

    def _poll(self, _: float, __: str) -> None:
        if self.stopped():
            raise KeyboardInterrupt

    @cached_property
    def foam(self) -> WatchedPress | None:
        """Press of figures 6.1 to 6.3, which 4.2, 4.4 and 6.6 to 6.8 use too."""
        return self.measure(press_runs.PLAIN, lambda record: _watch_press(record, "foam"))

    @cached_property
    def rubber(self) -> WatchedPress | None:
        """Press of figures 6.4 and 6.5."""
        return self.measure(press_runs.RUBBER, lambda record: _watch_press(record, "rubber"))

    @cached_property
    def foam_answer(self) -> NetworkAnswer | None:
        """Answer of the network in figures 6.7 and 6.8."""
        return self.answer_at(NetworkChoice().rate)

    @cached_property
    def rubber_answer(self) -> NetworkAnswer | None:
        """Answer of the network in figure 6.9, on a rubber of its own."""
        press = self.measure(network.RUBBER, lambda record: network.press_of(record, "rubber"))
        return None if press is None else self.identifiers_answer(press)

    def answer_at(self, rate: float) -> NetworkAnswer | None:
        """Answer of the network of figure 6.6 at a learning rate."""
        return None if self.foam is None else self.identifiers_answer(self.foam.network, rate)

    def identifiers_answer(self, press: NetworkPress, rate: float = NetworkChoice().rate) -> NetworkAnswer:
        """K, B and M of this laboratory's network over a press, at a learning rate."""
        lab = self.laboratory
        return network.answer(
            press, network.identifier_network(lab, rate), int(self.seed if lab.start is None else lab.start)
        )

    @cached_property
    def hybrid(self) -> fig_6_10.Ends | None:
        """Ends of the intervals under hybrid control alone: figure 6.10."""
        return self.measure(HYBRID, fig_6_10.interval_ends)

    @cached_property
    def _foam_steps(self) -> Record:
        return self.record(FOAM.PARAMETERS)

    @cached_property
    def foam_steps(self) -> Tracking:
        """Force on foam that follows steps: figure 6.11."""
        return tracking(*JUDGED)(self._foam_steps)

    @cached_property
    def free_directions(self) -> fig_6_15.Errors | None:
        """Errors of y and angle after the last millimetres of the approach: figure 6.15."""
        record = self._foam_steps
        return fig_6_15.measure_free_errors(record) if _in_one_contact(record) else None

    @cached_property
    def unstuck(self) -> fig_6_15.Errors | None:
        """Errors of y and angle without friction along the surface."""
        return self.measure(UNSTUCK, fig_6_15.measure_free_errors)

    @cached_property
    def foam_sine(self) -> Tracking:
        """Force on foam that follows steps and a sine: figure 6.12."""
        return tracking(*JUDGED)(self.record(SINE.PARAMETERS))

    @cached_property
    def slow_first(self) -> Tracking:
        """Force at a small learning rate, at first: figure 6.13."""
        return tracking(*SLOW.judged)(self.record(SLOW.PARAMETERS))

    @cached_property
    def slow_later(self) -> Tracking:
        """Force at a small learning rate, minutes later: figure 6.14, as long as all others together."""
        return tracking(*fig_6_14.JUDGED)(self.record(fig_6_14.PARAMETERS))

    @cached_property
    def rubber_steps(self) -> Tracking:
        """Force on rubber that follows steps: figure 6.16."""
        return tracking(*JUDGED)(self.record(RUBBER.PARAMETERS))

    @cached_property
    def rubber_sine(self) -> tuple[Tracking, float]:
        """Force on rubber from the start, and the time of adapting [s], infinite if contact was lost: figure 6.17."""
        record = self.record(RUBBER_SINE.PARAMETERS)
        adapted = adapted_at(away_from_settled(record)) if _in_one_contact(record) else float("inf")
        return tracking(*RUBBER_SINE.judged)(record), adapted


def _in_one_contact(record: Record) -> bool:
    """True if the run came to its end without a loss of contact."""
    touched = since_contact(record) >= 0.0
    return record.meta["end"] == DONE and bool(
        (record["phase"][touched] == record["phase"][touched][0]).all()
    )


def _watch_press(record: Record, surface: str) -> WatchedPress:
    press = press_runs.contact(record)
    estimates = press_runs.press_estimates(record)
    low, _, high = by_ratios(press)["B"]
    rows = since_contact(record) < SWITCHED
    early = Record({n: record[n][rows] for n in record.columns}, record.units, record.meta)
    switch = fig_4_02.measure_switch(early)
    return WatchedPress(
        estimates,
        float((high - low) / estimates.true_B),
        switch.clean,
        switch.true_force <= 0.0,
        fig_4_04.half_ranges(record)[0],
        network.cut(network.press_of(record, surface), network.PRESS),
    )
