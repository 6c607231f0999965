"""Questions as the identification asks them of a log, for tests of what comes after."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.identification.choosing import Question
from palpate.identification.preparing import filter_and_contacts, question_of
from palpate.identification.prior import Lag
from palpate.identification.sampling import channels_of
from palpate.identification.touch import touching
from palpate.records import Record


def question(
    log: Record, bonded: bool | None = None, lag: float | None = 0.0, cutoff: float | None = None
) -> Question:
    """Of a log, with its touches in it where it has them; None for a lag that is not known."""
    channels, chain, contacts = filter_and_contacts(channels_of(log), bonded, cutoff)
    asked = question_of(channels, chain, contacts, Lag(lag or 0.0, known=lag is not None), 0.25)
    if contacts.bonded:
        return asked
    force = chain(contacts.force_sign * channels.force)
    margin = int(np.ceil(chain.settling / chain.dt))
    usable = np.arange(len(force)) >= margin
    begins = [begin for begin, _ in contacts.spans]
    touch = touching(force, contacts.resting, asked.motion.rows, asked.spans, begins, margin, usable)
    origin = float(contacts.position_sign * channels.position[0] - asked.motion.position[0])
    return replace(asked, touch=touch, origin=origin, position_sign=contacts.position_sign)
