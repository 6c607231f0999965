"""Every way in which logs write an orientation gives the same quaternions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.errors import InputError
from palpate.logs import read_wrench_and_pose
from palpate.logs.arm_logs import ROTATIONS

RNG = np.random.default_rng(0)
TURNS = Rotation.random(60, rng=RNG)
PLACE = RNG.normal(size=(60, 3))


def written(rotation, whole=False):
    """The columns of a pose in this writing."""
    q, R = TURNS.as_quat(), TURNS.as_matrix()
    if rotation.startswith("matrix"):
        full = np.tile(np.eye(4), (60, 1, 1))
        full[:, :3, :3], full[:, :3, 3] = R, PLACE
        if rotation.endswith("columns"):
            R, full = R.transpose(0, 2, 1), full.transpose(0, 2, 1)
        return full.reshape(60, 16) if whole else np.hstack([PLACE, R.reshape(60, 9)])
    turn = {
        "quaternion": q,
        "quaternion-wxyz": q[:, [3, 0, 1, 2]],
        "rotation-vector": TURNS.as_rotvec(),
        "rpy": TURNS.as_euler("xyz"),
    }[rotation]
    return np.hstack([PLACE, turn])


def csv(tmp_path, pose):
    names = [f"c{i}" for i in range(pose.shape[1])]
    head = ",".join(["t", "fx", "fy", "fz", *names])
    rows = np.column_stack([np.arange(60) / 100, np.sin(np.arange(60)), PLACE[:, :2], pose])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header=head, comments="", fmt="%.17g")
    return tmp_path / "log.csv", ",".join(names)


@pytest.mark.parametrize(
    ("rotation", "whole"), [(r, False) for r in ROTATIONS] + [("matrix", True), ("matrix-by-columns", True)]
)
def test_each_writing_is_the_same_turn(tmp_path, rotation, whole):
    path, names = csv(tmp_path, written(rotation, whole))
    record = read_wrench_and_pose(path, "fx,fy,fz", names, rotation, time="t")
    found = Rotation.from_quat(np.column_stack([record[f"quaternion_{axis}"] for axis in "xyzw"]))
    assert (found * TURNS.inv()).magnitude().max() < 1e-7  # what arccos leaves of rounding
    np.testing.assert_allclose(np.column_stack([record[f"position_{axis}"] for axis in "xyz"]), PLACE)


def test_degrees_are_read_with_their_unit(tmp_path):
    pose = written("rpy")
    pose[:, 3:] = np.degrees(pose[:, 3:])
    path, names = csv(tmp_path, pose)
    names = ",".join(n + (":deg" if i >= 3 else "") for i, n in enumerate(names.split(",")))
    record = read_wrench_and_pose(path, "fx,fy,fz", names, "rpy", time="t")
    found = Rotation.from_quat(np.column_stack([record[f"quaternion_{axis}"] for axis in "xyzw"]))
    assert (found * TURNS.inv()).magnitude().max() < 1e-7


def test_another_number_of_columns_is_refused_with_the_rotation_that_has_it(tmp_path):
    path, names = csv(tmp_path, written("rotation-vector"))
    with pytest.raises(InputError, match="rotation-vector or rpy"):
        read_wrench_and_pose(path, "fx,fy,fz", names, "quaternion", time="t")


def test_numbers_that_are_no_rotation_are_refused(tmp_path):
    pose = written("matrix")
    pose[7, 3:] *= 2
    path, names = csv(tmp_path, pose)
    with pytest.raises(InputError, match="row 8"):
        read_wrench_and_pose(path, "fx,fy,fz", names, "matrix", time="t")
    mirrored = written("matrix")
    mirrored[:, 3:6] *= -1
    path, names = csv(tmp_path, mirrored)
    with pytest.raises(InputError, match="reflection"):
        read_wrench_and_pose(path, "fx,fy,fz", names, "matrix", time="t")
