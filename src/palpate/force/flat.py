"""The law's numbers and its state as flat arrays: what a compiled call from Python takes without boxing."""

from typing import Any

import numpy as np

from palpate._jit import reader, writer
from palpate._jit.overloads import leaves, places
from palpate.arrays import Array
from palpate.force.guard import SafetyState
from palpate.force.law import Cautious, CautiousState


def flatten(tree: Any) -> Array:
    """Every number of nested tuples, in their order, shape (n,)."""
    return np.array(list(leaves(tree)))


law_in = reader(Cautious)
state_in = reader(CautiousState)
put_state = writer(CautiousState)
guard_in = reader(SafetyState)
put_guard = writer(SafetyState)

_PLACES = places(CautiousState)
STATE = len(_PLACES)
"""Numbers of a state."""
VARIANCE, REST, DRIFT = (_PLACES.index(("watch", name)) for name in ("variance", "rest", "drift"))
PHASE = _PLACES.index(("stage", "phase"))
VALUE, STD = (_PLACES.index(("estimate", name, "x")) for name in ("value", "std"))
BOUND = _PLACES.index(("bound", "used"))
GUARD, TROUBLE = len(places(SafetyState)), STATE + places(SafetyState).index(("trouble",))
"""Numbers of a guard's state behind it, and the place of the trouble."""
