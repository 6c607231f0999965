"""Explanation 4: causes of the neural identifier's answer."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import with_values
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.drawing import STATED, Axes, Figure, panels
from palpate_thesis.least_squares.panels import set_title
from palpate_thesis.neural_identifier import network
from palpate_thesis.neural_identifier.claims import describe_spread, share_of_starts
from palpate_thesis.neural_identifier.network import STARTS, NetworkAnswer, NetworkChoice, NetworkPress
from palpate_thesis.runs import Runs

NUMBER = "what-the-probe-depends-on"
SHOWN_STARTS = STARTS[:6]
TITLES = (
    "Force as the network knows it, at rest, foam",
    "K from that, by the probe's displacement",
    "K by probing, slope at rest, over f/x: foam",
    "The same: rubber",
    "M of each start: foam",
    "The same: rubber",
)

LONG = 20.0
"""Seconds of contact for one of the toggles; everything else stops at the thesis' four [s]."""
PARAMETERS = {
    "foam": with_values(network.FOAM, {"run.press": LONG}),
    "rubber": with_values(network.RUBBER, {"run.press": LONG}),
}
FEW = 2
"""Noise seeds for the toggles, with ten starts on each."""
MANY_STARTS = tuple(range(30))
STRAIGHT = NetworkChoice(200.0, 0.1, thresholds=False)
CHOSEN, FIXED = NetworkChoice(), NetworkChoice(thresholds=False)
SHOWN = {"as chosen": CHOSEN, "thresholds at zero": FIXED, "zero, 200 N, 0.1": STRAIGHT}
"""Networks of the first two panels."""


class Toggle(NamedTuple):
    """One change against the networks as chosen."""

    choice: NetworkChoice = CHOSEN
    displacement: float | None = 1.0  # of the probe, in multiples of the thesis'; None: where the press rests
    duration: float = network.PRESS  # of contact [s]


TOGGLES = {
    "as chosen": Toggle(),
    "thresholds at zero": Toggle(FIXED),
    "zero, 200 N, weights 0.1": Toggle(STRAIGHT),
    "weights to 0.01": Toggle(NetworkChoice(weights=0.01)),
    "weights to 2": Toggle(NetworkChoice(weights=2.0)),
    "amplitude 25 N": Toggle(NetworkChoice(amplitude=25.0)),
    "amplitude 100 N": Toggle(NetworkChoice(amplitude=100.0)),
    "rate 1e-5": Toggle(NetworkChoice(rate=1e-5)),
    "rate 1e-3": Toggle(NetworkChoice(rate=1e-3)),
    "inputs not scaled": Toggle(NetworkChoice(scale=(1.0, 1.0, 1.0))),
    "probe at half": Toggle(displacement=0.5),
    "probe where it rests": Toggle(displacement=None),
    "probe at twice": Toggle(displacement=2.0),
    "1 s of contact": Toggle(duration=1.0),
    "20 s of contact": Toggle(duration=LONG),
}


class Looked(NamedTuple):
    """Answer of one network after one press, at any probe."""

    over: float  # K by probing over f/x
    tangent: float  # slope of its force where it rests, over f/x
    warned: bool


class SurfaceResults(NamedTuple):
    """Results on one surface."""

    press: NetworkPress  # of the first noise seed, 4 s
    stiffness: float  # of the surface [N/m]
    perfect: float  # K over f/x of a network that knows the surface without error
    toggled: dict[str, list[Looked]]
    nominal: list[NetworkAnswer]  # every start of MANY_STARTS on the press of every noise seed
    before: Array  # M of each start before it has learned anything [kg]
    gap: tuple[float, float]  # from the probes for K and M to the nearest sample, in the network's inputs
    varied: dict[str, list[NetworkAnswer]]

    @property
    def slope(self) -> float:
        """The surface's stiffness over f/x."""
        return self.stiffness / self.press.ratio

    @property
    def masses(self) -> Array:
        """M by noise seed and start, shape (seeds, starts) [kg]."""
        return np.array([a.M for a in self.nominal]).reshape(-1, len(MANY_STARTS))


Data = dict[str, SurfaceResults]


def run(runs: Runs) -> Data:
    """One long press a noise seed on each surface."""
    return {name: _surface(runs, name) for name in PARAMETERS}


def _surface(runs: Runs, name: str) -> SurfaceResults:
    experiment = PARAMETERS[name]
    whole = network.presses(runs, experiment, name, list(runs.seeds)[:FEW])
    contacts = network.presses(runs, with_values(experiment, {"run.press": network.PRESS}), name)
    cases = {name: [(t, p, s) for p in whole for s in network.STARTS] for name, t in TOGGLES.items()}
    x = NetworkChoice().probe(name, 0).values[0]
    switch, stiffness = experiment.approach.switch, experiment.surface.stiffness
    return SurfaceResults(
        press=contacts[0],
        stiffness=stiffness,
        perfect=float((switch / x + stiffness) / np.median([press.ratio for press in contacts])),
        toggled=runs.map_each(lambda case: look(*case), cases),
        nominal=network.answers(runs, contacts, NetworkChoice(), MANY_STARTS),
        before=np.array([NetworkChoice().probe(name, start).probe().mass for start in MANY_STARTS]),
        gap=gap(contacts[0]),
        varied=network.answers_under_conditions(runs, getattr(network, name.upper()), name),
    )


def look(toggle: Toggle, press: NetworkPress, start: int) -> Looked:
    """Lets a network learn for as long as the toggle says, and asks it."""
    cut = network.cut(press, toggle.duration)
    probe, _ = network.learn(cut, toggle.choice, start)
    at = cut.rest if toggle.displacement is None else toggle.displacement * probe.values[0]
    probed = probe.probe(displacement=at)
    slope = network.tangent(probe, cut.rest)
    return Looked(probed.stiffness / cut.ratio, slope / cut.ratio, bool(probed.warnings))


def gap(press: NetworkPress) -> tuple[float, float]:
    """Distance of the nearest sample from the probes for K and M, in the units of the network's inputs."""
    probe = NetworkChoice().probe(press.surface, 0)
    learned = press.inputs * probe.scale
    probed = probe.values * probe.scale
    for_stiffness, for_mass = (
        np.linalg.norm(learned - at, axis=1).min() for at in (probed * [1, 0, 0], probed)
    )
    return float(for_stiffness), float(for_mass)


STUDY = (1.3, 2.3)
"""K over f/x with learning thresholds, from an earlier study of ours."""


def check(data: Data) -> Sequence[ThesisClaim]:
    """K and the sign of M, as an earlier study of ours has them."""
    inside = {name: [STUDY[0] <= a.over <= STUDY[1] for a in s.nominal] for name, s in data.items()}
    foam, rubber = data["foam"], data["rubber"]
    chosen = [a.over for s in data.values() for a in s.nominal]
    large = [look.over for s in data.values() for look in s.toggled["weights to 2"]]
    medians = {
        f"{condition} ({name})": float(np.median([a.over for a in answers]))
        for name, s in data.items()
        for condition, answers in s.varied.items()
    }
    low, high = min(medians, key=lambda m: medians[m]), max(medians, key=lambda m: medians[m])
    return [
        claim(
            "network-probe.K",
            all(often(i) for i in inside.values()),
            surfaces="; ".join(
                f"{name} {_spread([a.over for a in s.nominal], 'times f/x')}" for name, s in data.items()
            ),
            perfect=foam.perfect,
            toggled={toggle: _median(foam, toggle) for toggle in TOGGLES},
            foam_slope=np.median([a.tangent / a.ratio for a in foam.nominal]),
            foam_true=foam.slope,
            rubber_slope=np.median([a.tangent / a.ratio for a in rubber.nominal]),
            rubber_true=rubber.slope,
            least=min(chosen),
            most=max(chosen),
            large_least=min(large),
            large_most=max(large),
            conditions=len(medians),
            low=medians[low],
            low_with=low,
            high=medians[high],
            high_with=high,
        ),
        _mass(data),
    ]


def _mass(data: Data) -> ThesisClaim:
    firm = {name: firm_signs(s.masses) for name, s in data.items()}
    both = all((s.masses > 0).any() and (s.masses < 0).any() for s in data.values())
    holds = both and all(often(f) for f in firm.values())
    kept = {
        name: float(np.mean(np.sign(s.before) == np.sign(np.median(s.masses, axis=0))))
        for name, s in data.items()
    }
    steady, total = _steady_conditions(data)
    return claim(
        "network-probe.M",
        holds,
        surfaces="; ".join(
            f"{name}: sign the same over all noise seeds for {int(f.sum())} of {len(f)} starts, "
            f"positive for {int((np.median(data[name].masses, axis=0) > 0).sum())}"
            for name, f in firm.items()
        ),
        foam_starts=_percent(data["foam"]),
        rubber_starts=_percent(data["rubber"]),
        foam_kept=kept["foam"],
        rubber_kept=kept["rubber"],
        foam_gap=data["foam"].gap[1],
        rubber_gap=data["rubber"].gap[1],
        total=total,
        steady=steady,
    )


def firm_signs(values: Array) -> Array:
    """For each start, a column, whether the sign is the same in all rows."""
    return np.all(values > 0, axis=0) | np.all(values < 0, axis=0)


def _steady_conditions(data: Data) -> tuple[int, int]:
    """Number of conditions under which the starts keep their signs, and number of all."""
    steady = []
    for surface in data.values():
        usual = np.sign(np.median(surface.masses, axis=0))[: network.VARIED_STARTS]
        for answers in surface.varied.values():
            signs = np.sign(np.array([a.M for a in answers]).reshape(-1, network.VARIED_STARTS))
            steady.append(often((signs == usual).ravel()))
    return sum(map(bool, steady)), len(steady)


def _median(surface: SurfaceResults, toggle: str) -> float:
    return float(np.median([look.over for look in surface.toggled[toggle]]))


def _percent(surface: SurfaceResults) -> str:
    part = share_of_starts([a.M for a in surface.nominal], len(MANY_STARTS))
    return "over 99 %" if part > 0.99 else f"{100 * part:.0f} %"


def _spread(values: Sequence[float], unit: str) -> str:
    return describe_spread(values, unit, len(MANY_STARTS))


def plot(data: Data) -> Figure:
    """Learned force, K by probing, every change, and M by initial weights."""
    drawing, (known, toggles, masses) = panels([2.4, 4.6, 2.4], columns=2)
    for axis, letter, title in zip((*known, *toggles, *masses), "abcdef", TITLES, strict=True):
        set_title(axis, letter, title)
    foam = data["foam"]
    _draw_known_force(known[0], known[1], foam)
    for upper, lower, surface in zip(toggles, masses, data.values(), strict=True):
        _toggles(upper, surface, named=surface is foam)
        _masses(lower, surface)
    return drawing


def _draw_known_force(force: Axes, stiffness: Axes, surface: SurfaceResults) -> None:
    press = surface.press
    x = np.linspace(0.0, 2.0 * press.rest, 80)

    def both(known: Array, label: str | None, **options: Any) -> None:
        force.plot(1e3 * x, known, label=label, **options)
        stiffness.plot(1e3 * x[1:], known[1:] / x[1:] / press.ratio, **options)

    for (label, choice), color in zip(SHOWN.items(), style.SERIES, strict=False):
        for start in SHOWN_STARTS:
            probe, _ = network.learn(press, choice, start)
            known = np.array([probe.force((d, 0.0, 0.0)) for d in x])
            both(known, None if start else label, color=color, linewidth=0.9, alpha=0.8)
    truth = press.force[-500:].mean() + surface.stiffness * (x - press.rest)
    both(truth, "the surface", color=style.INK, linewidth=1.3, linestyle="--")
    stiffness.axhline(1.0, color=style.MEASURED, linewidth=0.8)
    probed = 1e3 * NetworkChoice().probe(press.surface, 0).values[0]
    for axis in (force, stiffness):
        axis.axvspan(0.0, 1e3 * press.inputs[:, 0].max(), color=style.MEASURED, alpha=0.12, linewidth=0)
        axis.axvline(probed, **STATED)
        axis.set(xlim=(0.0, 2e3 * press.rest), xlabel="x [mm]; shaded: learned; dotted: probe")
    force.set(ylim=(-2.0, 40.0), ylabel="force [N]")
    stiffness.set(ylim=(0.0, 3.0), ylabel="K over f/x")
    force.legend(ncols=2, loc="lower right")


def _toggles(axis: Axes, surface: SurfaceResults, *, named: bool) -> None:
    names = list(surface.toggled)
    for i, looks in enumerate(surface.toggled.values()):
        warned = all(look.warned for look in looks)
        _strip(axis, [look.over for look in looks], i - 0.16, style.FAIL if warned else style.SERIES[0])
        _strip(axis, [look.tangent for look in looks], i + 0.16, style.SERIES[1])
    axis.axvline(1.0, color=style.MEASURED, linewidth=1.0)
    for at, color in zip((surface.perfect, surface.slope), style.SERIES, strict=False):
        axis.axvline(at, color=color, linewidth=0.9, linestyle="--")
    axis.set_yticks(range(len(names)), names if named else [""] * len(names))
    axis.set(xlim=(-0.6, 3.0), ylim=(len(names) - 0.5, -0.5))
    axis.set_xlabel("above: K; below: slope; dashed: no error")


def _strip(axis: Axes, values: Sequence[float], y: float, color: str) -> None:
    axis.plot(values, np.full(len(values), y), ".", color=color, markersize=3.5, alpha=0.55)
    axis.plot(np.median(values), y, "|", color=style.INK, markersize=9, markeredgewidth=1.4)


def _masses(axis: Axes, surface: SurfaceResults) -> None:
    order = np.argsort(np.median(surface.masses, axis=0))
    rows = np.arange(len(MANY_STARTS))
    ring: Any = {"color": style.MEASURED, "markersize": 4, "fillstyle": "none", "label": "untrained"}
    axis.plot(rows, surface.before[order], "o", **ring)
    after = axis.plot(rows, surface.masses[:, order].T, ".", color=style.SERIES[0], markersize=3)
    after[0].set_label("after 4 s, each noise seed")
    axis.axhline(0.0, color=style.INK, linewidth=0.8)
    axis.set(xlabel="start, by its M", ylabel="$M_e$ [kg]")
    axis.legend(loc="upper left")
