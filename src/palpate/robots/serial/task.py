"""An arm told in the axes of its own task: what a controller takes for three directions then serves six.

In these axes the arm is  A^-1 xdd + ... : a body of six directions with the apparent inertia A^-1 = (J M^-1 J^T)^-1,
its Jacobian the identity (Khatib, 1987). A controller's torque is then a wrench F at the tip, and the joints get

    tau = J^T F + (1 - J^T Jbar^T) tau_0,    Jbar = M^-1 J^T (J M^-1 J^T)^-1

of which the second part moves joints to spare and not the tip.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Vec3, Vec6
from palpate.arrays import Array
from palpate.robots.serial.linear import backward, factorise, forward, product


@part
class Identity(NamedTuple):
    """The Jacobian of an arm that is told in its task's axes."""

    one: float = 1.0

    def on(A, b):
        """The vector b itself, unchanged."""
        return b

    def __matmul__(A, b):
        return b

    @property
    def T(A):
        """The identity, its own transpose."""
        return A

    def map_resolve(J, a, M):
        """The vector a itself, unchanged."""
        return a


@part
class ApparentInertia(NamedTuple):
    """(J M^-1 J^T)^-1, held as the factor of what it is the inverse of.

    Args:
        L: of J M^-1 J^T = L L^T, shape (6, 6).
        six: room, shape (6,).
    """

    L: Array
    six: Array

    def on(A, b):
        """The wrench that gives the acceleration b."""
        y = A.six
        y[0], y[1], y[2], y[3], y[4], y[5] = b.lin.x, b.lin.y, b.lin.z, b.ang.x, b.ang.y, b.ang.z
        forward(A.L, y)
        backward(A.L, y)
        return Vec6(Vec3(y[0], y[1], y[2]), Vec3(y[3], y[4], y[5]))

    def __matmul__(A, b):
        return A.on(b)


@part
class TaskModel(NamedTuple):
    """The arm's laws for a controller: F = M xdd + h + f, in the task's axes."""

    J: Identity
    Jdqd: Vec6
    M: ApparentInertia
    h: Vec6


for _cls in (Identity, ApparentInertia):
    _cls.__array_ufunc__ = None  # type: ignore[union-attr]  # NumPy leaves the operators to these classes


@law
def into(axes, lin, ang):
    """A pair of vectors of the base's axes in those of the task, whose rows are `axes`."""
    return Vec6(axes @ lin, axes @ ang)


@law
def column_in(axes, J, i):
    """Column i of the Jacobian in the task's axes."""
    return into(axes, Vec3(J[0, i], J[1, i], J[2, i]), Vec3(J[3, i], J[4, i], J[5, i]))


@law
def put_six(a, i, v):
    """A pair of vectors into column i."""
    a[0, i], a[1, i], a[2, i] = v.lin.x, v.lin.y, v.lin.z
    a[3, i], a[4, i], a[5, i] = v.ang.x, v.ang.y, v.ang.z


@part
class TaskRoom(NamedTuple):
    """Where the laws of this file put what they find; whoever steps an arm makes it."""

    L: Array  # of M = L D L^T, as `linear` has it, shape (n, n)
    W: Array  # J in the task's axes, then L^-1 J^T in rows; the last row is L^-1 h, shape (7, n)
    mobility: Array  # J M^-1 J^T, shape (6, 6)
    factor: Array  # of that, shape (6, 6)
    six: Array  # shape (6,)


@law
def task_model(axes, room, tip, own):
    """The arm in the task's axes.

    Args:
        axes: of the task, in rows.
        room: filled by `chain_model`.
        tip: of the same.
        own: a `TaskRoom`.
    """
    factorise(room.M, own.L)
    for i in range(len(room.h)):
        put_six(own.W, i, column_in(axes, room.J, i))
        own.W[6, i] = room.h[i]
    for k in range(7):
        forward(own.L, own.W[k])
    for i in range(6):
        for k in range(i + 1):
            own.mobility[i, k] = product(own.L, own.W[i], own.W[k])
    factorise(own.mobility, own.factor)
    inertia = ApparentInertia(own.factor, own.six)
    Jdqd = into(axes, tip.a, tip.dw)
    return TaskModel(Identity(1.0), Jdqd, inertia, inertia @ acceleration_of_last(own))


@law
def acceleration_of_last(own):
    """Task acceleration that the torque of the last row gives, J M^-1 tau."""
    y = own.six
    for i in range(6):
        y[i] = product(own.L, own.W[i], own.W[6])
    return Vec6(Vec3(y[0], y[1], y[2]), Vec3(y[3], y[4], y[5]))


@law
def joint_torque(axes, room, model, own, F, damping, qd, torque):
    """Fills `torque` [N m], shape (n,): J^T F, and joints to spare held against gravity and slowed down.

    Args:
        axes: of the task, in rows.
        room: filled by `chain_model`.
        model: `task_model` of it.
        own: as that left it.
        F: the controller's wrench in the task's axes [N, N m].
        damping: of the joints to spare, M times this and their rates [1/s].
        qd: joint rates, shape (n,).
        torque: where it goes.
    """
    n, last = len(torque), own.W[6]
    for i in range(n):
        torque[i] = room.h[i]
        for k in range(n):
            torque[i] -= damping * (room.M[i, k] * qd[k])
        last[i] = torque[i]
    forward(own.L, last)
    wrench = F - model.M @ acceleration_of_last(own)
    for i in range(n):
        torque[i] += wrench @ column_in(axes, room.J, i)
