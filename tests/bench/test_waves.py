"""A desired force of any shape: a chirp, many sines, or whatever an array holds."""

import numpy as np
import pytest

from bench.quick import quick
from palpate.bench import build, load, with_values
from palpate.errors import InputError
from palpate.references import Chirp, Multisine

CHIRP = {"low": 5.0, "high": 40.0, "seconds": 0.15, "amplitude": 2.0}
SINES = {"frequencies": [10.0, 30.0], "amplitudes": [1.0, 0.5], "phases": [0.0, 1.0]}


def asked(experiment):
    """What the record says was asked for in contact [N], shape (n,)."""
    record = build(experiment).run(1.0, 0, press=0.2)
    return record["force_desired"][record["phase"] == 1.0]


def test_chirp_and_sines_are_asked_for_from_contact_on():
    experiment = with_values(quick("foam-hybrid"), {"force.chirp": CHIRP, "force.multisine": SINES})
    time = np.arange(200) / 1000.0
    expected = 20.0 + Chirp(**CHIRP).at(time) + Multisine(**SINES).at(time)
    np.testing.assert_allclose(asked(experiment), expected, rtol=0, atol=1e-12)


def test_any_array_will_do():
    wave = np.random.default_rng(0).uniform(-1.0, 1.0, 150)
    record = build(quick("foam-hybrid")).with_wave(wave).run(1.0, 0, press=0.2)
    desired = record["force_desired"][record["phase"] == 1.0]
    np.testing.assert_allclose(desired - 20.0, [*wave, *50 * [0.0]], rtol=0, atol=1e-13)


@pytest.mark.parametrize("wave", [np.zeros((2, 3)), [1.0, np.nan], 3.0])
def test_what_is_no_wave_is_refused(wave):
    with pytest.raises(InputError, match=r"wave must be finite numbers of shape \(n,\)"):
        build(quick("foam-hybrid")).with_wave(wave)


@pytest.mark.parametrize("name", ["foam-chirp", "rubber-chirp"])
def test_the_shipped_chirps_stay_in_contact(name):
    experiment = load(name)
    record = build(experiment).run(experiment.run.duration, 0, press=experiment.run.press)
    pressing = record["phase"] == 1.0
    assert pressing.sum() == 20500
    assert not (record["phase"] == 2.0).any()
    force = record["force"][pressing][1000:]
    assert force.min() > 8.0
    assert force[:5000].std() > 1.5
    assert force[18000:19000].std() > 0.5, "it shakes at 40 Hz still"
    assert force.mean() == pytest.approx(15.0, abs=0.2)


BAD = {
    "unknown key": ({"force.chirp": {**CHIRP, "to": 3.0}}, r"unknown key 'to' in \[force.chirp\]"),
    "too fast": ({"force.chirp": {**CHIRP, "high": 600.0}}, r"\[force.chirp\] must be below 500 Hz"),
    "too fast at first": ({"force.chirp": {**CHIRP, "low": 500.0}}, r"got 500 and 40"),
    "sines too fast": ({"force.multisine": {**SINES, "frequencies": [10.0, 500.0]}}, r"below 500 Hz.*got 500"),
    "lengths": ({"force.multisine": {**SINES, "phases": [0.0]}}, r"of one length, got \[2, 2, 1\]"),
    "no time": ({"force.chirp": {**CHIRP, "seconds": 0.0}}, r"seconds in \[force.chirp\] must be a number above 0"),
}  # fmt: skip


@pytest.mark.parametrize(("changes", "told"), BAD.values(), ids=BAD)
def test_a_bad_wave_is_refused_by_its_key(changes, told):
    with pytest.raises(InputError, match=told):
        build(with_values(load("foam-hybrid"), changes))
