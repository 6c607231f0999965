"""Drake: the contact in a collision of an SDF or URDF file, and a press in a discrete plant with the SAP solver.

Point contact of two geometries in Drake (documentation of MultibodyPlant, Compliant Point Contact): stiffness
k = k1 k2 / (k1 + k2), and with the SAP approximation of a discrete plant f = k (x + tau v), tau = tau1 + tau2. So the
surface has k = K and tau = B / K, and the probe a very large k and no tau.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any, NamedTuple
from xml.dom import expatbuilder
from xml.dom.minidom import Document, Element
from xml.parsers.expat import ExpatError
from xml.sax.saxutils import quoteattr

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError, how_to_install, unknown
from palpate.export.contact import Contact
from palpate.export.pressing import MIN_DIRECTED_GAP, normal_axes
from palpate.files import read_bytes

RIGID = 1e12
"""Point stiffness of the probe [N/m]: K / RIGID is lost of K."""
MAX_BYTES = 1 << 26
TIME_STEP = 1e-3
"""Time step of the plant in a check [s]."""
PROBE, PROBE_MASS = "palpate-probe", 1.0
"""The sphere that presses where the file has no probe [kg]; `benchmarks/export/table.py` tries other masses."""
_PROPERTIES = "drake:proximity_properties"
_POINT_CONTACT = ("point_contact_stiffness", "relaxation_time", "hunt_crossley_dissipation")
_HYDROELASTIC = (
    "rigid_hydroelastic",
    "compliant_hydroelastic",
    "hydroelastic_modulus",
    "mesh_resolution_hint",
)
PLANT_NOTE = (
    "this needs a discrete MultibodyPlant with contact_model point and discrete_contact_approximation sap; the other"
    " approximations take no B"
)


class Collision(NamedTuple):
    """A collision of a file: names of the models and the link around it and its own, and its element."""

    path: tuple[str, ...]
    element: Element

    @property
    def name(self) -> str:
        """The names, joined by ::."""
        return "::".join(self.path)


class DrakeScene:
    """An SDF or URDF file.

    Args:
        path: of the file.

    Raises:
        InputError: no SDF or URDF.
        OSError: no such file.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.document = path, _read(path)
        root = self.document.documentElement
        if root is None or root.tagName not in {"sdf", "robot"}:
            tag = root.tagName if root else ""
            raise InputError(f"{path}: begins with <{tag}>; Drake's contact goes into SDF or URDF")
        self.is_urdf = root.tagName == "robot"
        self.collisions = list(_collisions(root, ()))

    def collision(self, name: str) -> Collision:
        """The collision of a name, which may be preceded by those around it and ::.

        Raises:
            InputError: there is none, or there are several.
        """
        words = tuple(name.split("::"))
        matches = [c for c in self.collisions if c.path[-len(words) :] == words]
        if len(matches) == 1:
            return matches[0]
        if matches:
            names = ", ".join(c.name for c in matches)
            raise InputError(
                f"{self.path}: {len(matches)} collisions are called {name!r}; say which: {names}"
            )
        inside = [c.path[-1] for c in self.collisions if c.path[-2:-1] == (name,)]
        if inside:
            raise InputError(
                f"{self.path}: {name!r} is a link; name one of its collisions: {', '.join(inside)}"
            )
        if not self.collisions:
            raise InputError(f"{self.path}: it has no collision with a name")
        raise InputError(f"{self.path}: {unknown('collision', name, [c.name for c in self.collisions])}")

    def probe(self, surface: Collision, name: str | None) -> Collision | None:
        """The probe: of that name, or the only other collision; None if there is no other.

        Raises:
            InputError: there are several, or none of that name.
        """
        if name is not None:
            probe = self.collision(name)
            if probe is surface:
                raise InputError(f"{self.path}: {name!r} is the surface itself; name the probe with --probe")
            return probe
        candidates = [c for c in self.collisions if c.path[:-1] != surface.path[:-1]]
        if len(candidates) > 1:
            names = ", ".join(c.name for c in candidates)
            raise InputError(f"{self.path}: name the probe with --probe: {names}")
        return candidates[0] if candidates else None

    def with_contact(self, surface: Collision, probe: Collision | None, contact: Contact) -> str:
        """The file with the contact in it."""
        self._set(surface.element, contact.stiffness.value, contact.relaxation_time)
        if probe is not None:
            self._set(probe.element, RIGID, 0.0)
        return str(self.document.toxml())

    def _set(self, collision: Element, stiffness: float, relaxation: float) -> None:
        """Replace a collision's properties of point contact, and remove the hydroelastic ones."""
        properties = next(_children(collision, _PROPERTIES), None)
        if properties is None:
            properties = collision.appendChild(self.document.createElement(_PROPERTIES))
        for child in list(_children(properties)):
            if child.tagName.removeprefix("drake:") in (*_POINT_CONTACT, *_HYDROELASTIC):
                properties.removeChild(child)
        for name, value in _point_contact(stiffness, relaxation).items():
            child = properties.appendChild(self.document.createElement(f"drake:{name}"))
            if self.is_urdf:
                child.setAttribute("value", value)
            else:
                child.appendChild(self.document.createTextNode(value))


def _read(path: Path) -> Document:
    text = read_bytes(path, MAX_BYTES, "an SDF or URDF file")
    try:
        text.decode()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8, byte {error.start}; save it as UTF-8") from None
    if b"<!ENTITY" in text:
        raise InputError(f"{path}: it declares entities, which are not read; write their text instead")
    try:
        # Without namespaces: files use the prefix drake: without declaring it.
        document: Document = expatbuilder.parseString(text, namespaces=False)  # noqa: S316 - entities are refused
    except ExpatError as error:
        raise InputError(f"{path}: no XML: {error}; give an SDF or URDF file") from None
    return document


def _children(element: Element, tag: str = "") -> Iterator[Element]:
    for child in element.childNodes:
        if isinstance(child, Element) and tag in {"", child.tagName}:
            yield child


def _collisions(element: Element, names: tuple[str, ...]) -> Iterator[Collision]:
    """All collisions with a name within an element of a file."""
    for child in _children(element):
        name = child.getAttribute("name")
        if child.tagName == "collision":
            if name:
                yield Collision((*names, name), child)
        else:
            is_named = child.tagName in {"model", "link"} and name
            yield from _collisions(child, (*names, name) if is_named else names)


def _point_contact(stiffness: float, relaxation: float) -> dict[str, str]:
    return dict(zip(_POINT_CONTACT, (f"{stiffness:.17g}", f"{relaxation:.17g}", "0"), strict=True))


def _properties_sdf(stiffness: float, relaxation: float) -> str:
    lines = (f"<drake:{n}>{v}</drake:{n}>" for n, v in _point_contact(stiffness, relaxation).items())
    return f"<{_PROPERTIES}>{''.join(lines)}</{_PROPERTIES}>"


def probe_note(has_probe: bool) -> str:
    """A note on the numbers of the probe.

    Args:
        has_probe: True if the probe is in the file too.
    """
    known = f"a point stiffness of {RIGID:g} N/m and a relaxation time of 0"
    if has_probe:
        return f"the probe has {known}; any other body that touches the surface needs them too"
    return f"the probe needs {known}: Drake's defaults would add to the surface's"


def plate(contact: Contact, name: str) -> str:
    """A block in the world with its upper side at z = 0, as an SDF model, where there is no file."""
    title = quoteattr(name)
    return f"""<sdf version="1.7" xmlns:drake="http://drake.mit.edu">
  <model name={title}>
    <static>true</static>
    <link name={title}>
      <collision name={title}>
        <pose>0 0 -0.05 0 0 0</pose>
        <geometry><box><size>0.4 0.4 0.1</size></box></geometry>
        {_properties_sdf(contact.stiffness.value, contact.relaxation_time)}
      </collision>
    </link>
  </model>
</sdf>
"""


def _probe_sdf() -> str:
    """A sphere on a vertical rail above the origin."""
    return f"""<sdf version="1.7" xmlns:drake="http://drake.mit.edu"><model name="{PROBE}">
<link name="{PROBE}"><inertial><mass>{PROBE_MASS:g}</mass></inertial>
<collision name="{PROBE}"><geometry><sphere><radius>0.02</radius></sphere></geometry>
{_properties_sdf(RIGID, 0.0)}</collision></link>
<joint name="rail" type="prismatic"><parent>world</parent><child>{PROBE}</child><axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""


def drake() -> Any:
    """The package.

    Raises:
        InputError: it is not installed.
    """
    try:
        import pydrake.all as package
    except ImportError:
        raise InputError(f"pressing in Drake needs Drake: {how_to_install('palpate[drake]')}") from None
    return package


class DrakeRig:
    """Two collision geometries of a file, see `palpate.export.pressing.Rig`.

    Args:
        path: SDF or URDF file.
        surface: path of the surface's collision.
        probe: path of the probe's; None for a sphere above the origin.
    """

    time_step = TIME_STEP

    def __init__(self, path: Path, surface: tuple[str, ...], probe: tuple[str, ...] | None) -> None:
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
                parser.AddModelsFromString(_probe_sdf(), "sdf")
        except RuntimeError as error:
            raise InputError(f"{path}: Drake refuses it: {' '.join(str(error).split())}") from None
        self.plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
        self.plant.Finalize()
        diagram = builder.Build()
        self.root = diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)
        self._apply(np.zeros(self.plant.num_velocities()))
        self.simulator = library.Simulator(diagram, self.root)
        self._surface, self._probe = self._geometry(surface), self._geometry(probe or (PROBE, PROBE))
        self._normal = np.zeros(3)

    def _geometry(self, path: tuple[str, ...]) -> Any:
        """The geometry of a collision: of that name, on the link's body."""
        inspector = self.scene.model_inspector()
        for geometry in inspector.GetAllGeometryIds():
            body = self.plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
            names = (body.name(), inspector.GetName(geometry).split("::")[-1])
            if names == path[-2:] and inspector.GetProximityProperties(geometry) is not None:
                return geometry
        raise InputError(f"Drake has no collision geometry {'::'.join(path)!r} in the file")

    def _apply(self, force: Array) -> None:
        self.plant.get_applied_generalized_force_input_port().FixValue(self.context, force)

    def gap(self) -> tuple[float, Array]:
        """Distance between probe and surface, see `Rig.gap`."""
        query = self.plant.get_geometry_query_input_port().Eval(self.context)
        pair = query.ComputeSignedDistancePairClosestPoints(self._surface, self._probe)
        distance = float(pair.distance)
        if abs(distance) > MIN_DIRECTED_GAP or not self._normal.any():
            self._normal = np.array(pair.nhat_BA_W) * (-1.0 if pair.id_A == self._surface else 1.0)
        points = {pair.id_A: pair.p_ACa, pair.id_B: pair.p_BCb}
        rates = {geometry: self._point_rates(geometry, np.array(p)) for geometry, p in points.items()}
        return distance, normal_axes(self._normal) @ (rates[self._probe] - rates[self._surface])

    def _point_rates(self, geometry: Any, point: Array) -> Array:
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
        """Mass matrix of all joints, see `Rig.mass`."""
        return np.array(self.plant.CalcMassMatrix(self.context))

    def velocity(self) -> Array:
        """Velocities of all joints, see `Rig.velocity`."""
        return np.array(self.plant.GetVelocities(self.context))

    def move(self, change: Array) -> None:
        """Move the joints, see `Rig.move`."""
        rate = self.plant.MapVelocityToQDot(self.context, change)
        positions = self.plant.GetPositions(self.context) + rate
        low, high = self.plant.GetPositionLowerLimits(), self.plant.GetPositionUpperLimits()
        self.plant.SetPositions(self.context, np.clip(positions, low, high))

    def step(self, force: Array) -> tuple[float, float, float]:
        """See `Rig.step`; penetration and rate are those at the step's end, to which SAP's implicit force belongs."""
        self._apply(force)
        self.simulator.AdvanceTo(self.root.get_time() + self.time_step)
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        for i in range(results.num_point_pair_contacts()):
            contact = results.point_pair_contact_info(i)
            pair = contact.point_pair()
            if {pair.id_A, pair.id_B} == {self._surface, self._probe}:
                contact_force = abs(float(np.dot(contact.contact_force(), pair.nhat_BA_W)))
                gap, rates = self.gap()
                return -gap, -float(rates[0] @ self.velocity()), contact_force
        return 0.0, 0.0, 0.0


def _add(parser: Any, path: Path) -> None:
    """Add the models of a file; one with another ending is read under one that Drake knows, in the same folder."""
    if path.suffix in {".sdf", ".urdf"}:
        parser.AddModels(str(path))
        return
    text = path.read_bytes()
    ending = ".urdf" if b"<robot" in text else ".sdf"
    with NamedTemporaryFile(dir=path.parent, prefix=".palpate-", suffix=ending) as copy:
        copy.write(text)
        copy.flush()
        parser.AddModels(copy.name)
