"""A press prepared from its specification: arm, surface and gains, all checked."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.contact_frame.payload import Payload
from palpate.environments.models import KelvinVoigt, Layered, stiffest
from palpate.errors import InputError, unknown
from palpate.force.arm import Sensor
from palpate.force.ceiling import check_same_force_max, usual_force_max
from palpate.force.force_loop import ForceLoop
from palpate.force.gains import Gains, load_gains
from palpate.press.at_rest import SURE, check_drift, check_range, fitting, noise_and_drift
from palpate.press.engines import (
    ENGINES,
    MODES,
    check_arm,
    check_mode,
    loop_of,
    mass_note,
    press_gains,
    usual_mode,
)
from palpate.press.free_stroke import StrokePlan, make_stroke
from palpate.press.pressing import Progress, press
from palpate.press.sequence import CautiousDriver, Plan, PressDriver, plan_for
from palpate.press.setting import GAP, Place, cell_of, check_able, held_tool, place_of, with_tool
from palpate.press.simulated_arm import NO_FREE_FORCE, PoseForce, SimulatedArm
from palpate.press.summary import PressRequest
from palpate.press.tip_controller import CONTROLLERS, TorqueDriver
from palpate.press.unload import SLOW
from palpate.records import Record
from palpate.robots.serial.from_toml import names
from palpate.robots.serial.loading import mujoco
from palpate.robots.serial.serial_arm import SerialArm
from palpate.units import unit

CAUTIOUS = "cautious"
_SURFACE = {"K": "N/m", "B": "N s/m", "M": "kg", "thickness": "m", "behind": "N/m"}
_FREE_FORCE = {"cable": "N/m", "ripple": "N", "wave": "m"}


@dataclass(frozen=True)
class PressSpec:
    """Arm, surface and force of a press, as given by the user, in SI.

    Args:
        arm: a name, or the path of a file that ends in .toml, .xml, .mjcf or .urdf.
        force: [N].
        surface: what is touched.
        site: the tip, of a file that has several sites or links.
        mode: torque or position; the arm's own when left out.
        physics: own or mujoco.
        controller: by name.
        gains: file of `palpate tune`; made for the arm when left out.
        at: point of the surface [m]; before the tip at home when left out.
        normal: into the surface; the tip's own z at home when left out.
        seconds: of the hold, from where the force is reached on [s].
        probe: share of the force.
        seed: of the noise.
        payload: of `palpate payload`: the arm carries this tool, and its sensor shows what that one did.
        end: hold, to rest in contact after a press that is done; else retreat.
        force_max: F_max, see `force.ceiling` [N]; that of the gains, else five times the force, if left out.
        free: force that the sensor shows in free motion, by the place of the tip.
    """

    arm: str
    force: float
    surface: KelvinVoigt | Layered
    site: str | None = None
    mode: str | None = None
    physics: str = "own"
    controller: str = CAUTIOUS
    gains: Path | None = None
    at: tuple[float, float, float] | None = None
    normal: tuple[float, float, float] | None = None
    seconds: float = 6.0
    probe: float = 0.2
    seed: int = 0
    payload: Payload | None = None
    end: str = "retreat"
    force_max: float | None = None
    free: PoseForce = NO_FREE_FORCE


@dataclass(frozen=True)
class PreparedPress:
    """A press that is ready to run.

    Args:
        request: arm, surface and loop.
        plan: of the force.
    """

    request: PressRequest
    plan: Plan

    def run(self, progress: Progress | None = None) -> Record:
        """Run the press; the record has its own metadata."""
        request = self.request
        loop = request.gains.arm
        cell = cell_of(request.arm, request.place, request.surface, loop, held_tool(request.payload))
        arm, resting = (
            SimulatedArm(request.arm, loop, request.place, cell, request.physics, request.seed)
            for _ in range(2)
        )
        arm.free = resting.free = request.free
        if request.payload is not None:
            arm.tare()
            max_force = self.plan.force + SURE * loop.sensor.noise
            check_range(abs(arm.zero), max_force, loop.sensor.full_scale)
        gains = fit_gains(request.gains, resting.at_rest(), self.plan)
        stroke = self._free_stroke(resting, gains, arm) if request.controller == CAUTIOUS else None
        driver = _driver(request, arm, gains, self.plan.force)
        record = press(arm, driver, request.place, self.plan, gains, progress, request.end)
        meta = {**record.meta, **request.meta(record), "tare_N": arm.zero, "free_stroke": stroke}
        return Record(record.columns, record.units, meta)

    def _free_stroke(self, resting: SimulatedArm, gains: Gains, arm: SimulatedArm) -> dict[str, Any]:
        """Make the free stroke with the arm that rested; take its slope off the readings of the other."""
        reach = gains.approach * self.plan.longest
        speed = min(SLOW * gains.approach, gains.speed_at(self.plan.force))
        plan = StrokePlan(self.request.place.normal, reach, speed, gains, self.plan.force)
        free = make_stroke(resting, plan)
        arm.slope = free.slope_to_subtract(reach, gains.level)
        return free.to_json(arm.slope)


def _driver(request: PressRequest, arm: SimulatedArm, gains: Gains, force: float) -> PressDriver:
    """The driver of the controller asked for.

    Raises:
        InputError: no such controller; one of torques on an arm of positions.
    """
    name, place = request.controller, request.place
    if name == CAUTIOUS:
        return CautiousDriver(arm, ForceLoop(gains), place.normal)
    if gains.arm.kind != "torque":
        raise InputError(f"--controller {name} gives torques, and the arm takes positions; add --mode torque")
    return TorqueDriver(arm, place, name, gains.approach, 8.0 * gains.arm.sensor.noise, force)


def fit_gains(gains: Gains, readings: Array, plan: Plan) -> Gains:
    """The gains for the noise of an arm at rest.

    Args:
        gains: as they were tuned.
        readings: by the sensor in each tick at rest [N], shape (n,).
        plan: of the press.

    Raises:
        InputError: a drift, or a noise, with which there is no press.
    """
    noise, drift, std = noise_and_drift(gains.arm.tick * np.arange(len(readings), dtype=np.float64), readings)
    check_drift(drift, std, plan.force, plan.longest + plan.seconds, gains.arm.sensor)
    return fitting(gains, noise, len(readings)) or gains


def prepare_press(spec: PressSpec) -> PreparedPress:
    """Check a specification, and prepare its press without running it.

    Raises:
        InputError: an arm, surface, pose or number with which there is no press, in one line.
    """
    _check_words(spec)
    Plan(spec.force, spec.seconds, spec.probe)
    arm = _load(spec, arm_of(spec.arm, spec.site))
    place = place_of(arm, spec.at, spec.normal)
    gains = _gains(spec, arm, place)
    _check_surface(spec, gains)
    notes = check_able(arm, place, gains.approach, spec.force)
    massless = mass_note(gains, place.mass)
    notes = [*arm.notes, *notes, *([massless] if massless else []), *_engine_notes(spec, arm)]
    request = PressRequest(
        arm=arm,
        gains=gains,
        place=place,
        surface=spec.surface,
        controller=spec.controller,
        physics=spec.physics,
        seed=spec.seed,
        payload=spec.payload,
        notes=tuple(notes),
        end=spec.end,
        free=spec.free,
    )
    return PreparedPress(request, plan_for(spec.force, spec.seconds, spec.probe, GAP, gains.approach))


def _load(spec: PressSpec, arm: SerialArm) -> SerialArm:
    """The arm with its tool, if there is one."""
    if spec.payload is None:
        return arm
    if spec.physics == "mujoco" and arm.scene is not None:
        raise InputError(
            f"{spec.arm} is MuJoCo's own model, in which --payload hangs nothing; give the tool a body there, or"
            " leave --physics out"
        )
    return with_tool(arm, spec.payload)


def arm_of(name: str, site: str | None) -> SerialArm:
    """An arm by its name, or from a file by its ending.

    Raises:
        InputError: no such arm, a file that is none.
    """
    if name in names():
        if site is not None:
            raise InputError(f"--site is for files; {name} has its flange as tip")
        return SerialArm.named(name)
    path, ending = Path(name), Path(name).suffix.lower()
    if ending == ".toml":
        return SerialArm.from_toml(path)
    if ending in {".xml", ".mjcf"}:
        return SerialArm.from_mujoco(path, site)
    if ending == ".urdf":
        if site is None:
            raise InputError(f"{name}: which link is the tip? Give it with --site")
        return SerialArm.from_urdf(path, site)
    raise unknown("arm", name, [*names(), "FILE.toml", "FILE.xml", "FILE.urdf"])


def surface_of(text: str) -> KelvinVoigt | Layered:
    """`K=5000,B=50`, and M=0.1 if it has a mass; `K=500,thickness=20:mm,behind=1e5` of a layer on something hard.

    Raises:
        InputError: another text, a number out of range.
    """
    numbers = _numbers("--surface", text, _SURFACE, "K=5000,B=50 or K=500,thickness=20:mm,behind=1e5")
    if "K" not in numbers:
        raise InputError(f"--surface needs a stiffness, as K=5000; got {text!r}")
    if ("thickness" in numbers) != ("behind" in numbers) or {"M", "behind"} <= set(numbers):
        raise InputError(
            "--surface needs thickness and behind together and without M, as K=500,thickness=20:mm,behind=1e5; got"
            f" {text!r}"
        )
    stiffness, damping = numbers.pop("K"), numbers.pop("B", 0.0)
    try:
        if "behind" not in numbers:
            return KelvinVoigt(stiffness, damping, numbers.get("M", 0.0))
        return Layered(stiffness, damping, 0.0, numbers["thickness"], numbers["behind"])
    except InputError as error:
        raise InputError(f"--surface: {error}") from None


def parse_pose_force(text: str) -> PoseForce:
    """`cable=20` and `ripple=1.5,wave=60:mm`, in SI or with units.

    Raises:
        InputError: another text, a wave without length.
    """
    force = PoseForce(**_numbers("--free-force", text, _FREE_FORCE, "cable=20,ripple=1.5,wave=60:mm"))
    if not force.wave > 0.0:
        raise InputError(f"--free-force: the wave must be longer than 0 m, got {force.wave:g}")
    return force


def _numbers(option: str, text: str, units: dict[str, str], example: str) -> dict[str, float]:
    """Numbers of `NAME=NUMBER` or `NAME=NUMBER:UNIT`, separated by commas, in SI."""
    numbers: dict[str, float] = {}
    for part in text.split(","):
        name, sign, number = (word.strip() for word in part.partition("="))
        if name not in units or not sign:
            names = ", ".join(f"{known} in {si}" for known, si in units.items())
            raise InputError(f"{option} needs {example} ({names}); got {text!r}")
        if name in numbers:
            raise InputError(f"{option} has {name} twice: {text!r}")
        numbers[name] = _number(option, name, number, units[name])
    return numbers


def _number(option: str, name: str, text: str, si: str) -> float:
    plain, _, symbol = text.partition(":")
    try:
        value = float(plain)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{option}: {name} needs a number in {si}, got {text!r}")
    if not symbol:
        return value
    given = unit(symbol)
    if given.si != si:
        raise InputError(f"{option}: {name} needs a unit of {si}, and {symbol!r} is one of {given.quantity}")
    return value * given.factor


def _check_words(spec: PressSpec) -> None:
    if spec.physics not in ENGINES:
        raise unknown("physics", spec.physics, ENGINES)
    if spec.mode is not None and spec.mode not in MODES:
        raise unknown("mode", spec.mode, MODES)
    if spec.controller not in {CAUTIOUS, *CONTROLLERS}:
        raise unknown("controller", spec.controller, (CAUTIOUS, *CONTROLLERS))
    if spec.physics == "mujoco":
        mujoco()


def _gains(spec: PressSpec, arm: SerialArm, place: Place) -> Gains:
    if spec.gains is not None:
        gains = load_gains(spec.gains)
        check_arm(gains, spec.arm)
        check_mode(gains, spec.mode)
        _check_sensor(spec, gains.arm.sensor, gains.force_limit)
        check_same_force_max(gains.force_max, spec.force_max)
        return gains
    mode = spec.mode or usual_mode(spec.arm)
    if spec.controller != CAUTIOUS and spec.mode is None:
        mode = "torque"
    loop = loop_of(spec.arm, arm.title, mode, place.mass)
    _check_sensor(spec, loop.sensor, loop.sensor.full_scale)
    force_max = spec.force_max
    if spec.controller == CAUTIOUS and force_max is None:
        force_max = usual_force_max(spec.force, loop.sensor)
    return press_gains(loop, spec.force * (1.0 - spec.probe), force_max)


def _check_sensor(spec: PressSpec, sensor: Sensor, max_force: float) -> None:
    """Refuse a force that noise hides, or that is not below the largest that may be [N]."""
    min_force = SURE * sensor.noise
    lowest = spec.force * (1.0 - spec.probe)
    if not min_force <= lowest:
        raise InputError(
            f"--force {spec.force:g}, lowered by the probe to {lowest:g} N, is below {min_force:g} N, 8 "
            "standard deviations of the sensor's noise; ask for more, or for a smaller --probe"
        )
    if spec.force >= max_force:
        raise InputError(
            f"--force {spec.force:g} N is not below the force limit of {max_force:g} N; ask for less"
        )


def _check_surface(spec: PressSpec, gains: Gains) -> None:
    total = stiffest(spec.surface) + spec.surface.damping / gains.theta
    if total > gains.cap:
        raise InputError(
            f"the surface has K + B/theta = {total:.4g} N/m, and the gains are for at most {gains.cap:.4g} N/m; "
            "press on a softer one, or tune for it"
        )


def _engine_notes(spec: PressSpec, arm: SerialArm) -> list[str]:
    if spec.physics == "mujoco" and arm.scene is not None:
        return [
            "motors and contacts of the model itself are off: torques are the controller's, the surface is --surface"
        ]
    return []
