"""An arm told in the axes of its own task: what a controller takes for three directions then serves six.

In these axes the arm is  A^-1 xdd + ... : a body of six directions with the apparent inertia A^-1 = (J M^-1 J^T)^-1,
its Jacobian the identity (Khatib, 1987). A controller's torque is then a wrench F at the tip, and the joints get

    tau = J^T F + (1 - J^T Jbar^T) tau_0,    Jbar = M^-1 J^T (J M^-1 J^T)^-1

of which the second part moves joints to spare and not the tip.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import Mat3, Vec3, Vec6, solve
from palpate.robots.serial.linear import backward, forward


@part
class Identity(NamedTuple):
    """The Jacobian of an arm that is told in its task's axes."""

    one: float = 1.0

    def on(A, b):
        """b itself."""
        return b

    def __matmul__(A, b):
        return b

    @property
    def T(A):
        """Itself."""
        return A

    def map_resolve(J, a, M):
        """a itself."""
        return a


@part
class ApparentInertia(NamedTuple):
    """(J M^-1 J^T)^-1, held as what it is the inverse of: [[P, Q], [Q^T, R]]."""

    P: Mat3
    Q: Mat3
    R: Mat3

    def on(A, b):
        """By blocks: first the rotation's share, seen through the translation's."""
        w = solve(A.P, b.lin)
        columns = A.Q.T
        X = Mat3(solve(A.P, columns.r1), solve(A.P, columns.r2), solve(A.P, columns.r3)).T
        y = solve(A.R - A.Q.T @ X, b.ang - A.Q.T @ w)
        return Vec6(w - X @ y, y)

    def __matmul__(A, b):
        return A.on(b)


@part
class TaskModel(NamedTuple):
    """What a controller knows: F = M xdd + h + f, told in the task's axes."""

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


@law
def task_model(axes, L, room, tip, W):
    """The arm in the task's axes.

    Args:
        axes: of the task, in rows.
        L: of M = L L^T, shape (n, n).
        room: filled by `chain_model`.
        tip: of the same.
        W: room for J in the task's axes, then L^-1 J^T in rows, shape (7, n): the last row is L^-1 h.
    """
    n = len(room.h)
    for i in range(n):
        put_six(W, i, column_in(axes, room.J, i))
        W[6, i] = room.h[i]
    for k in range(7):
        forward(L, W[k])
    A = ApparentInertia(block(W, 0, 0), block(W, 0, 3), block(W, 3, 3))
    bias = Vec6(products(W, 0, 6), products(W, 3, 6))
    return TaskModel(Identity(1.0), into(axes, tip.a, tip.dw), A, A @ bias)


@law
def product(W, i, j):
    """Of two rows."""
    total = 0.0
    for k in range(W.shape[1]):
        total += W[i, k] * W[j, k]
    return total


@law
def products(W, i, j):
    """Of three rows from i on with row j."""
    return Vec3(product(W, i, j), product(W, i + 1, j), product(W, i + 2, j))


@law
def block(W, i, j):
    """Of three rows from i on with three from j on."""
    return Mat3(products(W, j, i), products(W, j, i + 1), products(W, j, i + 2))


@law
def joint_torque(axes, L, room, model, W, F, damping, qd, torque):
    """Fills `torque` [N m], shape (n,): J^T F, and joints to spare held against gravity and slowed down.

    Args:
        axes: of the task, in rows.
        L: of M = L L^T.
        room: filled by `chain_model`.
        model: `task_model` of it.
        W: as that left it.
        F: the controller's wrench in the task's axes [N, N m].
        damping: of the joints to spare, M times this and their rates [1/s].
        qd: joint rates, shape (n,).
        torque: where it goes.
    """
    n = len(torque)
    for i in range(n):
        torque[i] = room.h[i]
        for k in range(n):
            torque[i] -= damping * (room.M[i, k] * qd[k])
    y = W[6]
    for i in range(n):
        y[i] = torque[i]
    forward(L, y)
    spare = Vec6(products(W, 0, 6), products(W, 3, 6))  # J M^-1 tau_0
    wrench = F - model.M @ spare
    for i in range(n):
        torque[i] += wrench @ column_in(axes, room.J, i)


@law
def accelerations(L, room, torque, qdd):
    """Fills qdd = M^-1 (torque - h), shape (n,)."""
    for i in range(len(torque)):
        qdd[i] = torque[i] - room.h[i]
    forward(L, qdd)
    backward(L, qdd)
