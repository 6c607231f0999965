"""One contact in one simulator: the file, its assumptions, and the result of a press.

Without a scene it is a plate on a slide joint with a spring and a damper, in MJCF: exact of the plate's own
displacement.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from palpate.errors import InputError, unknown
from palpate.robots.serial.loading import mujoco, refusals
from palpate.text import printable
from palpate_export.contact import Contact
from palpate_export.rig import MuJoCoRig, RigPress, press, touch

TARGETS = ("mujoco", "drake", "newton", "mjcf-spring")
TOLERANCE = 1e-3
"""Largest error of K and of B, as shares, of a check that is passed."""
_LOST = "it lost contact, or diverged: is the time step too long?"
_DEPTH = 1e-3
"""Of a press whose force the identification does not tell [m]."""


@dataclass(frozen=True)
class Request:
    """An export as requested.

    Args:
        target: one of `TARGETS`.
        model: the scene's file: MJCF for MuJoCo, SDF or URDF for Drake; None if there is none.
        surface: the geom or collision that is to have the contact; a name for one where there is no scene.
        probe: the body that presses; None for all that can (MuJoCo), or the only other (Drake).
    """

    target: str
    model: Path | None = None
    surface: str | None = None
    probe: str | None = None

    def __post_init__(self) -> None:
        if self.target not in TARGETS:
            raise unknown("target", self.target, TARGETS)
        needs_scene = self.target == "mujoco"
        if needs_scene and (self.model is None or self.surface is None):
            raise InputError(
                "MuJoCo's contact depends on the bodies that touch: name the scene with --model and the surface with"
                " --geom"
            )
        if self.target in {"newton", "mjcf-spring"} and (self.model or self.probe):
            raise InputError(f"--model and --probe are of a scene; --to {self.target} takes none")
        if self.target == "drake" and self.model is not None and self.surface is None:
            raise InputError("name the collision that is the surface with --geom")
        if self.target == "drake" and self.model is None and self.probe is not None:
            raise InputError("--probe is of a scene; name it with --model")

    @property
    def name(self) -> str:
        """Name of the surface's geometry."""
        return self.surface or "surface"

    def default_place(self) -> Path:
        """Default path of the file: beside the scene, so that its meshes are found."""
        plain = re.sub(r"[^\w.-]+", "-", self.name)
        if self.model is not None:
            return self.model.with_name(f"{self.model.stem}-{plain}{self.model.suffix}")
        ending = {"drake": ".sdf", "newton": "_newton.py", "mjcf-spring": "-spring.xml"}[self.target]
        return Path(f"{plain}{ending}")


@dataclass(frozen=True)
class Checked:
    """Result of a press in the engine.

    Args:
        probe: what pressed.
        pressed: K, B and the rest as measured; None if it could not be pressed.
        error_K, error_B: as shares; None likewise.
        note: why not, or what it is of.
        reached: whether the probe could be brought to the surface at all.
    """

    probe: str
    pressed: RigPress | None
    error_K: float | None
    error_B: float | None
    note: str = ""
    reached: bool = True

    @property
    def within_tolerance(self) -> bool | None:
        """Whether both errors are within `TOLERANCE`; None if it could not be pressed for want of reach."""
        if not self.reached:
            return None
        errors = (self.error_K, self.error_B)
        return all(error is not None and error <= TOLERANCE for error in errors)

    def to_json(self) -> dict[str, Any]:
        """The result as plain values."""
        measured = self.pressed.to_json() if self.pressed else None
        return {
            "probe": self.probe, "measured": measured, "error_K": self.error_K, "error_B": self.error_B,
            "tolerance": TOLERANCE, "passed": self.within_tolerance, "note": self.note,
        }  # fmt: skip


@dataclass(frozen=True)
class Exported:
    """A file that can be written.

    Args:
        contact: the exported contact.
        target: for which simulator.
        text: of the file, without a comment.
        notes: on it, a line each.
        numbers: the engine's own, as in the file.
        validate: reads a file as the engine does, and raises InputError where it refuses it.
        check: presses the contact of a file.
    """

    contact: Contact
    target: str
    text: str
    notes: tuple[str, ...]
    numbers: dict[str, Any]
    validate: Callable[[Path], object] = field(default=lambda _path: None, repr=False)
    check: Callable[[Path], list[Checked]] = field(default=lambda _path: [], repr=False)

    def with_comment(self, mark: str) -> str:
        """The text with a comment about its origin.

        Args:
            mark: the comment's first line.
        """
        lines = [mark, *(printable(line).replace("\n", " ") for line in self.lines())]
        if self.target == "newton":
            head, rest = self.text.split("\n", 1)
            return "\n".join([head, "", *(f"# {line}" for line in lines), rest])
        safe = "\n     ".join(re.sub("-(?=-)", "- ", line) for line in lines)
        declared = re.match(r"\s*<\?xml[^>]*\?>\s*", self.text)
        at = declared.end() if declared else 0
        first = self.text[:at].rstrip() + "\n" if at else ""
        return f"{first}<!-- {safe} -->\n{self.text[at:]}"

    def lines(self) -> list[str]:
        """Description with intervals and assumptions."""
        own = self.contact
        mass = [f"M = {own.mass}"] if own.mass else []
        return [
            f"from {own.source}, model {own.model}",
            f"K = {own.stiffness}",
            f"B = {own.damping}",
            *mass,
            *self.notes,
        ]

    def to_json(self) -> dict[str, Any]:
        """The result as plain values."""
        own = self.contact
        quantities = {"K": own.stiffness, "B": own.damping, "M": own.mass}
        return {
            "to": self.target,
            "from": own.source,
            "model": own.model,
            "parameters": {name: q.to_json() for name, q in quantities.items() if q is not None},
            "force_N": own.force,
            "assumptions": list(self.notes),
            "numbers": self.numbers,
        }


def prepare(contact: Contact, request: Request, out: Path) -> Exported:
    """Everything that can be said before a file is written.

    Raises:
        InputError: the scene is refused; a geom is not there; the contact lacks what the target needs.
        OSError: no such scene.
    """
    made = {"mujoco": _mujoco, "drake": _drake, "newton": _newton, "mjcf-spring": _spring}[request.target]
    done = made(contact, request, out)
    left: tuple[str, ...] = ()
    if contact.mass is not None and request.target != "mjcf-spring":
        left = (f"a contact has no mass of its own: M = {contact.mass.value:.3g} kg is left out",)
    return replace(done, notes=(*contact.assumptions, *left, *done.notes))


def check(exported: Exported, path: Path) -> list[Checked]:
    """Press the contact of a written file in the engine.

    Raises:
        InputError: the engine is not installed, or refuses the file.
    """
    return exported.check(path)


def _judge(probe: str, pressed: RigPress | None, contact: Contact, note: str = "") -> Checked:
    if pressed is None:
        return Checked(
            probe,
            None,
            None,
            None,
            note or _LOST,
        )
    return Checked(probe, pressed, *pressed.errors(contact.stiffness.value, contact.damping.value), note)


def _out_of_reach(probe: str) -> Checked:
    return Checked(probe, None, None, None, "its joints cannot bring it to the surface", reached=False)


def _force(contact: Contact) -> float:
    return contact.force if contact.force is not None else contact.stiffness.value * _DEPTH


def _mujoco(contact: Contact, request: Request, out: Path) -> Exported:
    from palpate_export import mujoco_scene as scenes

    assert request.model is not None
    assert request.surface is not None
    scene = scenes.load_scene(request.model, request.surface)
    found, notes = scenes.pairs(scene, request.probe)
    step = float(scene.model.opt.timestep)
    for pair in found:
        longest = pair.longest_step(contact)
        if longest is not None and longest < step:
            notes.append(
                f"{pair.probe!r}: unstable at the scene's time step of {step:g} s; at most {longest:.2g} s, for the"
                f" {pair.mass:.3g} kg that the contact feels"
            )
    numbers = {pair.probe: _pair_numbers(pair, contact) for pair in found}

    def press_pairs(path: Path) -> list[Checked]:
        return [_pressed_pair(scenes.compile_scene(path), scene, pair, contact) for pair in found]

    return Exported(
        contact, request.target, scenes.xml(scene, found, contact, out.parent),
        (*notes, *scenes.NOTES), {"pairs": numbers}, validate=scenes.compile_scene, check=press_pairs,
    )  # fmt: skip


def _pair_numbers(pair: Any, contact: Contact) -> dict[str, Any]:
    return {
        "solref": list(pair.solref(contact)),
        "R": pair.softness,
        "points": pair.points,
        "mass_kg": pair.mass,
        "longest_time_step_s": pair.longest_step(contact),
    }


def _pressed_pair(model: Any, scene: Any, pair: Any, contact: Contact) -> Checked:
    from palpate_export.mujoco_scene import bring_to_touch
    from palpate_export.rig import MuJoCoRig

    rig = MuJoCoRig(model, scene.geom(scene.surface), scene.geom(pair.probe))
    if bring_to_touch(rig) is None:
        return _out_of_reach(pair.probe)
    return _judge(pair.probe, press(rig, contact.stiffness.value, _force(contact)), contact)


def _drake(contact: Contact, request: Request, _out: Path) -> Exported:
    from palpate_export import drake_scene as scenes

    surface: tuple[str, ...]
    probe: tuple[str, ...] | None
    if request.model is None:
        text = scenes.plate(contact, request.name)
        surface, probe = (request.name, request.name), None
        named = "palpate's sphere"
    else:
        scene = scenes.load_scene(request.model)
        own = scene.collision(request.name)
        other = scenes.probe_of(scene, own, request.probe)
        surface, probe = own.path, other.path if other else None
        text = scenes.edit(scene, own, other, contact).decode()
        named = other.path[-1] if other else "palpate's sphere"

    def press_pairs(path: Path) -> list[Checked]:
        from palpate_export.other_rigs import DrakeRig

        rig = DrakeRig(path, surface, probe, scenes.RIGID)
        if touch(rig) is None:
            return [_out_of_reach(named)]
        note = f"SAP, point contact, {rig.time_step:g} s a step"
        return [_judge(named, press(rig, contact.stiffness.value, _force(contact)), contact, note)]

    numbers = {"point_contact_stiffness": contact.stiffness.value, "relaxation_time": contact.relaxation_time}
    return Exported(
        contact, request.target, text, scenes.notes(probe is not None), numbers, check=press_pairs
    )


def _newton(contact: Contact, request: Request, _out: Path) -> Exported:
    from palpate_export import drake_scene as shapes

    def press_pairs(path: Path) -> list[Checked]:
        from palpate_export.other_rigs import NewtonRig

        rig = NewtonRig(path)
        touch(rig)
        ways = press(rig, contact.stiffness.value, _force(contact), inward=True)
        return [_judge("palpate's sphere", ways, contact, "SolverSemiImplicit, going in")]

    numbers = {"ke": contact.stiffness.value, "kd": contact.damping.value}
    return Exported(contact, request.target, shapes.python(contact), shapes.NOTES, numbers, check=press_pairs)


def _spring(contact: Contact, request: Request, _out: Path) -> Exported:

    check_mass(contact, contact.source)
    text = xml(contact, request.name)

    def press_pairs(_path: Path) -> list[Checked]:
        found = press_plate(text, contact, request.name, _force(contact))
        return [_judge("palpate's sphere", found, contact, "of the plate's own displacement")]

    numbers = {"stiffness": contact.stiffness.value, "damping": contact.damping.value}
    return Exported(contact, request.target, text, NOTES, numbers, check=press_pairs)


_HALF = (0.05, 0.05, 0.005)
"""Of the plate [m]."""
_PROBE = 1.0
"""Mass of the sphere that presses on it in a check [kg]."""

_OWN = (
    "K and B are those of the plate's own displacement, the joint's; a probe sinks into the plate besides, as the"
    " scene's contact has it"
)
NOTES = (
    _OWN,
    "unpressed, the plate's upper side is at z = 0 and its joint at 0; it goes down as it is pressed",
)


def check_mass(contact: Contact, source: str) -> None:
    """Refuse a contact without a mass: a plate has one.

    Raises:
        InputError: none was identified or given.
    """
    if contact.mass is None:
        raise InputError(
            f"{source}: a plate on a spring has a mass, and none is identified; give a small one with --mass (kg),"
            " far below that of the probe"
        )


def xml(contact: Contact, name: str) -> str:
    """The plate, as a model of its own that can be compiled, attached or included.

    Args:
        contact: with a mass.
        name: of body, joint and geom.
    """
    assert contact.mass is not None
    own = quoteattr(name)
    K, B, M = contact.stiffness.value, contact.damping.value, contact.mass.value
    size = " ".join(f"{half:g}" for half in _HALF)
    return f"""<mujoco model={own}>
  <worldbody>
    <body name={own}>
      <joint name={own} type="slide" axis="0 0 -1" stiffness="{K:.17g}" damping="{B:.17g}"/>
      <geom name={own} type="box" size="{size}" pos="0 0 {-_HALF[2]:g}" mass="{M:.17g}"/>
    </body>
  </worldbody>
</mujoco>
"""


def press_plate(text: str, contact: Contact, name: str, force: float) -> RigPress | None:
    """Press the plate with a sphere, and read K and B of the plate's displacement."""
    probe = (
        '<body name="palpate-probe" pos="0 0 0.1"><joint type="slide" axis="0 0 1"/>'
        f'<geom name="palpate-probe" type="sphere" size="0.02" mass="{_PROBE:g}"/></body>'
    )
    pair = f'<contact><pair geom1={quoteattr(name)} geom2="palpate-probe"/></contact>'
    whole = text.replace("</worldbody>", f"{probe}</worldbody>{pair}")
    with refusals("the plate"):
        model = mujoco().MjModel.from_xml_string(whole)
    rig = MuJoCoRig(model, _geom(model, name), _geom(model, "palpate-probe"), plate=0)
    if touch(rig) is None:
        return None
    return press(rig, contact.stiffness.value, force)


def _geom(model: Any, name: str) -> int:
    return int(mujoco().mj_name2id(model, mujoco().mjtObj.mjOBJ_GEOM, name))
