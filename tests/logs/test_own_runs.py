"""The record of a run says itself what measured it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from identification.synthetic_contacts import coloured, force_of, press_path
from logs.ros_bags import pose, wrench, write_bag
from palpate.cli import main
from palpate.logs import write_record
from palpate.logs.read import is_run, measured_by
from palpate.records import Record
from palpate.signals.low_pass import LowPass

KNOWN = LowPass.parse("butterworth3:120").lag
FINE, RATE, SAMPLING, DELAY = 48_000, 1000, 480, 1 / 480
INSTRUMENTS = {
    "force": {"filter": "butterworth3:120", "sampling_Hz": SAMPLING, "delay_s": DELAY},
    "position": {"lag_s": 0.0},
}


def samples_of_a_press():
    """What the sensor samples: the force through its low-pass at 480 Hz, with noise."""
    fine = np.arange(3 * FINE) / FINE
    force = force_of(press_path(fine, 0.06), lambda d, v: 5000 * d + 40 * v, 1 / FINE)
    passed = lfilter(*butter(3, 120, fs=FINE), force)
    return passed[:: FINE // SAMPLING] + coloured(3 * SAMPLING, 0.1, 0.0, np.random.default_rng(0))


def run_record(**instruments):
    """A press as a run leaves it: each sample stands in the log for a sample's time, and a sample late."""
    samples = samples_of_a_press()
    time = np.arange(3 * RATE) / RATE
    shown = np.floor((time + 1e-9 - DELAY) * SAMPLING).astype(int)
    held = np.where(shown < 0, 0.0, samples[np.maximum(shown, 0)])
    columns = {
        "t": time,
        "x_measured": press_path(time, 0.06),
        "force_sampled": held,
        "phase": np.ones(3 * RATE),
    }
    units = {"t": "s", "x_measured": "m", "force_sampled": "N", "phase": "1"}
    return Record(columns, units, {"instruments": INSTRUMENTS | instruments})


@pytest.fixture
def path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return write_record(run_record(), tmp_path / "record.parquet")


def test_columns_lag_and_filter_come_from_the_record(path, capsys):
    assert main(["identify", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["lag_s"]["value"] == pytest.approx(KNOWN + DELAY)
    assert found["parameters"]["K"]["value"] == pytest.approx(5000, rel=0.01)
    assert found["parameters"]["B"]["value"] == pytest.approx(40, rel=0.1)
    assert found["parameters"]["B"]["verdict"] == "identified"


def test_what_is_said_counts_more(path, capsys):
    assert main(["identify", str(path), "--json", "--lag", "0.001", "--force-filter", "none"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["lag_s"]["value"] == 0.001
    assert found["options"]["force_filter"] == "none"


@pytest.mark.long
def test_it_is_shown(path, capsys):
    assert main(["identify", str(path), "--verbose"]) == 0
    assert "a run's record: x_measured and force_sampled" in capsys.readouterr().out


def test_a_record_that_does_not_say_is_a_log_like_others(tmp_path):
    silent = run_record(force={"filter": "unknown", "sampling_Hz": 480.0, "delay_s": 0.0})
    path = write_record(silent, tmp_path / "silent.parquet")
    assert is_run(path)
    assert measured_by(path) == {}
    late = run_record(position={"lag_s": 0.001})
    assert measured_by(write_record(late, tmp_path / "late.parquet"))["lag"] == pytest.approx(
        KNOWN + DELAY - 0.001
    )


def test_other_parquet_is_no_run(tmp_path):
    other = Record({"time": np.arange(3.0)}, {"time": "s"})
    assert not is_run(write_record(other, tmp_path / "a.parquet"))
    (tmp_path / "a.csv").write_text("t,x_measured,force_sampled\n1,2,3\n")
    assert not is_run(tmp_path / "a.csv")


def test_a_bag_with_the_sensor_s_own_samples(tmp_path, monkeypatch, capsys):
    """Stamped when they were taken, at 480 Hz beside a pose of 1 kHz: they are not moved, and their grid is found."""
    monkeypatch.chdir(tmp_path)
    samples, time = samples_of_a_press(), np.arange(3 * RATE) / RATE
    force = np.column_stack([0 * samples, 0 * samples, samples])
    place = np.column_stack([0 * time, 0 * time, -press_path(time, 0.06)])
    write_bag(
        tmp_path / "press",
        "mcap",
        [wrench("/ft", np.arange(len(samples)) / SAMPLING, force), pose("/pose", time, place)],
    )
    words = ["--wrench-frame", "base", "--normal", "0,0,-1", "--position-from", "tip"]
    known = ["--force-filter", "butterworth3:120", "--lag", str(KNOWN)]
    assert main(["identify", "press", *words, *known, "--json"]) == 0
    parameters = json.loads(capsys.readouterr().out)["parameters"]
    for name, truth in (("K", 5000), ("B", 40)):
        assert parameters[name]["verdict"] == "identified"
        low, high = parameters[name]["ci95"]
        assert low - (high - low) / 2 < truth < high + (high - low) / 2  # four standard deviations
