"""Everything that the laws say of one state of an arm, in arrays: one call, compiled once for every arm."""

from typing import NamedTuple

import numpy as np

from palpate._jit import kernel, law, part
from palpate._vector import ZERO3, Mat3, Vec3
from palpate.arrays import Array
from palpate.robots.serial.chain import Room, Tip, chain_model, jacobian_rate, room_for


@part
class Found(NamedTuple):
    """The laws at one state, in arrays."""

    room: Room
    Jdot: Array  # shape (6, n)
    Jdqd: Array  # shape (6,)
    pose: Array  # shape (4, 4)


@law
def described(chain, q, qd, found):
    """Fills everything that is known of one state."""
    tip = chain_model(chain, q, qd, found.room)
    jacobian_rate(qd, found.room, tip, found.Jdot)
    bias, pose = found.Jdqd, found.pose
    bias[0], bias[1], bias[2] = tip.a.x, tip.a.y, tip.a.z
    bias[3], bias[4], bias[5] = tip.dw.x, tip.dw.y, tip.dw.z
    R = tip.R
    pose[0, 0], pose[0, 1], pose[0, 2], pose[0, 3] = R.r1.x, R.r1.y, R.r1.z, tip.p.x
    pose[1, 0], pose[1, 1], pose[1, 2], pose[1, 3] = R.r2.x, R.r2.y, R.r2.z, tip.p.y
    pose[2, 0], pose[2, 1], pose[2, 2], pose[2, 3] = R.r3.x, R.r3.y, R.r3.z, tip.p.z


@law
def tip_of(found, qd):
    """The tip, from the arrays."""
    pose, bias, J = found.pose, found.Jdqd, found.room.J
    v, w = ZERO3, ZERO3
    for i in range(len(qd)):
        v += qd[i] * Vec3(J[0, i], J[1, i], J[2, i])
        w += qd[i] * Vec3(J[3, i], J[4, i], J[5, i])
    R = Mat3(
        Vec3(pose[0, 0], pose[0, 1], pose[0, 2]),
        Vec3(pose[1, 0], pose[1, 1], pose[1, 2]),
        Vec3(pose[2, 0], pose[2, 1], pose[2, 2]),
    )
    p = Vec3(pose[0, 3], pose[1, 3], pose[2, 3])
    return Tip(p, R, v, w, Vec3(bias[0], bias[1], bias[2]), Vec3(bias[3], bias[4], bias[5]))


def found_for(n: int) -> Found:
    """Room for what is found of an arm of n joints."""
    return Found(room_for(n), np.zeros((6, n)), np.zeros(6), np.eye(4))


compiled_description = kernel(described)
