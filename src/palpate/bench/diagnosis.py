"""Why a loop with a part of the user's does not compile, in words shorter than the compiler's."""

from __future__ import annotations

import numpy as np

from palpate.bench.row import COLUMNS
from palpate.bench.sequence import CONTACT
from palpate.bench.tick import Loop, LoopState, tick
from palpate.environments.surface_state import touch
from palpate.errors import PartError


def diagnosed(loop: Loop, state: LoopState) -> PartError:
    """Steps the loop once in plain Python, in contact, and tells what is raised there.

    A mistake in a part shows itself there with the line that makes it, which is the cause of the error returned. What
    only the compiler minds has no such line.
    """
    plant = state.plant._replace(surface=touch(state.plant.surface, 0.0))
    pressed = state._replace(plant=plant, sequence=state.sequence._replace(phase=CONTACT))
    try:
        after = tick(loop, pressed, 0, 0.0, np.empty(len(COLUMNS)))
    except Exception as error:  # noqa: BLE001 - whatever the user's own code raises
        found = PartError(f"a part fails when it is stepped: {type(error).__name__}: {error}")
        found.__cause__ = error
        return found
    changed = [name for name in state._fields if _kinds(getattr(state, name)) != _kinds(getattr(after, name))]
    if changed:
        return PartError(
            f"the state of the {changed[0]} changes its types from one tick to the next; start as it goes on"
        )
    return PartError(
        "the loop runs in plain Python but cannot be compiled: a part may hold, take and return only floats, "
        "vectors and NamedTuples of them, and call only laws; run it with compiled=False, or see the cause"
    )


def _kinds(value: object) -> object:
    """The types of a value and of all that is in it."""
    if isinstance(value, tuple):
        return type(value), tuple(_kinds(v) for v in value)
    return float if isinstance(value, float) else type(value)
