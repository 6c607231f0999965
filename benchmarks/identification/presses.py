"""Presses on the bench with a truth, a seed and a sensor phase of their own, identified, with the bound beside them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.bench import build, load
from palpate.bench.tables import with_values
from palpate.identification import Identification, identify
from palpate.records import Record
from palpate.signals.low_pass import LowPass
from palpate_excitation.spectra import ForceChain, cramer_rao_bound, phase_std

NAMES = ("K", "B", "M")
FIELDS = {"K": "stiffness", "B": "damping", "M": "mass"}
SPREAD = 1.3
"""The truth lies between its nominal value divided and multiplied by this."""
STEP_START = (0.454, 0.0, 0.0168)
CHIRP_START = (0.454, 0.0, 0.0208)
"""Start poses that bring the last link along the normal in contact: the wrist's coarse encoder (2000 counts) then moves
the tip's position along the normal to second order only."""
THESIS_START = (0.454, 0.0, 0.0)
SETTLED = 10.0
"""Time constants of a low-pass after which it has forgotten the touch."""


@dataclass(frozen=True)
class Condition:
    """What is pressed on, how, and what the identification is told.

    Args:
        experiment: its name.
        start: pose [m, m, rad].
        lag_known: whether the lag is calibrated.
        mass: "free", "fixed" (at its truth) or "prior" (a deviation of half of it).
        changes: of the experiment.
    """

    experiment: str
    start: tuple[float, float, float]
    lag_known: bool = True
    mass: str = "free"
    changes: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Trial:
    """One press and what was found, by name; lag in seconds.

    Args:
        truth: of the surface.
        value, std: estimate and deviation if the model holds.
        bound: of that deviation.
        verdict: on each parameter.
        robust: the interval that holds whatever the model, of the parameters that were given with a number.
        codes: of the warnings.
    """

    truth: dict[str, float]
    value: dict[str, float]
    std: dict[str, float]
    bound: dict[str, float]
    verdict: dict[str, str]
    robust: dict[str, tuple[float, float]]
    codes: tuple[str, ...]


def press(condition: Condition, seed: int) -> tuple[Record, LowPass, float]:
    """Run one press; with the force sensor's low-pass and its whole lag [s]."""
    rng = np.random.default_rng([seed, 480])
    nominal = load(condition.experiment)
    factor = np.exp(rng.uniform(-np.log(SPREAD), np.log(SPREAD), 3))
    truth = {
        f"surface.{FIELDS[n]}": float(getattr(nominal.surface, FIELDS[n]) * f)
        for n, f in zip(NAMES, factor, strict=True)
    }
    experiment = with_values(
        nominal,
        {
            **truth,
            "approach.hold": 0.3,
            "approach.first": 0.4625 + 0.001 * float(rng.uniform()),
            "force_sensor.phase": float(rng.uniform(0, 1 / nominal.force_sensor.sampling)),
            "robot.start": condition.start,
            **condition.changes,
        },
    )
    record = build(experiment).run(experiment.run.duration, seed=seed, press=experiment.run.press)
    force = record.meta["instruments"]["force"]
    low_pass = LowPass.parse(force["filter"])
    return record, low_pass, low_pass.lag + force["delay_s"]


def log_of(record: Record) -> Record:
    """What a log of the press holds: time, the measured position, the force as sampled."""
    columns = {"time": record["t"], "position": record["x_measured"], "force": record["force_sampled"]}
    return Record(columns, {"time": "s", "position": "m", "force": "N"})


def trial(condition: Condition, seed: int) -> Trial:
    """One press, identified: the estimates before any verdict, with the verdicts beside them."""
    record, low_pass, lag = press(condition, seed)
    truth = {name: record.meta["truth"][name]["value"] for name in NAMES}
    mass = _mass(condition, truth["M"], seed)
    found = identify(
        log_of(record),
        model="kelvin-voigt-mass",
        force_filter=low_pass,
        lag=lag if condition.lag_known else None,
        mass=mass,
    )
    estimate, traces = found.estimate, found.traces
    if estimate is None or traces is None:
        raise RuntimeError(f"seed {seed}: nothing was found to identify ({found.codes})")
    return Trial(
        truth | {"lag": lag},
        dict(zip(estimate.names, estimate.theta.tolist(), strict=True)),
        dict(zip(estimate.names, estimate.std.tolist(), strict=True)),
        _bound(record, truth, low_pass, condition, _in_contact(found, low_pass)),
        {name: str(p.verdict) for name, p in found.parameters.items()},
        {name: p.ci95 for name, p in found.parameters.items() if p.ci95},
        found.codes,
    )


def _mass(condition: Condition, truth: float, seed: int) -> tuple[float, float] | None:
    """What the identification is told of the mass: a prior is off by its own deviation, as an honest one is."""
    if condition.mass == "free":
        return None
    if condition.mass == "fixed":
        return truth, 0.0
    return float(np.random.default_rng([seed, 481]).normal(truth, truth / 2)), truth / 2


def _in_contact(found: Identification, low_pass: LowPass) -> tuple[float, float]:
    """First and last instant at which the sensor feels nothing but the contact [s]: what least squares is fitted to.

    In the air the force does not follow the position, as the bound's model would have it.
    """
    assert found.traces is not None
    touched, _ = found.contacts[0]
    first, last = found.traces.fitted_time[[0, -1]]
    return max(float(first), touched + SETTLED / low_pass.decay), float(last)


def _bound(
    record: Record,
    truth: dict[str, float],
    low_pass: LowPass,
    condition: Condition,
    span: tuple[float, float],
) -> dict[str, float]:
    sensor = record.meta["experiment"]["force_sensor"]
    chain = ForceChain(low_pass, sensor["sampling"], sensor["noise"], phase_std(sensor["sampling"], 1000))
    known = {} if condition.lag_known else {"lag": np.inf}
    known |= {"fixed": {"M": 0.0}, "prior": {"M": truth["M"] / 2}, "free": {}}[condition.mass]
    best = cramer_rao_bound(record["t"], record["penetration"], truth, chain, known=known, span=span)
    return dict(zip(best.names, best.std.tolist(), strict=True))
