"""What a step of an arm before a surface costs: palpate's own laws, and MuJoCo's `mj_step`, both from compiled code.

MuJoCo's step is called by its address from a Numba loop, so that nothing of Python is in it. It is measured with the
arm alone, without shapes or contact, and with a small ball at the tip that rests on a plane, which a press needs.
Palpate's step has the surface, its contact and the force sensor in it.
"""

import argparse
import ctypes
import sys
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import numba
import numpy as np

from palpate._vector import ZERO3
from palpate.environments.models import KelvinVoigt
from palpate.environments.surface import UNTOUCHED, touch
from palpate.press.cell import Reading, TouchState, compiled_tick
from palpate.press.engines import loop_of
from palpate.press.setting import cell_of, place_of
from palpate.press.simulated_arm import body_at
from palpate.robots import SerialArm
from palpate.robots.serial.serial_arm import mjcf, scene_of

STEPS, WANTED = 1000, 3.0
NAMES = ("ur5e", "panda", "fr3", "iiwa14")
HEAD = (
    "| | own step, touching [us] | `mj_step`, touching [us] | times (90 % of the turns) | `mj_step`, in free motion"
    " [us] | times |"
)


def own(name: str) -> Callable[[], float]:
    """Measures seconds a step, touching."""
    arm = SerialArm.named(name)
    place = place_of(arm, None, None, gap=-1e-4)
    cell = cell_of(arm, place, KelvinVoigt(5000.0, 50.0, 0.0), loop_of(name, arm.title, "torque", place.mass))
    start = TouchState(touch(UNTOUCHED, 0.0), Reading(ZERO3, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
    cell = cell._replace(steps=STEPS)
    torque, noise = arm.gravity_torque(place.q), np.zeros(8)

    def once() -> float:
        body = body_at(place.q, place.q)
        begun = time.process_time()
        compiled_tick(cell, body, start, torque, 0, noise)
        return (time.process_time() - begun) / STEPS

    return once


def mujoco_step() -> ctypes._CFuncPtr:
    """`mj_step` of the library that the package itself has loaded."""
    folder = Path(mujoco.__file__).parent
    (library,) = [p for p in folder.glob("libmujoco*") if p.is_file()][:1]
    step = ctypes.CDLL(str(library)).mj_step
    step.argtypes, step.restype = [ctypes.c_void_p, ctypes.c_void_p], None
    return step


def scene(name: str, touching: bool) -> "mujoco.MjModel":
    """The arm, with a ball at its tip a tenth of a millimetre in a plane if it shall touch."""
    arm = SerialArm.named(name)
    if not touching:
        return scene_of(arm).model
    spec = mujoco.MjSpec.from_string(mjcf(arm))
    spec.compiler.balanceinertia = True
    tip = next(site for site in spec.sites if site.name == "tip")
    ball = tip.parent.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.01, 0, 0], pos=tip.pos, mass=0.0)
    height = arm.forward_kinematics(arm.home)[2, 3] - 0.01 + 1e-4
    floor = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 0.1], pos=[0, 0, height])
    for geom in (ball, floor):
        geom.condim = 1
    return spec.compile()


def theirs(name: str, touching: bool) -> Callable[[], float]:
    """Measures seconds a step of MuJoCo's."""
    arm, model = SerialArm.named(name), scene(name, touching)
    model.opt.timestep = 5e-4
    step = mujoco_step()

    @numba.njit
    def march(model, data, count):
        for _ in range(count):
            step(model, data)

    def once() -> float:
        data = mujoco.MjData(model)
        data.qpos[:] = arm.home
        data.qfrc_applied[:] = arm.gravity_torque(arm.home)
        mujoco.mj_forward(model, data)
        assert data.ncon == int(touching)
        begun = time.process_time()
        march(model._address, data._address, STEPS)  # noqa: SLF001
        assert data.time > 0.9 * STEPS * 5e-4
        return (time.process_time() - begun) / STEPS

    return once


def row(name: str, turns: int) -> tuple[str, bool]:
    """A row of the table, and whether the ratio is what is wanted.

    The three take turns, so that what else the machine does falls on all of them alike.
    """
    ways = own(name), theirs(name, True), theirs(name, False)
    for way in ways:
        way()
    took = 1e6 * np.array([[way() for way in ways] for _ in range(turns)])
    a, touching, free = np.median(took, axis=0)
    ratios = [np.percentile(took[:, i] / took[:, 0], (5, 50, 95)) for i in (1, 2)]
    cells = [f"{r[1]:.1f} ({r[0]:.1f} to {r[2]:.1f})" for r in ratios]
    return f"| {name} | {a:.2f} | {touching:.2f} | {cells[0]} | {free:.2f} | {cells[1]} |", ratios[1][
        1
    ] >= WANTED


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--arms", nargs="+", default=NAMES, choices=NAMES)
    asked.add_argument("--turns", type=int, default=400, help="of the engines, by turns")
    words = asked.parse_args()
    print(HEAD, "|" + "---|" * HEAD.count(" | ") + "---|", sep="\n")
    for name in words.arms:
        line, enough = row(name, words.turns)
        print(line, flush=True)
        if not enough:
            print(f"{name}: {WANTED:g} of both is wanted", file=sys.stderr)


if __name__ == "__main__":
    main()
