"""A MuJoCo model from its source, with the inertias as they are published, and refusals in one line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.errors import InputError, how_to_install
from palpate.files import open_file
from palpate.files.confined import read_confined
from palpate.files.reading import GB, ReadingBudget, ReadingLimits
from palpate.robots.serial.linear import check_inertia


def mujoco() -> Any:
    """The package.

    Raises:
        InputError: it is not installed.
    """
    try:
        import mujoco as found
    except ImportError:
        raise InputError(
            f"reading MJCF and URDF, and MuJoCo's physics, need MuJoCo: {how_to_install('palpate[arms]')}"
        ) from None
    return found


@contextmanager
def refusals(where: str) -> Iterator[None]:
    """Turns what MuJoCo raises into one line that names the file; its warnings are dropped, not filed."""
    package = mujoco()
    package.set_mju_user_warning(lambda _: None)
    try:
        yield
    except InputError:
        raise
    except (ValueError, TypeError, package.FatalError) as error:
        raise InputError(f"{where}: MuJoCo refuses it: {' '.join(str(error).split())}") from None
    finally:
        package.set_mju_user_warning(None)


_LIMITS = ReadingLimits(
    size=GB / 4,
    seconds=25.0,
    what="a model of a robot",
    larger="leave height fields, textures and meshes out of it that the arm does not touch",
    longer="leave out of it what the arm does not touch",
)
"""The largest arm of MuJoCo's own collection with its meshes takes 4 s and 60 MB."""


def load_mjcf(path: Path, text: str | None = None, *, published: bool = True) -> tuple[Any, list[str]]:
    """The model of a file, and notes on it; MuJoCo compiles it in a process of its own, under limits.

    Args:
        path: of the file.
        text: MJCF or URDF in its place.
        published: keep inertias that MuJoCo would refuse, with a note.

    Raises:
        InputError: what MuJoCo refuses; an inertia that is none; a model that takes too much.
        OSError: no such file.
    """
    open_file(path, "a model of MuJoCo").close()
    mujoco()
    arrays, notes = read_confined(
        __name__, path, "a model of MuJoCo", ReadingBudget(path, _LIMITS), [text, published]
    )
    name = "model.mjb"
    return mujoco().MjModel.from_binary_path(name, {name: arrays["model"].tobytes()}), notes


def unpack(
    path: Path, size: int, question: tuple[str | None, bool]
) -> tuple[dict[str, NDArray[Any]], list[str]]:
    """The compiled model as MuJoCo itself stores it, and notes on it. Runs in a process of its own."""
    (text, published), specs = question, mujoco().MjSpec
    try:
        with refusals(str(path)):
            spec = specs.from_file(str(path)) if text is None else specs.from_string(text)
            model, notes = compile_model(spec) if published else (spec.compile(), [])
    except RuntimeError:  # a foreign exception without a name: there is no memory for what it asks
        raise MemoryError from None
    if model.narena + model.nbuffer > size:
        raise MemoryError
    stored = np.zeros(mujoco().mj_sizeModel(model), np.uint8)
    mujoco().mj_saveModel(model, None, stored)
    return {"model": stored}, notes


def compile_model(spec: Any) -> tuple[Any, list[str]]:
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
    bodies = []
    for body in spec.bodies:
        if body.explicitinertial and body.name != "world":
            moment = _moment(body)
            note = check_inertia(body.name, float(body.mass), moment)
            if note:
                bodies.append((body, moment, note))
    return bodies


def _moment(body: Any) -> Array:
    """About the centre of mass in the axes of the body's inertial frame."""
    if np.isnan(body.fullinertia[0]):
        return np.diag(np.array(body.inertia, dtype=float))
    xx, yy, zz, xy, xz, yz = np.array(body.fullinertia, dtype=float)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _restore(model: Any, source: Any, moment: Array) -> None:
    """Puts the published moments back, which MuJoCo keeps as principal ones and their axes."""
    body = source.id
    quat = np.array(source.iquat, dtype=float)
    if np.isnan(source.fullinertia[0]):
        model.body_inertia[body] = np.diag(moment)  # the axes are still the published ones
        return
    package = mujoco()
    turn = np.zeros(9)
    total = np.zeros(4)
    package.mju_quat2Mat(turn, quat / np.linalg.norm(quat))
    principal, axes = np.linalg.eigh(moment)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    package.mju_mat2Quat(total, (turn.reshape(3, 3) @ axes).ravel())
    model.body_inertia[body], model.body_iquat[body] = principal, total
