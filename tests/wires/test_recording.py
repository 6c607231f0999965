"""A press's rows on the disk: a folder is begun whole, and a record that was made stays as it was said to end."""

import errno

import msgspec
import pytest

from palpate.wires import outcome


def test_a_disk_without_room_for_the_rows_leaves_nothing(tmp_path, monkeypatch):
    def full(path, size):
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(outcome, "_reserve", full)
    with pytest.raises(OSError, match="No space left") as caught:
        outcome.Rows(tmp_path / "rec", 10, {})
    assert caught.value.filename == str(tmp_path / "rec" / "rows.f64")
    assert not list(tmp_path.iterdir())


def test_recovery_keeps_the_end_of_a_press_whose_rows_alone_were_left(tmp_path):
    rows = outcome.Rows(tmp_path / "rec", 10, {"title": "an arm"})
    for k in range(1, 6):
        rows.add(*[float(k)] * len(outcome.UNITS))
    left = (tmp_path / "rec" / "rows.f64").read_bytes()
    path = rows.finish({"ended": "done", "ok": True})
    (tmp_path / "rec" / "rows.f64").write_bytes(left)
    assert outcome.recover(tmp_path / "rec") == path
    said = msgspec.json.decode((tmp_path / "rec" / "press.json").read_bytes())
    assert (said["ended"], said["ok"]) == ("done", True)
    assert sorted(file.name for file in (tmp_path / "rec").iterdir()) == ["press.json", "record.parquet"]
