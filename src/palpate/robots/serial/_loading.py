"""A MuJoCo model from its source, with the inertias as they are published."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.robots.serial._extra import mujoco, refusals
from palpate.robots.serial.inertias import check_inertia


def load_mjcf(path: Path) -> tuple[Any, list[str]]:
    """The model of a file, and notes on it.

    Raises:
        InputError: what MuJoCo refuses; an inertia that is none.
        OSError: no such file.
    """
    with path.open("rb"):
        pass
    with refusals(str(path)):
        spec = mujoco().MjSpec.from_file(str(path))
        return compiled(spec)


def compiled(spec: Any) -> tuple[Any, list[str]]:
    """The model, and notes on links that no body can be, which MuJoCo would refuse or change."""
    odd = {} if spec.compiler.balanceinertia else _odd(spec)
    if not odd:
        return spec.compile(), []
    spec.compiler.balanceinertia = True
    model = spec.compile()
    for body, moment, _ in odd:
        _restore(model, body, moment)
    mujoco().mj_setConst(model, mujoco().MjData(model))
    return model, [note for _, _, note in odd]


def _odd(spec: Any) -> list[tuple[Any, Array, str]]:
    """Links whose published inertia breaks the triangle inequality, its moments, and the note."""
    found = []
    for body in spec.bodies:
        if body.explicitinertial and body.name != "world":
            moment = _moment(body)
            note = check_inertia(body.name, float(body.mass), moment)
            if note:
                found.append((body, moment, note))
    return found


def _moment(body: Any) -> Array:
    """About the centre of mass in the axes of the body's inertial frame."""
    if np.isnan(body.fullinertia[0]):
        return np.diag(np.array(body.inertia, dtype=float))
    xx, yy, zz, xy, xz, yz = np.array(body.fullinertia, dtype=float)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _restore(model: Any, source: Any, moment: Array) -> None:
    """Puts the published moments back, which MuJoCo keeps as principal ones and their axes."""
    body, quat = source.id, np.array(source.iquat, dtype=float)
    if np.isnan(source.fullinertia[0]):
        model.body_inertia[body] = np.diag(moment)  # the axes are still the published ones
        return
    package, turn, total = mujoco(), np.zeros(9), np.zeros(4)
    package.mju_quat2Mat(turn, quat / np.linalg.norm(quat))
    principal, axes = np.linalg.eigh(moment)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    package.mju_mat2Quat(total, (turn.reshape(3, 3) @ axes).ravel())
    model.body_inertia[body], model.body_iquat[body] = principal, total
