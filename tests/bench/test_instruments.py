"""What a record says of its instruments: filter and delay of the force, to a microsecond."""

import pytest

from bench.quick import quick
from palpate.bench import build
from palpate.logs.tables.parquet import read_record, write_record


def test_a_record_carries_its_instruments_to_disk_and_back(tmp_path):
    record = build(quick("foam-hybrid", force_sensor={"phase": 5e-4})).run(0.3)
    told = record.meta["instruments"]
    assert told["position"] == {"lag_s": 0.0}
    assert told["force"]["filter"] == "butterworth3:120"
    assert told["force"]["sampling_Hz"] == 480.0
    assert told["force"]["delay_s"] == pytest.approx(1.0 / 480.0, abs=50e-6)
    assert read_record(write_record(record, tmp_path / "record.parquet")).meta["instruments"] == told


def test_a_line_with_a_filter_of_its_own_has_no_name():
    record = build(quick("foam-hybrid", force_sensor={"analog_filter": True})).run(0.01)
    assert record.meta["instruments"]["force"]["filter"] == "unknown"
