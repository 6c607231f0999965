"""Strokes of a position: where they begin and end, and which positions have none."""

import numpy as np
import pytest

from identification.synthetic_contacts import record
from palpate.identification.sampling import channels_of
from palpate.identification.strokes import find_strokes

TIME = np.arange(5000) / 1000
REST_AND_PRESS = np.interp(TIME, [0.0, 0.5, 1.5, 3.0, 5.0], [0.0, 0.3e-3, 0.3e-3, 2e-3, 0.0])


def strokes(position):
    return find_strokes(channels_of(record(TIME, position, 3000 * position)))


def test_a_stroke_begins_where_the_probe_last_rested():
    advance, retreat = strokes(REST_AND_PRESS)
    assert 1.45 < advance.begin < 1.6
    assert 2.9 < advance.end < 3.0 < retreat.begin < 3.1


@pytest.mark.parametrize(("scale", "offset"), [(-1.0, 0.0), (1e-3, 0.0), (1.0, 0.4)])
def test_neither_sign_nor_size_nor_origin_counts(scale, offset):
    for own, other in zip(strokes(REST_AND_PRESS), strokes(scale * REST_AND_PRESS + offset), strict=True):
        assert (own.begin, own.end) == pytest.approx((other.begin, other.end), abs=2e-3)


@pytest.mark.parametrize("frequency", [0.5, 2.0, 7.0])
def test_a_shaken_position_has_none(frequency):
    assert strokes(1e-3 * np.sin(2 * np.pi * frequency * TIME)) == ()
