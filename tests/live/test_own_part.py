"""A surface of the user's on the live page: it has the sliders that it has numbers for."""

import pytest

from palpate.bench import load
from palpate.bench.tables import with_values
from palpate.live.simulation import sliders_of

pytestmark = pytest.mark.usefixtures("permitted")


def test_sliders_are_those_that_the_part_has():
    experiment = with_values(
        load("foam-hybrid"), {"surface": {"kind": "own_parts:Spring", "stiffness": 4000.0}}
    )
    assert {one.key for one in sliders_of(experiment)} >= {
        "surface.stiffness",
        "surface.damping",
        "controller.kf",
    }
    bare = with_values(load("foam-hybrid"), {"surface": {"kind": "own_parts:Rigid"}})
    assert {one.key for one in sliders_of(bare)} == {"force.first", "controller.kf"}
