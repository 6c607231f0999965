"""Sensitivity of the neural identifier's answer: one change at a time, measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array
from palpate.bench import changed
from palpate.thesis.neural_identifier import network
from palpate.thesis.neural_identifier.network import Answer, Choice, Press
from palpate.thesis.runs import Runs

LONG = 20.0
"""Seconds of contact for one of the toggles; everything else stops at the thesis' four [s]."""
PARAMETERS = {
    "foam": changed(network.FOAM, {"run.press": LONG}),
    "rubber": changed(network.RUBBER, {"run.press": LONG}),
}
FEW = 2
"""Noise seeds for the toggles, with ten starts on each."""
MANY_STARTS = tuple(range(30))
STRAIGHT = Choice(200.0, 0.1, thresholds=False)


CHOSEN = Choice()


@dataclass(frozen=True)
class Toggle:
    """One change against the networks as chosen."""

    choice: Choice = CHOSEN
    displacement: float | None = 1.0  # of the probe, in multiples of the thesis'; None: where the press rests
    duration: float = network.PRESS  # of contact [s]


TOGGLES = {
    "as chosen": Toggle(),
    "thresholds at zero": Toggle(Choice(thresholds=False)),
    "zero, 200 N, weights 0.1": Toggle(STRAIGHT),
    "weights to 0.01": Toggle(Choice(weights=0.01)),
    "weights to 2": Toggle(Choice(weights=2.0)),
    "amplitude 25 N": Toggle(Choice(amplitude=25.0)),
    "amplitude 100 N": Toggle(Choice(amplitude=100.0)),
    "rate 1e-5": Toggle(Choice(rate=1e-5)),
    "rate 1e-3": Toggle(Choice(rate=1e-3)),
    "inputs not scaled": Toggle(Choice(scale=(1.0, 1.0, 1.0))),
    "probe at half": Toggle(displacement=0.5),
    "probe where it rests": Toggle(displacement=None),
    "probe at twice": Toggle(displacement=2.0),
    "1 s of contact": Toggle(duration=1.0),
    "20 s of contact": Toggle(duration=LONG),
}


@dataclass(frozen=True)
class Looked:
    """One network after one press, asked at a probe of one's own."""

    over: float  # K by probing over f/x
    tangent: float  # slope of its force where it rests, over f/x
    warned: bool


@dataclass(frozen=True)
class Surface:
    """Results on one surface."""

    press: Press  # of the first noise seed, 4 s
    long: Press  # the same, gone on with
    stiffness: float  # of the surface [N/m]
    perfect: float  # K over f/x of a network that knows the surface without error
    toggled: dict[str, list[Looked]]
    nominal: list[Answer]  # every start of MANY_STARTS on the press of every noise seed
    before: Array  # M of each start before it has learned anything [kg]
    far: list[
        tuple[float, bool]
    ]  # at twice the largest displacement: force over the surface's, whether warned
    near: list[float]  # at the thesis' probe: force over the surface's
    gap: tuple[
        float, float
    ]  # from the probes for K and for M to the nearest sample, in the network's scaled inputs
    varied: dict[str, list[Answer]]

    @property
    def masses(self) -> Array:
        """M by noise seed and start, shape (seeds, starts) [kg]."""
        return np.array([a.M for a in self.nominal]).reshape(-1, len(MANY_STARTS))


Data = dict[str, Surface]


def run(runs: Runs) -> Data:
    """One long press a noise seed on each surface."""
    return {name: _surface(runs, name) for name in PARAMETERS}


def _surface(runs: Runs, name: str) -> Surface:
    experiment = PARAMETERS[name]
    whole = network.presses(runs, experiment, name, list(runs.seeds)[:FEW])
    some = network.presses(runs, changed(experiment, {"run.press": network.PRESS}), name)
    cases = [(t, p, s) for t in TOGGLES.values() for p in whole for s in network.STARTS]
    looked = iter(runs.map(lambda case: look(*case), cases))
    x = Choice().probe(name, 0).values[0]
    switch, stiffness = experiment.approach.switch, experiment.surface.stiffness
    far, near = _truths(runs, some, switch, stiffness, float(x))
    return Surface(
        press=some[0],
        long=whole[0],
        stiffness=stiffness,
        perfect=float((switch / x + stiffness) / np.median([press.ratio for press in some])),
        toggled={t: [next(looked) for _ in range(len(whole) * len(network.STARTS))] for t in TOGGLES},
        nominal=network.answers(runs, some, Choice(), MANY_STARTS),
        before=np.array([Choice().probe(name, start).probe().mass for start in MANY_STARTS]),
        far=far,
        near=near,
        gap=gap(some[0]),
        varied=network.varied(runs, network.FOAM if name == "foam" else network.RUBBER, name),
    )


def look(toggle: Toggle, press: Press, start: int) -> Looked:
    """Lets a network learn for as long as the toggle says, and asks it."""
    seen = network.cut(press, toggle.duration)
    probe, _ = network.learned(seen, toggle.choice, start)
    at = seen.rest if toggle.displacement is None else toggle.displacement * probe.values[0]
    asked = probe.probe(displacement=at)
    slope = network.tangent(probe, seen.rest)
    return Looked(asked.stiffness / seen.ratio, slope / seen.ratio, bool(asked.warnings))


def _truths(
    runs: Runs, some: Sequence[Press], switch: float, stiffness: float, x: float
) -> tuple[list[tuple[float, bool]], list[float]]:
    """The network's force over the surface's, at twice the largest displacement and at the probe; a start a press."""

    def work(case: tuple[int, Press]) -> tuple[tuple[float, bool], float]:
        start, press = case
        probe, _ = network.learned(press, Choice(), start)
        far = 2.0 * float(probe.learned[1, 0])
        at_far, at_probe = (probe.force((d, 0.0, 0.0)) / (switch + stiffness * d) for d in (far, x))
        return (at_far, bool(probe.probe(displacement=far).warnings)), at_probe

    found = runs.map(work, list(enumerate(some)))
    return [f for f, _ in found], [n for _, n in found]


def gap(press: Press) -> tuple[float, float]:
    """How far the nearest sample is from where K and M are asked, in the units that the network sees."""
    probe = Choice().probe(press.surface, 0)
    seen = press.inputs * probe.scale
    asked = probe.values * probe.scale
    for_stiffness, for_mass = (
        np.linalg.norm(seen - asked * np.array(m), axis=1).min() for m in ((1, 0, 0), (1, 1, 1))
    )
    return float(for_stiffness), float(for_mass)
