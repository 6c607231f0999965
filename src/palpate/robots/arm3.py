"""The three-joint planar arm as laws, for numbers, for batches and for compiled kernels.

Everything is written in the absolute angles of the links, `t1 = q1`, `t2 = q1 + q2`, `t3 = q1 + q2 + q3`:
with them the Jacobian, the inertia and the bias torque need three sines and three cosines between them, and
the dynamics are one line: the generalised force on `t_i` is the sum over j of

    H_ij (cos(t_i - t_j) t_j'' + sin(t_i - t_j) t_j'^2)

with six constants `H_ij`. `Arm3.newton_euler`, the recursion of the thesis' appendix D, does not use them.
"""

from typing import NamedTuple

from palpate._jit import law, part
from palpate._vector import ZERO3, Mat3, Vec3, atan2, cos, sin, solve, sqrt

MOTOR_TORQUE = Vec3(88.2, 9.8, 2.0)
"""Peak torques of the motors [N m] (thesis, appendix B); also what the converter's full scale asks for."""


@law
def absolute(q):
    """Angles or rates of the links from those of the joints: running sums, shape (3,)."""
    t2 = q.x + q.y
    return Vec3(q.x, t2, t2 + q.z)


@law
def onto_joints(e):
    """Torque on each link's absolute angle from torques of the joints: the transpose of `absolute`."""
    e2 = e.y + e.z
    return Vec3(e.x + e2, e2, e.z)


@law
def directions(q):
    """Cosines and sines of the links' absolute angles, (Vec3, Vec3)."""
    t = absolute(q)
    return Vec3(cos(t.x), cos(t.y), cos(t.z)), Vec3(sin(t.x), sin(t.y), sin(t.z))


@law
def jacobian(arm, c, s):
    """J of (2-1), from the links' directions."""
    return Mat3(onto_joints(-(arm.length * s)), onto_joints(arm.length * c), Vec3(1.0, 1.0, 1.0))


@law
def jacobian_rate_velocity(arm, c, s, w):
    """Jdot qd: each link's end is pulled towards its own joint, by its absolute rate squared."""
    p = arm.length * w * w
    return Vec3(-(p @ c), -(p @ s), 0.0)


@law
def own_terms(arm):
    """H_11, H_22, H_33 [kg m^2]: each link about its joint, carrying what follows as a point at its end."""
    r, a, m = arm.length + arm.com, arm.length, arm.mass
    carried = Vec3(m.y + m.z, m.z, 0.0)
    return arm.moment + m * r * r + carried * a * a


@law
def coupling_terms(arm):
    """H_12, H_13, H_23 [kg m^2]."""
    r, a, m = arm.length + arm.com, arm.length, arm.mass
    third = m.z * r.z
    return Vec3(a.x * (m.y * r.y + m.z * a.y), a.x * third, a.y * third)


@law
def inertia(arm, c, s):
    """M, from the inertia X in the links' rates: each element sums X from its row and its column on."""
    own, k = own_terms(arm), coupling_terms(arm)
    x12 = k.x * (c.x * c.y + s.x * s.y)
    x13 = k.y * (c.x * c.z + s.x * s.z)
    x23 = k.z * (c.y * c.z + s.y * s.z)
    m33 = own.z
    m23 = x23 + m33
    m13 = x13 + m23
    m22 = own.y + x23 + m23
    m12 = x12 + own.y + x23 + m13
    m11 = own.x + x12 + x13 + m12
    return Mat3(Vec3(m11, m12, m13), Vec3(m12, m22, m23), Vec3(m13, m23, m33))


@law
def bias(arm, c, s, w):
    """h: centrifugal and Coriolis torque [N m]; in the links' rates w only their squares appear."""
    k, v = coupling_terms(arm), w * w
    x12 = k.x * (s.x * c.y - c.x * s.y)
    x13 = k.y * (s.x * c.z - c.x * s.z)
    x23 = k.z * (s.y * c.z - c.y * s.z)
    return onto_joints(Vec3(x12 * v.y + x13 * v.z, x23 * v.z - x12 * v.x, -(x13 * v.x) - x23 * v.y))


@law
def carry_outward(a, qi, w, dw, ax, ay):
    """Acceleration of a link's end in its own frame (App. D1-3, D2-3, D3-3) [m/s^2]; its cosine and sine."""
    c, s = cos(qi), sin(qi)
    return c * ax + s * ay - a * w * w, c * ay - s * ax + a * dw, c, s


@law
def carry_inward(link, c, s, w, dw, ax, ay, fx, fy, n):
    """Force and torque on a link at its joint, in the frame of the link before it (App. D4, D5, D6).

    `fx, fy, n` is what the link exerts at its end, in its own frame; the `n` returned is the joint's torque.
    """
    a, com, m, moment = link
    Fx, Fy = m * (ax - com * w * w), m * (ay + com * dw)
    n = n + a * fy + (a + com) * Fy + moment * dw
    fx, fy = fx + Fx, fy + Fy
    return c * fx - s * fy, s * fx + c * fy, n


@part
class ArmModel(NamedTuple):
    """The arm's laws at one state, for a controller: tau = M qdd + h + J^T w, xdd = J qdd + Jdqd."""

    J: Mat3
    Jdqd: Vec3
    M: Mat3
    h: Vec3


@part
class Arm3(NamedTuple):
    """The numbers of a planar arm with three revolute joints, and its laws.

    The arguments of the laws are `Vec3` of numbers, or of arrays of one shape: joint angles q [rad], rates
    qd [rad/s], accelerations qdd [rad/s^2]; pose (x [m], y [m], phi [rad]); wrench (F_x [N], F_y [N],
    N_z [N m]) that the arm exerts on what it touches. The defaults are the thesis' appendices B and D.

    Args:
        length: joint to joint, the last one to the tip [m].
        mass: [kg].
        com: centre of mass along the link, measured from its far end: negative is towards its joint [m].
        moment: moment of inertia about the centre of mass [kg m^2].
        limits: what the bench allows each motor [N m]; the motors' own peaks are `MOTOR_TORQUE`.
        rotor: rotor inertias [kg m^2]. No law here uses them: see `with_rotors`.
    """

    length: Vec3 = Vec3(0.2207, 0.1603, 0.1508)
    mass: Vec3 = Vec3(12.88, 5.95, 0.44)
    com: Vec3 = Vec3(-0.0476, -0.0619, -0.0918)
    moment: Vec3 = Vec3(0.138841, 0.039523, 1.339e-3)
    limits: Vec3 = Vec3(16.0, 2.5, 0.6)
    rotor: Vec3 = Vec3(0.084, 0.009, 2.8e-5)

    def with_rotors(self):
        """The arm whose links carry their motors' rotors.

        The motors are direct drives: a rotor is bolted to the link that it turns, and turns with it. So its
        inertia belongs to that link's own moment, and reaches every element of M that this moment reaches,
        not the diagonal alone.
        """
        return Arm3(self.length, self.mass, self.com, self.moment + self.rotor, self.limits, ZERO3)

    def pose(self, q):
        """Pose (x, y, phi) of the tip (1-3), (1-7)."""
        c, s = directions(q)
        return Vec3(self.length @ c, self.length @ s, q.x + q.y + q.z)

    def jac(self, q):
        """J of (2-1), d pose / d q."""
        c, s = directions(q)
        return jacobian(self, c, s)

    def jac_dot(self, q, qd):
        """dJ/dt: (2-3) with each link's absolute rate."""
        c, s = directions(q)
        p = self.length * absolute(qd)
        return Mat3(onto_joints(-(p * c)), onto_joints(-(p * s)), ZERO3)

    def jac_dot_qd(self, q, qd):
        """Jdot qd [m/s^2, m/s^2, rad/s^2]."""
        c, s = directions(q)
        return jacobian_rate_velocity(self, c, s, absolute(qd))

    def jac_det(self, q):
        """det J = a1 a2 sin q2 [m^2]."""
        return self.length.x * self.length.y * sin(q.y)

    def jac_inverse(self, q):
        """J^-1 of (2-2), its element [2, 2] put right; infinite where `jac_det` is zero."""
        c, s = directions(q)
        (a1, a2, a3), d = self.length, 1.0 / self.jac_det(q)
        s3, s23 = s.z * c.y - c.z * s.y, s.z * c.x - c.z * s.x
        first = Vec3(d * a2 * c.y, d * a2 * s.y, d * a2 * a3 * s3)
        last = Vec3(d * a1 * c.x, d * a1 * s.x, d * a1 * a3 * s23 + 1.0)
        return Mat3(first, Vec3(-first.x - last.x, -first.y - last.y, 1.0 - first.z - last.z), last)

    def beyond_reach(self, pose):
        """How far joint 3 lies from where joints 1 and 2 can bring it [m]: negative within reach."""
        a1, a2, a3 = self.length
        px, py = pose.x - a3 * cos(pose.z), pose.y - a3 * sin(pose.z)
        p, inner = sqrt(px * px + py * py), abs(a1 - a2)
        middle = 0.5 * (a1 + a2 + inner)
        return abs(p - middle) - (a1 + a2 - middle)

    def inverse(self, pose, elbow):
        """Joint angles of a pose (1-8)-(1-10); elbow +1 bends joint 2 to the positive side, -1 to the other.

        q1 and q2 lie in [-pi, pi] and q1 + q2 + q3 = phi, turns included. Out of reach, joint 2 is straight
        or folded and the arm points at the pose: ask `beyond_reach` first.
        """
        a1, a2, a3 = self.length
        px, py = pose.x - a3 * cos(pose.z), pose.y - a3 * sin(pose.z)
        p = px * px + py * py
        # (2 a1 a2 sin q2)^2 in Heron's form: no cancellation next to the stretched arm.
        d = ((a1 + a2) * (a1 + a2) - p) * (p - (a1 - a2) * (a1 - a2))
        s2, c2 = elbow * sqrt(0.5 * (d + abs(d))), p - a1 * a1 - a2 * a2
        q2 = atan2(s2, c2)
        k, across = 2.0 * a1 * a1 + c2, s2
        q1 = atan2(py * k - px * across, px * k + py * across)
        return Vec3(q1, q2, pose.z - q1 - q2)

    def inertia(self, q):
        """M(q) [kg m^2], symmetric to the last bit."""
        c, s = directions(q)
        return inertia(self, c, s)

    def bias(self, q, qd):
        """h(q, qd), centrifugal and Coriolis torque [N m]; the plane is level: no gravity."""
        c, s = directions(q)
        return bias(self, c, s, absolute(qd))

    def model(self, q, qd):
        """J, Jdot qd, M and h together, each sine and cosine once."""
        c, s = directions(q)
        w = absolute(qd)
        return ArmModel(
            jacobian(self, c, s),
            jacobian_rate_velocity(self, c, s, w),
            inertia(self, c, s),
            bias(self, c, s, w),
        )

    def newton_euler(self, q, qd, qdd, wrench):
        """Joint torques [N m] by the recursion of App. D, link by link outwards and back."""
        a, w, dw = self.length, absolute(qd), absolute(qdd)
        x1, y1, c1, s1 = carry_outward(a.x, q.x, w.x, dw.x, 0.0, 0.0)
        x2, y2, c2, s2 = carry_outward(a.y, q.y, w.y, dw.y, x1, y1)
        x3, y3, c3, s3 = carry_outward(a.z, q.z, w.z, dw.z, x2, y2)
        t = q.x + q.y + q.z
        c, s = cos(t), sin(t)
        fx, fy = c * wrench.x + s * wrench.y, c * wrench.y - s * wrench.x
        b, m, moment = self.com, self.mass, self.moment
        fx, fy, n3 = carry_inward((a.z, b.z, m.z, moment.z), c3, s3, w.z, dw.z, x3, y3, fx, fy, wrench.z)
        fx, fy, n2 = carry_inward((a.y, b.y, m.y, moment.y), c2, s2, w.y, dw.y, x2, y2, fx, fy, n3)
        fx, fy, n1 = carry_inward((a.x, b.x, m.x, moment.x), c1, s1, w.x, dw.x, x1, y1, fx, fy, n2)
        return Vec3(n1, n2, n3)

    def accelerations(self, q, qd, torque, wrench):
        """Joint accelerations [rad/s^2]: M^-1 (tau - h - J^T w)."""
        model = self.model(q, qd)
        return solve(model.M, torque - model.h - model.J.T @ wrench)

    def kinetic_energy(self, q, qd):
        """1/2 qd^T M qd [J]."""
        return 0.5 * (qd @ (self.inertia(q) @ qd))
