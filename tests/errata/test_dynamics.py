"""Appendix D and the dynamics of the listing, against Lagrange's equations."""

import numpy as np

from errata.derivation import COM, LENGTH, MASS, MOMENT, bias_torque, mass_matrix, on_states, states, torque
from errata.page import fails, holds
from palpate.robots import Planar3R

Q, QD, QDD = states()
(A1, A2, A3), (M1, M2, M3), (S1, S2, S3), (I1, I2, I3) = LENGTH, MASS, COM, MOMENT
G = 9.81


def carry(angle, v):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])


def along(r, w, dw):
    """Acceleration across a distance r along a turning link: centripetal, tangential."""
    return np.array([-r * w * w, r * dw])


def centre_2(q, qd, qdd, a2_sign=1.0, com=S2):
    """D2-4: acceleration of the centre of mass of link 2, in its frame."""
    w, dw = np.cumsum(qd), np.cumsum(qdd)
    v1 = along(A1, w[0], dw[0])  # D1-3
    carried = carry(-q[1], v1) + along(A2, w[1], dw[1]) * np.array([1.0, a2_sign])
    return carried + along(com, w[1], dw[1])


def appendix_d(q, qd, qdd, centre=centre_2, q1=A1 + S1, q2=A2 + S2):
    """The recursion of D1 to D6 in the plane; `q1`, `q2` are the vectors to the centres of D6-2 and D5-2."""
    w, dw = np.cumsum(qd), np.cumsum(qdd)
    v1 = along(A1, w[0], dw[0])
    v2 = carry(-q[1], v1) + along(A2, w[1], dw[1])
    v3 = carry(-q[2], v2) + along(A3, w[2], dw[2])
    f1 = M1 * (v1 + along(S1, w[0], dw[0]))
    f2 = M2 * centre(q, qd, qdd)
    f3 = M3 * (v3 + along(S3, w[2], dw[2]))
    n3 = (A3 + S3) * f3[1] + I3 * dw[2]  # D4-4
    f32 = carry(q[2], f3)
    n2 = n3 + A2 * f32[1] + q2 * f2[1] + I2 * dw[1]  # D5-4
    n1 = n2 + A1 * carry(q[1], f32 + f2)[1] + q1 * f1[1] + I1 * dw[0]  # D6-4
    return np.array([n1, n2, n3])


RIGHT = on_states(torque, Q, QD, QDD)


def test_E8_final_torques():
    holds(on_states(appendix_d, Q, QD, QDD) - RIGHT, 1e-11)
    holds(Planar3R().inverse_dynamics(Q, QD, QDD) - RIGHT, 1e-11)


def test_E9_centre_of_link_2_takes_link_2_s_own_distance():
    def printed(q, qd, qdd):
        return centre_2(q, qd, qdd, com=S1)

    holds(on_states(appendix_d, Q, QD, QDD) - RIGHT, 1e-11)
    fails(on_states(lambda *s: appendix_d(*s, centre=printed), Q, QD, QDD) - RIGHT, 0.5)


def test_E10_sign_in_the_first_line_of_d2_4():
    """The second difference of where the centre is decides."""
    h = 1e-4

    def place(q):
        t = np.cumsum(q)
        return np.array(
            [A1 * np.cos(t[0]) + (A2 + S2) * np.cos(t[1]), A1 * np.sin(t[0]) + (A2 + S2) * np.sin(t[1])]
        )

    def measured(q, qd, qdd):
        ahead, behind = (place(q + side * h * qd + h * h / 2 * qdd) for side in (1, -1))
        return carry(-q[0] - q[1], (ahead - 2 * place(q) + behind) / h**2)

    right = on_states(measured, Q, QD, QDD)
    holds(on_states(centre_2, Q, QD, QDD) - right, 1e-5)
    fails(on_states(lambda *s: centre_2(*s, a2_sign=-1.0), Q, QD, QDD) - right, 5.0)


def test_E11_vectors_to_the_centres_of_mass():
    fails(on_states(lambda *s: appendix_d(*s, q2=A2 - S2), Q, QD, QDD) - RIGHT, 5.0)
    fails(on_states(lambda *s: appendix_d(*s, q1=A1 - S1), Q, QD, QDD) - RIGHT, 3.0)
    holds(on_states(lambda *s: appendix_d(*s, q1=A1 + S1, q2=A2 + S2), Q, QD, QDD) - RIGHT, 1e-11)


def test_E12_gravity_appears_from_nowhere():
    """D1-3: from the base's acceleration to that of frame 1, whose third component is printed -g."""

    def frame_1(base, q, qd, qdd):
        plane = carry(-q[0], np.array(base[:2])) + along(A1, qd[0], qdd[0])
        return np.array([*plane, base[2]])

    printed = np.array([*along(A1, QD[0, 0], QDD[0, 0]), -G])
    fails(frame_1((0.0, 0.0, 0.0), Q[0], QD[0], QDD[0]) - printed, 9.8)
    holds(frame_1((0.0, 0.0, -G), Q[0], QD[0], QDD[0]) - printed, 1e-14)


def test_E13_a_dot_too_many_in_d3_6():
    """At twice the speed every torque of a motion is fourfold; a third time derivative would make it eightfold."""
    t = np.linspace(0.0, 1.0, 2001)

    def peak(speed, order):
        angle = np.sin(speed * t)
        for _ in range(order):
            angle = np.gradient(angle, t)
        return np.max(np.abs(I3 * angle[10:-10]))

    holds(peak(6.0, 2) / peak(3.0, 2) - 4.0, 0.05)
    fails(peak(6.0, 3) / peak(3.0, 3) - 4.0, 3.5)


def shorthand(q):
    """Where the centre of link 3 (ta, tb) and that of link 2 (tc, a1 s2) lie from joint 1, in the link's own axes."""
    (_, q2, q3), q23 = q, q[1] + q[2]
    ta = A2 * np.cos(q3) + A1 * np.cos(q23) + A3 + S3
    tb = A2 * np.sin(q3) + A1 * np.sin(q23)
    return ta, tb, A2 + S2 + A1 * np.cos(q2), A1 * np.sin(q2)


def m_00(q, last):
    ta, tb, tc, td = shorthand(q)
    return I1 + I2 + I3 + M3 * (ta**2 + tb**2) + M2 * (tc**2 + td**2) + M1 * last


def m_10(q, sideways):
    ta, tb, tc, _ = shorthand(q)
    reach = A2 * np.cos(q[2]) + A3 + S3
    return I2 + I3 + M3 * ta * reach + M3 * A2 * sideways * tb + M2 * (A2 + S2) * tc


def m_21(q, factor):
    return I3 + M3 * (A3 + S3) ** 2 + M3 * factor * A2 * np.cos(q[2])


MASSES = on_states(mass_matrix, Q)


def test_E14_mass_matrix_00():
    holds(on_states(lambda q: m_00(q, (A1 + S1) ** 2), Q) - MASSES[:, 0, 0], 1e-13)
    fails(on_states(lambda q: m_00(q, (A1 + S1) * (A1 * S1)), Q) - MASSES[:, 0, 0], 0.4)


def test_E15_mass_matrix_10():
    holds(on_states(lambda q: m_10(q, np.sin(q[2])), Q) - MASSES[:, 1, 0], 1e-13)
    fails(on_states(lambda q: m_10(q, np.cos(q[2])), Q) - MASSES[:, 1, 0], 0.01)


def test_E16_mass_matrix_21():
    holds(on_states(lambda q: m_21(q, A3 + S3), Q) - MASSES[:, 2, 1], 1e-13)
    fails(on_states(lambda q: m_21(q, 1.0), Q) - MASSES[:, 2, 1], 0.05)
    # In kg m, added to kg m^2: negative where joint 3 is folded, and then M is not positive definite.
    assert m_21(np.array([0.0, 1.0, np.pi]), 1.0) < -0.05


def omega_0(q, qd, first, second, third_rate=None):
    """Bias torque of joint 1 by the squares of the links' rates; `first`, `second` are the terms of link 2."""
    w1, w2, w3 = np.cumsum(qd)
    w3 = w3 if third_rate is None else third_rate
    ta, tb, _, _ = shorthand(q)
    c3, s3, c23, s23 = np.cos(q[2]), np.sin(q[2]), np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
    of_1 = M3 * A1 * (s23 * ta - c23 * tb) + M2 * first(q)
    of_2 = M3 * A2 * (s3 * ta - c3 * tb) - M2 * second(q)
    return of_1 * w1**2 + of_2 * w2**2 - M3 * tb * (A3 + S3) * w3**2


def first_right(q):
    s2, c2 = np.sin(q[1]), np.cos(q[1])
    return A1 * s2 * (A2 + S2 + A1 * c2) - A1**2 * s2 * c2


def first_printed(q):
    s2, c2 = np.sin(q[1]), np.cos(q[1])
    return A1 * s2 * (A2 + S2 + A1 * c2) - A1**2 * s2**2 * c2


def second_right(q):
    return A1 * np.sin(q[1]) * (A2 + S2)


def second_printed(q):
    return A1**2 * np.sin(q[1]) ** 2 * (A2 + S2)


BIAS = on_states(bias_torque, Q, QD)


def test_E17_bias_torque_0():
    holds(on_states(lambda *s: omega_0(*s, first_right, second_right), Q, QD) - BIAS[:, 0], 1e-12)
    fails(on_states(lambda *s: omega_0(*s, first_printed, second_right), Q, QD) - BIAS[:, 0], 0.2)
    fails(on_states(lambda *s: omega_0(*s, first_right, second_printed), Q, QD) - BIAS[:, 0], 0.2)


def test_E18_the_third_rate_has_two_names():
    """Read letter by letter, the squared rate of link 3 goes into one variable, and another, still zero, is used."""
    holds(on_states(lambda *s: omega_0(*s, first_right, second_right), Q, QD) - BIAS[:, 0], 1e-12)
    read = on_states(lambda *s: omega_0(*s, first_right, second_right, third_rate=0.0), Q, QD)
    fails(read - BIAS[:, 0], 0.05)


def test_E19_the_other_elements():
    def others(q):
        ta, tb, tc, _ = shorthand(q)
        reach, side, r3 = A2 * np.cos(q[2]) + A3 + S3, A2 * np.sin(q[2]), A3 + S3
        return np.array(
            [
                I2 + I3 + M3 * (ta * reach + side * tb) + M2 * (A2 + S2) * tc,
                I3 + M3 * r3 * ta,
                I2 + I3 + M3 * (reach**2 + side**2) + M2 * (A2 + S2) ** 2,
                I3 + M3 * r3 * reach,
                I3 + M3 * r3 * ta,
                I3 + M3 * r3**2,
            ]
        )

    def omegas(q, qd):
        w1, w2, w3 = np.cumsum(qd)
        c3, s3, c23, s23 = np.cos(q[2]), np.sin(q[2]), np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
        reach, r3 = A2 * c3 + A3 + S3, A3 + S3
        of_1 = M3 * A1 * (reach * s23 - A2 * s3 * c23) + M2 * A1 * np.sin(q[1]) * (A2 + S2)
        second = of_1 * w1**2 + M3 * A2 * (s3 * reach - A2 * s3 * c3) * w2**2 - M3 * A2 * s3 * r3 * w3**2
        return np.array([second, M3 * r3 * (A1 * s23 * w1**2 + A2 * s3 * w2**2)])

    at = [(0, 1), (0, 2), (1, 1), (1, 2), (2, 0), (2, 2)]
    expected = np.stack([MASSES[:, i, j] for i, j in at], axis=-1)
    holds(on_states(others, Q) - expected, 1e-13)
    holds(on_states(omegas, Q, QD) - BIAS[:, 1:], 1e-12)
