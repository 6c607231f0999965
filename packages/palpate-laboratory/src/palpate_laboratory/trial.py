"""The experiments of chapters 4 and 6 in one laboratory, each run once and only when a sentence asks for it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from palpate.bench import Experiment, build, with_values
from palpate.bench.summary import DONE, INTERRUPTED
from palpate.records import Record
from palpate_laboratory.laboratory import Laboratory
from palpate_thesis.figures import (
    fig_4_02,
    fig_4_04,
    fig_6_06,
    fig_6_10,
    fig_6_14,
    fig_6_15,
)
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
from palpate_thesis.least_squares import press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates
from palpate_thesis.neural_identifier import network
from palpate_thesis.neural_identifier.network import NetworkAnswer, NetworkChoice, NetworkPress

STEPS = 5
"""Of the physics in a tick while a laboratory is looked for: a quarter of the figures', at half the cost. As many
verdicts turn as with another draw of the noise (`benchmarks/steps.py`)."""
SWITCHED = 4.0
"""Seconds of contact that figure 4.2 looks at [s]."""
LARGEST_RATE = fig_6_06.RATES[-1]
UNSTUCK = with_values(FOAM.PARAMETERS, {"wall.side_friction": 0.0})
HYBRID = with_values(fig_6_10.PARAMETERS, {"run.press": 10.0})
"""One interval of each force, of those that figure 6.10 looks at."""


@dataclass(frozen=True)
class WatchedPress:
    """A press that least squares watched."""

    found: PressEstimates
    spread: float  # of the middle eight tenths of single samples' B, over the true B
    clean: bool  # the switch at 5 N, and what followed
    in_the_air: bool  # switched before anything was touched
    half_range: float  # of the force's noise [N]
    network: NetworkPress  # the first four seconds, as the network is given them


@dataclass(eq=False)
class Trial:
    """One laboratory and one seed of the noise, with the result of each experiment; None if contact was lost.

    Args:
        laboratory: in which.
        seed: of the noise.
        steps: of the physics in a tick.
        stopped: asked between pieces of a run whether to give up.
    """

    laboratory: Laboratory
    seed: int = 0
    steps: int = STEPS
    stopped: Callable[[], bool] = lambda: False

    def record(self, experiment: Experiment) -> Record:
        """The run of an experiment here, up to the first loss of contact: no verdict changes after that."""
        e = with_values(self.laboratory.of(experiment), {"run.steps": self.steps, "run.losses": 1})
        record = build(e).run(e.run.duration, self.seed, press=e.run.press, progress=self._look)
        if record.meta["end"] == INTERRUPTED:
            raise KeyboardInterrupt
        return record

    def _look(self, _: float, __: str) -> None:
        if self.stopped():
            raise KeyboardInterrupt

    @cached_property
    def foam(self) -> WatchedPress | None:
        """Figures 6.1 to 6.3, and what 4.2, 4.4 and 6.6 to 6.8 need of a press on foam."""
        return _press_of(self.record(press_runs.PLAIN), "foam")

    @cached_property
    def rubber(self) -> WatchedPress | None:
        """Figures 6.4 and 6.5."""
        return _press_of(self.record(press_runs.RUBBER), "rubber")

    @cached_property
    def foam_answer(self) -> NetworkAnswer | None:
        """Figures 6.7 and 6.8."""
        return None if self.foam is None else self.identifiers_answer(self.foam.network)

    @cached_property
    def rubber_answer(self) -> NetworkAnswer | None:
        """Figure 6.9, on a rubber of its own."""
        record = self.record(network.RUBBER)
        return self.identifiers_answer(network.press_of(record, "rubber")) if _whole(record) else None

    def answer_at(self, rate: float) -> NetworkAnswer | None:
        """Figure 6.6: the network of figure 6.7 at another learning rate."""
        return None if self.foam is None else self.identifiers_answer(self.foam.network, rate)

    def identifiers_answer(self, press: NetworkPress, rate: float = NetworkChoice().rate) -> NetworkAnswer:
        """The network's K, B and M over a press, at a learning rate."""
        lab = self.laboratory
        choice = NetworkChoice(lab.amplitude, lab.weights, rate=rate)
        return network.answer(press, choice, int(self.seed if lab.start is None else lab.start))

    @cached_property
    def hybrid(self) -> fig_6_10.Ends | None:
        """Ends of the intervals under hybrid control alone: figure 6.10."""
        record = self.record(HYBRID)
        return fig_6_10.ends_of(record) if _whole(record) else None

    @cached_property
    def _foam_steps(self) -> tuple[Tracking, fig_6_15.Errors | None]:
        record = self.record(FOAM.PARAMETERS)
        return tracking(*JUDGED)(record), fig_6_15.errors_of(record) if _whole(record) else None

    @property
    def foam_steps(self) -> Tracking:
        """Force on foam that follows steps: figure 6.11."""
        return self._foam_steps[0]

    @property
    def free_directions(self) -> fig_6_15.Errors | None:
        """Figure 6.15, after the last millimetres of the approach."""
        return self._foam_steps[1]

    @cached_property
    def unstuck(self) -> fig_6_15.Errors | None:
        """The same without friction along the surface."""
        record = self.record(UNSTUCK)
        return fig_6_15.errors_of(record) if _whole(record) else None

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
        """Figure 6.14: as long as all others together."""
        return tracking(*fig_6_14.JUDGED)(self.record(fig_6_14.PARAMETERS))

    @cached_property
    def rubber_steps(self) -> Tracking:
        """Force on rubber that follows steps: figure 6.16."""
        return tracking(*JUDGED)(self.record(RUBBER.PARAMETERS))

    @cached_property
    def rubber_sine(self) -> tuple[Tracking, float]:
        """Figure 6.17: how it follows, and when it has adapted [s]; never where contact was lost."""
        record = self.record(RUBBER_SINE.PARAMETERS)
        adapted = adapted_at(away_from_settled(record)) if _whole(record) else float("inf")
        return tracking(*RUBBER_SINE.judged)(record), adapted


def _whole(record: Record) -> bool:
    """Whether the run came to its end, in one contact."""
    touched = since_contact(record) >= 0.0
    return record.meta["end"] == DONE and bool(
        (record["phase"][touched] == record["phase"][touched][0]).all()
    )


def _press_of(record: Record, surface: str) -> WatchedPress | None:
    if not _whole(record):
        return None
    press = press_runs.contact(record)
    found = press_runs.numbers_of(record)
    low, _, high = by_ratios(press)["B"]
    rows = since_contact(record) < SWITCHED
    early = Record({n: record[n][rows] for n in record.columns}, record.units, record.meta)
    switch = fig_4_02.switch_of(early)
    return WatchedPress(
        found,
        float((high - low) / found.true_B),
        switch.clean,
        switch.true_force <= 0.0,
        fig_4_04.half_ranges(record)[0],
        network.cut(network.press_of(record, surface), network.PRESS),
    )
