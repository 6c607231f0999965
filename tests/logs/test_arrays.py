"""HDF5, MATLAB v7.3, npz and TDMS: read with what they state; truncated, lying and hostile files end in one line."""

from __future__ import annotations

import os
import pickle
from zipfile import ZIP_DEFLATED, ZipFile

import afmformats
import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from palpate.cli import main
from palpate.errors import InputError
from palpate.files.reading import ReadingLimits
from palpate.logs import read_log
from palpate.logs.listing import list_log
from palpate.logs.tables.arrays import unpack

T = np.arange(400) / 100
X = np.maximum(np.sin(3 * T), 0)
F = 2 * X + 0.01 * np.cos(99 * T)


def hdf5(path, user_block=0):
    with h5py.File(path, "w", userblock_size=user_block) as file:
        file["run/time_s"] = T
        file["run/depth"] = X[:, None]
        file["run/depth"].attrs["units"] = "mm"
        file["run/wrench"] = np.column_stack([0 * F, 0 * F, F])
        file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "x")
    return path


def matlab(path):
    hdf5(path, 512)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(head + path.read_bytes()[128:])
    return path


def npz(path):
    np.savez(path, time_s=T, depth_mm=X, force_N=F, settings=np.array({"gain": 1}, dtype=object))
    return path


def tdms(path):
    with TdmsWriter(path) as file:
        step = {"wf_increment": 0.01}
        channels = {"Load": (F, "N"), "Displacement": (X, "mm")}
        file.write_segment(
            [
                ChannelObject("DAQ", name, values, {"unit_string": unit, **step})
                for name, (values, unit) in channels.items()
            ]
        )
    return path


MAKERS = {"log.h5": hdf5, "log.mat": matlab, "log.npz": npz, "log.tdms": tdms}
COLUMNS = {
    "log.h5": {"time": "run.time_s", "position": "run.depth", "force": "run.wrench.2"},
    "log.mat": {"time": "run.time_s", "position": "run.depth", "force": "run.wrench.2"},
    "log.npz": {"time": "time_s", "position": "depth_mm", "force": "force_N"},
    "log.tdms": {"position": "Displacement", "force": "Load"},
}


@pytest.mark.parametrize("name", MAKERS)
def test_columns_have_the_units_and_the_rate_of_the_file(tmp_path, name):
    path = MAKERS[name](tmp_path / name)
    record = read_log(path, **COLUMNS[name])
    np.testing.assert_allclose(record["position"], 1e-3 * X, atol=1e-12)
    np.testing.assert_allclose(record["force"], F)
    np.testing.assert_allclose(record["time"], T, atol=1e-9)
    assert list_log(path).proposal.options["position"].startswith(COLUMNS[name]["position"])


@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize("fraction", [0.02, pytest.param(0.5, marks=pytest.mark.long), 0.9])
def test_a_truncated_file_is_refused_in_one_line(tmp_path, name, fraction, capsys):
    path = MAKERS[name](tmp_path / name)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(fraction * len(whole))])
    columns = [word for role, column in COLUMNS[name].items() for word in (f"--{role}", column)]
    code = main(["identify", str(path), *columns])
    shown = capsys.readouterr().err
    assert (code, shown.count("\n")) == (2, 1) or (
        name == "log.tdms" and code in {0, 1}
    )  # of which whole parts are read


@pytest.mark.parametrize("name", MAKERS)
def test_a_file_that_holds_more_than_the_limit_is_not_unpacked(tmp_path, name):
    path = MAKERS[name](tmp_path / name)
    with pytest.raises(InputError, match="--max-size"):
        read_log(path, limits=ReadingLimits(size=3000), **COLUMNS[name])


def test_a_size_that_a_file_only_claims_takes_no_memory(tmp_path):
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("force", shape=(2**40,), dtype=float, chunks=(1024,))
    with pytest.raises(InputError, match="--max-size"):
        read_log(path, time="time", position="position", force="force")
    assert path.stat().st_size < 10_000


def test_a_table_of_pandas_has_its_names_and_nothing_in_them_is_run(tmp_path):
    """PyTables keeps a block of columns as one field, and their names as a pickle; a first row may be empty."""
    rows = np.zeros(401, [("index", "i8"), ("values_block_0", "f8", (3,)), ("values_block_1", "S9", (1,))])
    rows["values_block_0"] = np.vstack([np.full(3, np.nan), np.column_stack([X, F, T])])
    mark = tmp_path / "ran"
    for names in (["Depth_mm", "Load_N", "Time"], Mark(str(mark))):
        path = tmp_path / "log.h5"
        with h5py.File(path, "w") as file:
            table = file.create_dataset("Test 1/table", data=rows)
            table.attrs["values_block_0_kind"] = pickle.dumps(names, protocol=0)
            file["Test 1/_i_table/index/sorted"] = np.arange(5000)
        listing = list_log(path)
        assert not mark.exists()
        if isinstance(names, list):
            assert listing.proposal.options["time"] == "Test 1.Time"
            np.testing.assert_allclose(read_log(path)["position"], 1e-3 * X, atol=1e-12)
        assert not any("_i_table" in entry.name for entry in listing.entries)


def test_data_in_other_files_are_not_followed(tmp_path):
    (tmp_path / "secret").write_bytes(np.arange(400.0).tobytes())
    path = hdf5(tmp_path / "log.h5")
    with h5py.File(path, "a") as file:
        file.create_dataset("raw", (400,), float, external=[(str(tmp_path / "secret"), 0, 3200)])
        file.create_virtual_dataset("other", h5py.VirtualLayout((400,), float), fillvalue=0)
    listing = list_log(path)
    names = [entry.name for entry in listing.entries if entry.count]
    assert names == ["run.depth", "run.time_s", "run.wrench.0", "run.wrench.1", "run.wrench.2"]
    with pytest.raises(InputError, match="kept in another file"):
        read_log(path, time="run.time_s", position="run.depth", force="raw")


class Mark:
    """Makes a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (self.path,)


def test_objects_of_python_are_never_loaded(tmp_path):
    mark = tmp_path / "ran"
    path = tmp_path / "log.npz"
    np.savez(path, time_s=T, depth_mm=X, force_N=np.array([Mark(str(mark))] * len(T), dtype=object))
    with pytest.raises(InputError, match="could run code"):
        read_log(path, time="time_s", position="depth_mm", force="force_N")
    assert not mark.exists()


def test_a_curve_that_is_none_is_refused_in_one_line(tmp_path):
    for name in ("curve.ibw", "curve.jpk-force"):
        path = tmp_path / name
        path.write_bytes(b"\x05\x00" + bytes(500))
        with pytest.raises(InputError, match="cannot be read as an AFM curve") as refused:
            read_log(path, time="time", position="height (measured)", force="force")
        assert "\n" not in str(refused.value)


def test_a_curve_without_its_spring_constant_is_a_deflection(tmp_path, monkeypatch):
    class Curve(dict):
        @property
        def metadata(self):
            return {"spring constant": 1.0}

    def load(path, meta_override=None):
        if meta_override != {"spring constant": 1.0}:
            raise afmformats.errors.MissingMetaDataError(["spring constant"])
        return [Curve({"time": T, "force": F, "height (measured)": X})]

    monkeypatch.setattr(afmformats, "load_data", load)
    columns, about = unpack(tmp_path / "curve.ibw", 10**6, "AFM")
    assert [*columns] == ["time", "deflection", "height (measured)"]
    assert about["spring"] is None
    assert "does not state: spring constant" in about["left_out"]["force"]


def test_the_text_in_a_zip_archive_is_read_and_a_cut_one_is_refused(tmp_path):
    path = tmp_path / "log.zip"
    text = "t,x_mm,f_N\n" + "".join(f"{t},{x},{f}\n" for t, x, f in zip(T, X, F, strict=True))
    with ZipFile(path, "w", ZIP_DEFLATED) as packed:
        packed.writestr("log.csv", text)
    np.testing.assert_allclose(read_log(path)["force"], F)
    with pytest.raises(InputError, match="--max-size"):
        read_log(path, limits=ReadingLimits(size=3000))
    whole = path.read_bytes()
    path.write_bytes(whole[:60] + b"\0" * 50 + whole[110:])
    with pytest.raises(InputError, match="cannot be unpacked"):
        read_log(path)
    with ZipFile(path, "w") as packed:
        packed.writestr("a.csv", text)
        packed.writestr("b.csv", text)
    with pytest.raises(InputError, match="several files"):
        read_log(path)


def test_the_times_of_a_log_much_shorter_than_the_one_beside_it(tmp_path):
    ends = np.where(np.arange(len(T)) < 50, 1.0, np.nan)
    np.savez(tmp_path / "log.npz", **{f"{name}_{k}": v * (1.0 if k == "a" else ends)
             for k in "ab" for name, v in (("time_s", T), ("depth_mm", X), ("force_N", F))})  # fmt: skip
    assert len(list_log(tmp_path / "log.npz").proposals) == 2
    assert list_log(tmp_path / "log.npz").proposals[1].options["time"] == "time_s_b"
