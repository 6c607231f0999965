"""Given motion: the force is the surface's law of the path, to the reading through the bench's own instruments."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.bench import ForceSensorTable
from palpate.bench.tip_on_path import COLUMNS, given_motion
from palpate.environments import HuntCrossley, KelvinVoigt, StandardLinearSolid
from palpate.environments.surface import SurfaceState
from palpate.errors import InputError
from palpate.instruments import Converter

FOAM, RUBBER = KelvinVoigt(5200, 200, 0.10), KelvinVoigt(34500, 480, 0.05)
SURFACES = {
    "foam": FOAM,
    "rubber": RUBBER,
    "solid": StandardLinearSolid(5600, 13, 0.02, 6900, 0.23),
    "sphere": HuntCrossley(5e5, 2e6, 1.5, 0.01),
    "massless": KelvinVoigt(5200, 200, 0),
}
OMEGA = 2 * np.pi * 10.0
IDEAL = {"sensor": ForceSensorTable(noise=0.0, bits=32), "resolution": 0.0}
CODE = 200.0 / 2**15
"""Of the converter that reads the sensor's line [N]."""


def sine(t):
    """Always in the surface."""
    return 3e-3 + 1e-3 * np.sin(OMEGA * t)


def sines_force(t, surface=FOAM):
    rate, second = 1e-3 * OMEGA * np.cos(OMEGA * t), -1e-3 * OMEGA**2 * np.sin(OMEGA * t)
    return surface.stiffness * sine(t) + surface.damping * rate + surface.mass * second


@pytest.mark.parametrize("given_as", ["a function", "ticks"])
def test_the_force_is_the_laws(given_as):
    rig = given_motion(FOAM, **IDEAL)
    t = np.arange(1000) / 1000.0
    record = rig.run(sine, 1.0) if given_as == "a function" else rig.run(sine(t))
    np.testing.assert_allclose(record["t"], t, rtol=1e-15)
    np.testing.assert_allclose(record["x"], sine(t), rtol=0, atol=1e-15)
    # Central differences at 50 us, and a spline through points 1 ms apart: both far under a milli-newton of 16 N,
    # but for the ends, beyond which an array tells nothing.
    np.testing.assert_allclose(record["force"][2:-2], sines_force(t)[2:-2], rtol=0, atol=5e-4)
    np.testing.assert_allclose(record["force"], sines_force(t), rtol=0, atol=0.1)


def test_its_error_falls_with_the_square_of_the_step():
    t = np.arange(400) / 1000.0
    errors = [
        np.abs(given_motion(FOAM, steps=steps, **IDEAL).run(sine, 0.4)["force"] - sines_force(t)).max()
        for steps in (5, 10, 20, 40)
    ]
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.05)


def test_the_reading_is_the_filtered_force_of_its_sample():
    """A sine in steady state: gain and phase of a continuous Butterworth, at the instants that the record states."""
    rig = given_motion(FOAM, sensor=ForceSensorTable(noise=0.0, bits=32, phase=4e-4), resolution=0.0)
    fine = rig.line._replace(converter=Converter(32, 200.0))
    record = replace(rig, line=fine).run(sine, 3.0)
    told = record.meta["instruments"]["force"]
    assert (told["filter"], told["sampling_Hz"]) == ("butterworth3:120", 480.0)
    s = 1j * OMEGA / (2 * np.pi * 120.0)
    gain = 1.0 / ((1.0 + s) * (1.0 + s + s * s))
    forced = 1e-3 * (FOAM.stiffness + 1j * OMEGA * FOAM.damping - OMEGA**2 * FOAM.mass)
    clock = 4e-4 + np.arange(240, 1400) / 480.0 + 1.0 / 20000.0
    fresh = record["force_sampled"][np.ceil(clock * 1000 - 1e-9).astype(int)]
    measured = clock - told["delay_s"]
    expected = 3e-3 * FOAM.stiffness + np.imag(gain * forced * np.exp(1j * OMEGA * measured))
    slope = np.real(OMEGA * gain * forced * np.exp(1j * OMEGA * measured))
    assert abs((fresh - expected) @ slope) / (slope @ slope) < 1e-6
    np.testing.assert_allclose(fresh, expected, rtol=0, atol=30e-6 * np.abs(slope).max())


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
def test_at_rest_it_starts_as_after_a_long_rest(surface):
    record = given_motion(surface, **IDEAL).run(lambda t: 0.0 * t + 2e-3, 0.2)
    settled = surface.force(SurfaceState(2e-3, 0.0, 0.0, 1.0), 2e-3, 0.0)
    assert record["force"][0] == pytest.approx(settled)
    np.testing.assert_allclose(record["force_sampled"], settled, rtol=0, atol=CODE)


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
@settings(max_examples=8, deadline=None)
@given(
    amplitudes=st.lists(st.floats(-2e-3, 2e-3), min_size=3, max_size=3),
    frequencies=st.lists(st.floats(0.5, 20.0), min_size=3, max_size=3),
)
def test_it_never_pulls_and_gives_back_no_more_than_it_got(surface, amplitudes, frequencies):
    """Any smooth path from rest and back to rest outside, touching and parting as it likes."""

    def path(t):
        swing = sum(a * np.sin(2 * np.pi * f * t) for a, f in zip(amplitudes, frequencies, strict=True))
        return np.sin(np.pi * np.clip(t, 0.0, 1.0)) ** 4 * (1e-3 + swing) - 1e-6

    record = given_motion(surface, rate=20000, steps=1, **IDEAL).run(path, 1.0)
    force, x = record["force"], record["x"]
    assert np.isfinite(force).all()
    assert force.min() >= 0.0
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(x))
    # An impact's energy is not in these forces: it goes in only, but leaves the mass moving. Sums are trapezoidal.
    moving = 0.5 * surface.mass * np.gradient(x, 5e-5).max() ** 2
    assert work.min() >= -moving - 2e-3 * np.abs(work).max() - 1e-9


def test_a_touch_at_speed_gives_its_impulse_to_the_sensor():
    speed = 0.2
    heavy = KelvinVoigt(1.0, 0.0, 0.5)
    record = given_motion(heavy, **IDEAL).run(lambda t: speed * (t - 0.1), 0.3)
    impulse = record["force_sampled"].sum() / 1000.0
    assert impulse == pytest.approx(heavy.mass * speed, rel=0.1)  # read at 480 Hz


def test_the_same_seed_gives_the_same_numbers_and_another_others():
    rig = given_motion(FOAM)
    first, again, other = rig.run(sine, 0.5, 3), rig.run(sine, 0.5, 3), rig.run(sine, 0.5, 4)
    for name in COLUMNS:
        np.testing.assert_array_equal(first[name], again[name])
    np.testing.assert_array_equal(first["force"], other["force"])
    assert np.std(first["force_sampled"] - other["force_sampled"]) == pytest.approx(0.6 * 2**0.5, rel=0.2)
    assert np.abs(first["x_measured"] - first["x"]).max() <= 2.5e-6 * (1 + 1e-9)
    assert len(np.unique(first["x_measured"])) < 500


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
def test_compiled_is_plain_to_the_bit(surface):
    rig = given_motion([(0.0, surface), (0.05, RUBBER)], sensor=ForceSensorTable(phase=1e-3))
    one, other = rig.run(sine, 0.1, 1), rig.run(sine, 0.1, 1, compiled=False)
    for name in COLUMNS:
        np.testing.assert_array_equal(one[name], other[name])


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
def test_a_surface_that_comes_later_bears_the_force_there_is(surface):
    rig = given_motion([(0.0, KelvinVoigt(7000, 100, 0.05)), (0.2, surface)], rate=20000, steps=1, **IDEAL)
    record = rig.run(sine, 0.4)
    force, at = record["force"], 4000
    step = np.diff(force)
    assert abs(step[at - 1]) < 1.5 * max(abs(step[at - 2]), abs(step[at])), "no jump"
    first, second = record.meta["surfaces"]
    assert (first["from_s"], first["rest_m"], second["from_s"]) == (0.0, 0.0, 0.2)
    assert second["rest_m"] != 0.0
    assert record.meta["truth"] == second["truth"]


def test_after_the_change_the_law_is_the_new_ones():
    soft, hard = KelvinVoigt(7000, 100, 0.05), KelvinVoigt(62000, 300, 0.02)
    record = given_motion([(0.0, soft), (0.475, hard)], **IDEAL).run(
        sine, 1.0
    )  # at the least depth: no parting
    t, late = record["t"], record["t"] >= 0.475
    rest = record.meta["surfaces"][1]["rest_m"]
    np.testing.assert_allclose(record["force"][~late], sines_force(t, soft)[~late], rtol=0, atol=1e-3)
    expected = sines_force(t, hard) - hard.stiffness * rest
    np.testing.assert_allclose(record["force"][late], expected[late], rtol=0, atol=2e-3)


BAD = {
    "no duration": (lambda rig: rig.run(sine), "duration must be at least 0.004 s"),
    "short": (lambda rig: rig.run(sine, 0.001), "duration must be at least 0.004 s .*, got 0.001"),
    "two durations": (
        lambda rig: rig.run(np.zeros(10), 1.0),
        "duration belongs to a path that is a function",
    ),
    "shape": (lambda rig: rig.run(np.zeros((10, 3))), r"path must be of shape \(n,\).*got \(10, 3\)"),
    "three ticks": (lambda rig: rig.run(np.zeros(3)), r"n at least 4; got \(3,\)"),
    "not finite": (lambda rig: rig.run([0.0, 1.0, np.nan, 2.0, 3.0]), "path must be finite numbers"),
    "one number": (lambda rig: rig.run(lambda _: 1.0, 1.0), "one position for each time"),
    "order": (lambda _: given_motion([(0.0, FOAM), (0.0, RUBBER)]), r"growing times \[s\], the first at 0"),
    "late": (lambda _: given_motion([(1.0, FOAM)]), r"growing times .*, got \[1.0\]"),
    "no surface": (lambda _: given_motion([]), r"growing times .*, got \[\]"),
    "phase": (lambda _: given_motion(FOAM, sensor=ForceSensorTable(phase=1.0)), "phase must be at least 0"),
    "rate": (lambda _: given_motion(FOAM, rate=0), "rate must be at least 1, got 0"),
    "resolution": (lambda _: given_motion(FOAM, resolution=-1.0), "resolution must be at least 0"),
}


@pytest.mark.parametrize(("asked", "told"), BAD.values(), ids=BAD)
def test_what_makes_no_sense_is_refused(asked, told):
    with pytest.raises(InputError, match=told):
        asked(given_motion(FOAM))
