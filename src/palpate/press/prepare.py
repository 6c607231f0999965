"""From what was typed to an arm, a surface and gains."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.arrays import Array
from palpate.contact_frame.load import Payload
from palpate.environments.kelvin_voigt import KelvinVoigt
from palpate.errors import InputError, unknown
from palpate.force.arm import Sensor
from palpate.force.force_loop import ForceLoop
from palpate.force.gains import Gains, load_gains
from palpate.press import sequence
from palpate.press.by_torque import CONTROLLERS, ByTorque
from palpate.press.engines import ENGINES, MODES, check_mode, loop_of, mass_note, press_gains, usual_mode
from palpate.press.pressing import Asked, Progress, press
from palpate.press.sequence import SURE, Plan
from palpate.press.setting import GAP, Place, cell_of, check_able, held_tool, place_of, with_tool
from palpate.press.simulated_arm import SimulatedArm
from palpate.records import Record
from palpate.robots.serial.from_toml import names
from palpate.robots.serial.loading import mujoco
from palpate.robots.serial.serial_arm import SerialArm

CAUTIOUS = "cautious"
_UNITS = {"K": "N/m", "B": "N s/m", "M": "kg"}


@dataclass(frozen=True)
class Question:
    """The request as typed, but in SI.

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
        seconds: from the touch on [s].
        probe: share of the force.
        seed: of the noise.
        payload: of `palpate payload`: the arm carries this tool, and its sensor shows what that one did.
    """

    arm: str
    force: float
    surface: KelvinVoigt
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


@dataclass(frozen=True)
class Pressing:
    """A press that is ready to run.

    Args:
        asked: with what, for the record.
        plan: what is asked for.
    """

    asked: Asked
    plan: Plan

    def run(self, progress: Progress | None = None) -> Record:
        """Runs it; the record says itself what it is of."""
        asked = self.asked
        loop = asked.gains.arm
        cell = cell_of(asked.arm, asked.place, asked.surface, loop, held_tool(asked.payload))
        arm, resting = (
            SimulatedArm(asked.arm, loop, asked.place, cell, asked.physics, asked.seed) for _ in range(2)
        )
        if asked.payload is not None:
            arm.tare()
            most = self.plan.force + SURE * loop.sensor.noise
            sequence.check_range(abs(arm.zero), most, loop.sensor.full_scale)
        gains = fit_gains(asked.gains, resting.at_rest(), self.plan)
        driver = _driver(asked, arm, gains, self.plan.force)
        record = press(arm, driver, asked.place, self.plan, progress)
        meta = {**record.meta, **asked.meta(record), "tare_N": arm.zero}
        return Record(record.columns, record.units, meta)


def _driver(asked: Asked, arm: SimulatedArm, gains: Gains, force: float) -> sequence.PressDriver:
    """The driver of the controller asked for.

    Raises:
        InputError: no such controller; one of torques on an arm of positions.
    """
    name, place = asked.controller, asked.place
    if name == CAUTIOUS:
        return sequence.CautiousDriver(arm, ForceLoop(gains), place.normal)
    if gains.arm.kind != "torque":
        raise InputError(f"--controller {name} gives torques, and the arm takes positions; add --mode torque")
    return ByTorque(arm, place, name, gains.approach, 8.0 * gains.arm.sensor.noise, force)


def fit_gains(gains: Gains, shown: Array, plan: Plan) -> Gains:
    """The gains for the noise of an arm at rest.

    Args:
        gains: as they were tuned.
        shown: by the sensor in each tick at rest [N], shape (n,).
        plan: of the press.

    Raises:
        InputError: a drift, or a noise, with which there is no press.
    """
    noise, drift, std = sequence.noise_and_drift(
        gains.arm.tick * np.arange(len(shown), dtype=np.float64), shown
    )
    sequence.check_drift(drift, std, plan.force, plan.longest + plan.seconds, gains.arm.sensor)
    return sequence.fitting(gains, noise, len(shown)) or gains


def prepare_press(question: Question) -> Pressing:
    """Everything checked, nothing run.

    Raises:
        InputError: whatever of it cannot be, in one line.
    """
    _check_words(question)
    Plan(question.force, question.seconds, question.probe)
    arm = _load(question, arm_of(question.arm, question.site))
    place = place_of(arm, _array(question.at), _array(question.normal))
    gains = _gains(question, arm, place)
    _check_surface(question, gains)
    notes = check_able(arm, place, gains.approach, question.force)
    massless = mass_note(gains, place.mass)
    notes = [*arm.notes, *notes, *([massless] if massless else []), *_engine_notes(question, arm)]
    asked = Asked(
        arm=arm, gains=gains, place=place, surface=question.surface, controller=question.controller,
        physics=question.physics, seed=question.seed, payload=question.payload, notes=tuple(notes),
    )  # fmt: skip
    return Pressing(
        asked, sequence.plan_for(question.force, question.seconds, question.probe, GAP, gains.approach)
    )


def _load(question: Question, arm: SerialArm) -> SerialArm:
    """The arm with its tool, if there is one."""
    if question.payload is None:
        return arm
    if question.physics == "mujoco" and arm.scene is not None:
        raise InputError(
            f"{question.arm} is MuJoCo's own model, in which --payload hangs nothing; give the tool a body there, or"
            " leave --physics out"
        )
    return with_tool(arm, question.payload)


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


def surface_of(text: str) -> KelvinVoigt:
    """`K=5000,B=50`, and M=0.1 if it has a mass, in SI.

    Raises:
        InputError: another text, a number out of range.
    """
    found: dict[str, float] = {}
    for part in text.split(","):
        name, sign, number = (word.strip() for word in part.partition("="))
        if name not in _UNITS or not sign:
            raise InputError(
                f"--surface needs K=..,B=.. in N/m and N s/m (and M=.. in kg), as K=5000,B=50; got {text!r}"
            )
        if name in found:
            raise InputError(f"--surface has {name} twice: {text!r}")
        found[name] = _number(name, number)
    if "K" not in found:
        raise InputError(f"--surface needs a stiffness, as K=5000; got {text!r}")
    try:
        return KelvinVoigt(found["K"], found.get("B", 0.0), found.get("M", 0.0))
    except InputError as error:
        raise InputError(f"--surface: {error}") from None


def _number(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"--surface: {name} needs a number in {_UNITS[name]}, got {text!r}")
    return value


def _check_words(question: Question) -> None:
    if question.physics not in ENGINES:
        raise unknown("physics", question.physics, ENGINES)
    if question.mode is not None and question.mode not in MODES:
        raise unknown("mode", question.mode, MODES)
    if question.controller not in {CAUTIOUS, *CONTROLLERS}:
        raise unknown("controller", question.controller, (CAUTIOUS, *CONTROLLERS))
    if question.physics == "mujoco":
        mujoco()


def _gains(question: Question, arm: SerialArm, place: Place) -> Gains:
    if question.gains is not None:
        gains = load_gains(question.gains)
        check_mode(gains, question.mode)
        _check_sensor(question, gains.arm.sensor, gains.force_limit)
        return gains
    mode = question.mode or usual_mode(question.arm)
    if question.controller != CAUTIOUS and question.mode is None:
        mode = "torque"
    loop = loop_of(question.arm, arm.title, mode, place.mass)
    _check_sensor(question, loop.sensor, loop.sensor.full_scale)
    return press_gains(loop, question.force * (1.0 - question.probe))


def _check_sensor(question: Question, sensor: Sensor, most: float) -> None:
    """Refuse a force that noise hides, or that is not below the largest that may be [N]."""
    least = SURE * sensor.noise
    lowest = question.force * (1.0 - question.probe)
    if not least <= lowest:
        raise InputError(
            f"--force {question.force:g}, lowered by the probe to {lowest:g} N, is below {least:g} N, 8 "
            "standard deviations of the sensor's noise; ask for more, or for a smaller --probe"
        )
    if question.force >= most:
        raise InputError(
            f"--force {question.force:g} N is not below the force limit of {most:g} N; ask for less"
        )


def _check_surface(question: Question, gains: Gains) -> None:
    total = question.surface.stiffness + question.surface.damping / gains.theta
    if total > gains.cap:
        raise InputError(
            f"the surface has K + B/theta = {total:.4g} N/m, and the gains are for at most {gains.cap:.4g} N/m; "
            "press on a softer one, or tune for it"
        )


def _engine_notes(question: Question, arm: SerialArm) -> list[str]:
    if question.physics == "mujoco" and arm.scene is not None:
        return [
            "motors and contacts of the model itself are off: torques are the controller's, the surface is --surface"
        ]
    return []


def _array(values: tuple[float, float, float] | None) -> Array | None:
    return None if values is None else np.array(values)
