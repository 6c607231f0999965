"""The Silverbox: a twin of known numbers in the benchmark's own layout, and the measured record where it is."""

import json
from pathlib import Path

import numpy as np
import pytest

from palpate.cli import main
from palpate.errors import InputError
from palpate_benchmark.duffing import EDGE, MODELS, Part, fit, nrmse, simulate, turn
from palpate_benchmark.silverbox import ESTIMATION, RATE, ROWS, TESTS, load_silverbox

MEASURED = Path(__file__).parents[4] / "shared/data/silverbox/schroeder_80mV.csv"
TRUE = {
    "M": 5.37e-6,
    "B": 2.25e-4,
    "K": 0.99,
    "K3": 3.94,
    "B3": 2.6e-4,
    "phase": -3.3,
    "f0": -0.008,
    "x0": 0.0026,
}
NOISE = 1e-4


def multisine(rows, rng, deviation=0.027, period=8192):
    """Random phases up to 200 Hz, one period after the other."""
    lines = np.arange(1, int(200.0 / RATE * period))
    spectrum = np.zeros(period // 2 + 1, complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.uniform(size=len(lines)))
    one = np.fft.irfft(spectrum)
    return np.tile(one / one.std() * deviation, rows // period + 1)[:rows]


def twin(u, rng, noise=NOISE):
    """Position of the true equation under a force, with noise, shape (n,)."""
    own = Part(np.pad(u, EDGE, mode="wrap"), EDGE, np.zeros(len(u)), RATE)
    return simulate({**TRUE, "y": 0.0, "v": 0.0}, own) + rng.normal(0.0, noise, len(u))


def test_the_search_finds_a_twin_within_its_intervals():
    rng = np.random.default_rng(3)
    u = multisine(14000, rng)
    x = twin(u, rng)
    found = fit(Part.of(u, x, RATE, 1000, 10000), MODELS["cubic spring and damping, phase"])
    for name in ("M", "B", "K", "K3", "B3", "phase"):
        low, high = found.ci95(name)
        middle = TRUE[name]
        assert low - (high - low) / 2 < middle < high + (high - low) / 2, name  # six at once, of 95 % each
    unseen = Part.of(u, x, RATE, 10000, 13800)
    assert nrmse(found, unseen, 50) == pytest.approx(NOISE / x[10050:13800].std(), rel=0.1)
    linear = fit(Part.of(u, x, RATE, 1000, 10000), MODELS["linear"])
    assert nrmse(linear, unseen, 50) > 0.1


def test_the_filter_of_a_channel_turns_a_sine_by_its_phase():
    n, k = 1000, 300
    t = np.arange(n)
    w = 2.0 * np.pi * k / n
    inner = slice(2 * EDGE, -2 * EDGE)
    share = w / np.pi
    found = turn(np.sin(w * t), -2.0)
    assert found[inner] == pytest.approx(np.sin(w * t - 2.0 * share**3)[inner], abs=5e-3)
    fine = turn(np.sin(0.1 * w * t), 0.0, 4)
    assert fine[4 * EDGE : -4 * EDGE] == pytest.approx(
        np.sin(0.025 * w * np.arange(4 * (n - 1) + 1))[4 * EDGE : -4 * EDGE],
        abs=3e-3,  # the mirrored ends are no sine
    )


def write(path, u, x):
    """As the benchmark's own file is, with an empty last column."""
    path.write_text("V1,V2,\n" + "".join(f"{a:.8g},{b:.8g},\n" for a, b in zip(u, x, strict=True)))
    return path


def arrow(rng):
    """A record in the benchmark's layout: noise whose amplitude grows, a pause, multisines."""
    u = np.zeros(ROWS)
    u[100:40575] = np.linspace(0.0, 1.0, 40475) * multisine(40475, rng, 0.05)
    u[40650:127400] = multisine(86750, rng)
    return u


def test_the_official_split_is_that_of_the_benchmark(tmp_path):
    rng = np.random.default_rng(0)
    u = arrow(rng)
    data = load_silverbox(write(tmp_path / "SNLS80mV.csv", u, u))
    assert data.official
    assert len(data.estimation.x) == 65062
    assert {name: len(own.x) for name, own in data.tests.items()} == {
        "test multisine": 21688,
        "test arrow": 40475,
        "test arrow, no extrapolation": 32000,
    }
    assert data.estimation.x == pytest.approx(u[slice(*ESTIMATION)], abs=1e-8)
    assert data.tests["test arrow"].x == pytest.approx(u[slice(*TESTS["test arrow"])], abs=1e-8)
    other = load_silverbox(write(tmp_path / "other.csv", u[50000:60000], u[50000:60000]))
    assert not other.official
    assert [len(other.estimation.x), len(other.tests["test"].x)] == [7500, 2500]


def test_a_matlab_file_is_read_too(tmp_path):
    from scipy.io import savemat

    u = multisine(8192, np.random.default_rng(1))
    savemat(tmp_path / "record.mat", {"V1": u[None], "V2": 2.0 * u[None]})
    data = load_silverbox(tmp_path / "record.mat")
    assert data.estimation.x == pytest.approx(2.0 * u[:6144])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "x,y\n1,2\n"),
        ("a.csv", "V1,V2,\n1,2,\n"),
        ("a.csv", "V1,V2,\n1,2\n1,oh,3,4\n"),
        ("a.mat", "none"),
    ],
)
def test_another_file_is_refused_in_one_line(tmp_path, capsys, name, text):
    (tmp_path / name).write_text(text)
    assert main(["benchmark", "silverbox", str(tmp_path / name)]) == 2
    assert "Traceback" not in capsys.readouterr().err
    with pytest.raises(InputError):
        load_silverbox(tmp_path / name)


def test_silverbox_takes_one_file(capsys):
    assert main(["benchmark", "silverbox"]) == 2
    assert "one file" in capsys.readouterr().err
    assert main(["benchmark", "silverbox", "nowhere.csv"]) == 2
    assert main(["benchmark", "silverbox", "nowhere.csv", "--force", "5"]) == 2


@pytest.mark.long
def test_a_twin_in_the_official_layout_reaches_its_noise_in_all_three_tests(tmp_path, capsys):
    rng = np.random.default_rng(5)
    u = arrow(rng)
    x = twin(u, rng)
    assert main(["benchmark", "silverbox", str(write(tmp_path / "SNLS80mV.csv", u, x)), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["official"]
    best = found["models"]["cubic spring and damping, phase"]
    for name, ends in TESTS.items():
        assert best["nrmse"][name] == pytest.approx(NOISE / x[slice(*ends)].std(), rel=0.1)
    assert best["parameters"]["K3"]["value"] == pytest.approx(TRUE["K3"], rel=2e-3)


@pytest.mark.long
@pytest.mark.skipif(not MEASURED.exists(), reason="the measured record is not here")
def test_the_measured_circuit_is_predicted_to_half_a_per_cent(capsys):
    assert main(["benchmark", "silverbox", str(MEASURED), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert not found["official"]
    errors = {name: own["nrmse"]["test"] for name, own in found["models"].items()}
    assert errors["cubic spring and damping, phase"] < 0.0045
    assert errors["linear"] > 0.1
