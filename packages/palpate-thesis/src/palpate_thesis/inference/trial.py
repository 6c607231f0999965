"""The experiments of chapters 4 and 6 in one laboratory, each run once and only when a sentence asks for it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from palpate.bench import Experiment, build, with_values
from palpate.bench.summary import DONE, INTERRUPTED
from palpate.records import Record
from palpate_thesis.figures import fig_6_10_17 as force
from palpate_thesis.figures.fig_4_02_04 import PARAMETERS, Switch, half_ranges, measure_switch
from palpate_thesis.force_control.tracking import since_contact
from palpate_thesis.laboratory import Laboratory
from palpate_thesis.least_squares import press_runs
from palpate_thesis.least_squares.press_runs import PressEstimates
from palpate_thesis.neural_identifier import network
from palpate_thesis.neural_identifier.network import Identified, NetworkChoice, NetworkPress

STEPS = 5
"""Steps of the physics in a tick during a search: a quarter of those of the figures, at half the cost. They change as
many verdicts as another draw of the noise does."""


class WatchedPress(NamedTuple):
    """A press: its least-squares estimates, the switch and its first seconds, its noise, and the network's inputs."""

    estimates: PressEstimates
    switch: Switch
    noise: tuple[float, float]  # see `half_ranges`
    network: NetworkPress


@dataclass(eq=False)
class Trial:
    """One laboratory and one seed of the noise; `trial[name]` is the result of an experiment of `MEASURES`."""

    laboratory: Laboratory  # in which the experiments run, each once and only when its result is asked for
    seed: int = 0  # of the noise
    steps: int = STEPS  # of the physics in a tick
    stopped: Callable[[], bool] = lambda: False  # polled in a run; True: KeyboardInterrupt
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

    def answer(self, surface: str, rate: float = NetworkChoice().rate) -> Identified | None:
        """Answer of this laboratory's network on foam or on the rubber of figure 6.9; None if contact was lost."""
        watched = self["foam" if surface == "foam" else "rubber of the network"]
        return None if watched is None else self.answer_for(getattr(watched, "network", watched), rate)

    def answer_for(self, press: NetworkPress, rate: float = NetworkChoice().rate) -> Identified:
        """K, B and M of this laboratory's network over a press, at a learning rate."""
        lab = self.laboratory
        start = int(self.seed if lab.start is None else lab.start)
        _, curve = network.learn(press, network.identifier_network(lab, rate), start)
        return network.identified(press, curve)


def _watch_press(record: Record) -> WatchedPress:
    rows = since_contact(record) < PARAMETERS["foam"].run.press
    early = Record({n: record[n][rows] for n in record.columns}, record.units, record.meta)
    estimates, press = press_runs.press_estimates(record), network.press_of(record, "foam")
    return WatchedPress(estimates, measure_switch(early), half_ranges(record), press)


Measure = Callable[[Record], Any]


def _unbroken(measure: Measure) -> Measure:
    """`measure` of a record that came to its end without a loss of contact; None of another."""

    def measure_unbroken(record: Record) -> Any:
        phases = record["phase"][since_contact(record) >= 0.0]
        unbroken = record.meta["end"] == DONE and bool((phases == phases[0]).all())
        return measure(record) if unbroken else None

    return measure_unbroken


def _steps_on_foam(record: Record) -> tuple[Any, force.Errors]:
    return force.FOAM.measure(record), force.measure_free_errors(record)


UNSTUCK = with_values(force.ON_FOAM, {"wall.side_friction": 0.0})
SHORT_HYBRID = with_values(force.HYBRID_ALONE.PARAMETERS, {"run.press": 10.0})
"""One interval at each force."""
MEASURES: Mapping[str, tuple[Experiment, Measure]] = {
    "foam": (press_runs.PLAIN, _unbroken(_watch_press)),
    "rubber": (press_runs.RUBBER, _unbroken(_watch_press)),
    "rubber of the network": (network.RUBBER, _unbroken(lambda r: network.press_of(r, "rubber"))),
    "unstuck": (UNSTUCK, _unbroken(force.measure_free_errors)),
    **{study.NUMBER: (study.PARAMETERS, _unbroken(study.measure)) for study in force.FORCE},
    "6.10": (SHORT_HYBRID, _unbroken(force.interval_ends)),
    "6.11": (force.ON_FOAM, _unbroken(_steps_on_foam)),
    "6.13": (force.SLOW_FOAM, force.SLOW.measure),  # a lost contact does not follow either
}
"""Experiments by name or figure, and the function that measures each; 6.14 takes as long as all others together."""
