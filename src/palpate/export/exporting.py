"""One contact in one simulator: the file, its assumptions, and the result of a press."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palpate.errors import InputError, unknown
from palpate.export import to_drake, to_mujoco, to_spring
from palpate.export.contact import Contact
from palpate.export.pressing import RigPress, press, touch
from palpate.text import printable

TARGETS = ("mujoco", "drake", "mjcf-spring")
TOLERANCE = 1e-3
"""Largest error of K and of B, as shares, of a check that is passed."""
DEFAULT_DEPTH = 1e-3
"""Depth of a press whose force is not known [m]."""


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
        if self.target == "mujoco" and (self.model is None or self.surface is None):
            raise InputError(
                "MuJoCo's contact depends on the bodies that touch: name the scene with --model and the surface with"
                " --geom"
            )
        if self.target == "mjcf-spring" and (self.model or self.probe):
            raise InputError("--model and --probe are of a scene; --to mjcf-spring takes none")
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
        ending = {"drake": ".sdf", "mjcf-spring": "-to_spring.xml"}[self.target]
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
        """True if both errors are within `TOLERANCE`; None if the probe could not reach the surface."""
        if not self.reached:
            return None
        errors = (self.error_K, self.error_B)
        return all(error is not None and error <= TOLERANCE for error in errors)

    def to_json(self) -> dict[str, Any]:
        """The result as plain values."""
        return {
            "probe": self.probe,
            "measured": self.pressed.to_json() if self.pressed else None,
            "error_K": self.error_K,
            "error_B": self.error_B,
            "tolerance": TOLERANCE,
            "passed": self.within_tolerance,
            "note": self.note,
        }


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
        safe = "\n     ".join(re.sub("-(?=-)", "- ", line) for line in lines)
        declared = re.match(r"\s*<\?xml[^>]*\?>\s*", self.text)
        at = declared.end() if declared else 0
        first = self.text[:at].rstrip() + "\n" if at else ""
        return f"{first}<!-- {safe} -->\n{self.text[at:]}"

    def lines(self) -> list[str]:
        """Description with intervals and assumptions."""
        contact = self.contact
        mass = [f"M = {contact.mass}"] if contact.mass else []
        return [
            f"from {contact.source}, model {contact.model}",
            f"K = {contact.stiffness}",
            f"B = {contact.damping}",
            *mass,
            *self.notes,
        ]

    def to_json(self) -> dict[str, Any]:
        """The result as plain values."""
        contact = self.contact
        quantities = {"K": contact.stiffness, "B": contact.damping, "M": contact.mass}
        return {
            "to": self.target,
            "from": contact.source,
            "model": contact.model,
            "parameters": {name: q.to_json() for name, q in quantities.items() if q is not None},
            "force_N": contact.force,
            "assumptions": list(self.notes),
            "numbers": self.numbers,
        }


def prepare(contact: Contact, request: Request, out: Path) -> Exported:
    """Everything that can be said before a file is written.

    Raises:
        InputError: the scene is refused; a geom is not there; the contact lacks what the target needs.
        OSError: no such scene.
    """
    preparations = {"mujoco": _mujoco, "drake": _drake, "mjcf-spring": _spring}
    exported = preparations[request.target](contact, request, out)
    omitted: tuple[str, ...] = ()
    if contact.mass is not None and request.target != "mjcf-spring":
        omitted = (f"a contact has no mass of its own: M = {contact.mass.value:.3g} kg is left out",)
    return replace(exported, notes=(*contact.assumptions, *omitted, *exported.notes))


def _judge(probe: str, pressed: RigPress | None, contact: Contact, note: str = "") -> Checked:
    if pressed is None:
        lost = "it lost contact, or diverged: is the time step too long?"
        return Checked(probe, None, None, None, note or lost)
    return Checked(probe, pressed, *pressed.errors(contact.stiffness.value, contact.damping.value), note)


def _out_of_reach(probe: str) -> Checked:
    return Checked(probe, None, None, None, "its joints cannot bring it to the surface", reached=False)


def _force(contact: Contact) -> float:
    return contact.force if contact.force is not None else contact.stiffness.value * DEFAULT_DEPTH


def _mujoco(contact: Contact, request: Request, out: Path) -> Exported:
    assert request.model is not None
    assert request.surface is not None
    scene = to_mujoco.MuJoCoScene(request.model, request.surface)
    pairs, notes = scene.pairs(request.probe)
    step = float(scene.model.opt.timestep)
    for pair in pairs:
        longest = pair.longest_step(contact)
        if longest is not None and longest < step:
            notes.append(
                f"{pair.probe!r}: unstable at the scene's time step of {step:g} s; at most {longest:.2g} s, for the"
                f" {pair.mass:.3g} kg that the contact feels"
            )

    def press_pairs(path: Path) -> list[Checked]:
        model = to_mujoco.compile_scene(path)
        return [_press_pair(model, scene, pair.probe, contact) for pair in pairs]

    return Exported(
        contact,
        request.target,
        scene.xml(pairs, contact, out.parent),
        (*notes, to_mujoco.BODIES_NOTE, to_mujoco.FRICTION_NOTE),
        {"pairs": {pair.probe: pair.to_json(contact) for pair in pairs}},
        validate=to_mujoco.compile_scene,
        check=press_pairs,
    )


def _press_pair(model: Any, scene: to_mujoco.MuJoCoScene, probe: str, contact: Contact) -> Checked:
    rig = to_mujoco.MuJoCoRig(model, scene.geom(scene.surface), scene.geom(probe))
    if to_mujoco.bring_to_touch(rig) is None:
        return _out_of_reach(probe)
    return _judge(probe, press(rig, contact.stiffness.value, _force(contact)), contact)


def _drake(contact: Contact, request: Request, _out: Path) -> Exported:
    surface: tuple[str, ...] = (request.name, request.name)
    probe: tuple[str, ...] | None = None
    if request.model is None:
        text = to_drake.plate(contact, request.name)
    else:
        scene = to_drake.DrakeScene(request.model)
        pressed = scene.collision(request.name)
        pressing = scene.probe(pressed, request.probe)
        surface, probe = pressed.path, pressing.path if pressing else None
        text = scene.with_contact(pressed, pressing, contact)
    name = probe[-1] if probe else "palpate's sphere"

    def press_probe(path: Path) -> list[Checked]:
        rig = to_drake.DrakeRig(path, surface, probe)
        if touch(rig) is None:
            return [_out_of_reach(name)]
        note = f"SAP, point contact, {rig.time_step:g} s a step"
        return [_judge(name, press(rig, contact.stiffness.value, _force(contact)), contact, note)]

    numbers = {"point_contact_stiffness": contact.stiffness.value, "relaxation_time": contact.relaxation_time}
    notes = (to_drake.PLANT_NOTE, to_drake.probe_note(probe is not None))
    return Exported(contact, request.target, text, notes, numbers, check=press_probe)


def _spring(contact: Contact, request: Request, _out: Path) -> Exported:
    text = to_spring.plate(contact, request.name)

    def read_joint(path: Path) -> list[Checked]:
        return [_judge("the plate's joint", to_spring.read_joint(path, _force(contact)), contact)]

    numbers = {"stiffness": contact.stiffness.value, "damping": contact.damping.value}
    return Exported(
        contact, request.target, text, (to_spring.JOINT_NOTE, to_spring.PLACE_NOTE), numbers, check=read_joint
    )
