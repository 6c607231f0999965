"""Consistency of an experiment's numbers with each other; each number alone is checked where it is read."""

from __future__ import annotations

from palpate.bench.experiments.tables import Experiment
from palpate.bench.force_input import ForceInput
from palpate.errors import InputError
from palpate.signals.filters import butterworth3

LONGEST_DELAY = 9.0
"""Ticks that the matched front-end's delay line holds."""
SLOWER = 20.0
"""Steps of the physics in a period of an elastic mode, at least: they resolve it, and stay stable."""


def check(e: Experiment) -> None:
    """Raises an InputError that names the keys of numbers that do not go together."""
    _check_rates(e)
    _check_waves(e)
    if any(high < low for high, low in zip(e.friction.static, e.friction.coulomb, strict=True)):
        raise InputError(
            f"static in [friction] must be at least coulomb in every joint, got {list(e.friction.static)} "
            f"and {list(e.friction.coulomb)}"
        )
    if e.approach.release >= e.approach.switch:
        raise InputError(
            f"release in [approach] must be below switch ({e.approach.switch:g} N), or contact is lost at the "
            f"moment of the switch; got {e.approach.release:g}"
        )
    if e.force_sensor.full_scale <= e.approach.switch:
        raise InputError(
            f"full_scale in [force_sensor] must be above switch in [approach] ({e.approach.switch:g} N), or the "
            f"switch is never reached; got {e.force_sensor.full_scale:g}"
        )


def _check_rates(e: Experiment) -> None:
    half, physics = e.run.rate / 2.0, e.run.rate * e.run.steps
    cutoffs = {
        "motion in [filters]": e.filters.motion,
        "force in [filters]": e.filters.force,
        "cutoff in [identification]": e.identification.cutoff,
        "cutoff in [force_sensor]": e.force_sensor.cutoff,
    }
    for name, cutoff in cutoffs.items():
        if cutoff >= half:
            raise InputError(
                f"{name} must be below {half:g} Hz, half the rate in [run], got {cutoff:g}; lower it or raise rate"
            )
    if e.force_sensor.phase * e.force_sensor.sampling >= 1.0:
        raise InputError(
            f"phase in [force_sensor] must be below {1.0 / e.force_sensor.sampling:g} s, a period of its sampling, got "
            f"{e.force_sensor.phase:g}"
        )
    if e.force_sensor.sampling > physics:
        raise InputError(
            f"sampling in [force_sensor] must be at most {physics} Hz, rate times steps in [run], got "
            f"{e.force_sensor.sampling}"
        )

    if e.elastic is not None and e.elastic.frequency > physics / SLOWER:
        raise InputError(
            f"frequency in [elastic] must be at most {physics / SLOWER:g} Hz, rate times steps in [run] over "
            f"{SLOWER:g}, got {e.elastic.frequency:g}; lower it or raise steps"
        )


def _check_waves(e: Experiment) -> None:
    half, chirp, sines = e.run.rate / 2.0, e.force.chirp, e.force.multisine
    if chirp is not None and max(chirp.low, chirp.high) >= half:
        raise InputError(
            f"low and high in [force.chirp] must be below {half:g} Hz, half the rate in [run], got {chirp.low:g} and "
            f"{chirp.high:g}"
        )
    if sines is None:
        return
    lengths = [len(values) for values in (sines.frequencies, sines.amplitudes, sines.phases)]
    if len(set(lengths)) > 1:
        raise InputError(
            f"frequencies, amplitudes and phases in [force.multisine] must be of one length, got {lengths}"
        )
    if max(sines.frequencies, default=0.0) >= half:
        raise InputError(
            f"frequencies in [force.multisine] must be below {half:g} Hz, half the rate in [run], got "
            f"{max(sines.frequencies):g}"
        )


def matched_delay(e: Experiment, force: ForceInput) -> float:
    """Seconds by which the matched front-end must delay the position, beside its model of the sensor's filter."""
    late = force.lag - butterworth3(e.force_sensor.cutoff, float(e.run.rate)).lag
    if late * e.run.rate > LONGEST_DELAY:
        raise InputError(
            f"the force is {1e3 * late:.1f} ms late beside its filter, more than the {LONGEST_DELAY:g} ticks that the "
            "matched estimator can follow; raise sampling in [force_sensor] or lower rate in [run]"
        )
    return late
