"""Why M_e comes out negative: every fault of the signals switched on, one after the other."""

from collections.abc import Collection, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import with_values
from palpate.bench.summary import CONTACT
from palpate.records import Record
from palpate.report import style
from palpate.signals.filters import Biquad, butterworth2, butterworth3
from palpate_thesis.claims import ThesisClaim, claim, spread
from palpate_thesis.drawing import ZERO, Axes, Figure
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.runs import Runs

CAUSES = {
    "offset": "displacement from the 5 N point",
    "lag": "the sensor's lag",
    "filter": "120 Hz on the force",
    "acceleration": "35 Hz on the acceleration",
    "counts": "encoder counts",
    "noise": "noise of the force",
}
"""Signal faults between the surface and the thesis' estimator, in the order of the waterfall."""
BEFORE, PRESS = 1.5, 4.0
TICK = 1e-3
FORCE_CUTOFF, MOTION_CUTOFF, SAMPLING = 120.0, 35.0, 480.0
"""Of the force sensor and the force's filter, of the acceleration's, and of the sensor [Hz]."""
START, COVARIANCE = (0.0, 0.0, 2e5), 1e10


class RegressionWindow(NamedTuple):
    """A press with what came before it, so that filters have settled; true and measured."""

    x: Array  # true [m]
    counts: Array  # as the encoders have it [m]
    force: Array  # true [N]
    sampled: Array  # [N]
    x0: float  # measured x at the change-over [m]
    wall: float  # [m]
    first: int  # sample of the change-over
    matched: Array  # M, B, K of the matched front-end at the end of the window


def window(record: Record) -> RegressionWindow:
    """The first press of a run."""
    at = int(np.argmax(record["phase"] == CONTACT))
    first = min(at, round(BEFORE / TICK))
    rows = slice(at - first, at + round(PRESS / TICK))
    e = record.meta["experiment"]
    # A row's force is that of the physics step before its tick; at 500 N s/m those 50 us would be 25 g.
    step = 1.0 / (e["run"]["rate"] * e["run"]["steps"])
    return RegressionWindow(
        x=record["x"][rows],
        counts=record["x_measured"][rows],
        force=late(record["force"][rows], -step),
        sampled=record["force_sampled"][rows],
        x0=float(record["x_measured"][at]),
        wall=float(e["wall"]["x"]),
        first=first,
        matched=np.array([record[f"{key}_matched"][rows][-1] for key in "MBK"]),
    )


def estimate(press: RegressionWindow, causes: Collection[str], lag: float = 0.0) -> Array:
    """(M, B, K) by least squares over the press, with these causes on and the force late by another `lag` [s]."""
    x, v, a = _motion(press, causes)
    force = late(_force(press, causes), lag)
    phi = np.column_stack([a, v, x])[press.first :]
    scale = np.sqrt((phi**2).sum(axis=0))
    unit = phi / scale
    prior = np.diag(1.0 / (COVARIANCE * scale**2))
    right = prior @ (np.array(START) * scale) + unit.T @ force[press.first :]
    return np.asarray(np.linalg.solve(prior + unit.T @ unit, right) / scale)


def _motion(press: RegressionWindow, causes: Collection[str]) -> tuple[Array, Array, Array]:
    position = press.counts if "counts" in causes else press.x
    if "counts" in causes:
        v = np.diff(position, prepend=position[0]) / TICK
        a = np.diff(v, prepend=0.0) / TICK
    else:
        v = np.gradient(position, TICK)
        a = np.gradient(v, TICK)
    if "acceleration" in causes:
        a = filter_signal(butterworth2(MOTION_CUTOFF, 1.0 / TICK), a)
    return position - (press.x0 if "offset" in causes else press.wall), v, a


def _force(press: RegressionWindow, causes: Collection[str]) -> Array:
    sensed = through_sensor(press.force)
    force = sensed if "lag" in causes else press.force
    if "noise" in causes:
        force = force + (press.sampled - sensed)
    return filter_signal(butterworth2(FORCE_CUTOFF, 1.0 / TICK), force) if "filter" in causes else force


def through_sensor(force: Array) -> Array:
    """The force as the sensor gives it without noise: its filter, one cycle of computing, half a cycle of holding."""
    analog = butterworth3(FORCE_CUTOFF, 1.0 / TICK)
    return late(filter_signal(analog.second, filter_signal(analog.first, force)), 1.5 / SAMPLING)


def filter_signal(section: Biquad, signal: Array) -> Array:
    """Filter a signal, from the steady state at its first value."""
    from scipy.signal import lfilter, lfilter_zi

    b, a = (section.b0, section.b1, section.b2), (1.0, section.a1, section.a2)
    return np.asarray(lfilter(b, a, signal, zi=lfilter_zi(b, a) * signal[0])[0])


def late(signal: Array, seconds: float) -> Array:
    """Delay a signal [s], linearly between samples."""
    k = np.arange(len(signal), dtype=float)
    return signal if seconds == 0.0 else np.interp(k - seconds / TICK, k, signal)


def delayed_fit(M: float, B: float, K: float, lag: float | Array) -> Array:
    """M and B estimated from a force that lags by `lag`, to second order: x(t - T) = x - T v + T^2/2 a."""
    return np.array([M - B * lag + K * lag**2 / 2.0, B - K * lag])


NUMBER = "why-negative-mass"
PARAMETERS = {
    "plain foam": with_values(press_runs.PLAIN, {"run.press": 4.2}),
    "rubber": with_values(press_runs.RUBBER, {"run.press": 4.2}),
    "relaxing foam": with_values(press_runs.RELAXING, {"run.press": 4.2}),
}
MODELLED = ("plain foam", "rubber")
"""Surfaces that the estimator's model fits."""
LABELS = ("$M_e$ [kg]", "$B_e$ [N s/m]")
LAGS = 1e-3 * np.arange(0.0, 11.0)
SENSOR_LAG = 5.6e-3
"""[s]; of the force sensor alone, for the lag formula's test."""
NEAR_FORMULA = 0.25
NEAR_TRUTH = {"K": 0.02, "B": 0.05, "M": 0.25}
"""Shares of K and B; kilograms."""


class EstimatesOfPress(NamedTuple):
    """Least-squares estimates of one press, each (M, B, K)."""

    steps: Array  # with perfect signals, then with one cause more each, shape (7, 3)
    lags: Array  # perfect signals, the force late by `LAGS`, shape (11, 3)
    sensor: Array  # late by the sensor's lag, shape (3,)
    matched: Array


class Data(NamedTuple):
    """Presses on each surface."""

    presses: dict[str, list[EstimatesOfPress]]
    truth: dict[str, tuple[float, float, float]]  # M, B, K

    def middle(self, surface: str, what: str) -> Array:
        """The median over the seeds."""
        return np.median([getattr(p, what) for p in self.presses[surface]], axis=0)


def run(runs: Runs) -> Data:
    """One press a seed on each surface."""
    truth = {name: (e.surface.mass, e.surface.damping, e.surface.stiffness) for name, e in PARAMETERS.items()}
    return Data(runs.by_name(PARAMETERS, _press), truth)


def _press(record: Record) -> EstimatesOfPress:
    press, names = window(record), list(CAUSES)
    return EstimatesOfPress(
        steps=np.array([estimate(press, names[:i]) for i in range(len(names) + 1)]),
        lags=np.array([estimate(press, (), lag) for lag in LAGS]),
        sensor=estimate(press, (), SENSOR_LAG),
        matched=press.matched,
    )


def check(data: Data) -> Sequence[ThesisClaim]:
    """The thesis' own reason, the lag, the wrong model, and the cure."""
    perfect = {s: [float(p.steps[0, 0]) for p in presses] for s, presses in data.presses.items()}
    relaxing = perfect["relaxing foam"]
    right = all(abs(float(np.median(perfect[s])) - data.truth[s][0]) < 0.05 for s in MODELLED)
    masses = "; ".join(f"{s} {spread(perfect[s], 'kg', 2)}, true {data.truth[s][0]:g} kg" for s in MODELLED)
    foam, rubber = (_contributions(data.middle(surface, "steps")[:, 0]) for surface in MODELLED)
    shifts = {surface: _shift_by_lag(data, surface) for surface in MODELLED}
    near = all(apart < NEAR_FORMULA for _, apart in shifts.values())
    values = "; ".join(f"{surface}: {words}" for surface, (words, _) in shifts.items())
    return [
        claim("negative-mass.small", not right, masses=masses, foam_added=foam, rubber_added=rubber),
        claim("negative-mass.lag", near, sensor_lag=1e3 * SENSOR_LAG, values=values),
        claim("negative-mass.model", max(relaxing) < 0.0, values=spread(relaxing, "kg")),
        _matched_claim(data),
    ]


def _contributions(masses: Array) -> str:
    """Sentence with the contribution of each cause."""
    added = (f"{n} {s:+.2f}" for n, s in zip(CAUSES.values(), np.diff(masses), strict=True))
    return f"{masses[0]:.2f} kg, then {', '.join(added)}, in all {masses[-1]:.2f} kg"


def _shift_by_lag(data: Data, surface: str) -> tuple[str, float]:
    """M and B with the sensor's lag, fitted and by the formula, and how far the shift is from it."""
    predicted = delayed_fit(*data.truth[surface], SENSOR_LAG)
    fitted = data.middle(surface, "sensor")[:2]
    apart = np.abs(fitted - predicted) / np.abs(predicted - np.array(data.truth[surface][:2]))
    words = f"M {fitted[0]:.2f} ({predicted[0]:.2f}) kg, B {fitted[1]:.0f} ({predicted[1]:.0f}) N s/m"
    return words, float(apart.max())


def _matched_claim(data: Data) -> ThesisClaim:
    parts, good = [], True
    for surface in MODELLED:
        truth = dict(zip("MBK", data.truth[surface], strict=True))
        matched = dict(zip("MBK", np.transpose([p.matched for p in data.presses[surface]]), strict=True))
        limits = {"K": NEAR_TRUTH["K"] * truth["K"], "B": NEAR_TRUTH["B"] * truth["B"], "M": NEAR_TRUTH["M"]}
        good &= all(abs(np.median(matched[key]) - truth[key]) < limit for key, limit in limits.items())
        parts.append(
            f"{surface}: K {spread(1e-3 * matched['K'], 'kN/m')}, true {1e-3 * truth['K']:g}; "
            f"B {spread(matched['B'], 'N s/m')}, true {truth['B']:g}; "
            f"M {spread(matched['M'], 'kg', 2)}, true {truth['M']:g}"
        )
    return claim("negative-mass.matched", bool(good), values="; ".join(parts))


def plot(data: Data) -> Figure:
    """Waterfalls of M and B on three surfaces, and the lag formula."""
    drawing, axes = panels.grid(4)
    for axis, letter, (surface, index) in zip(axes, "abcdef", product(PARAMETERS, (0, 1)), strict=False):
        panels.set_title(axis, letter, f"{LABELS[index].split(' ')[0]} on {surface}")
        _waterfall(axis, data, surface, index)
    for index, axis in enumerate(axes[6:8]):
        panels.set_title(
            axis, "gh"[index], f"{LABELS[index].split(' ')[0]} of perfect signals, the force late by T"
        )
        _lag_panel(axis, data, index)
    return drawing


def _waterfall(axis: Axes, data: Data, surface: str, index: int) -> None:
    """A bar from each estimate to the one with a cause more; last, the matched channels."""
    seeds = np.array([[*p.steps[:, index], p.matched[index]] for p in data.presses[surface]])
    middle = np.median(seeds, axis=0)
    before = np.array([0.0, *middle[:-2], 0.0])
    rows, added = np.arange(len(middle)), middle - before
    colors = [style.FAIL if value < 0.0 else style.SERIES[0] for value in added]
    axis.barh(rows, added, left=before, color=[style.MEASURED, *colors[1:-1], style.OK], height=0.62)
    axis.plot(seeds.T, rows, "o", color=style.INK, markersize=1.8, alpha=0.5)
    axis.axvline(0.0, **ZERO)
    if surface in MODELLED:
        axis.axvline(data.truth[surface][index], color=style.OK, linewidth=1.1, linestyle="--")
    labels = ["perfect signals", *(f"+ {name}" for name in CAUSES.values()), "channels matched"]
    axis.set_yticks(rows, labels if index == 0 else [""] * len(rows))
    axis.invert_yaxis()
    axis.set_xlabel(LABELS[index])


def _lag_panel(axis: Axes, data: Data, index: int) -> None:
    fine = np.linspace(0.0, float(LAGS[-1]), 100)
    for surface in MODELLED:
        color = panels.COLORS[surface.removeprefix("plain ")]
        fits = data.middle(surface, "lags")[:, index]
        axis.plot(1e3 * LAGS, fits, "o", color=color, markersize=4, label=surface)
        predicted = delayed_fit(*data.truth[surface], fine)[index]
        axis.plot(1e3 * fine, predicted, "--", color=color, linewidth=1.1)
    axis.axhline(0.0, **ZERO)
    axis.set(xlabel="T [ms]", ylabel=LABELS[index])
    axis.legend()
