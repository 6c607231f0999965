"""One identification for every kind of outcome that a page has to tell of, made once."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from identification.synthetic_contacts import coloured, force_of, press_path, pressed, record, shaken
from palpate.identification import Identification, identify
from palpate.records import Record


@cache
def identified() -> Identification:
    """K, B and M of a shaken contact."""
    return identify(shaken(noise=0.05), lag=0.0)


@cache
def not_identifiable() -> Identification:
    """A press that shows no mass."""
    return identify(pressed(), lag=0.0)


@cache
def rejected() -> Identification:
    """A contact whose stiffness grows, held to a model in which it does not."""
    time = np.arange(6000) / 1000
    x = press_path(time, 0.06)
    force = force_of(x, lambda d, v: 2e6 * d**2, 1e-3)
    noise = coloured(len(time), 0.02, 0.9, np.random.default_rng(0))
    return identify(record(time, x, force + noise), model="kelvin-voigt", lag=0.0)


@cache
def with_its_touch() -> Identification:
    """A power of the depth, told from before the touch on: the place of the surface is found, and no offset."""
    time = np.arange(6000) / 1000
    x = press_path(time, 0.06)
    force = force_of(x, lambda d, v: 1e5 * d**1.5 * (1 + 0.5 * v), 1e-3)
    noise = coloured(len(time), 0.02, 0.9, np.random.default_rng(0))
    return identify(record(time, x, force + noise), model="hunt-crossley", lag=0.0)


@cache
def no_contact() -> Identification:
    """The motion of a press, and nothing but noise of the force."""
    log = pressed()
    noise = coloured(len(log), 0.05, 0.9, np.random.default_rng(0))
    return identify(record(log["time"], log["position"], noise))


@cache
def volts() -> Identification:
    """The same as identified, of a log in volts."""
    log = shaken(noise=0.05)
    return identify(Record(log.columns, {"time": "s", "position": "1", "force": "1"}, log.meta), lag=0.0)


@cache
def many_contacts() -> Identification:
    """Identified, over fifty contacts; their times are what the page lists."""
    return replace(identified(), contacts=tuple((k / 10, k / 10 + 0.05) for k in range(50)))


OUTCOMES = {
    own.__name__: own
    for own in (identified, not_identifiable, rejected, with_its_touch, no_contact, volts, many_contacts)
}
