"""From channels and contacts to the problem: by the sensor's own way where that is known and seen, else by a filter."""

from __future__ import annotations

from palpate.identification.contacts import Contacts
from palpate.identification.filters.state_variable import Chain
from palpate.identification.options import Options
from palpate.identification.problem.behind_filter import behind_filter
from palpate.identification.problem.behind_sensor import behind_sensor, shown
from palpate.identification.problem.problem import Problem
from palpate.identification.problem.touch import touching
from palpate.identification.sampling import Channels


def problem_of(channels: Channels, chain: Chain, contacts: Contacts, options: Options) -> Problem:
    """Build the problem of a log.

    Args:
        channels: as the contacts were found in.
        chain: behind which they were found.
        contacts: at least one.
        options: what is known of lag, mass and the sensor's low-pass.

    Raises:
        InputError: too few rows in contact.
    """
    low_pass = options.force_filter
    if low_pass is not None and shown(low_pass, channels.raw.dt):
        seen = behind_sensor(channels, low_pass, chain, contacts, options)
    else:
        seen = behind_filter(channels, chain, contacts, options)
    free_standing = not contacts.bonded
    return Problem(
        motion=seen.motion,
        force=seen.force[seen.motion.rows],
        spans=seen.spans,
        lag=seen.lag,
        free=seen.free,
        touch=touching(seen, contacts.resting) if free_standing else None,
        approach=touching(seen, contacts.resting, reach=1) if free_standing else None,
        origin=seen.origin,
        contacts=contacts,
        read=seen.read,
        rounding=seen.rounding,
        filtered=seen.filtered,
    )
