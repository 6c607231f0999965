"""What to see on the figures of an identification, with the numbers of the log at hand."""

from __future__ import annotations

import numpy as np

from palpate.identification.result import Identification, Traces
from palpate.report.identification_fit import tangled
from palpate.report.identification_spectra import leaving, moving, over_noise, reach, whiteness_of
from palpate.report.identification_words import listed
from palpate.report.numbers import plain

DOUBTED = 1e-3
"""Probability below which residuals count as not white, as in the choice of the model."""
_FAR = 1000.0
_AS_LARGE = 1.3
"""Times the noise out of contact up to which a misfit is no larger than that."""


def untouched(found: Identification) -> str:
    """Of a log without a contact."""
    return "The force over the whole log: it leaves its resting level nowhere for long enough."


def loop(found: Identification, traces: Traces) -> str:
    """Of the force against penetration."""
    left = float(np.sqrt(np.mean((traces.fitted_force - traces.predicted) ** 2)))
    span = float(np.ptp(traces.fitted_force)) or 1.0
    text = f"The model misses the force by {100 * left / span:.2g} % of its range (rms). "
    if tangled(traces):
        return (
            f"{text}Grey is the force as measured; blue has the model's damping and mass taken off, and should lie on"
            " the red line."
        )
    return (
        f"{text}The width of the loop is damping, relaxation or a lag; the dashed line is what the spring alone would"
        " give."
    )


def force(found: Identification, traces: Traces) -> str:
    """Of the force over time."""
    count = len(found.contacts)
    seconds = sum(end - start for start, end in found.contacts)
    each = f"{count} contacts" if count != 1 else "One contact"
    return f"{each} of {plain(seconds, 3)} s in all. The model is drawn where it was fitted."


def residual(found: Identification, traces: Traces) -> str:
    """Of the misfit over time."""
    return (
        "Noise looks the same all along. Waves, steps, or a shape that comes back at every contact are what the model"
        " cannot follow."
    )


def noise(found: Identification, traces: Traces) -> str:
    """Of the misfit's spectrum."""
    p, times = whiteness_of(found, traces), over_noise(found, traces)
    size = f" It is {_times(times)} the usual noise out of contact." if times is not None else ""
    if p is None:
        return "Too few samples to test whether the misfit is white."
    chance = f"p = {p:.2g}" if p >= 1e-4 else "p < 0.0001"
    band = "White noise would stay within the grey band."
    if p >= DOUBTED:
        return f"{band} The misfit passes for white ({chance}).{size}"
    if times is not None and times < _AS_LARGE:
        return f"{band} The misfit is not white ({chance}), but no noise here seems to be.{size}"
    return (
        f"{band} The misfit is not white ({chance}): the noise is coloured, or the model lacks something. The intervals"
        f" allow for its colour, not for a wrong model.{size}"
    )


def _times(ratio: float) -> str:
    """A force that is rounded to nothing out of contact has a noise of nothing."""
    return f"{plain(ratio, 2)} times" if ratio < _FAR else "far above"


def settled() -> str:
    """Of the estimates over the growing log."""
    return (
        "The estimate (line) and its 95 % interval (shade) from the data up to each moment; the point at the end is"
        " what is reported. An estimate that leaves its own earlier interval tells of a surface or a model that"
        " changes. Dashed: not identified."
    )


def excited(found: Identification, traces: Traces) -> str:
    """Of what was excited."""
    moved, left = moving(found, traces), leaving(found, traces)
    if left is None or not moved:
        return "The contact is too short to tell frequencies apart."
    said = []
    for name, own in moved.items():
        top = reach(own, left)
        said.append(f"{name} up to {plain(top, 2)} Hz" if top is not None else f"{name} nowhere")
    return (
        f"The force that each term of the model accounts for, by frequency. Above the misfit stand {listed(said)}."
        " Below it the share of each term: stiffness shows itself by slow motion, damping by faster, mass by the"
        " fastest."
    )
