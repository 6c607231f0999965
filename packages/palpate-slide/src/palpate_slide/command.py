"""`palpate slide`: a simulated arm holds a force while its tip moves along an unknown curved surface."""

from __future__ import annotations

from dataclasses import dataclass, fields
from dataclasses import replace as replaced
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from palpate.cli.options import values
from palpate.cli.options.common import QUIET, LoopArm, Physics
from palpate.cli.options.force import SlideLimits
from palpate.cli.options.values import FLAG, SIGNED, WHOLE, only, options_given, si
from palpate.cli.press import AskOptions, LimitOptions, WireOptions
from palpate.cli.toolkit import command, console, option_of, place, print_answer
from palpate.errors import InputError, unknown
from palpate.files import fresh_folder, with_author, write_json, write_text
from palpate.text import printable

if TYPE_CHECKING:
    from palpate.arrays import Array
    from palpate.force import Gains
    from palpate_slide.ground import Ground
    from palpate_slide.jointed_arm import HeldTip, JointedArm

SHORTEST = 0.003
"""Path that is one [m]."""
SHORTEST_TIME = 1.0
"""Slide that is judged, twice the time in which it settles [s]."""
_OF_WIRE = {"force", "gains", "normal", "path", "length", "seconds"}
_SURFACE = {
    "K": "stiffness",
    "B": "damping",
    "mu": "friction",
    "mus": "sticking",
    "creep": "creep",
    "grade": "grade",
}

_SIMULATED = Parameter(group=Group("The simulated surface", sort_key=2))


@Parameter(name="*", group=Group("The slide", sort_key=1))
@dataclass(frozen=True, kw_only=True)
class SlideOptions(SlideLimits):
    """Arm, force and path."""

    arm: Annotated[LoopArm, QUIET] = "ur5e"
    "ur5e, fr3, panda, iiwa14, or a TOML file."
    force: values.Force | None = None
    "Desired force, as 20:N; that of the gains if left out, or 15 N."
    shape: Annotated[str, _SIMULATED] = "sphere:200:mm"
    """plane, or sphere, bowl, cylinder, saddle, waves or eggs with its radius, as sphere:200:mm; step:1:mm; or
    mesh:FILE:mm, an STL or OBJ in that unit, from above (extra: arms)."""
    surface: Annotated[str, _SIMULATED] = "K=20000,mu=0.3"
    """K=..,B=..,mu=.. in N/m and N s/m; mus for friction at rest, creep for its speed in m/s (Stribeck); grade for the
    relative change of K along x per metre."""
    path: str = "circle"
    "line, back, raster or circle."
    length: values.Length = values.quantity_default("40:mm", "length")
    "Of a line or a pass, radius of a circle, as 60:mm."
    seconds: Annotated[float, SIGNED] = 8.0
    "Duration of the slide; a line ends at its --length, if that is earlier."
    normal: values.Direction | None = None
    """Direction into the surface that is given to the law, x,y,z; the true one of a simulated surface is
    0,0,-1."""
    turn: values.Length | None = None
    """Keeps the tool perpendicular to the surface, about the centre of its spherical tip: how far that is behind the
    tool's point, as 20:mm or 0:mm. A flat tool's moment is not covered."""
    payload: Path | None = None
    "File of palpate payload, whose weight is taken off in every orientation of the tool; for --turn."
    dither: Annotated[float, SIGNED, _SIMULATED] = 0.0
    """Share of the force by which it changes in the slide, as 0.1: the stiffness along the path goes to places.csv,
    which palpate map --table reads; 0 for none."""
    gains: Path | None = None
    "Gains from palpate tune --slide; made for the arm if left out."
    physics: Annotated[Physics, QUIET, _SIMULATED] = "own"
    """own: a tip with the arm's lags in each axis, or with --turn the arm's joints; mujoco: the arm's joints
    (extra: arms)."""
    seed: Annotated[int, WHOLE, _SIMULATED] = 0
    "Of the sensor's noise."

    def ground(self, ways: Array, speed: float, rate: float) -> Ground:
        """The surface under a path."""
        from palpate_slide.ground import ground_of

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
        (name, _, size), heights = self.shape.partition(":"), None
        if name == "mesh":
            from palpate_slide.mesh import heights_of

            file, _, unit = size.rpartition(":")
            if not file:
                raise InputError(
                    f"--shape mesh needs a file and its unit, as mesh:part.stl:mm; got {self.shape!r}"
                )
            way = speed / rate * ways.cumsum(axis=0)
            heights = heights_of(
                Path(file), values.quantity("--shape", f"1:{unit}", "length"), float(abs(way).max())
            )
        if name == "step":
            return ground_of(name, 0.2, heights=None, **numbers, height=self.radius, period=0.02)
        return ground_of(name, self.radius, heights=heights, **numbers)

    @property
    def extent(self) -> float:
        """Of the path [m]."""
        length = self.length.si
        if not SHORTEST_TIME <= self.seconds <= 600.0:
            raise InputError(f"--seconds must be from {SHORTEST_TIME:g} to 600, got {self.seconds:g}")
        if not length >= SHORTEST:
            raise InputError(f"--length must be at least {1e3 * SHORTEST:g} mm, got {1e3 * length:g} mm")
        return length

    @property
    def radius(self) -> float:
        """Radius of the shape, or its height [m]; of a plane or a mesh the smallest radius that is expected."""
        name, _, size = self.shape.partition(":")
        if name == "plane" and size:
            raise InputError(f"--shape plane has no radius; leave out :{size}, or give a sphere or a bowl")
        if name in {"plane", "mesh"} or not size:
            return 0.1 if name == "mesh" else 0.2
        radius = values.quantity("--shape", size, "length")
        if not 1e-3 <= abs(radius) <= 1e4 and name != "step":
            raise InputError(f"--shape {name} needs a radius from 1 mm to 10 km, got {radius:g} m")
        return radius

    @property
    def has_no_joints(self) -> bool:
        """Whether the arm is a tip with lags in each axis."""
        return self.physics == "own" and self.turn is None

    @cached_property
    def joints(self) -> JointedArm:
        """The arm with its joints, for MuJoCo's physics."""
        from palpate.press.engines import ENGINES
        from palpate.robots.serial.loading import mujoco
        from palpate_slide.jointed_arm import jointed_arm

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
        from palpate_slide.jointed_arm import HeldTip

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

    def run(self, gains: Gains, ground: Ground, ways: Array) -> Array:
        """Rows of the slide."""
        if self.has_no_joints:
            from palpate_slide.dither import dither_frequency
            from palpate_slide.world import simulate

            share = (self.dither, dither_frequency(gains))
            return simulate(gains, ground, ways, into=self.into, seed=self.seed, dither=share)
        if self.dither:
            raise InputError("--dither needs an arm without joints; leave out --physics mujoco and --turn")
        return self.joints.slide(
            gains, ground, ways, into=self.into, seed=self.seed, physics=self.physics, tool=self.tool
        )

    def tuned_gains(self) -> Gains:
        """Gains for the slide; for an arm with joints with the mass of its tip."""
        from msgspec.structs import replace as changed

        from palpate.force import load_arm, load_gains
        from palpate.force.gains import gains_for

        wanted = 15.0 if self.force is None else self.force.si
        if self.gains is not None:
            gains = load_gains(self.gains)
            own = {field.name.replace("_", "-") for field in fields(SlideLimits)}
            if self.has_no_joints and load_arm(self.arm).title != gains.arm.title:
                own.add("arm")
            for name in sorted(own & options_given((self,)).keys()):
                raise InputError(
                    f"--{name} is of the gains, and {self.gains} has its own; leave it out, or tune again"
                )
            return gains if self.force is None else changed(gains, force=wanted)
        if not wanted > 0.0:
            raise InputError(f"--force must be above 0 N (pressing is positive), got {wanted:g} N")
        gains = gains_for(load_arm(self.arm) if self.has_no_joints else self.joints.inner, wanted)
        return self.gains_with(gains, abs(self.radius))


def slide(
    *,
    asked: SlideOptions | None = None,
    wire: WireOptions | None = None,
    limits: LimitOptions | None = None,
    out: Path | None = None,
    replace: Annotated[bool, FLAG] = False,
    live: Annotated[bool, FLAG] = False,
    json: Annotated[bool, FLAG] = False,
) -> int:
    """Hold a force while the tip moves along an unknown curved surface, in simulation or with a real arm.

    palpate slide --arm fr3 --force 15:N --speed 30:mm/s --shape bowl:150:mm --surface K=20000,mu=0.3 --path raster

    The arm looks for the surface along --normal, presses, and slides. It estimates normal, friction and stiffness, each
    with an interval. Exit code 1: the force was not held within 3 % rms and 10 %.

    A real arm slides with the gains of palpate tune --slide, after a confirmation, and with --dry-run not at all. The
    path's first direction is the base's x along the surface. The arm stops as in palpate press --wire:

    palpate slide --wire rtde:192.168.0.10 --gains gains.toml --force 15:N --normal 0,0,-1 --path line --length 40:mm
    --force-limit 40:N --speed-limit 50:mm/s --travel-limit 60:mm --time-limit 30:s --dry-run

    Parameters
    ----------
    out
        Folder for record.parquet, summary.json, film.svg, slide.png and report.html; runs/slide-ARM-SEED when left out.
    replace
        Replace the results at --out.
    live
        Watch the slide in the browser, around a circle, its joints moved by MuJoCo (extras: arms, live).
    json
        Print one JSON object and nothing else.
    """
    from palpate.force.sliding.paths import check_directions, directions, duration
    from palpate.force.sliding.slide_domain import numbers_of
    from palpate_slide.dither import check_share, dither_frequency, stiffness_along
    from palpate_slide.report import sentence, summarise, write_report

    asked, wire, limits = asked or SlideOptions(), wire or WireOptions(), limits or LimitOptions()
    if wire.wire is not None or wire.recover is not None:
        return _slide_over(asked, wire, limits, json)
    for part in (wire, limits):
        only(part, "a real arm, and --wire is missing; add --wire")
    check_share(asked.dither)
    if live:
        asked = replaced(asked, physics="mujoco", path="circle", seconds=1.0)
    tool = asked.tool
    gains = asked.tuned_gains()
    speed = numbers_of(gains).speed
    seconds = duration(asked.path, asked.seconds, speed, asked.extent)
    if seconds < SHORTEST_TIME:
        raise InputError(
            f"a line of {1e3 * asked.extent:g} mm ends after {seconds:.2g} s, and a slide is judged from "
            f"{SHORTEST_TIME:g} s up; give a longer --length, or a lower --speed"
        )
    ways = directions(asked.path, seconds, gains.arm.rate, speed, asked.extent)
    check_directions(ways, gains, asked.into)
    ground = asked.ground(ways, speed, gains.arm.rate)
    if live:
        return _watch(asked, gains, ground)
    folder = out or Path("runs") / f"slide-{Path(asked.arm).stem}-{asked.seed}"
    with fresh_folder(folder, replace=replace) as fresh:
        rows = asked.run(gains, ground, ways)
        head = {name: getattr(asked, name) for name in ("seed", "shape", "path", "physics")}
        summary: dict[str, Any] = with_author(
            {"command": printable(command()), **head, **summarise(rows, gains, ground, tool is not None)}
        )
        summary["along"] = None
        if asked.dither:
            along = stiffness_along(rows, gains.arm, dither_frequency(gains))
            write_text(fresh / "places.csv", along.to_csv())
            summary["along"] = along.to_json()
        write_report(rows, gains, ground, summary, fresh)
        write_json(fresh / "summary.json", summary)
    if json:
        print_answer(summary)
    else:
        screen = console()
        screen.print(f"{gains.arm.title}: {sentence(summary)}", soft_wrap=True)
        for note in summary["troubles"]:
            screen.print(f"! {note}", soft_wrap=True)
        place(screen, "report:", folder / "report.html")
    return 0 if summary["end"] == "held" else 1


def _watch(asked: SlideOptions, gains: Gains, ground: Ground) -> int:
    """Serves the live page of a slide."""
    try:
        from palpate_live.command import ServedOptions, show_live
        from palpate_slide.watched import WatchedSlide
    except ImportError:
        raise InputError(
            "--live needs palpate-live, which is not installed: pip install palpate-live"
        ) from None
    watched = WatchedSlide(asked.joints, gains, ground, asked.extent, asked.into, asked.seed, asked.tool)
    return show_live(watched, ServedOptions())


def _slide_over(asked: SlideOptions, wire: WireOptions, limits: LimitOptions, json: bool) -> int:
    other = next((name for name in options_given((asked,)) if name not in _OF_WIRE), None)
    if other is not None:
        raise InputError(
            f"--{other} is for a simulated slide, and --wire names a real arm; leave out --{other}"
        )
    press_over = option_of("wire", "wires")
    from palpate_wires.order import Path as SlidePath

    path = SlidePath(asked.path, asked.extent, asked.seconds)
    press = AskOptions(force=asked.force, gains=asked.gains, normal=asked.normal, seconds=asked.seconds)
    return press_over(press, wire, limits, json=json, path=path)
