from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from palpate.signals.samples import runs


@given(st.lists(st.booleans(), max_size=30))
def test_runs_are_the_samples_within_and_as_long_as_can_be(inside):
    found = runs(np.array(inside, bool))
    assert [i for a, b in found for i in range(a, b)] == [i for i, own in enumerate(inside) if own]
    assert all(before < after for (_, before), (after, _) in pairwise(found))
