"""MATLAB files, v5 to v7."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.io import savemat

from palpate.errors import InputError
from palpate.logs import columns_of, read_log, read_wrench_and_pose

T = np.arange(50) / 100
COLUMNS = {"time": "t", "position": "x:mm", "force": "f"}


def saved(tmp_path, compressed=True, **variables):
    path = tmp_path / "log.mat"
    savemat(path, variables, do_compression=compressed)
    return path


@pytest.mark.parametrize("compressed", [pytest.param(False, marks=pytest.mark.long), True])  # v6 and v7
def test_vectors_whichever_way_they_lie(tmp_path, compressed):
    path = saved(
        tmp_path, compressed, t=T[:, None], x=1e3 * T[None, :], f=np.arange(50, dtype=np.int16), gain=3.0
    )
    record = read_log(path, **COLUMNS)
    np.testing.assert_allclose(record["position"], T)
    np.testing.assert_allclose(record["force"], np.arange(50))
    assert record.units == {"time": "s", "position": "m", "force": "N"}
    assert columns_of(path) == ["t", "x", "f"]


def test_fields_of_a_struct_and_columns_of_a_matrix(tmp_path):
    log = {"time": T, "inner": {"force": 2 * T}}
    path = saved(
        tmp_path, log=log, wrench=np.arange(300.0).reshape(50, 6), pose=np.arange(150.0).reshape(3, 50)
    )
    record = read_log(path, time="log.time", force="log.inner.force", position="pose.2")
    np.testing.assert_allclose(record["force"], 2 * T)
    np.testing.assert_allclose(record["position"], np.arange(100.0, 150.0))
    arm = read_wrench_and_pose(path, wrench="wrench", pose="pose", time="log.time")
    np.testing.assert_allclose(arm["torque_z"], np.arange(300.0).reshape(50, 6)[:, 5])
    assert "quaternion_x" not in arm.columns


def test_the_order_of_a_quaternion_is_not_guessed(tmp_path):
    path = saved(tmp_path, t=T, wrench=np.zeros((50, 3)), pose=np.ones((50, 7)))
    with pytest.raises(InputError, match=r"one by one.*the scalar last"):
        read_wrench_and_pose(path, wrench="wrench", pose="pose", time="t")
    names = ",".join(f"pose.{i}" for i in (0, 1, 2, 4, 5, 6, 3))
    assert "quaternion_w" in read_wrench_and_pose(path, wrench="wrench", pose=names, time="t").columns


def test_nan_and_what_stands_for_it_are_no_reading(tmp_path):
    force = np.arange(50.0)
    force[3], force[4] = np.nan, -77
    record = read_log(saved(tmp_path, t=T, x=T, f=force), missing=[-77], **COLUMNS)
    assert list(np.flatnonzero(np.isnan(record["force"]))) == [3, 4]
    assert record.meta["notes"][0]["code"] == "missing-samples"


WRONG = {
    "v7.3": (
        lambda path: path.write_bytes(b"MATLAB 7.3 MAT-file, Platform".ljust(512) + b"\x89HDF"),
        "cannot be read as HDF5",
    ),
    "HDF5": (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(99)), "cannot be read as HDF5"),
    "rubbish": (lambda path: path.write_bytes(b"\x07" * 400), "cannot be read as a MATLAB file"),
    "text": (lambda path: path.write_text("t,x,f\n1,2,3\n" * 30), "cannot be read as a MATLAB file"),
    "short": (lambda path: path.write_bytes(b"MATLAB 5.0 MAT-file"), "cannot be read as a MATLAB file"),
    "empty": (lambda path: path.write_bytes(b""), "is empty"),
    "nothing in it": (lambda path: savemat(path, {"word": "press"}), "holds no array of numbers"),
    "lengths": (
        lambda path: savemat(path, {"t": T, "x": T[:40], "f": T}),
        "one length, got t 50, x 40, f 50",
    ),
    "complex": (lambda path: savemat(path, {"t": T, "x": T, "f": T * 1j}), "'f', row 1 holds '0j'"),
    "infinite": (lambda path: savemat(path, {"t": T, "x": T, "f": 1 / T.clip(0)}), "row 1 holds 'inf'"),
    "other names": (lambda path: savemat(path, {"t": T, "x": T, "g": T}), "unknown column 'f'"),
}


@pytest.mark.filterwarnings("ignore:divide by zero")
@pytest.mark.parametrize("kind", WRONG)
def test_wrong_files(tmp_path, kind):
    make, words = WRONG[kind]
    path = tmp_path / "log.mat"
    make(path)
    with pytest.raises(InputError, match=words) as caught:
        read_log(path, **COLUMNS)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("share", [0.3, pytest.param(0.6, marks=pytest.mark.long), 0.95])
def test_half_a_file(tmp_path, share):
    rng = np.random.default_rng(0)
    path = saved(tmp_path, t=T, x=rng.normal(size=50), f=rng.normal(size=50))
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(InputError) as caught:
        read_log(path, **COLUMNS)
    assert "\n" not in str(caught.value)
