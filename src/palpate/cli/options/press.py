"""Options of a press: of any arm, of a simulated one, of a real one over its wire with its limits, of a phantom."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from palpate.cli.options import values
from palpate.cli.options.common import QUIET, Controller, Mode, Physics, SerialArm, read_found
from palpate.cli.options.values import FLAG, SIGNED, WHOLE, options, si
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.contact_frame.payload import Payload
    from palpate.environments.models import KelvinVoigt
    from palpate.press.prepare import PressSpec


@options("The press", 1)
class AskOptions:
    """The press, of any arm."""

    force: values.Force | None = None
    "Desired force, N, or with a unit as 20:N."
    force_max: values.Force | None = None
    """F_max, N: the largest force, on layers and after a false touch, too (docs/proofs.md states the assumptions).
    If left out, that of the gains; without gains five times the force, and at most what the sensor reads."""
    seconds: Annotated[float, SIGNED] = 6.0
    "Duration of the press from where the force is reached on."
    end: Literal["retreat", "hold"] = "retreat"
    """retreat: after the press the tip goes back to free motion; hold: it rests in contact. After every other end
    (a limit, a fault, a signal) it retreats."""
    gains: Path | None = None
    """Gains from palpate tune, a TOML file. Over a wire they are needed; for a simulated arm they are tuned if
    left out."""
    normal: values.Direction | None = None
    """Direction into the surface, x,y,z in the base's axes, as 0,0,-1. Over a wire it is needed; a simulated
    arm presses where its tip points at home if left out."""
    probe: Annotated[float | None, SIGNED] = None
    """Fraction by which the force is lowered three times, to identify the surface: palpate identify learns little
    from a constant force. If left out, 0.2 for a simulated arm, 0 for a real
    one."""
    payload: Path | None = None
    """File of palpate payload; the tool's mass is subtracted from M. A simulated arm carries that tool with
    its sensor's bias; for a real arm the sensor's reading in free motion is compared with it."""

    @property
    def tool(self) -> Payload | None:
        """The weighed tool; None if not given."""
        from palpate.contact_frame.payload import load_payload

        return None if self.payload is None else load_payload(self.payload)

    @property
    def force_or_gains(self) -> float:
        """Desired force, or that of the gains if none is given [N]."""
        if self.force is None and self.gains is not None:
            from palpate.force import load_gains

            return load_gains(self.gains).force
        return self.desired_force

    @property
    def desired_force(self) -> float:
        """Desired force F_d [N]."""
        if self.force is None:
            raise InputError("the desired force is missing; add --force, as 20:N")
        force = self.force.si
        if not force > 0.0:
            raise InputError(f"--force must be above 0 N (pressing is positive), got {force:g} N")
        return force


@options("A simulated arm", 2)
class SimulatedOptions:
    """The simulated arm, its surface, and the results."""

    arm: Annotated[SerialArm | None, QUIET] = None
    "ur5e, fr3, panda, iiwa14, or a file: .toml, .xml (MJCF), .urdf."
    surface: str | None = None
    """The surface: K=5000,B=50 in N/m and N s/m, and M=0.1 in kg if it has a mass; a layer on something hard:
    K=500,thickness=20:mm,behind=1e5."""
    free_force: str | None = None
    """Simulated force in free motion, by a cable that pulls at the tool and a ripple over the position:
    cable=20:N/m,ripple=1.5:N,wave=60:mm."""
    site: str | None = None
    "The tip in the file: a site or a body of MJCF, a link of URDF."
    mode: Annotated[Mode | None, QUIET] = None
    "torque or position: the arm's input; its usual one when left out."
    physics: Annotated[Physics, QUIET] = "own"
    "own or mujoco (extra: arms)."
    controller: Annotated[Controller, QUIET] = "cautious"
    "cautious (with gains for any surface), or a torque law: hybrid, proportional-integral, impedance."
    at: values.Point | None = None
    "Point of the surface in the base's axes, x,y,z or x,y,z:mm; in front of the tip at home when left out."
    seed: Annotated[int, WHOLE] = 0
    "Seed of the noise; the same seed gives the same numbers."
    out: Path | None = None
    """Folder for record.parquet, summary.json, film and report.html; runs/press-ARM-SEED when left
    out."""
    replace: Annotated[bool, FLAG] = False
    "Replace the results at --out."

    def read_surface(self, identified: Path) -> KelvinVoigt:
        """The surface of an identification; without the arm's compliance where the log includes it.

        Raises:
            InputError: --surface is given too, or the stiffness or the damping is unknown.
        """
        from palpate.environments.models import KelvinVoigt
        from palpate.export.contact import LINEAR, Given, contact_from
        from palpate.force import load_arm
        from palpate.force.arm import names

        if self.surface is not None:
            raise InputError("give a file or --surface, not both")
        answer, remedy = read_found(identified), "give the surface with --surface, as K=5000,B=50"
        contact = contact_from(
            answer,
            str(identified),
            Given(
                working_point="logs" not in answer and str(answer.get("model")) not in LINEAR,
                arm=load_arm(str(self.arm)) if self.arm in names() else None,
                give_stiffness=remedy,
                give_damping=remedy,
                name_arm="",
            ),
        )
        mass = contact.mass.value if contact.mass is not None else 0.0
        return KelvinVoigt(contact.stiffness.value, contact.damping.value, mass)

    def spec(self, task: AskOptions, surface: KelvinVoigt | None = None) -> PressSpec:
        """The press to simulate, on a surface that is given here or by --surface."""
        from palpate.press.prepare import PressSpec, parse_pose_force, surface_of
        from palpate.press.simulated_arm import NO_FREE_FORCE

        if self.arm is None:
            raise InputError(
                "no arm is named; give --arm for a simulated one, as ur5e, or --wire for a real one"
            )
        if surface is None and self.surface is None:
            raise InputError(
                "the surface is missing; give FOUND.json of palpate identify --json, or --surface K=5000,B=50 in N/m"
                " and N s/m"
            )
        touched = surface if surface is not None else surface_of(str(self.surface))
        return PressSpec(
            arm=self.arm,
            force=task.force_or_gains,
            surface=touched,
            site=self.site,
            mode=self.mode,
            physics=self.physics,
            controller=self.controller,
            gains=task.gains,
            at=si(self.at),
            normal=si(task.normal),
            seconds=task.seconds,
            probe=0.2 if task.probe is None else task.probe,
            seed=self.seed,
            payload=task.tool,
            end=task.end,
            force_max=si(task.force_max),
            free=NO_FREE_FORCE if self.free_force is None else parse_pose_force(self.free_force),
        )

    @property
    def folder(self) -> Path:
        """Folder of the results."""
        return (
            self.out
            if self.out is not None
            else Path("runs") / f"press-{Path(str(self.arm)).stem}-{self.seed}"
        )


@options("A map of a phantom, by a simulated arm", 5)
class PhantomOptions:
    """The phantom and its map."""

    map: Path | None = None
    """phantom, which comes with palpate, or a TOML file: size, stiffness, damping and [[lumps]] with at, radius,
    stiffness and edge, in m, N/m and N s/m."""
    presses: Annotated[int, WHOLE] = 40
    "How many presses: sixteen on a grid, then where the map is worst known."
    stiffer_than: values.Stiffness | None = None
    "A stiffness, as 2000 or 2:kN/m: presses are chosen for the edges of lumps above it."
    page: Path | None = None
    "Page to write after each map; the browser loads it again until the last."


@options("A real arm, over its wire", 3)
class WireOptions:
    """The wire, and its safeguards."""

    wire: str | None = None
    """rtde:ADDRESS of a UR, franka:ADDRESS, sim:HOST:PORT of a simulated arm in another process, or
    ros2:DOMAIN?wrench=TOPIC&pose=TOPIC&command=TOPIC&as=twist&wrench-frame=tool&force-sign=action, as one
    word; or module:Class?WHERE, the wire to your own robot. There is no default."""
    dry_run: Annotated[bool, FLAG] = False
    "Read the arm, print the planned motion, and end: nothing moves."
    yes: Annotated[bool, FLAG] = False
    "Do not ask for confirmation; for scripts."
    record: Path | None = None
    "Folder for all readings and commands; palpate identify reads its record.parquet."
    certificate: Path | None = None
    "File of palpate certify; without it the lateness is measured, and nothing is proved."
    retreat: values.Length | None = None
    "Clearance of the retreat from the surface; 2 mm if left out, or the travel limit if that is shorter."
    free_stroke: values.Length | None = None
    """Length of a stroke away from the surface and back before the press. It measures how the force in free motion
    changes with the position; 0 for none. If left out, 20 mm, or 0.9 of the travel limit if that is shorter."""
    ordinary_priority: Annotated[bool, FLAG] = False
    "Do not request real-time priority from the system."
    recover: Path | None = None
    "Build the record of a press that was killed, from the folder of its --record, and end."


@options("Limits at which a real arm stops", 4)
class LimitOptions:
    """Limits that end a press over a wire."""

    force_limit: values.Force | None = None
    "Force of any axis, as 40:N."
    speed_limit: values.Velocity | None = None
    "Largest commanded speed, as 20:mm/s; at twice this speed the arm stops."
    travel_limit: values.Length | None = None
    """Distance from the start, as 10:mm. If left out, the force limit divided by the stiffness of the gains'
    stiffest surface: a sensor that lies then stays below the force limit. Start that close to the surface."""
    time_limit: values.Time | None = None
    "Total duration, as 20:s."
