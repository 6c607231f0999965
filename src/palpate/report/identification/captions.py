"""Captions of an identification's figures, with the log's own numbers."""

from __future__ import annotations

from palpate.identification.result import Identification, Traces
from palpate.report.identification.evidence_panels import shown_by
from palpate.report.identification.spectra import over_noise, whiteness_of
from palpate.report.identification.words import lost, units_of
from palpate.report.numbers import plain, quantity

DOUBTED = 1e-3
"""Probability below which residuals count as not white."""
_FAR = 1000.0
"""Times beyond which a ratio of powers says no more by its figures."""
_AS_LARGE = 1.3
"""Times the noise out of contact up to which a misfit is no larger than that."""


def untouched(found: Identification, traces: Traces) -> str:
    """Of a log without a contact."""
    return "The force over the whole log: it never leaves its resting level for long enough."


def spectrum(found: Identification, traces: Traces) -> str:
    """Of storage and loss by frequency."""
    octaves = found.dynamic_stiffness
    if not octaves:
        return "The contact is too short to tell frequencies apart."
    told = [o.frequency for o, yes in zip(octaves, shown_by(octaves, "storage"), strict=True) if yes]
    if not told:
        where = "No octave shows it with an interval narrower than its value"
    else:
        where = f"The log shows the storage from {plain(told[0], 2)} to {plain(told[-1], 2)} Hz"
        where = where if len(told) > 1 else f"The log shows the storage about {plain(told[0], 2)} Hz"
    return (
        f"Force over position, by octave, whatever the model. {where}. Storage gives the force back, loss turns it into"
        " heat. Flat storage and loss in proportion to frequency are a spring beside a damper; storage that falls with"
        " the square of the frequency is a mass."
    )


def press(found: Identification, traces: Traces) -> str:
    """Of force over depth."""
    own = found.press
    if own is None:
        return "The log has no loading long enough for a slope."
    force = units_of(found)[0]
    told = ["The slope is the stiffness, the width of the loop the lost work. The ring is the working point."]
    if own.hysteresis_loss is not None:
        told.append(f"{lost(own.hysteresis_loss)}.")
    if own.relaxation is not None:
        r = own.relaxation
        told.append(
            f"In a hold of {plain(r.duration, 2)} s the force falls by {100 * r.share:.2g} %,"
            f" half of that within {plain(r.half_time, 2)} s."
        )
    if len(own.tangent) > 1:
        first, last = own.tangent[0], own.tangent[-1]
        told.append(
            f"From {quantity(first.force, force)} to {quantity(last.force, force)} the slope goes from"
            f" {plain(first.stiffness, 3)} ± {plain(first.half, 2)} to {plain(last.stiffness, 3)} ±"
            f" {plain(last.half, 2)}{_of_stiffness(found)}."
        )
    return " ".join(told)


def _of_stiffness(found: Identification) -> str:
    unit = found.working_point.stiffness.unit if found.working_point else "1"
    return "" if unit == "1" else f" {unit}"


def force(found: Identification, traces: Traces) -> str:
    """Of the force over time."""
    count = len(found.contacts)
    seconds = sum(end - start for start, end in found.contacts)
    each = f"{count} contacts" if count != 1 else "One contact"
    return f"{each} of {plain(seconds, 3)} s in all. The model is drawn where it was fitted."


def residual(found: Identification, traces: Traces) -> str:
    """Of the misfit over time."""
    return (
        "Noise looks the same all along. Waves, steps, or a shape that repeats in every contact are forces that the"
        " model cannot follow."
    )


def noise(found: Identification, traces: Traces) -> str:
    """Of the misfit's spectrum."""
    p, times = whiteness_of(found, traces), over_noise(found, traces)
    size = f" It is {_times(times)} the usual noise out of contact." if times is not None else ""
    if p is None:
        return "Too few samples to test whether the misfit is white."
    chance = f"p = {p:.2g}" if p >= 1e-4 else "p < 0.0001"
    band = "White noise would stay within the shaded band."
    if p >= DOUBTED:
        return f"{band} The misfit is consistent with white noise ({chance}).{size}"
    if times is not None and times < _AS_LARGE:
        return f"{band} The misfit is not white ({chance}), but no noise here seems to be.{size}"
    return (
        f"{band} The misfit is not white ({chance}): the noise is coloured, or the model lacks something. The 95 %"
        f" interval allows for both; the one that holds if the model does allows for the colour alone.{size}"
    )


def _times(ratio: float) -> str:
    """A force that is rounded to nothing out of contact has a noise of nothing."""
    return f"{plain(ratio, 2)} times" if ratio < _FAR else "far above"
