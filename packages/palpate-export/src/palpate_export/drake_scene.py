"""A scene of Drake with the contact in it: a collision of an SDF or URDF file gets the numbers, the rest stays.

Point contact of two geometries in Drake (documentation of MultibodyPlant, Compliant Point Contact): stiffness
k = k1 k2 / (k1 + k2), and with the SAP approximation of a discrete plant f = k (x + tau v), tau = tau1 + tau2. So the
surface has k = K and tau = B / K, what presses on it a k without an end and no tau.

Newton's contact: two shapes share the mean of their ke and kd, so both get K and B.

The law of SolverSemiImplicit and SolverFeatherstone (newton 1.8): f = ke d + kd max(d', 0), d the penetration: the
damper works going in only. SolverMuJoCo takes ke and kd for a constraint of its own, and wants the rule of MuJoCo.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from palpate.errors import InputError, unknown
from palpate.files import read_bytes
from palpate_export.contact import Contact

RIGID = 1e12
"""Point stiffness of what presses [N/m]: K / RIGID is lost of K."""
_OWN = ("point_contact_stiffness", "relaxation_time", "hunt_crossley_dissipation")
_HYDROELASTIC = (
    "rigid_hydroelastic",
    "compliant_hydroelastic",
    "hydroelastic_modulus",
    "mesh_resolution_hint",
)
_PLANT = (
    "for a discrete MultibodyPlant with contact_model point and discrete_contact_approximation sap; with others B is"
    " not exported"
)
_LARGEST = 1 << 26
_PROPERTIES = "drake:proximity_properties"


@dataclass
class Collision:
    """One collision element of a file.

    Args:
        path: names of the elements around it and its own.
        end: byte at which its closing tag begins.
        properties: likewise of its proximity properties; None if it has none.
        taken: begin and end of each of its properties that are replaced.
    """

    path: tuple[str, ...]
    end: int = 0
    properties: int | None = None
    taken: list[tuple[int, int]] = field(default_factory=list)


@dataclass(frozen=True)
class DrakeScene:
    """An SDF or URDF file.

    Args:
        path: of it.
        text: its bytes.
        urdf: else SDF.
        collisions: all that have a name.
    """

    path: Path
    text: bytes = field(repr=False)
    urdf: bool
    collisions: tuple[Collision, ...]

    def collision(self, name: str) -> Collision:
        """The one of a name, which may be preceded by those around it and ::.

        Raises:
            InputError: there is none, or there are several.
        """
        words = tuple(name.split("::"))
        found = [own for own in self.collisions if own.path[-len(words) :] == words]
        known = ["::".join(own.path) for own in self.collisions]
        if not found:
            links = {own.path[-2] for own in self.collisions if len(own.path) > 1}
            if name in links:
                inside = ", ".join(own.path[-1] for own in self.collisions if own.path[-2:-1] == (name,))
                raise InputError(f"{self.path}: {name!r} is a link; name one of its collisions: {inside}")
            if not known:
                raise InputError(f"{self.path}: it has no collision with a name")
            raise InputError(f"{self.path}: {unknown('collision', name, known)}")
        if len(found) > 1:
            several = ", ".join("::".join(own.path) for own in found)
            raise InputError(
                f"{self.path}: {len(found)} collisions are called {name!r}; say which: {several}"
            )
        return found[0]


def load_scene(path: Path) -> DrakeScene:
    """Read a file.

    Raises:
        InputError: no SDF or URDF.
        OSError: no such file.
    """
    text = read_bytes(path, _LARGEST, "an SDF or URDF file")
    try:
        text.decode()
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8, byte {error.start}; save it as UTF-8") from None
    reader = _Reader(text)
    try:
        reader.parser.Parse(text, True)
    except expat.ExpatError as error:
        raise InputError(f"{path}: no XML: {error}; give an SDF or URDF file") from None
    if reader.root not in {"sdf", "robot"}:
        raise InputError(f"{path}: begins with <{reader.root}>; Drake's contact goes into SDF or URDF")
    return DrakeScene(path, text, reader.root == "robot", tuple(reader.found))


class _Reader:
    """Finds collisions and where they are, without a change to anything else."""

    def __init__(self, text: bytes) -> None:
        self.text = text
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._begin
        self.parser.EndElementHandler = self._end
        self.parser.EntityDeclHandler = _no_entities
        self.root = ""
        self.found: list[Collision] = []
        self._names: list[str] = []
        self._tags: list[str] = []
        self._inside: Collision | None = None
        self._child = 0

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        self.root = self.root or tag
        self._tags.append(tag)
        self._names.append(attributes.get("name", ""))
        if tag == "collision" and attributes.get("name"):
            around = [n for t, n in zip(self._tags, self._names, strict=True) if t in {"model", "link"} and n]
            self._inside = Collision((*around, attributes["name"]))
        elif self._inside is not None and self._tags[-2] == _PROPERTIES:
            self._child = self.parser.CurrentByteIndex

    def _end(self, tag: str) -> None:
        at, past = self._closing(tag)
        self._tags.pop()
        self._names.pop()
        own = self._inside
        if own is None:
            return
        if tag == "collision":
            own.end = at
            self.found.append(own)
            self._inside = None
        elif tag == _PROPERTIES:
            own.properties = at
        elif self._tags[-1] == _PROPERTIES and tag.removeprefix("drake:") in (*_OWN, *_HYDROELASTIC):
            own.taken.append((self._child, past))

    def _closing(self, tag: str) -> tuple[int, int]:
        """Where an element's closing tag begins, or the stroke of one that closes itself; and what is past it."""
        at = self.parser.CurrentByteIndex
        if self.text.startswith(f"</{tag}".encode(), at):
            return at, self.text.index(b">", at) + 1
        if self.text.endswith(b"/>", 0, at):  # expat is past such an element already
            return at - 2, at
        return self.text.index(b"/>", at), self.text.index(b"/>", at) + 2


def _no_entities(*_: Any) -> None:
    raise expat.ExpatError("it declares entities, which are not read")


def probe_of(scene: DrakeScene, surface: Collision, name: str | None) -> Collision | None:
    """The probe: of that name, or the only other collision; None if there is no other.

    Raises:
        InputError: there are several, or none of that name.
    """
    if name is not None:
        found = scene.collision(name)
        if found is surface:
            raise InputError(f"{scene.path}: {name!r} is the surface itself; name the probe with --probe")
        return found
    others = [own for own in scene.collisions if own is not surface and own.path[:-1] != surface.path[:-1]]
    if len(others) > 1:
        named = ", ".join("::".join(own.path) for own in others)
        raise InputError(f"{scene.path}: name the probe with --probe: {named}")
    return others[0] if others else None


def notes(probe: bool) -> tuple[str, ...]:
    """Notes of the file.

    Args:
        probe: whether the probe is in it too.
    """
    known = f"a point stiffness of {RIGID:g} N/m and a relaxation time of 0"
    other = (
        f"the probe has {known}; any other body that touches the surface needs them too"
        if probe
        else f"the probe needs {known}: Drake's defaults would add to the surface's"
    )
    return (_PLANT, other)


def edit(scene: DrakeScene, surface: Collision, probe: Collision | None, contact: Contact) -> bytes:
    """The file with the contact in it."""
    numbers = {surface.path: (contact.stiffness.value, contact.relaxation_time)}
    if probe is not None:
        numbers[probe.path] = (RIGID, 0.0)
    text = scene.text
    changed = [own for own in (surface, probe) if own is not None]
    for own in sorted(changed, key=lambda one: -one.end):
        text = _with(text, own, properties(*numbers[own.path], urdf=scene.urdf))
    return text


def properties(stiffness: float, relaxation: float, *, urdf: bool) -> str:
    """The lines of point contact."""
    values = dict(zip(_OWN, (f"{stiffness:.17g}", f"{relaxation:.17g}", "0"), strict=True))
    if urdf:
        return "".join(f"<drake:{name} value={quoteattr(value)}/>" for name, value in values.items())
    return "".join(f"<drake:{name}>{value}</drake:{name}>" for name, value in values.items())


def _with(text: bytes, own: Collision, lines: str) -> bytes:
    """The text with these lines among a collision's proximity properties, in place of those of the same names."""
    if own.properties is None:
        new = f"<{_PROPERTIES}>{lines}</{_PROPERTIES}>".encode()
        return _insert(text, own.end, new, "collision")
    at = own.properties
    text = _insert(text, at, lines.encode(), _PROPERTIES)
    for begin, end in reversed(own.taken):
        text = text[:begin] + text[end:]
    return text


def _insert(text: bytes, at: int, new: bytes, tag: str) -> bytes:
    """Before the closing tag at a byte; an element that closes itself is opened for it."""
    if text.startswith(b"</", at):
        return text[:at] + new + text[at:]
    return text[:at] + b">" + new + f"</{tag}>".encode() + text[at + 2 :]


def plate(contact: Contact, name: str) -> str:
    """A block in the world whose upper side is z = 0, as an SDF model, for who has no file."""
    own = quoteattr(name)
    lines = properties(contact.stiffness.value, contact.relaxation_time, urdf=False)
    return f"""<sdf version="1.7" xmlns:drake="http://drake.mit.edu">
  <model name={own}>
    <static>true</static>
    <link name={own}>
      <collision name={own}>
        <pose>0 0 -0.05 0 0 0</pose>
        <geometry><box><size>0.4 0.4 0.1</size></box></geometry>
        <{_PROPERTIES}>{lines}</{_PROPERTIES}>
      </collision>
    </link>
  </model>
</sdf>
"""


_SOLVERS = (
    "for SolverSemiImplicit and SolverFeatherstone; SolverMuJoCo takes the same numbers for another contact: export a"
    " scene of MuJoCo for it"
)
NOTES = (
    _SOLVERS,
    "the damper acts in loading only: in unloading, Newton's force is K x",
    "both shapes must have these numbers: Newton takes the mean of the two",
)

_TEXT = '''"""Contact of a surface for Newton: call apply(builder, surface, probe) before builder.finalize()."""

KE = {stiffness:.17g}  # N/m
KD = {damping:.17g}  # N s/m, in loading only


def apply(builder, *shapes):
    """Give shapes of a newton.ModelBuilder this contact; Newton takes the mean of the two that touch."""
    for shape in shapes:
        builder.shape_material_ke[shape] = KE
        builder.shape_material_kd[shape] = KD
'''


def python(contact: Contact) -> str:
    """A module that gives shapes the contact."""
    return _TEXT.format(stiffness=contact.stiffness.value, damping=contact.damping.value)
