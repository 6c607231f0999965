"""Maps of surfaces with lumps: intervals that hold, next presses that tell most, and bad input."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InputError
from palpate.maps import StiffnessMap, stiffness_map
from palpate.maps.result import lumps_of
from palpate.maps.stiffness_map import choose

RNG = np.random.default_rng(8)
GRID = np.stack(np.meshgrid(np.linspace(0.0, 0.1, 40), np.linspace(0.0, 0.1, 40)), axis=-1).reshape(-1, 2)
CORNERS = np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.1, 0.1]])


def truth(places):
    lump = 1.0 / (1.0 + np.exp((np.hypot(*(places[:, :2] - [0.06, 0.04]).T) - 0.02) / 0.003))
    return 1000.0 * np.exp(1.1 * lump)


def pressed(count=60, std=0.03, seed=8, places=None):
    rng = np.random.default_rng(seed)
    if places is None:
        places = np.vstack([CORNERS, rng.uniform(0.0, 0.1, (count - 4, 2))])
    value = truth(places) * np.exp(std * rng.normal(size=len(places)))
    result = StiffnessMap()
    result.update(places, value, 1.96 * std * value)
    return result


@pytest.fixture(scope="module")
def lumpy():
    return pressed()


def test_intervals_hold_on_the_surface_and_for_a_next_press(lumpy):
    seen = lumpy.predict(GRID)
    low, high = seen.ci95.T
    assert np.mean((low < truth(GRID)) & (truth(GRID) < high)) > 0.88
    stated = truth(GRID) * np.exp(0.03 * RNG.normal(size=len(GRID)))
    low, high = seen.next95.T
    assert np.mean((low < stated) & (stated < high)) > 0.88
    assert np.median(seen.ci95[:, 1] / seen.ci95[:, 0]) < 1.6


def test_a_lump_is_found_where_it_is(lumpy):
    grid = lumpy.grid(2500)
    (lump,) = [lump for lump in lumps_of(grid, lumpy.predict(grid.places), 1700.0) if lump.is_sure]
    assert np.hypot(lump.place[0] - 0.06, lump.place[1] - 0.04) < 0.012
    assert lump.ci95[0] < 3000.0 < lump.ci95[1]
    assert lump.area95[0] < np.pi * 0.02**2 < lump.area95[1]


def test_the_next_press_takes_most_off_what_is_asked():
    """Against the definition: the variance after each candidate, each conditioned by itself."""
    A = RNG.normal(size=(12, 12))
    covariance, weights, noise = A @ A.T, RNG.uniform(size=12), 0.3
    after = [
        weights @ np.diag(covariance - np.outer(c, c) / (c[k] + noise)) for k, c in enumerate(covariance.T)
    ]
    best, left = next(choose(covariance, weights, noise))
    assert best == np.argmin(after)
    assert weights @ left == pytest.approx(min(after))


def test_a_place_is_not_chosen_twice_and_all_lie_within_the_hull(lumpy):
    found = lumpy.next(6)
    assert len({tuple(place) for place in np.asarray(found)}) == len(found) == 6
    assert np.all((np.asarray(found) >= 0.0) & (np.asarray(found) <= 0.1))
    assert np.all(
        found.expected_half < 1.96 * lumpy.predict(found.places).std * lumpy.predict(found.places).stiffness
    )


def test_presses_for_an_edge_lie_nearer_to_it_than_presses_for_the_interval(lumpy):
    radius = lambda places: np.hypot(*(np.asarray(places) - [0.06, 0.04]).T)  # noqa: E731
    edge = radius(lumpy.next(12, stiffer_than=1700.0))
    rest = radius(lumpy.next(12))
    assert np.median(np.abs(edge - 0.02)) < np.median(np.abs(rest - 0.02))


def test_fewer_presses_are_needed_for_a_wider_interval(lumpy):
    few, many = lumpy.presses_until(0.3), lumpy.presses_until(0.15)
    assert 0 <= few < many
    assert lumpy.presses_until(10.0) == 0


def test_presses_do_not_take_off_their_common_error():
    result = StiffnessMap(common=0.1)
    result.update(*_of(pressed()))
    assert result.presses_until(0.1) is None
    wide, alone = result.predict(GRID), pressed().predict(GRID)
    assert np.all(wide.ci95[:, 1] > alone.ci95[:, 1])
    assert wide.next95 == pytest.approx(alone.next95)  # the next press shares the error


def _of(result):
    return result.places, result.stiffness, result.half


def test_a_press_that_its_neighbours_contradict_is_named(lumpy):
    places, stiffness, half = _of(lumpy)
    wrong = int(np.argmin(np.hypot(*(places - [0.06, 0.04]).T)))
    result = StiffnessMap()
    result.update(places, np.where(np.arange(len(places)) == wrong, stiffness / 4.0, stiffness), half)
    assert wrong in result.disagreeing()
    assert not lumpy.disagreeing()


def test_a_curved_surface_is_mapped_in_its_own_places():
    places = np.vstack([CORNERS, np.random.default_rng(1).uniform(0.0, 0.1, (46, 2))])
    dome = np.column_stack([places, 0.5 * np.sum((places - 0.05) ** 2, axis=1) / 0.1])
    result = pressed(places=dome)
    grid = result.grid(400)
    assert grid.places.shape[1] == 3
    height = 0.5 * np.sum((grid.places[grid.inside, :2] - 0.05) ** 2, axis=1) / 0.1
    assert grid.places[grid.inside, 2] == pytest.approx(
        height, abs=1e-3
    )  # a dome of 25 mm, pressed every 14 mm
    low, high = result.predict(grid.places[grid.inside]).ci95.T
    known = truth(grid.places[grid.inside])
    assert np.mean((low < known) & (known < high)) > 0.85


@pytest.mark.parametrize(
    ("places", "stiffness", "half", "words"),
    [
        ([[0.0, 0.0]], [1.0, 2.0], [0.1], "shapes"),
        ([0.0, 0.0], [1.0], [0.1], "shapes"),
        ([[0.0, np.nan]], [1.0], [0.1], "places must be finite"),
        ([[0.0, 0.0]], [-1.0], [0.1], "stiffness must be finite and above 0"),
        ([[0.0, 0.0]], [1.0], [0.0], "half must be finite and above 0"),
        ([[0.0, 0.0]], [1e300], [10.0], "of a size that is measured"),
        ([[1e300, 0.0]], [1.0], [0.1], "places must be finite"),
        (
            [[0.0, 0.0], [0.1, 0.0], [0.0, 0.0], [0.0, 0.1]],
            [500.0, 510.0, 5000.0, 530.0],
            [5.0, 5.0, 5.0, 5.0],
            "at one place",
        ),
    ],
)
def test_bad_presses_are_refused_in_one_line(places, stiffness, half, words):
    with pytest.raises(InputError, match=words) as error:
        StiffnessMap().update(places, stiffness, half)
    assert "\n" not in str(error.value)


def test_presses_that_repeat_worse_than_they_state_are_no_contradiction():
    rng = np.random.default_rng(4)
    places = np.repeat(rng.uniform(0.0, 0.1, (12, 2)), 2, axis=0)
    value = 1e3 * np.exp(0.1 * rng.normal(size=24))
    result = StiffnessMap()
    result.update(places, value, 0.01 * value)
    assert result.process.repeat == pytest.approx(0.1, rel=0.5)


def test_two_frames_are_not_mixed():
    result = pressed()
    with pytest.raises(InputError, match="one frame"):
        result.update([[0.0, 0.0, 0.0]], [1e3], [10.0])


WRONG = (
    None, "a", 3.0, np.nan, np.inf, -np.inf, 0.0, -1.0, 1e-12, 1e12, 1e300, 10**400, True, 1j, object, [], [[]], [1.0],
    [[0.01]], [[0.01, 1j]], [[0.01, None]], [["a", "b"]], [[[0.01, 0.01]]], [[0.01], [0.0, 0.0]], [[np.nan, 0.01]],
    [[0.01, np.inf]], [[1e300, 0.0]],
)  # fmt: skip
SIZES = (1e-9, 1e-3, 1.0, 1e6, 1e11)
PLACES = np.random.default_rng(2).uniform(-1.0, 1.0, (12, 3))
FORMS = {
    "scattered": PLACES,
    "repeated": PLACES[[0, 1, 2] * 4],
    "nearly in one line": PLACES * [1e-8, 1.0, 1.0],
    "far from the origin": 1e3 + PLACES,
    "two": PLACES[:2],
    "none": PLACES[:0],
}


@pytest.mark.parametrize("form", FORMS)
@given(st.data())
def test_any_call_gives_finite_numbers_or_one_line(form, data):
    """Presses of any place, size and interval, then each public call with numbers, text, arrays and nothing."""
    draw = lambda *right: data.draw(st.sampled_from([*right] * 60 + [*WRONG]))  # noqa: E731
    size, value, half = (data.draw(st.sampled_from(SIZES)) for _ in range(3))
    places = size * FORMS[form][:, : data.draw(st.sampled_from([2, 3]))]
    count = len(places)
    stiffness = value * np.exp(data.draw(st.sampled_from([0.0, 0.1, 2.0])) * PLACES[:count, 0])
    result = answer(lambda: StiffnessMap(draw(0.0, 0.1))) or StiffnessMap()
    answer(lambda: result.update(places, stiffness, half * stiffness, draw(None, np.arange(count) // 3)))
    answer(lambda: result.update(draw(places), draw(stiffness), draw(half * stiffness)))
    there = draw(1.5 * places - 0.5 * places[:1], np.full_like(places, np.nan))
    prediction = answer(lambda: result.predict(there))
    if prediction is not None:
        assert_finite(
            *(getattr(prediction, name) for name in ("stiffness", "ci95", "next95", "relative_half"))
        )
        assert_finite(answer(lambda: prediction.exceeds(draw(value))))
    chosen = answer(lambda: result.next(draw(1, 2, 3), draw(None, there), stiffer_than=draw(None, value)))
    if chosen is not None:
        assert_finite(chosen.places, chosen.expected_half)
    grid = answer(lambda: result.grid(draw(1, 100)))
    assert_finite(None if grid is None else grid.places)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stiffness_map, "MAX_PRESSES", 20)  # a thousand take seconds
        assert_finite(answer(lambda: result.presses_until(draw(0.1))), answer(result.disagreeing))


def answer(call):
    """The result of a call, or None if it is refused in one line."""
    try:
        return call()
    except InputError as error:
        lines = str(error).splitlines()
    assert len(lines) == 1
    return None


def assert_finite(*numbers):
    for array in numbers:
        assert array is None or np.isfinite(array).all()


def test_a_map_without_presses_answers_in_one_line():
    for call in ("disagreeing", "grid", "next"):
        with pytest.raises(InputError, match="three places"):
            getattr(StiffnessMap(), call)()
    with pytest.raises(InputError, match="from 1 to"):
        pressed().next(1.5)
