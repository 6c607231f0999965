"""Options of `palpate press`, in groups: what is asked of any arm, of a simulated one, of a real one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from palpate.cli.options.flags import FLAG, SIGNED, WHOLE, in_si
from palpate.cli.options.kept import options_given
from palpate.cli.options.values import vector
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.contact_frame import Payload
    from palpate.press.prepare import Question
    from palpate.wires import Limits, Task


@Parameter(name="*", group=Group("The press", sort_key=1))
@dataclass(frozen=True, kw_only=True)
class AskOptions:
    """What is asked of any arm.

    Parameters
    ----------
    force
        Desired force, N, or with a unit as 20:N.
    seconds
        For how long to press, from the touch on.
    gains
        Gains from palpate tune, a TOML file. Over a wire they are needed; for a simulated arm they are made if left
        out.
    normal
        Direction into the surface, x,y,z in the base's axes, as 0,0,-1. Over a wire it is needed; a simulated arm
        presses where its tip points at home if left out.
    probe
        Share of the force by which it is lowered three times, so that the surface shows what it is: a force that stays
        tells palpate identify little. 0.2 of a simulated arm, 0 of a real one if left out.
    payload
        What palpate payload wrote of the tool; its mass is taken out of M. A simulated arm carries that tool, and its
        sensor shows what that one did; of a real arm the sensor in the air is compared with it.
    """

    force: Annotated[str | None, SIGNED] = None
    seconds: Annotated[float, SIGNED] = 6.0
    gains: Path | None = None
    normal: Annotated[str | None, SIGNED] = None
    probe: Annotated[float | None, SIGNED] = None
    payload: Path | None = None

    @property
    def tool(self) -> Payload | None:
        """The tool that was weighed; None if none was said."""
        from palpate.contact_frame import load_payload

        return None if self.payload is None else load_payload(self.payload)

    @property
    def desired(self) -> float:
        """F_d [N]."""
        if self.force is None:
            raise InputError("how hard? Say --force, as 20:N")
        force = in_si("--force", self.force, "force")
        if not force > 0.0:
            raise InputError(f"--force must be above 0 N (it presses), got {force:g} N")
        return force


@Parameter(name="*", group=Group("A simulated arm", sort_key=2))
@dataclass(frozen=True, kw_only=True)
class SimulatedOptions:
    """The arm that is simulated, what it touches, and where the results go.

    Parameters
    ----------
    arm
        ur5e, fr3, panda, iiwa14, or a file: .toml, .xml (MJCF), .urdf.
    surface
        What is touched: K=5000,B=50 in N/m and N s/m, and M=0.1 in kg if it has a mass.
    site
        The tip, of a file: a site or a body of MJCF, a link of URDF.
    mode
        torque or position: how the arm is driven; its own way when left out.
    physics
        own or mujoco (extra: arms).
    controller
        cautious (with gains for any surface), or of torques: hybrid, proportional-integral, impedance.
    at
        Point of the surface in the base's axes, x,y,z or x,y,z:mm; before the tip at home when left out.
    seed
        Of the noise; the same seed gives the same numbers.
    out
        Folder for record.parquet, summary.json, figures, film and report.html; runs/press-ARM-SEED when left out.
    replace
        Replace the results that stand at --out.
    """

    arm: str | None = None
    surface: str | None = None
    site: str | None = None
    mode: str | None = None
    physics: str = "own"
    controller: str = "cautious"
    at: Annotated[str | None, SIGNED] = None
    seed: Annotated[int, WHOLE] = 0
    out: Path | None = None
    replace: Annotated[bool, FLAG] = False

    def question(self, asked: AskOptions) -> Question:
        """What is to be simulated."""
        from palpate.press.prepare import Question, surface_of

        if self.arm is None or self.surface is None:
            raise InputError(
                "press with what, on what? Give --arm and --surface for a simulated arm, or --wire for a real one"
            )
        return Question(
            arm=self.arm, force=asked.desired, surface=surface_of(self.surface), site=self.site, mode=self.mode,
            physics=self.physics, controller=self.controller, gains=asked.gains, at=vector("at", self.at, "length"),
            normal=vector("normal", asked.normal, "number"), seconds=asked.seconds,
            probe=0.2 if asked.probe is None else asked.probe, seed=self.seed, payload=asked.tool,
        )  # fmt: skip

    @property
    def folder(self) -> Path:
        """Where the results go."""
        return (
            self.out
            if self.out is not None
            else Path("runs") / f"press-{Path(str(self.arm)).stem}-{self.seed}"
        )


@Parameter(name="*", group=Group("A real arm, over its wire", sort_key=3))
@dataclass(frozen=True, kw_only=True)
class WireOptions:
    """The wire, and how carefully.

    Parameters
    ----------
    wire
        rtde:ADDRESS of a UR, franka:ADDRESS, sim:HOST:PORT of a simulated arm in another process, or
        ros2:DOMAIN?wrench=TOPIC&pose=TOPIC&command=TOPIC&as=twist&wrench-frame=tool&force-sign=action, as one word.
        There is no default.
    dry_run
        Read the arm, say what would be done, and end: nothing moves.
    yes
        Do not ask; for scripts.
    record
        Folder for everything that was read and commanded; palpate identify takes its record.parquet.
    certificate
        What palpate certify wrote; without it the lateness is measured, and nothing is proved.
    retreat
        Way back afterwards.
    ordinary_priority
        Ask the system for no real-time priority.
    recover
        Make the record of a press that was killed, from the folder of its --record, and end.
    """

    wire: str | None = None
    dry_run: Annotated[bool, FLAG] = False
    yes: Annotated[bool, FLAG] = False
    record: Path | None = None
    certificate: Path | None = None
    retreat: Annotated[str, SIGNED] = "2:mm"
    ordinary_priority: Annotated[bool, FLAG] = False
    recover: Path | None = None


@Parameter(name="*", group=Group("Limits at which a real arm stops; none has a default", sort_key=4))
@dataclass(frozen=True, kw_only=True)
class LimitOptions:
    """What ends a press over a wire.

    Parameters
    ----------
    force_limit
        Force of any axis, as 40:N.
    speed_limit
        Speed that is never commanded, and at whose double the arm stops, as 20:mm/s.
    travel_limit
        Way from the start, as 10:mm.
    time_limit
        Of all, as 20:s.
    """

    force_limit: Annotated[str | None, SIGNED] = None
    speed_limit: Annotated[str | None, SIGNED] = None
    travel_limit: Annotated[str | None, SIGNED] = None
    time_limit: Annotated[str | None, SIGNED] = None


def only(part: SimulatedOptions | WireOptions | LimitOptions, of: str) -> None:
    """Refuse what was said of the other kind of arm.

    Raises:
        InputError: something was; it is named.
    """
    given = next(iter(options_given((part,))), None)
    if given is not None:
        raise InputError(f"--{given} is of {of}, or leave out --{given}")


def task_of(asked: AskOptions, wire: WireOptions, limits: LimitOptions) -> tuple[Task, Limits]:
    """What was asked of a real arm; the direction and every limit have to be said.

    Raises:
        InputError: one was not, or is none.
    """
    from palpate.wires import Limits, Task

    needed = {
        "--wire": wire.wire, "--gains": asked.gains, "--force": asked.force, "--normal": asked.normal,
        "--force-limit": limits.force_limit, "--speed-limit": limits.speed_limit,
        "--travel-limit": limits.travel_limit, "--time-limit": limits.time_limit,
    }  # fmt: skip
    lacking = [name for name, value in needed.items() if value is None]
    if lacking:
        raise InputError(f"a press with a real arm needs {', '.join(lacking)}; none of them has a default")
    normal = vector("normal", asked.normal, "number")
    assert normal is not None
    most = Limits(
        in_si("--force-limit", str(limits.force_limit), "force"),
        in_si("--speed-limit", str(limits.speed_limit), "velocity"),
        in_si("--travel-limit", str(limits.travel_limit), "length"),
        in_si("--time-limit", str(limits.time_limit), "time"),
    )
    retreat = in_si("--retreat", wire.retreat, "length")
    return Task(asked.desired, normal, asked.seconds, retreat, asked.probe or 0.0), most
