"""Rigs of other simulators: two collision geometries of Drake, and a sphere over a block in Newton.

In Newton both shapes have the exported contact, and SolverSemiImplicit steps them.
"""

import runpy
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate_export.drake_scene import properties
from palpate_export.rig import across

TIME_STEP = 1e-3
"""Of the plant in a check [s]."""
_DIRECTED = 1e-6
"""Gap from which on its direction is taken [m]."""
PROBE = "palpate-probe"
_PROBE_MASS = 1.0
"""Of the sphere that presses [kg]; `benchmarks/export/table.py` finds the same K and B with 0.5, 2 and 8 kg."""


def drake() -> Any:
    """The package.

    Raises:
        InputError: it is not installed.
    """
    try:
        import pydrake.all as found
    except ImportError:
        raise InputError(
            "pressing in Drake needs Drake; install it with: pip install 'palpate[drake]'"
        ) from None
    return found


def probe_sdf(rigid: float) -> str:
    """A sphere of 1 kg on a vertical rail above the origin."""
    return f"""<sdf version="1.7" xmlns:drake="http://drake.mit.edu"><model name="{PROBE}">
<link name="{PROBE}"><inertial><mass>{_PROBE_MASS:g}</mass></inertial>
<collision name="{PROBE}"><geometry><sphere><radius>0.02</radius></sphere></geometry>
<drake:proximity_properties>{properties(rigid, 0.0, urdf=False)}</drake:proximity_properties></collision></link>
<joint name="rail" type="prismatic"><parent>world</parent><child>{PROBE}</child><axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""


def _add(parser: Any, path: Path) -> None:
    """Add the models of a file; one with another ending is read under one that Drake knows, in the same folder."""
    if path.suffix in {".sdf", ".urdf"}:
        parser.AddModels(str(path))
        return
    ending = ".urdf" if b"<robot" in path.read_bytes() else ".sdf"
    with NamedTemporaryFile(dir=path.parent, prefix=".palpate-", suffix=ending) as copy:
        copy.write(path.read_bytes())
        copy.flush()
        parser.AddModels(copy.name)


class DrakeRig:
    """See `palpate_export.rig.Rig`.

    Args:
        path: SDF or URDF file.
        surface, probe: paths of the collisions; the probe's is None for a sphere of its own above the origin.
        rigid: point stiffness of that sphere [N/m].
    """

    time_step = TIME_STEP

    def __init__(
        self,
        path: Path,
        surface: tuple[str, ...],
        probe: tuple[str, ...] | None,
        rigid: float,
    ) -> None:
        library = drake()
        builder = library.DiagramBuilder()
        config = library.MultibodyPlantConfig(
            time_step=self.time_step, contact_model="point", discrete_contact_approximation="sap"
        )
        self.plant, self.scene = library.AddMultibodyPlant(config, builder)
        try:
            parser = library.Parser(self.plant)
            _add(parser, path)
            if probe is None:
                parser.AddModelsFromString(probe_sdf(rigid), "sdf")
        except RuntimeError as error:
            raise InputError(f"{path}: Drake refuses it: {' '.join(str(error).split())}") from None
        self.plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
        self.plant.Finalize()
        diagram = builder.Build()
        self.root = diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)
        self.n = int(self.plant.num_velocities())
        self._push(np.zeros(self.n))
        self.simulator = library.Simulator(diagram, self.root)
        self._surface, self._probe = self._geometry(surface), self._geometry(probe or (PROBE, PROBE))
        self._normal = np.zeros(3)

    def _geometry(self, path: tuple[str, ...]) -> Any:
        """The geometry of a collision: of that name, on a body of the link's."""
        inspector = self.scene.model_inspector()
        for own in inspector.GetAllGeometryIds():
            body = self.plant.GetBodyFromFrameId(inspector.GetFrameId(own))
            named = (body.name(), inspector.GetName(own).split("::")[-1])
            if named == path[-2:] and inspector.GetProximityProperties(own) is not None:
                return own
        raise InputError(f"Drake has no collision geometry {'::'.join(path)!r} in the file")

    def _push(self, force: Array) -> None:
        self.plant.get_applied_generalized_force_input_port().FixValue(self.context, force)

    def _query(self) -> Any:
        return self.plant.get_geometry_query_input_port().Eval(self.context)

    def gap(self) -> tuple[float, Array]:
        """Gap between the geometries, see `Rig.gap`."""
        pair = self._query().ComputeSignedDistancePairClosestPoints(self._surface, self._probe)
        distance = float(pair.distance)
        outward = np.array(pair.nhat_BA_W) * (-1.0 if pair.id_A == self._surface else 1.0)
        if abs(distance) > _DIRECTED or not self._normal.any():
            self._normal = outward
        ends = (pair.id_A, pair.p_ACa), (pair.id_B, pair.p_BCb)
        at = {own: np.array(point) for own, point in ends}
        moves = {own: self._moves(own, at[own]) for own in at}
        return distance, across(self._normal) @ (moves[self._probe] - moves[self._surface])

    def _moves(self, geometry: Any, point: Array) -> Array:
        """Velocity of a point of a geometry in the world per generalised velocity, shape (3, n)."""
        library, inspector = drake(), self.scene.model_inspector()
        frame = self.plant.GetBodyFromFrameId(inspector.GetFrameId(geometry)).body_frame()
        in_frame = inspector.GetPoseInFrame(geometry) @ point
        world = self.plant.world_frame()
        return np.array(
            self.plant.CalcJacobianTranslationalVelocity(
                self.context, library.JacobianWrtVariable.kV, frame, in_frame, world, world
            )
        )

    def mass(self) -> Array:
        """Mass that is felt, see `Rig.mass`."""
        return np.array(self.plant.CalcMassMatrix(self.context))

    def velocity(self) -> Array:
        """Velocity of the probe, see `Rig.velocity`."""
        return np.array(self.plant.GetVelocities(self.context))

    def move(self, change: Array) -> None:
        """Moves the probe, see `Rig.move`."""
        rate = self.plant.MapVelocityToQDot(self.context, change)
        positions = self.plant.GetPositions(self.context) + rate
        low, high = self.plant.GetPositionLowerLimits(), self.plant.GetPositionUpperLimits()
        self.plant.SetPositions(self.context, np.clip(positions, low, high))

    def step(self, force: Array) -> tuple[float, float, float]:
        """See `Rig.step`; penetration and rate are those at the step's end, to which SAP's implicit force belongs."""
        self._push(force)
        time = self.root.get_time()
        self.simulator.AdvanceTo(time + self.time_step)
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        for i in range(results.num_point_pair_contacts()):
            own = results.point_pair_contact_info(i)
            pair = own.point_pair()
            if {pair.id_A, pair.id_B} == {self._surface, self._probe}:
                pushed = abs(float(np.dot(own.contact_force(), pair.nhat_BA_W)))
                gap, rates = self.gap()
                return -gap, -float(rates[0] @ self.velocity()), pushed
        return 0.0, 0.0, 0.0


_RADIUS = 0.02
_MASS = 1.0
"""Radius [m] and mass [kg] of the sphere that presses."""


class NewtonRig:
    """See `palpate_export.rig.Rig`: one velocity, the sphere's, upward.

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
        """Gap between the geometries, see `Rig.gap`."""
        return self._height() - _RADIUS, np.array([[1.0], [0.0], [0.0]])

    def _height(self) -> float:
        return float(self._now.body_q.numpy()[0, 2])

    def mass(self) -> Array:
        """Mass that is felt, see `Rig.mass`."""
        return np.array([[_MASS]])

    def velocity(self) -> Array:
        """Velocity of the probe, see `Rig.velocity`."""
        return np.array([float(self._now.body_qd.numpy()[0, 2])])

    def move(self, change: Array) -> None:
        """Moves the probe, see `Rig.move`."""
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
