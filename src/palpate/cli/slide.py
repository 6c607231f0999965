"""`palpate slide`: a simulated arm holds a force while its tip moves along an unknown curved surface."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from palpate.cli._streams import notice_signals
from palpate.cli._terminal import simulation_progress
from palpate.cli.options import values
from palpate.cli.options.common import QUIET, LoopArm, Physics
from palpate.cli.options.force import SlideLimits
from palpate.cli.options.press import AskOptions, LimitOptions, WireOptions
from palpate.cli.options.values import FLAG, SIGNED, WHOLE, only, options_given, si
from palpate.cli.toolkit import command, console, guard_picture, place, print_answer
from palpate.errors import InputError, unknown
from palpate.files import fresh_folder, with_author, write_json, write_text
from palpate.text import printable

if TYPE_CHECKING:
    from palpate.arrays import Array
    from palpate.force import Gains
    from palpate.slide.ground import Ground
    from palpate.slide.jointed_arm import HeldTip, JointedArm
    from palpate.slide.world import SimulatedSlide, SlideRun

MIN_LENGTH = 0.003
"""Shortest path of a slide [m]."""
MIN_SECONDS = 1.0
"""Shortest slide that is judged, twice its settling time [s]."""
_WIRE_OPTIONS = {"force", "gains", "normal", "path", "length", "seconds", "end"}
_SURFACE = {
    "K": "stiffness",
    "B": "damping",
    "mu": "friction",
    "mus": "sticking",
    "creep": "creep",
    "grade": "grade",
}

_SIMULATED = Parameter(group=Group("The simulated surface", sort_key=2))
_REAL = Parameter(group=Group("A real arm, over its wire", sort_key=3))


@Parameter(name="*", group=Group("The slide", sort_key=1))
@dataclass(frozen=True, kw_only=True)
class SlideOptions(SlideLimits):
    """Arm, force and path."""

    arm: Annotated[LoopArm, QUIET] = "ur5e"
    "ur5e, fr3, panda, iiwa14, or a TOML file."
    force: values.Force | None = None
    "Desired force, as 20:N; that of the gains if left out, or 15 N."
    shape: Annotated[str, _SIMULATED] = "sphere:200:mm"
    "plane; sphere, bowl, cylinder, saddle, waves or eggs with its radius, as sphere:200:mm; or step:1:mm."
    surface: Annotated[str, _SIMULATED] = "K=20000,mu=0.3"
    """K=..,B=..,mu=.. in N/m and N s/m; mus for friction at rest, creep for its speed in m/s (Stribeck); grade for the
    relative change of K along x per metre."""
    path: str = "circle"
    "line, back, raster or circle."
    length: values.Length = values.quantity_default("40:mm", "length")
    "Length of a line or a pass, or radius of the circle, as 60:mm."
    seconds: Annotated[float, SIGNED] = 8.0
    "Duration of the slide; a line ends at its --length, if that is earlier."
    normal: values.Direction | None = None
    """Direction into the surface, x,y,z, as far as it is known; the true one of a simulated surface is 0,0,-1."""
    end: Annotated[Literal["retreat", "hold"], _REAL] = "retreat"
    "For a real arm. retreat: after the slide the tip goes back to free motion; hold: it rests in contact."
    turn: values.Length | None = None
    """Keep the tool perpendicular to the surface, in simulation: the distance from the tool's point back to the centre
    of its spherical tip, as 20:mm or 0:mm. A flat tool's moment is not covered."""
    payload: Path | None = None
    "File of palpate payload, for --turn: the weight is subtracted in every orientation of the tool."
    dither: Annotated[float, SIGNED, _SIMULATED] = 0.0
    """Fraction by which the force swings during the slide, as 0.1: the stiffness along the path goes to places.csv,
    which palpate map --table reads; 0 for none."""
    gains: Path | None = None
    "Gains from palpate tune --slide; made for the arm if left out."
    physics: Annotated[Physics, QUIET, _SIMULATED] = "own"
    """own: a tip with the arm's lags in each axis, or with --turn the arm's joints; mujoco: the arm's joints
    (extra: arms)."""
    seed: Annotated[int, WHOLE, _SIMULATED] = 0
    "Seed of the sensor's noise."

    def ground(self) -> Ground:
        """Shape and material of the simulated surface."""
        from palpate.slide.ground import ground_of

        numbers: dict[str, float] = {}
        names = dict(_SURFACE)
        try:
            for part in self.surface.split(","):
                key, _, text = part.partition("=")
                numbers[names.pop(key.strip())] = float(text)
        except (KeyError, ValueError):
            numbers.clear()
        if not {"stiffness", "friction"} <= numbers.keys():
            raise InputError(
                "--surface needs the numbers K and mu, and may have B, each once, as K=20000,B=50,mu=0.3 (mu=0: no"
                f" friction); got {self.surface!r}"
            )
        name = self.shape.partition(":")[0]
        if name == "step":
            return ground_of(name, 0.2, **numbers, height=self.radius, period=0.02)
        return ground_of(name, self.radius, **numbers)

    @property
    def extent(self) -> float:
        """Extent of the path [m]."""
        length = self.length.si
        if not MIN_SECONDS <= self.seconds <= 600.0:
            raise InputError(f"--seconds must be from {MIN_SECONDS:g} to 600, got {self.seconds:g}")
        if not length >= MIN_LENGTH:
            raise InputError(f"--length must be at least {1e3 * MIN_LENGTH:g} mm, got {1e3 * length:g} mm")
        return length

    @property
    def radius(self) -> float:
        """Radius of the shape, or its height [m]; of a plane the smallest radius that is expected."""
        name, _, size = self.shape.partition(":")
        if name == "plane" and size:
            raise InputError(f"--shape plane has no radius; leave out :{size}, or give a sphere or a bowl")
        if name == "plane" or not size:
            return 0.2
        radius = values.quantity("--shape", size, "length")
        if not 1e-3 <= abs(radius) <= 1e4 and name != "step":
            raise InputError(f"--shape {name} needs a radius from 1 mm to 10 km, got {radius:g} m")
        return radius

    @property
    def has_no_joints(self) -> bool:
        """True if the arm is a tip with lags in each axis."""
        return self.physics == "own" and self.turn is None

    @cached_property
    def joints(self) -> JointedArm:
        """The arm with its joints, for MuJoCo's physics."""
        from palpate.press.engines import ENGINES
        from palpate.robots.serial.loading import mujoco
        from palpate.slide.jointed_arm import jointed_arm

        if self.physics not in ENGINES:
            raise unknown("physics", self.physics, ENGINES)
        if self.physics == "mujoco":
            mujoco()
        return jointed_arm(self.arm)

    @property
    def tool(self) -> HeldTip | None:
        """The tool that is kept perpendicular; None for one that does not turn."""
        from palpate.contact_frame import load_payload
        from palpate.press.setting import held_tool
        from palpate.slide.jointed_arm import HeldTip

        if self.turn is None:
            if self.payload is not None:
                raise InputError("--payload is for a tool that turns; add --turn, as 20:mm")
            return None
        back = self.turn.si
        if not 0.0 <= back <= 0.5:
            raise InputError(f"--turn must be from 0 to 500 mm, got {1e3 * back:g} mm")
        return HeldTip(back, held_tool(load_payload(self.payload) if self.payload else None).weight)

    @property
    def into(self) -> tuple[float, ...]:
        """Direction into the surface that is given to the law."""
        return si(self.normal) or (0.0, 0.0, -1.0)

    def directions(self, gains: Gains) -> Array:
        """Directions of the slide, tick by tick, shape (m, 3)."""
        from palpate.force.sliding.paths import check_directions, directions, duration
        from palpate.force.sliding.slide_domain import numbers_of

        speed = numbers_of(gains).speed
        seconds = duration(self.path, self.seconds, speed, self.extent)
        if seconds < MIN_SECONDS:
            raise InputError(
                f"a line of {1e3 * self.extent:g} mm ends after {seconds:.2g} s, and a slide is judged from "
                f"{MIN_SECONDS:g} s up; give a longer --length, or a lower --speed"
            )
        ways = directions(self.path, seconds, gains.arm.rate, speed, self.extent)
        check_directions(ways, gains, self.into)
        return ways

    def prepare(self, gains: Gains, ground: Ground, ways: Array, tool: HeldTip | None) -> SimulatedSlide:
        """The slide at its start."""
        if self.has_no_joints:
            from palpate.slide.dither import dither_frequency
            from palpate.slide.world import PointSlide

            dither = (self.dither, dither_frequency(gains))
            return PointSlide(gains, ground, ways, into=self.into, seed=self.seed, dither=dither)
        if self.dither:
            raise InputError("--dither needs an arm without joints; leave out --physics mujoco and --turn")
        return self.joints.prepare(
            gains, ground, ways, into=self.into, seed=self.seed, physics=self.physics, tool=tool
        )

    def tuned_gains(self) -> Gains:
        """Gains for the slide; for an arm with joints with the mass of its tip."""
        from msgspec.structs import replace as changed

        from palpate.force import load_arm, load_gains
        from palpate.force.gains import gains_for

        force = 15.0 if self.force is None else self.force.si
        if self.gains is not None:
            gains = load_gains(self.gains)
            fixed = {field.name.replace("_", "-") for field in fields(SlideLimits)}
            if self.has_no_joints and load_arm(self.arm).title != gains.arm.title:
                fixed.add("arm")
            for name in sorted(fixed & options_given((self,)).keys()):
                raise InputError(f"--{name} is set by {self.gains}; leave it out, or tune again")
            return gains if self.force is None else changed(gains, force=force)
        if not force > 0.0:
            raise InputError(f"--force must be above 0 N (pressing is positive), got {force:g} N")
        gains = gains_for(load_arm(self.arm) if self.has_no_joints else self.joints.inner, force)
        return self.gains_with(gains, abs(self.radius))


def slide(
    *,
    task: SlideOptions | None = None,
    wire: WireOptions | None = None,
    limits: LimitOptions | None = None,
    out: Path | None = None,
    replace: Annotated[bool, FLAG] = False,
    json: Annotated[bool, FLAG] = False,
) -> int:
    """Hold a force while the tip moves along an unknown curved surface, in simulation or with a real arm.

    palpate slide --arm fr3 --force 15:N --speed 30:mm/s --shape bowl:150:mm --surface K=20000,mu=0.3 --path raster

    The arm looks for the surface along --normal, presses, and slides. It estimates normal, friction and stiffness, each
    with an interval. Exit code 1: the force was not held within 3 % rms and 10 %.

    A real arm needs the gains of palpate tune --slide, and moves after a confirmation; --dry-run moves nothing. The
    path's first direction is the base's x along the surface. Every end unloads, as in palpate press --wire:

    palpate slide --wire rtde:192.168.0.10 --gains gains.toml --force 15:N --normal 0,0,-1 --path line --length 40:mm
    --force-limit 40:N --speed-limit 50:mm/s --travel-limit 60:mm --time-limit 30:s --dry-run

    Parameters
    ----------
    out
        Folder for record.parquet, summary.json, slide.png and report.html; runs/slide-ARM-SEED when left out.
    replace
        Replace the results at --out.
    json
        Print one JSON object and nothing else.
    """
    from palpate.slide.dither import check_dither
    from palpate.slide.world import run_slide

    task, wire, limits = task or SlideOptions(), wire or WireOptions(), limits or LimitOptions()
    if wire.wire is not None or wire.recover is not None:
        return _slide_over(task, wire, limits, json)
    _check_simulated(task, wire, limits)
    check_dither(task.dither)
    tool, gains = task.tool, task.tuned_gains()
    ways, ground = task.directions(gains), task.ground()
    folder = out or Path("runs") / f"slide-{Path(task.arm).stem}-{task.seed}"
    with notice_signals() as interrupted, fresh_folder(folder, replace=replace) as fresh:
        prepared = task.prepare(gains, ground, ways, tool)
        with simulation_progress(console(stderr=json), interrupted) as show:
            run = run_slide(prepared, show)
        summary = _write(run, task, gains, ground, fresh)
    if json:
        print_answer(summary)
    else:
        _print(run, summary, folder)
    if interrupted() or run.interrupted:
        return interrupted.code
    return 0 if summary["end"] == "held" else 1


def _write(run: SlideRun, task: SlideOptions, gains: Gains, ground: Ground, folder: Path) -> dict[str, Any]:
    """Write summary, places, record and report into the folder; return the summary."""
    from palpate.slide.dither import dither_frequency, stiffness_along
    from palpate.slide.report import summarise, write_report

    head = {name: getattr(task, name) for name in ("seed", "shape", "path", "physics")}
    figures = summarise(run.rows, gains, ground, task.turn is not None, run.interrupted)
    summary = with_author({"command": printable(command()), **head, **figures, "along": None})
    summary["unloaded"] = run.unloading.how
    if task.dither:
        along = stiffness_along(run.rows, gains.arm, dither_frequency(gains))
        write_text(folder / "places.csv", along.to_csv())
        summary["along"] = along.to_json()
    write_json(folder / "summary.json", summary)
    with guard_picture("report.html"):
        write_report(run, gains, summary, folder)
    return summary


def _print(run: SlideRun, summary: dict[str, Any], folder: Path) -> None:
    """Print the answer, and what went wrong."""
    from palpate.slide.report import sentence

    screen = console()
    screen.print(f"{summary['arm']}: {sentence(summary)}", soft_wrap=True)
    for note in [*summary["troubles"], *([] if run.unloading.free else [run.unloading.how])]:
        screen.print(f"! {note}", soft_wrap=True)
    place(screen, "report:", folder / "report.html")


def _check_simulated(task: SlideOptions, wire: WireOptions, limits: LimitOptions) -> None:
    """Refuse options of a real arm."""
    for part in (wire, limits):
        only(part, "a real arm, and --wire is missing; add --wire")
    if task.end != "retreat":
        raise InputError("--end is for a real arm, and --wire is missing; add --wire, or leave out --end")


def _slide_over(task: SlideOptions, wire: WireOptions, limits: LimitOptions, json: bool) -> int:
    name = next((name for name in options_given((task,)) if name not in _WIRE_OPTIONS), None)
    if name is not None:
        raise InputError(
            f"--{name} is for a simulated slide, and --wire names a real arm; leave out --{name}"
        )
    from palpate.cli._press_over_wire import press_over
    from palpate.wires.order import Path as SlidePath

    path = SlidePath(task.path, task.extent, task.seconds)
    press = AskOptions(
        force=task.force, gains=task.gains, normal=task.normal, seconds=task.seconds, end=task.end
    )
    return press_over(press, wire, limits, json=json, path=path)
