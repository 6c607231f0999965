"""Small logs on which an identification has little to stand on, each with time [s], position [mm] and force [N]."""

import numpy as np

RATE = 500.0
STIFFNESS = 2000.0


def _log(depth, force, seed=0):
    """Columns time, position [mm] and noisy force of a depth [m] and a force [N] at `RATE`, shape (n, 3)."""
    noise = np.random.default_rng(seed).normal(0.0, 0.02, len(depth))
    return np.column_stack([np.arange(len(depth)) / RATE, 1e3 * np.asarray(depth), force + noise])


def _ramp(start, end, seconds):
    return np.linspace(start, end, int(RATE * seconds))


def only_unloading():
    """The log begins deep in the surface and leaves it."""
    depth = _ramp(5e-3, -3e-3, 4.0)
    return _log(depth, STIFFNESS * np.maximum(depth, 0.0))


def only_unloading_in_contact():
    """The log begins deep in the surface and ends before it is left."""
    depth = _ramp(5e-3, 1e-3, 4.0)
    return _log(depth, STIFFNESS * depth)


def one_touch():
    """Free motion, and a touch of 20 ms."""
    depth = np.full(2000, -2e-3)
    depth[1000:1010] = 1e-3 * np.sin(np.pi * np.arange(10) / 10)
    return _log(depth, STIFFNESS * np.maximum(depth, 0.0))


def single_sample():
    """One row."""
    return _log(np.array([1e-3]), np.array([2.0]))


def constant_force():
    """The probe moves and the force stays at 5 N."""
    time = np.arange(2000) / RATE
    log = _log(3e-3 * np.sin(2 * np.pi * time), np.full(2000, 5.0))
    log[:, 2] = 5.0
    return log


def no_number():
    """No force is ever read."""
    log = _log(_ramp(0.0, 5e-3, 4.0), np.zeros(2000))
    log[:, 2] = np.nan
    return log


def free_motion():
    """Nothing is touched."""
    time = np.arange(4000) / RATE
    return _log(5e-3 * np.sin(2 * np.pi * 0.5 * time), np.zeros(4000))


def fluid():
    """A bath of oil: damping, and no stiffness."""
    time = np.arange(4000) / RATE
    depth = 5e-3 * (1.0 - np.cos(2 * np.pi * 0.5 * time))
    return _log(depth, 60.0 * np.gradient(depth, 1 / RATE))


def fracture():
    """A specimen that is loaded until it breaks; after that no force is left."""
    depth = _ramp(-1e-3, 9e-3, 5.0)
    return _log(depth, np.where(depth < 5e-3, STIFFNESS * np.maximum(depth, 0.0), 0.0))


def tiny_force():
    """A force of 1e-303 N, whose squares are 0."""
    log = _log(_ramp(-1e-3, 5e-3, 4.0), np.zeros(2000))
    log[:, 2] = 1e-303 * np.maximum(log[:, 1], 0.0)
    return log


HOSTILE = (
    only_unloading, only_unloading_in_contact, one_touch, single_sample, constant_force, no_number, free_motion,
    fluid, fracture, tiny_force,
)  # fmt: skip


def write_log(folder, log, name="log.csv", head="time_s,position_mm,force_N"):
    """Write columns as CSV, and return its path."""
    path = folder / name
    np.savetxt(path, log, delimiter=",", header=head, comments="", fmt="%.9g")
    return path
