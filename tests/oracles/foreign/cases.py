"""Kinds of logs on which identification has been confidently wrong, one by one, each with its truth.

    python tests/oracles/foreign/cases.py
    python tests/oracles/foreign/cases.py 1 7b --data FOLDER
    python tests/oracles/foreign/cases.py --markdown

Each trial prints what is answered and OK or WRONG. WRONG is an identified number whose interval misses the truth, a
lag beyond its own bound, a crash, or what the case says besides. With --data the cases
that want measured logs read `mr_damper/ensaio3.mat` and `ensaio10.mat` there. The exit code is 1 if anything is wrong.
With --markdown a table of the wrong answers is printed, and the exit code is 0.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))

from foreign.logs import Cell, Log, Plan, Pressed, written
from foreign.motions import drifting, tracked
from foreign.on_line import streamed
from foreign.recording import Recording
from foreign.scoring import judge_found, record_of
from foreign.surfaces import Surface, touch
from palpate.contact_frame import ContactFrame, identify_contact
from palpate.errors import InputError
from palpate.identification import identify
from palpate.logs import read_log
from palpate.records import Record

Array = NDArray[np.float64]
Shape = Callable[[Array], Array]

_DENSE = 8000.0


@dataclass(frozen=True)
class Trial:
    """One identification of a case.

    Args:
        label: what is different in it.
        ask: returns what is answered; an input error is an answer too.
        judge: what is wrong with an answer, one sentence each.
    """

    label: str
    ask: Callable[[], Any]
    judge: Callable[[Any], list[str]]


@dataclass(frozen=True)
class Case:
    """A kind of log.

    Args:
        number: as it is asked for.
        title: what it is.
        trials: makes them; told the folder of measured logs, or None.
    """

    number: str
    title: str
    trials: Callable[[Path | None], Iterator[Trial]]


@dataclass(frozen=True)
class Press:
    """A press in words of a case.

    Args:
        surface, shape: what is pressed, and the command [m] over time [s].
        recording: how it is written down.
        seconds, span: length, and what of it the log shows.
        told: what `identify` is told.
        bandwidth: of the robot [Hz].
        drift: of the surface's height [m].
    """

    surface: Surface
    shape: Shape
    recording: Recording
    seconds: float = 10.0
    span: tuple[float, float] | None = None
    told: dict[str, Any] = field(default_factory=dict)
    bandwidth: float = 25.0
    drift: float = 0.0

    def log(self, seed: int) -> Log:
        """The log of a seed."""
        rng = np.random.default_rng([seed, 18])
        dt = 1 / (self.recording.rate * np.ceil(_DENSE / self.recording.rate))
        t = np.arange(int(self.seconds / dt)) * dt
        x, v, a = tracked(self.shape(t), self.bandwidth, dt)
        touched = touch(self.surface, x, v, a, dt)
        height = drifting(t, self.drift, rng) if self.drift else np.zeros_like(t)
        plan = Plan(self.surface, "case", self.recording, self.told, float(touched.force.max()))
        pressed = Pressed(dt, x, a, height, touched, self.span or (0.0, self.seconds))
        return written(plan, pressed, rng, Cell(self.surface.name, "case"), seed)

    def trial(self, seed: int, label: str = "", **options: Any) -> Trial:
        """Its log identified."""
        log = self.log(seed)
        told = replace(log, options={**log.options, **options})
        named = f"{label} seed {seed}".strip()
        return Trial(
            named, lambda: identify(record_of(told), **told.options), lambda found: judge_found(told, found)
        )


def kelvin_voigt(k: float, b: float, **elements: float) -> Surface:
    """A surface by its stiffness and damping."""
    return Surface("mass" if "M" in elements else "kelvin-voigt", {"K": k, "B": b, **elements})


def sine(base: float, size: float, frequency: float, start: float = 1.0, air: float = -1e-3) -> Shape:
    """Rest in free motion, a second of approach to a base depth, then a sine about it."""

    def shape(t: Array) -> Array:
        ramp = np.interp(t, [0, start, start + 1], [air, air, base])
        wave = size * np.sin(2 * np.pi * frequency * (t - start - 1.2))
        return ramp + np.where(t > start + 1.2, wave, 0.0)

    return shape


def trapezoids(top: float, rise: float, hold: float, free: float, bottom: float = -1e-3) -> Shape:
    """Ramp and hold, again and again, from the air."""
    period = 2 * rise + hold + free
    marks = [0, free / 2, free / 2 + rise, free / 2 + rise + hold, period - free / 2, period]
    return lambda t: np.interp(t % period, marks, [bottom, bottom, top, top, bottom, bottom])


def broadband(base: float, size: float, highest: float = 12.0, start: float = 1.0) -> Shape:
    """Rest in free motion, approach, then sines up to a frequency."""
    lines = np.geomspace(0.4, highest, 7)

    def shape(t: Array) -> Array:
        ramp = np.interp(t, [0, start, start + 1], [-1e-3, -1e-3, base])
        waves = np.sin(2 * np.pi * lines[:, None] * (t - start - 1.2) + np.arange(7)[:, None] ** 2).sum(0)
        return ramp + np.where(t > start + 1.2, size * waves / 4, 0.0)

    return shape


def moving_surface(data: Path | None) -> Iterator[Trial]:
    """2 Hz of 1.5 mm on a surface that drifts, which the probe follows: 65 Hz, K 470."""
    for seed, drift in enumerate((0.4e-3, 0.7e-3, 1.0e-3)):
        recording = Recording(65.0, 0.03, position_noise=2e-5)
        press = Press(kelvin_voigt(470, 0.4), sine(4e-3, 1.5e-3, 2.0), recording, 25.0, drift=drift)
        yield press.trial(seed, "from the air,")
        yield replace(press, span=(2.5, 25.0)).trial(seed, "in contact,")
        yield replace(press, span=(2.5, 25.0)).trial(seed, "said bonded,", bonded=True)


def relaxing(data: Path | None) -> Iterator[Trial]:
    """Ramp and hold of a relaxing, curved material at 10 Hz."""
    arms = ((300.0, 0.3), (250.0, 2.0), (200.0, 5.0))
    own = Surface("arms", {"K": 300.0, "B": 0.3, "C": 2.5e4, "n": 1.6}, arms)
    for seed, rise in enumerate((0.6, 1.0, 2.0, 4.0)):
        recording = Recording(10.0, 0.01, position_noise=5e-6)
        press = Press(own, trapezoids(5e-3, rise, 8.0, 3.0), recording, 2 * rise + 11.0)
        yield press.trial(seed, f"ramp of {rise:g} s,")


def falling(data: Path | None) -> Iterator[Trial]:
    """The falling branch of a bistable piece, cut out and called bonded: -7.5 kN/m."""
    own = Surface("falling", {"K": -7.5e3, "B": 4.0}, glued=True)
    for seed in range(3):
        shape = sine(-1.5e-3, 0.7e-3, 1.0, air=-1.5e-3)
        recording = Recording(500.0, 0.02, position_noise=2e-6, bias=float(seed))
        yield Press(own, shape, recording, 8.0, (3.0, 8.0), {"bonded": True}).trial(seed)


def single_sine(data: Path | None) -> Iterator[Trial]:
    """One frequency on a hysteretic damper: its harmonics look like a mass."""
    own = Surface("friction", {"K": 1500.0, "B": 600.0, "Fc": 60.0, "x_d": 4e-4}, glued=True)
    for seed in range(2):
        press = Press(own, sine(0.0, 8e-3, 1.0, air=0.0), Recording(1000.0, 0.5), 12.0, (3.0, 12.0))
        yield press.trial(seed, "said bonded,", bonded=True)
        yield press.trial(seed, "not said,")
    for path in sorted(data.glob("mr_damper/*.mat")) if data else []:
        for told in ({"bonded": True}, {}):
            yield Trial(
                f"{path.name} {told or ''}", lambda p=path, o=told: _measured(p, o), _no_mass_of_a_sine
            )


def _measured(path: Path, options: dict[str, Any]) -> Any:
    return identify(read_log(path, time="Tout:s", position="dist:mm", force="forc:N"), **options)


def _no_mass_of_a_sine(found: Any) -> list[str]:
    sure = [n for n in ("K", "M") if n in found.parameters and _is_sure(found.parameters[n])]
    return [f"{n} identified from one frequency" for n in sure]


def _is_sure(parameter: Any) -> bool:
    return str(parameter.verdict) == "identified"


def poor_fit(data: Path | None) -> Iterator[Trial]:
    """A third of the force has nothing to do with the position."""
    for seed in range(4):
        press = Press(
            kelvin_voigt(2000, 8.0), broadband(4e-3, 1.2e-3, 5.0), Recording(500.0, 0.9, colour=0.15), 10.0
        )
        yield press.trial(seed)


def step_in_contact(data: Path | None) -> Iterator[Trial]:
    """One step between two rows while in contact, the lag told."""
    for seed, rate in enumerate((100.0, 250.0, 500.0)):
        into = lambda t: np.where(t < 2.0, -1e-3, 5e-3)  # noqa: E731 - a shape in one line
        told = {"lag": 0.004}
        press = Press(kelvin_voigt(1000, 2.0), into, Recording(rate, 0.4, lag=0.004), 5.0, None, told, 300.0)
        yield press.trial(seed, f"from the air, {rate:g} Hz, with mass,", model="kelvin-voigt-mass")
        shape = lambda t: np.where(t < 2.5, 5e-3, 5.5e-3)  # noqa: E731 - a shape in one line
        recording = Recording(rate, 0.4, lag=0.004)
        told = {"lag": 0.004}
        press = Press(kelvin_voigt(1000, 2.0), shape, recording, 5.0, (1.5, 5.0), told, 300.0)
        yield press.trial(seed, f"{rate:g} Hz,")
        yield press.trial(seed, f"{rate:g} Hz, with mass,", model="kelvin-voigt-mass")


def never_leaves(data: Path | None) -> Iterator[Trial]:
    """The lowest force of a log that never leaves the surface is not free."""
    for seed, n in enumerate((1.3, 1.5, 1.8, 2.0)):
        own = Surface("hunt-crossley", {"C": 3000 * 3e-3 ** (1 - n), "n": n, "D": 0.01})
        press = Press(
            own, broadband(3e-3, 1e-3, 6.0), Recording(500.0, 0.01, position_noise=2e-6), 10.0, (2.5, 10.0)
        )
        yield press.trial(seed, f"n = {n:g},")
        yield press.trial(seed, f"n = {n:g}, named,", model="hunt-crossley")


def cut_from_motion(data: Path | None) -> Iterator[Trial]:
    """A log cut out of the motion of a relaxing surface: its branch is not at rest in the first row."""
    own = Surface("standard-linear", {"K": 1500.0, "B": 1.0}, ((1500.0, 0.5),))
    for seed in range(3):
        recording = Recording(500.0, 0.02, position_noise=2e-6)
        press = Press(own, broadband(4e-3, 1.5e-3, 8.0), recording, 10.0, (3.3 + 0.1 * seed, 10.0))
        yield press.trial(seed)
        yield press.trial(seed, "named,", model="standard-linear-solid")


def inertia_of_a_tool(data: Path | None) -> Iterator[Trial]:
    """The inertia of a tool turns the force negative in free motion."""
    for seed, payload in enumerate((0.5, 1.0, 2.0)):
        shape = lambda t: 6e-3 * np.sin(2 * np.pi * 2.0 * t) - 2e-3  # noqa: E731 - a shape in one line
        recording = Recording(500.0, 0.02, payload=payload, position_noise=2e-6)
        yield Press(kelvin_voigt(2500, 12.0), shape, recording, 8.0).trial(seed, f"{payload:g} kg,")


def no_mass_behind_a_filter(data: Path | None) -> Iterator[Trial]:
    """A mass of 0 is told beside the force's low-pass."""
    for seed in range(6):
        recording = Recording(500.0, 0.02, low_pass=(3, 60.0), position_noise=1e-6)
        told = {"force_filter": "butterworth3:60", "lag": recording.whole_lag, "mass": (0.0, 0.0)}
        yield Press(kelvin_voigt(4000, 25.0), broadband(2e-3, 0.8e-3), recording, 8.0, None, told).trial(seed)


def held_force(data: Path | None) -> Iterator[Trial]:
    """The force at 125 Hz in rows at 500 Hz looks like a mass of K T^2/12."""
    for seed in range(4):
        recording = Recording(500.0, 0.02, hold_force=4, position_noise=1e-6)
        press = Press(kelvin_voigt(20e3, 60.0), broadband(1e-3, 0.4e-3, 15.0), recording, 8.0)
        yield press.trial(seed, "lag not told,")
        yield press.trial(seed, "lag told,", lag=0.0)


def held_at_constant_speed(data: Path | None) -> Iterator[Trial]:
    """Held readings of a ramp at constant speed: no jump stands out."""
    for seed in range(3):
        recording = Recording(500.0, 0.05, hold_force=4 + seed, position_noise=1e-6)
        yield Press(kelvin_voigt(3000, 30.0), trapezoids(4e-3, 1.0, 0.0, 1.0), recording, 12.0).trial(seed)


def friction(data: Path | None) -> Iterator[Trial]:
    """Friction beside a spring: its size, and the damping beside it."""
    for seed in range(4):
        own = Surface("friction", {"K": 3000.0, "B": 15.0, "Fc": 0.8, "x_d": 3e-5})
        press = Press(
            own,
            broadband(4e-3, 1.5e-3, 4.0),
            Recording(500.0, 0.02, position_noise=1e-6),
            10.0,
            None,
            {"lag": 0.0},
        )
        yield press.trial(seed)


def rest_level(data: Path | None) -> Iterator[Trial]:
    """The exponent of a curved surface rests on the level of the free stretch."""
    own = Surface("hunt-crossley", {"C": 3000 * 3e-3**-0.5, "n": 1.5, "D": 0.05})
    for seed in range(4):
        recording = Recording(500.0, 0.05, position_noise=1e-6, bias=0.3)
        yield Press(own, trapezoids(4e-3, 0.8, 0.4, 1.5), recording, 11.0).trial(seed)


def coarse_encoder(data: Path | None) -> Iterator[Trial]:
    """An encoder with a few counts of motion."""
    for seed, counts in enumerate((4, 8, 16, 30)):
        recording = Recording(500.0, 0.02, position_count=2e-3 / counts)
        press = Press(
            kelvin_voigt(3000, 20.0), broadband(3e-3, 0.8e-3, 8.0), recording, 12.0, None, {"lag": 0.0}
        )
        yield press.trial(seed, f"{counts} counts,")


def arm_in_series(data: Path | None) -> Iterator[Trial]:
    """A robot's stiffness is told beside a lag of 4 ms."""
    for seed, lag in enumerate((0.0, 0.004, 0.01)):
        recording = Recording(500.0, 0.02, lag=lag, series=30e3, position_noise=1e-6)
        told = {"lag": lag, "series_stiffness": 30e3}
        press = Press(kelvin_voigt(9000, 60.0), broadband(1.5e-3, 0.6e-3), recording, 10.0, None, told)
        yield press.trial(seed, f"{1e3 * lag:g} ms,")


def lag_not_known(data: Path | None) -> Iterator[Trial]:
    """The same press with another noise: the lag is not told."""
    for seed in range(6):
        recording = Recording(500.0, 0.05, lag=0.006, position_noise=2e-6)
        yield Press(kelvin_voigt(5000, 30.0), broadband(2e-3, 0.8e-3, 8.0), recording, 8.0).trial(seed)


def hardly_a_mass(data: Path | None) -> Iterator[Trial]:
    """A mass that the motion hardly shows: the plainer model is chosen, and its K must hold."""
    for seed in range(6):
        recording = Recording(250.0, 0.05, position_noise=2e-6)
        press = Press(
            kelvin_voigt(3000, 15.0, M=0.6), broadband(3e-3, 1e-3, 4.0), recording, 9.0, None, {"lag": 0.0}
        )
        yield press.trial(seed)


def long_log(data: Path | None) -> Iterator[Trial]:
    """180 presses, in contact more than half of the time; and a log that begins inside a contact."""
    recording = Recording(125.0, 0.03, position_noise=2e-6)
    press = Press(kelvin_voigt(2000, 8.0), trapezoids(3e-3, 0.25, 0.7, 0.4), recording, 180 * 1.6)
    log = press.log(0)

    def counted(log: Log, seen: int) -> Callable[[Any], list[str]]:
        def judge(found: Any) -> list[str]:
            missed = abs(len(found.contacts) - seen) > 0.02 * seen
            faults = [f"{len(found.contacts)} contacts, there are {seen}"] if missed else []
            return faults + judge_found(log, found)

        return judge

    record, space = record_of(log), in_space(record_of(log))
    frame = ContactFrame(wrench_frame="base")
    yield Trial("180 presses, one axis", lambda: identify(record), counted(log, 180))
    yield Trial("180 presses, three axes", lambda: identify_contact(space, frame)[0], counted(log, 180))
    one = Press(kelvin_voigt(2000, 8.0), broadband(4e-3, 1.5e-3, 4.0), recording, 12.0, (3.1, 12.0)).log(1)
    assert one.dense.contact.all()
    yield Trial("begins inside a contact", lambda: identify(record_of(one)), counted(one, 1))


def in_space(record: Record, normal: tuple[float, float, float] = (0.36, -0.48, -0.8)) -> Record:
    """A log of one axis as an arm's: wrench and pose, the force that the surface exerts on the tool."""
    n = np.array(normal)
    place = 0.4 + record["position"][:, None] * n
    force = -record["force"][:, None] * n
    zero, one = np.zeros(len(record)), np.ones(len(record))
    columns = {"time": record["time"]}
    columns |= {f"position_{axis}": place[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"force_{axis}": force[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"torque_{axis}": zero for axis in "xyz"}
    columns |= {f"quaternion_{axis}": zero for axis in "xyz"} | {"quaternion_w": one}
    units = {"t": "s", "p": "m", "f": "N", "to": "N m", "q": "1"}
    return Record(
        columns, {name: units.get(name[:2], units[name[0]]) if name != "time" else "s" for name in columns}
    )


def on_line(data: Path | None) -> Iterator[Trial]:
    """A loop's ticks: some are missing, the probe leaves, chatters, or the sensor is at its end."""
    recording = Recording(1000.0, 0.02, low_pass=(3, 120.0), position_noise=1e-7)
    own = kelvin_voigt(3000, 20.0, M=0.4)
    steady = Press(own, broadband(4e-3, 1.2e-3, 15.0), recording, 10.0, (3.0, 10.0))
    leaving = Press(own, broadband(2e-3, 2.5e-3, 15.0), recording, 10.0, (2.0, 10.0))
    clipped = replace(steady, recording=replace(recording, range=13.0))
    for label, press, missing in (
        ("all ticks there", steady, 0.0),
        ("a twentieth of the ticks missing", steady, 0.05),
        ("contact is lost, touch not told", leaving, 0.0),
        ("the force is at its end", clipped, 0.0),
    ):
        log = press.log(0)
        yield Trial(
            label, lambda g=log, m=missing: streamed(g, m), lambda found, g=log: judge_found(g, found)
        )


def crashes(data: Path | None) -> Iterator[Trial]:
    """What has crashed: an answer or an input error is right."""
    noise = np.random.default_rng(0).normal(size=(2, 3000))
    t = np.arange(3000) / 500.0
    plain = Press(kelvin_voigt(3000, 20.0), broadband(3e-3, 1e-3), Recording(500.0, 0.02), 8.0).log(0)
    record = record_of(plain)
    wild = Record({"time": t, "position": noise[0], "force": noise[1] ** 3}, record.units)
    yields = Surface("plastic", {"Kp": 3000.0, "Fy": 1.0, "H": 10.0, "B": 1.0})
    bent = Press(yields, broadband(3e-3, 4e-3), Recording(500.0, 0.01)).log(0)
    huge = Record({**record.columns, "force": record["force"] * 1e300}, record.units)
    far = Record({**record.columns, "position": record["position"] * 1e300}, record.units)
    told = {"bonded": True, "model": "kelvin-voigt"}
    asks: list[tuple[str, Record, dict[str, Any]]] = [
        ("noise alone", wild, told),
        ("a plastic surface", record_of(bent), told),
        ("a lag that is no number", record, {"lag": float("nan")}),
        ("forces times 1e300", huge, {}),
        ("positions times 1e300", far, {}),
    ]
    for label, asked, options in asks:
        yield Trial(label, lambda r=asked, o=options: identify(r, **o), _anything)


def _anything(found: Any) -> list[str]:
    """An answer at all is right."""
    return []


def wrong_payload(data: Path | None) -> Iterator[Trial]:
    """A tool's inertia was taken out with the wrong sign."""
    for seed, payload in enumerate((-0.3, -0.6, -1.2)):
        recording = Recording(500.0, 0.02, payload=payload, position_noise=2e-6)
        press = Press(kelvin_voigt(4000, 50.0), broadband(3e-3, 0.8e-3, 10.0), recording, 9.0)
        yield press.trial(seed, f"{payload:g} kg, lag not told,")
        yield press.trial(seed, f"{payload:g} kg, lag told,", lag=0.0)


CASES = (
    Case("1", "moving surface, dithered", moving_surface),
    Case("2", "ramp and hold of a relaxing, curved material", relaxing),
    Case("3", "falling branch, cut out", falling),
    Case("4", "single frequency with hysteresis", single_sine),
    Case("5", "poor fit", poor_fit),
    Case("6", "step made while in contact", step_in_contact),
    Case("7a", "never leaves a curved surface", never_leaves),
    Case("7b", "cut out of the motion of a relaxing surface", cut_from_motion),
    Case("7c", "a tool's inertia in free motion", inertia_of_a_tool),
    Case("8", "no mass behind a force filter", no_mass_behind_a_filter),
    Case("9a", "held force", held_force),
    Case("9b", "held force at constant speed", held_at_constant_speed),
    Case("10a", "friction", friction),
    Case("10b", "rest level of a curved surface", rest_level),
    Case("11", "coarse encoder", coarse_encoder),
    Case("12", "robot stiffness and a lag", arm_in_series),
    Case("13", "lag not known, another noise", lag_not_known),
    Case("14", "a mass that hardly shows", hardly_a_mass),
    Case("15", "many presses; begins inside a contact", long_log),
    Case("16", "on line", on_line),
    Case("17", "what has crashed", crashes),
    Case("18", "payload of the wrong sign", wrong_payload),
)


def outcome(trial: Trial) -> tuple[str, list[str]]:
    """What a trial answers, in a line, and what is wrong with it."""
    try:
        found = trial.ask()
    except InputError as error:
        return f"input error: {str(error)[:90]}", []
    except Exception as error:  # noqa: BLE001 - a crash is what is looked for
        return "", [f"crash: {type(error).__name__}: {str(error)[:80]}"]
    return said(found), trial.judge(found)


def said(found: Any) -> str:
    """An answer in a line: identified parameters, working point, lag, contacts."""
    sure = [
        f"{name} {p.value:.4g} ({p.ci95[0]:.4g} .. {p.ci95[1]:.4g})"
        for name, p in found.parameters.items()
        if _is_sure(p) and p.value is not None and p.ci95
    ]
    point = getattr(getattr(found, "working_point", None), "stiffness", None)
    if point is not None and point.value is not None:
        sure.append(f"working point {point.value:.4g}")
    value = getattr(found.lag, "value", None) if not isinstance(found.lag, tuple) else found.lag[0]
    lag = f"; lag {1e3 * value:.3g} ms" if value else ""
    return f"{found.model}: {', '.join(sure) or 'nothing identified'}{lag}; {len(found.contacts)} contacts"


def told_of(case: Case, data: Path | None) -> Iterator[tuple[str, str, list[str]]]:
    """Label, answer and faults of each trial of a case."""
    for trial in case.trials(data):
        answer, faults = outcome(trial)
        yield trial.label, answer, faults


def print_table(cases: list[Case], data: Path | None) -> None:
    """Print a row for each case with a wrong answer, and the count of the others."""
    print("| case | logs | right | wrong |", "|---|---|---|---|", sep="\n")
    right, logs = 0, 0
    for case in cases:
        answers = list(told_of(case, data))
        wrong = [f"{label}: {', '.join(faults)}" for label, _, faults in answers if faults]
        if wrong:
            row = f"{case.number} {case.title} | {len(answers)} | {len(answers) - len(wrong)} | {'; '.join(wrong)}"
            print(f"| {row} |", flush=True)
        else:
            right, logs = right + 1, logs + len(answers)
    print(f"| the {right} others | {logs} | {logs} | |")


def main() -> None:
    """Print the cases asked for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(case.number for case in CASES))
    parser.add_argument("--data", type=Path, help="folder of measured logs")
    parser.add_argument("--markdown", action="store_true", help="print a table as a document has it")
    asked = parser.parse_args()
    if unknown := set(asked.cases) - {case.number for case in CASES}:
        parser.error(f"no case {', '.join(sorted(unknown))}; there are: {', '.join(c.number for c in CASES)}")
    chosen = [case for case in CASES if not asked.cases or case.number in asked.cases]
    if asked.markdown:
        print_table(chosen, asked.data)
        return
    wrong = []
    for case in chosen:
        print(f"\n{case.number}  {case.title}")
        bad = 0
        for label, answer, faults in told_of(case, asked.data):
            bad += bool(faults)
            said_of = "; ".join([answer, *faults])
            print(f"  {'WRONG' if faults else 'OK   '} {label}: {said_of}", flush=True)
        wrong += [case.number] if bad else []
    print(f"\n{len(chosen) - len(wrong)} cases right; wrong: {', '.join(wrong) or 'none'}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
