"""What the controller makes of angles and force: App. E's filters, each against SciPy's, at rest from the start."""

import numpy as np
from scipy import signal

from palpate._vector import Vec3
from palpate.bench.force_input import Conditioning
from palpate.robots.arm3 import Arm3
from palpate.signals.filters import butterworth2

RATE = 1000.0
ARM = Arm3()
CONDITIONING = Conditioning(ARM, butterworth2(35.0, RATE), butterworth2(120.0, RATE), 1e-3)
START = ARM.inverse(Vec3(0.454, 0.0, 0.0), 1.0)


def motion(ticks=400):
    """Joint angles (ticks, 3) from rest at START, and a force."""
    t = np.arange(ticks)[:, None] * 1e-3
    swing = np.array([0.02, -0.03, 0.05]) * (1 - np.cos(2 * np.pi * np.array([2.0, 3.0, 5.0]) * t))
    return np.array(START) + swing, 10.0 * np.sin(2 * np.pi * 4.0 * t[:, 0])


def conditioned(q, force):
    state, out = CONDITIONING.start_at(Vec3(*map(float, q[0]))), []
    for angles, f in zip(q, force, strict=True):
        signals, state = CONDITIONING.step(state, Vec3(*map(float, angles)), float(f))
        out.append(signals)
    return out


def filtered(cutoff, u):
    """SciPy's Butterworth, after the first sample for ever."""
    b, a = signal.butter(2, cutoff, fs=RATE)
    return signal.lfilter(b, a, u, zi=signal.lfilter_zi(b, a) * u[0])[0]


def test_at_rest_all_rates_are_zero_from_the_first_tick():
    for signals in conditioned(np.tile(START, (5, 1)), np.zeros(5)):
        np.testing.assert_allclose(np.array(signals.sense.xd), 0.0, atol=1e-9)
        np.testing.assert_allclose(np.array(signals.sense.qd), 0.0, atol=1e-9)
        np.testing.assert_allclose(np.array(signals.sense.x), [0.454, 0.0, 0.0], atol=1e-12)
        assert abs(signals.velocity) < 1e-9
        assert abs(signals.smooth_acceleration) < 1e-6


def test_every_signal_is_what_appendix_e_makes_of_it():
    q, force = motion()
    found = conditioned(q, force)
    q3 = filtered(35.0, q[:, 2])
    angles = np.column_stack([q[:, :2], q3])
    x = np.array([ARM.pose(Vec3(*map(float, a))) for a in angles])
    xd = np.diff(x, axis=0, prepend=x[:1]) / 1e-3
    xdd = np.diff(xd[:, 0], prepend=xd[0, 0]) / 1e-3
    qd = np.diff(q, axis=0, prepend=q[:1]) / 1e-3
    pick = {
        "joint 3": ([s.sense.q.z for s in found], q3),
        "rate of joint 2": ([s.sense.qd.y for s in found], qd[:, 1]),
        "rate of joint 3": ([s.sense.qd.z for s in found], filtered(35.0, qd[:, 2])),
        "pose": ([s.sense.x.x for s in found], x[:, 0]),
        "velocity": ([s.velocity for s in found], xd[:, 0]),
        "smooth velocity": ([s.sense.xd.x for s in found], filtered(35.0, xd[:, 0])),
        "acceleration": ([s.acceleration for s in found], xdd),
        "smooth acceleration": ([s.smooth_acceleration for s in found], filtered(35.0, xdd)),
        "force": ([s.force for s in found], force),
        "smooth force": ([s.sense.f.x for s in found], filtered(120.0, force)),
    }
    for name, (ours, theirs) in pick.items():
        scale = np.abs(theirs).max()
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-7 * scale + 1e-9, err_msg=name)
