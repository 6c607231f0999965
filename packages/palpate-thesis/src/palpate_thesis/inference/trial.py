"""The experiments of chapters 4 and 6 in one laboratory, each run once and only when a sentence asks for it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.bench import Experiment, build, with_values
from palpate.bench.summary import DONE, INTERRUPTED
from palpate.records import Record
from palpate_thesis.figures import fig_4_02, fig_4_04, fig_6_06, fig_6_10, fig_6_14, fig_6_15
from palpate_thesis.figures.fig_6_02_05 import by_ratios
from palpate_thesis.figures.fig_6_11_17 import (
    FOAM,
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
    """One laboratory and one seed of the noise; `trial[name]` is the result of an experiment of `MEASURES`.

    Args:
        laboratory: in which the experiments run, each once and only when its result is asked for.
        seed: of the noise.
        steps: of the physics in a tick.
        stopped: polled between pieces of a run; True ends it with KeyboardInterrupt.
    """

    laboratory: Laboratory
    seed: int = 0
    steps: int = STEPS
    stopped: Callable[[], bool] = lambda: False
    _results: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Any:
        """Result of an experiment; None if contact was lost."""
        if name not in self._results:
            experiment, measure = MEASURES[name]
            self._results[name] = measure(self.record(experiment))
        return self._results[name]

    def record(self, experiment: Experiment) -> Record:
        """Run an experiment up to the first loss of contact: no verdict changes after that."""
        e = with_values(self.laboratory.adapt(experiment), {"run.steps": self.steps, "run.losses": 1})
        record = build(e).run(e.run.duration, self.seed, press=e.run.press, progress=self._poll)
        if record.meta["end"] == INTERRUPTED:
            raise KeyboardInterrupt
        return record

    def _poll(self, _: float, __: str) -> None:
        if self.stopped():
            raise KeyboardInterrupt

    def answer(self, surface: str, rate: float = NetworkChoice().rate) -> NetworkAnswer | None:
        """Answer of this laboratory's network on foam or on the rubber of figure 6.9; None if contact was lost."""
        watched = self["foam" if surface == "foam" else "rubber of the network"]
        return None if watched is None else self.answer_for(getattr(watched, "network", watched), rate)

    def answer_for(self, press: NetworkPress, rate: float = NetworkChoice().rate) -> NetworkAnswer:
        """K, B and M of this laboratory's network over a press, at a learning rate."""
        lab = self.laboratory
        start = int(self.seed if lab.start is None else lab.start)
        return network.answer(press, network.identifier_network(lab, rate), start)


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


Measure = Callable[[Record], Any]


def _unbroken(measure: Measure) -> Measure:
    """`measure` of a record without a loss of contact; None of another."""
    return lambda record: measure(record) if _in_one_contact(record) else None


def _steps_on_foam(record: Record) -> tuple[Tracking, fig_6_15.Errors | None]:
    return FOAM.measure(record), _unbroken(fig_6_15.measure_free_errors)(record)


def _sine_on_rubber(record: Record) -> tuple[Tracking, float]:
    """Tracking, and the time of adapting [s], infinite if contact was lost."""
    adapted = _unbroken(lambda r: adapted_at(away_from_settled(r)))(record)
    return RUBBER_SINE.measure(record), float("inf") if adapted is None else adapted


MEASURES: Mapping[str, tuple[Experiment, Measure]] = {
    "foam": (press_runs.PLAIN, _unbroken(lambda r: _watch_press(r, "foam"))),
    "rubber": (press_runs.RUBBER, _unbroken(lambda r: _watch_press(r, "rubber"))),
    "rubber of the network": (network.RUBBER, _unbroken(lambda r: network.press_of(r, "rubber"))),
    "hybrid": (HYBRID, _unbroken(fig_6_10.interval_ends)),
    "steps on foam": (FOAM.PARAMETERS, _steps_on_foam),
    "unstuck": (UNSTUCK, _unbroken(fig_6_15.measure_free_errors)),
    "sine on foam": (SINE.PARAMETERS, SINE.measure),
    "slow, first": (SLOW.PARAMETERS, SLOW.measure),
    "slow, later": (fig_6_14.PARAMETERS, tracking(*fig_6_14.JUDGED)),
    "steps on rubber": (RUBBER.PARAMETERS, RUBBER.measure),
    "sine on rubber": (RUBBER_SINE.PARAMETERS, _sine_on_rubber),
}
"""Experiments by name, and the function that measures each; "slow, later" takes as long as all others together."""
