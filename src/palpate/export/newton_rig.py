"""A sphere over a block in Newton, as a rig: both shapes with the exported contact, stepped by SolverSemiImplicit."""

from __future__ import annotations

import runpy
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError

_RADIUS = 0.02
_MASS = 1.0
"""Radius [m] and mass [kg] of the sphere that presses."""


class NewtonRig:
    """See `palpate.export.rig.Rig`: one velocity, the sphere's, upward.

    Args:
        path: the exported module.

    Raises:
        InputError: Newton is not installed.
    """

    time_step = 1e-3

    def __init__(self, path: Path) -> None:
        if find_spec("newton") is None:
            raise InputError(
                "pressing in Newton needs Newton: pip install 'palpate[newton]', or leave out --check"
            )
        warp = import_module("warp")
        warp.config.log_level = warp.LOG_ERROR  # what it tells of itself goes to standard output
        newton = import_module("newton")

        self._library, self._warp = newton, warp
        builder = newton.ModelBuilder(up_axis=newton.Axis.Z, gravity=(0.0, 0.0, 0.0))
        plain = newton.ModelBuilder.ShapeConfig(density=0.0, mu=0.0, kf=0.0)
        at = warp.transform((0.0, 0.0, -0.05), warp.quat_identity())
        block = builder.add_shape_box(-1, xform=at, hx=0.2, hy=0.2, hz=0.05, cfg=plain)
        above = warp.transform((0.0, 0.0, 2 * _RADIUS), warp.quat_identity())
        body = builder.add_body(xform=above, mass=_MASS, inertia=warp.mat33(np.eye(3) * 1e-3))
        sphere = builder.add_shape_sphere(body, radius=_RADIUS, cfg=plain)
        runpy.run_path(str(path))["apply"](builder, block, sphere)
        self.model: Any = builder.finalize(device="cpu")
        self.solver = newton.solvers.SolverSemiImplicit(self.model)
        self._now, self._next = self.model.state(), self.model.state()
        self._control = self.model.control()
        self._pipeline = newton.CollisionPipeline(self.model)
        self._contacts = self._pipeline.contacts()

    def gap(self) -> tuple[float, Array]:
        """See `Rig.gap`."""
        return self._height() - _RADIUS, np.array([[1.0], [0.0], [0.0]])

    def _height(self) -> float:
        return float(self._now.body_q.numpy()[0, 2])

    def mass(self) -> Array:
        """See `Rig.mass`."""
        return np.array([[_MASS]])

    def velocity(self) -> Array:
        """See `Rig.velocity`."""
        return np.array([float(self._now.body_qd.numpy()[0, 2])])

    def move(self, change: Array) -> None:
        """See `Rig.move`."""
        poses = self._now.body_q.numpy()
        poses[0, 2] += change[0]
        self._now.body_q.assign(poses)

    def step(self, force: Array) -> tuple[float, float, float]:
        """See `Rig.step`; the force is that which changed the sphere's momentum."""
        depth, speed = _RADIUS - self._height(), float(self.velocity()[0])
        self._now.clear_forces()
        self._now.body_f.assign(np.array([[0.0, 0.0, force[0], 0.0, 0.0, 0.0]], dtype=np.float32))
        self._pipeline.collide(self._now, self._contacts)
        self.solver.step(self._now, self._next, self._control, self._contacts, self.time_step)
        self._now, self._next = self._next, self._now
        pushed = _MASS * (float(self.velocity()[0]) - speed) / self.time_step - float(force[0])
        return depth, -speed, pushed
