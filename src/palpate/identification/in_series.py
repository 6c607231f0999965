"""What lies between the position sensor and the surface, and gives way with it."""

from __future__ import annotations

from dataclasses import replace

from palpate.errors import InputError
from palpate.identification.estimators.fit import fit
from palpate.identification.models import KELVIN_VOIGT, KELVIN_VOIGT_MASS
from palpate.identification.preparing import filter_and_contacts, question_of
from palpate.identification.prior import Lag
from palpate.identification.sampling import Channels


def take_out(channels: Channels, stiffness: float, bonded: bool | None, cutoff: float | None) -> Channels:
    """The channels with the position of the surface instead of the sensor's.

    Args:
        channels: position [m] and force [N] as read.
        stiffness: of what is in series with the surface [N/m].
        bonded: whether the probe is fixed to the surface; None to find out.
        cutoff: of the filter chain [Hz]; None to choose.

    Raises:
        InputError: the log as a whole is stiffer than that, which nothing in series with another spring can be.
    """
    fewer, chain, contacts = filter_and_contacts(channels, bonded, cutoff)
    if not contacts.spans:
        return channels
    question = question_of(fewer, chain, contacts, Lag(), 1.0)
    model = KELVIN_VOIGT_MASS if contacts.bonded else KELVIN_VOIGT
    apparent = fit(model, question.motion, question.force, Lag())["K"]
    if abs(apparent) >= stiffness:
        raise InputError(
            f"the series stiffness of {stiffness:.4g} N/m is softer than the log's own {abs(apparent):.4g} N/m, but two"
            " springs in series are softer than either: check its value and unit (N/m), or leave it out"
        )
    sign = contacts.position_sign * contacts.force_sign * (1 if apparent > 0 else -1)
    return replace(channels, position=channels.position - sign * channels.force / stiffness)
