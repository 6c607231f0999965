"""The force loop in one direction, derived from continuous time by hand: what the differentiated bench is judged by.

A tip of mass m moves a surface M, B, K; its force goes through a third-order Butterworth low-pass, is sampled, held
for a period of the sensor's, read each tick, smoothed, and answered by a PI. Between the moments at which anything
changes, the step of plant and low-pass is a matrix exponential.
"""

import numpy as np
from scipy.linalg import expm
from scipy.signal import butter, tf2ss

from palpate.signals.filters import butterworth2

PERIOD, SAMPLING, TICK = 25, 480, 1e-3
CUTOFF = 120.0


def growth(tip, surface, kf, ki, steps):
    """Spectral radius of a tick, on average over the 25 after which all repeats itself.

    Args:
        tip: effective mass [kg].
        surface: mass [kg], damping [N s/m], stiffness [N/m].
        kf: force gain.
        ki: integral gain per tick.
        steps: to a tick, at whose ends the sensor may sample.
    """
    return np.abs(np.linalg.eigvals(_period(tip, surface, kf, ki, steps))).max() ** (1.0 / PERIOD)


def _period(tip, surface, kf, ki, steps):
    """What 25 ticks make of [place, rate, low-pass (3), computing, held, smoothing (2), integral, force command]."""
    step, rate = np.eye(11), round(steps / TICK)
    step[:5, :5], step[:5, 10] = _held(tip, surface, TICK / steps)
    sample = np.eye(11)
    low_pass = _low_pass()[2]
    sample[6], sample[5] = np.eye(11)[5], np.concatenate([[0.0, 0.0], low_pass, np.zeros(6)])
    total = np.eye(11)
    for k in range(PERIOD * steps):
        if k % steps == 0:
            total = _tick(kf, ki) @ total
        total = step @ total
        # The low-pass is at the step's end when it is sampled; what was held until then is read before.
        if (k * SAMPLING) % rate < SAMPLING:
            total = sample @ total
    return total


def _tick(kf, ki):
    """Smoothing by transposed direct form, then the PI: the command is what goes beyond the state of rest."""
    smooth, one = butterworth2(120.0, 1000.0), np.eye(11)
    reading = one[6]
    measured = smooth.b0 * reading + one[7]
    tick = np.eye(11)
    tick[7] = smooth.b1 * reading - smooth.a1 * measured + one[8]
    tick[8] = smooth.b2 * reading - smooth.a2 * measured
    tick[9] = one[9] - ki * measured
    tick[10] = tick[9] - kf * measured
    return tick


def _held(tip, surface, dt):
    """Plant and low-pass over a step under constant force."""
    (mass, damping, stiffness), (A_f, B_f, _) = surface, _low_pass()
    acceleration = np.array([-stiffness, -damping, 0.0, 0.0, 0.0, 1.0]) / (tip + mass)
    force = np.array([stiffness, damping, 0.0, 0.0, 0.0, 0.0]) + mass * acceleration
    A = np.zeros((6, 6))
    A[0, 1], A[1] = 1.0, acceleration
    A[2:5, 2:5] = A_f
    A[2:5] += np.outer(B_f, force)
    step = expm(dt * A)
    return step[:5, :5], step[:5, 5]


def _low_pass():
    A, B, C, _ = tf2ss(*butter(3, 1.0, analog=True))
    w = 2.0 * np.pi * CUTOFF
    return w * A, w * B[:, 0], C[0]
