"""Young's modulus of a named indenter: the laws, and that a press that does not follow them gives none."""

import numpy as np
import pytest

from identification.synthetic_contacts import coloured, force_of, press_path, record
from palpate.errors import InputError
from palpate.identification import identify
from palpate.identification.indenter import Indenter, with_modulus
from palpate.identification.result import Identification, Press, Tangent
from palpate.identification.uncertainty import Measurement, Verdict

MODULUS, NU = 2e5, 0.45
REDUCED = MODULUS / (1 - NU**2)
SHAPES = {
    "sphere": (Indenter("sphere", 0.02), lambda d: 4 / 3 * REDUCED * np.sqrt(0.02) * d**1.5),
    "punch": (Indenter("punch", 0.002), lambda d: 2 * 0.002 * REDUCED * d),
    "cone": (Indenter("cone", np.radians(70)), lambda d: 2 / np.pi * REDUCED * np.tan(np.radians(70)) * d**2),
}


GENTLE = Tangent(1.0, Measurement.within(100.0, 1.0))
FALLING = Tangent(2.0, Measurement.within(-5.0, 3.0))


def pressed(law, *, share=0.02, shift=0.0, deep=1e-3):
    """A press by its law, with slopes by the law's own differences, each known to a share."""
    depth = np.linspace(0, deep, 400)
    force = law(depth)
    tangent = []
    for level in (0.3, 0.5, 0.7, 0.9):
        at = np.interp(level * force[-1], force, depth)
        slope = (law(at + 1e-9) - law(at - 1e-9)) / 2e-9
        tangent.append(Tangent(level * force[-1], Measurement.within(slope, share * slope)))
    press = Press(tuple(tangent), np.stack([depth + shift, force]), np.empty((2, 0)))
    return Identification("kelvin-voigt", {}, (), None, 0.99, 0.1, 100, (), press=press)


def modulus(found, indenter, poisson=(NU, 0.0), **options):
    return with_modulus(found, indenter, poisson, **options).parameters["E"]


@pytest.mark.parametrize("shape", SHAPES)
def test_each_indenter_gives_the_modulus_of_its_law(shape):
    indenter, law = SHAPES[shape]
    own = modulus(pressed(law, deep=2e-4), indenter)
    assert own.value == pytest.approx(MODULUS, rel=1e-3)
    assert own.verdict is Verdict.IDENTIFIED
    assert own.unit == "Pa"
    for word in (shape, "half space", "no adhesion", "0.45"):
        assert word in own.reason


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("other", SHAPES)
def test_another_indenter_is_told_by_how_the_slope_grows(shape, other):
    own = modulus(pressed(SHAPES[shape][1]), SHAPES[other][0])
    assert (own.verdict is Verdict.IDENTIFIED) == (shape == other)


def test_a_surface_taken_to_be_elsewhere_widens_the_interval():
    indenter, law = SHAPES["sphere"]
    right, off = modulus(pressed(law), indenter), modulus(pressed(law, shift=4e-4), indenter)
    assert off.value == pytest.approx(right.value, rel=1e-6), "by the slope and the force alone"
    assert off.budget["surface position"] > 10 * right.budget.get("surface position", 0.0)
    assert off.verdict is not Verdict.IDENTIFIED


def test_poissons_ratio_is_part_of_the_interval():
    indenter, law = SHAPES["punch"]
    known, vague, untold = (
        modulus(pressed(law, share=1e-4), indenter, poisson) for poisson in ((NU, 0.0), (NU, 0.05), None)
    )
    assert "Poisson's ratio" not in known.budget
    assert vague.budget["Poisson's ratio"] == pytest.approx(1.96 * 2 * NU * 0.05 * REDUCED, rel=1e-3)
    low, high = untold.ci95
    assert (low, high) == pytest.approx((0.75 * REDUCED, REDUCED), rel=1e-3)


def test_a_deep_press_of_a_sphere_is_beyond_hertz():
    """Sneddon's sphere is not the paraboloid that Hertz takes it for: at a depth of 0.4 radii by several per cent."""
    indenter, law = SHAPES["sphere"]
    shallow, deep = modulus(pressed(law, deep=1e-4), indenter), modulus(pressed(law, deep=8e-3), indenter)
    assert shallow.budget.get("small strain", 0.0) < 0.01 * MODULUS
    assert deep.budget["small strain"] > 0.02 * MODULUS
    beyond = modulus(pressed(law, deep=0.04), indenter)
    assert beyond.value is None
    assert "beyond the sphere's radius" in beyond.reason


@pytest.mark.parametrize(
    "press",
    [
        None,
        Press((), np.empty((2, 0)), np.empty((2, 0))),
        Press((GENTLE,), np.ones((2, 3)), np.empty((2, 0))),
        Press((GENTLE, FALLING), np.ones((2, 3)), np.empty((2, 0))),
    ],
)
def test_a_press_that_shows_no_slope_gives_no_modulus(press):
    found = Identification("kelvin-voigt", {}, (), None, 0.99, 0.1, 100, (), press=press)
    own = modulus(found, SHAPES["sphere"][0])
    assert own.value is None
    assert own.verdict is Verdict.NOT_IDENTIFIABLE
    assert own.reason


@pytest.mark.parametrize("shape", ["sphere", pytest.param("cone", marks=pytest.mark.long)])
def test_a_press_of_a_simulated_surface(shape):
    """From a log: the loading of an elastic half space, with noise."""
    indenter, law = SHAPES[shape]
    time = np.arange(6000) / 1000
    x = press_path(time, 0.06)
    force = force_of(x, lambda d, v: law(d), 1e-3)
    log = record(time, x, force + coloured(len(time), 1e-3 * force.max(), 0.5, np.random.default_rng(0)))
    own = modulus(identify(log, lag=0.0), indenter)
    assert own.value is not None
    assert own.ci95[0] < MODULUS < own.ci95[1]


@pytest.mark.parametrize(("offset", "slope"), [(-2.0, 0.0), (0.5, 0.02), (0.0, 0.1), (0.0, -0.1)])
@pytest.mark.parametrize("shape", ["sphere", pytest.param("cone", marks=pytest.mark.long)])
def test_a_baseline_before_the_contact_is_estimated(shape, offset, slope):
    """An offset, and a slope per depth, of the peak force, under the approach and the retraction."""
    indenter, law = SHAPES[shape]
    held = 0
    for seed in range(3):
        time = np.arange(0, 12, 5e-3)
        x = np.interp(time, [0, 1, 6, 6.5, 11.5, 12], 1e-3 * np.array([-1.5, -1.5, 1, 1, -1.5, -1.5]))
        peak = law(1e-3)
        noise = 2e-3 * np.random.default_rng(seed).standard_normal(len(time))
        log = record(time, x, law(np.maximum(x, 0)) + peak * (offset + slope * (x + 1.5e-3) / 1e-3 + noise))
        own = with_modulus(identify(log), indenter, (NU, 0.0), record=log).parameters["E"]
        assert own.verdict is Verdict.IDENTIFIED
        assert ("above a baseline" in own.reason) == (slope != 0)
        held += own.ci95[0] < MODULUS < own.ci95[1]
    assert held >= 2


def test_a_baseline_does_not_excuse_another_indenter():
    indenter, _ = SHAPES["sphere"]
    x = np.linspace(-1.5e-3, 1e-3, 2000)
    force = SHAPES["cone"][1](np.maximum(x, 0))
    force += 1e-3 * force.max() * np.random.default_rng(0).standard_normal(len(x)) + 20 * x
    log = record(np.arange(len(x)) / 200, x, force)
    own = with_modulus(identify(log), indenter, (NU, 0.0), record=log).parameters["E"]
    assert own.verdict is not Verdict.IDENTIFIED


@pytest.mark.parametrize(
    ("shape", "size", "why"),
    [
        ("sphere", 0.0, "radius of a sphere"),
        ("cone", 2.0, "under 90 deg"),
        ("ball", 1.0, "indenter is a sphere"),
    ],
)
def test_an_impossible_indenter_is_refused(shape, size, why):
    with pytest.raises(InputError, match=why):
        Indenter(shape, size)


@pytest.mark.parametrize("poisson", [(0.6, 0.0), (-1.0, 0.0), (0.3, -0.1), (float("nan"), 0.0)])
def test_an_impossible_ratio_is_refused(poisson):
    with pytest.raises(InputError, match="Poisson"):
        modulus(pressed(SHAPES["punch"][1]), SHAPES["punch"][0], poisson)
