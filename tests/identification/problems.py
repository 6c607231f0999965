"""Problems as the identification makes them of a log, for tests of the stages after it."""

from __future__ import annotations

from typing import Any

from palpate.identification.contacts import contacts_of
from palpate.identification.options import Options
from palpate.identification.problem import Problem, build_problem
from palpate.identification.sampling import channels_of
from palpate.records import Record


def problem(log: Record, lag: float | None = 0.0, **said: Any) -> Problem:
    """Of a log whose lag is told; None for one that nobody has calibrated.

    Args:
        log: with time, position and force.
        lag: [s].
        said: further options of `identify`.
    """
    options = Options.of(lag=lag, **said)
    channels, chain, contacts = contacts_of(channels_of(log), options)
    return build_problem(channels, chain, contacts, options)
