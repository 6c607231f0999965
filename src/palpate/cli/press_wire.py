"""`palpate press-wire`: press with a real arm, over its wire."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from palpate.cli import _interrupts
from palpate.cli._program import command
from palpate.cli._terminal import print_json, print_lines, say
from palpate.cli._values import vector
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.force import ForceLoop
    from palpate.wires import Air, Limits, Outcome, Task

_FLAG = Parameter(negative=())
_NUMBER = Parameter(allow_leading_hyphen=True)
_WORD = "press"
_SI = {"force": "N", "velocity": "m/s", "length": "m", "time": "s"}


# More than seven arguments: the flags of the command.
def press_wire(
    *,
    wire: str | None = None,
    gains: Path | None = None,
    force: Annotated[str | None, _NUMBER] = None,
    direction: Annotated[str | None, _NUMBER] = None,
    force_limit: Annotated[str | None, _NUMBER] = None,
    speed_limit: Annotated[str | None, _NUMBER] = None,
    travel_limit: Annotated[str | None, _NUMBER] = None,
    time_limit: Annotated[str | None, _NUMBER] = None,
    hold: Annotated[str, _NUMBER] = "2:s",
    retreat: Annotated[str, _NUMBER] = "2:mm",
    certificate: Path | None = None,
    record: Path | None = None,
    dry_run: Annotated[bool, _FLAG] = False,
    yes: Annotated[bool, _FLAG] = False,
    ordinary_priority: Annotated[bool, _FLAG] = False,
    recover: Path | None = None,
    json: Annotated[bool, _FLAG] = False,
) -> int:
    """Press with a real arm, over its wire, with the force loop that palpate tune gave.

    First look, with --dry-run: the arm is only read, and it is said what would be done:

    palpate press-wire --dry-run --wire sim:127.0.0.1:4000 --gains gains.toml --force 20:N --direction 0,0,-1
    --force-limit 40:N --speed-limit 20:mm/s --travel-limit 10:mm --time-limit 20:s

    Then the same without --dry-run moves the arm, after it has asked. Keep a hand on the emergency stop. Nothing of
    this was tried on hardware. The arm stops at each limit, on lost or late readings, and on Ctrl-C. Exit code 1 says
    that the press ended before it was done.

    Parameters
    ----------
    wire
        The arm: rtde:ADDRESS of a UR, sim:HOST:PORT of a simulated one, or ros2:DOMAIN?wrench=TOPIC&pose=TOPIC&
        command=TOPIC&as=twist&wrench-frame=tool&force-sign=action, as one word. There is no default.
    gains
        What palpate tune wrote for this arm.
    force
        To press with, as 20:N.
    direction
        Into the surface, x,y,z in the base's axes.
    force_limit
        Force of any axis at which the arm stops, as 40:N.
    speed_limit
        Speed that is never commanded, and at whose double the arm stops, as 20:mm/s.
    travel_limit
        Way from the start at which the arm stops, as 10:mm.
    time_limit
        Of all, as 20:s.
    hold
        How long to press from the touch on.
    retreat
        Way back afterwards.
    certificate
        What palpate certify wrote; without it the lateness is measured, and nothing is proved.
    record
        Folder for everything that was read and commanded; palpate identify takes its record.parquet.
    dry_run
        Read the arm, say what would be done, and end.
    yes
        Do not ask; for scripts.
    ordinary_priority
        Ask the system for no real-time priority.
    recover
        Make the record of a press that was killed, from the folder of its --record, and end.
    json
        Print one JSON object and nothing else; needs --yes or --dry-run.
    """
    if recover is not None:
        from palpate.wires import recover as recovered

        print_lines(f"written: {recovered(recover)}")
        return 0
    loop, task, limits = _told(gains, certificate, force, direction, force_limit, speed_limit, travel_limit, time_limit,
                               hold, retreat)  # fmt: skip
    if wire is None:
        raise InputError("--wire says which arm, as sim:127.0.0.1:4000; there is no default")
    if json and not (yes or dry_run):
        raise InputError("--json asks nothing, so it needs --yes or --dry-run")
    from palpate.wires import Rows, look, open_wire

    if record is not None and record.exists():
        raise InputError(f"{record} exists; choose another place for --record")
    arm = open_wire(wire)
    try:
        plan = _plan(arm, loop, task, limits, record)
        if not json:
            print_lines(*plan)
        if dry_run:
            return _looked(look(arm, loop, task, limits), plan, json)
        _ask(yes)
        about = {
            "command": command(),
            "title": arm.title,
            "direction": list(task.direction),
            "desired_N": task.force,
        }
        most = int(1.2 * limits.seconds * loop.gains.arm.rate) + 1000
        rows = Rows(record, most, about)
        outcome, words = _pressed(arm, loop, task, limits, rows, ordinary_priority)
    finally:
        arm.close()
    where = rows.finish(outcome.to_json() | {"priority": words})
    return _print(outcome, words, where, json)


def _pressed(
    arm: Any, loop: ForceLoop, task: Task, limits: Limits, rows: Any, ordinary: bool
) -> tuple[Outcome, str]:
    from palpate.wires import press
    from palpate.wires.realtime import hurried

    try:
        with _interrupts.noticed() as came, hurried(not ordinary) as words:
            return press(arm, loop, task, limits, rows, came), words
    except BaseException as error:
        if rows.count or rows.folder is not None:
            rows.finish({"ended": str(error) or type(error).__name__, "ok": False})
        raise


# More than seven arguments: the flags of the command.
def _told(
    gains: Path | None, certificate: Path | None, force: str | None, direction: str | None, force_limit: str | None,
    speed_limit: str | None, travel_limit: str | None, time_limit: str | None, hold: str, retreat: str,
) -> tuple[ForceLoop, Task, Limits]:  # fmt: skip
    """What was asked; every limit has to be said."""
    needed = {
        "--gains": gains, "--force": force, "--direction": direction, "--force-limit": force_limit,
        "--speed-limit": speed_limit, "--travel-limit": travel_limit, "--time-limit": time_limit,
    }  # fmt: skip
    lacking = [name for name, value in needed.items() if value is None]
    if lacking:
        raise InputError(f"a press with a real arm needs {', '.join(lacking)}; none of them has a default")
    from palpate.force import ForceLoop
    from palpate.wires import Limits, Task, checked

    limits = Limits(
        _amount("--force-limit", str(force_limit), "force"),
        _amount("--speed-limit", str(speed_limit), "velocity"),
        _amount("--travel-limit", str(travel_limit), "length"),
        _amount("--time-limit", str(time_limit), "time"),
    )
    way = vector("direction", direction, "number")
    assert way is not None
    assert gains is not None
    task = Task(
        _amount("--force", str(force), "force"),
        way,
        _amount("--hold", hold, "time"),
        _amount("--retreat", retreat, "length"),
    )
    loop = ForceLoop.load(gains, certificate)
    return loop, checked(task, limits, loop), limits


def _amount(option: str, text: str, kind: str) -> float:
    """`NUMBER` or `NUMBER:UNIT` in SI."""
    from math import isfinite

    from palpate.units import unit

    number, _, symbol = text.partition(":")
    own = unit(symbol or _SI[kind])
    try:
        value = float(number)
    except ValueError:
        value = float("nan")
    if not isfinite(value) or own.quantity != kind:
        raise InputError(f"{option} needs a {kind} as NUMBER:UNIT, such as 20:{_SI[kind]}, got {text!r}")
    return value * own.factor


def _plan(arm: Any, loop: ForceLoop, task: Task, limits: Limits, record: Path | None) -> list[str]:
    gains = loop.gains
    x, y, z = task.direction
    last = 1e3 * (gains.theta + gains.arm.tick)
    does = (
        f"rests 0.5 s in the air and tares, approaches along ({x:.3g}, {y:.3g}, {z:.3g}) of the base at"
        f" {1e3 * gains.approach:.3g} mm/s at most, presses with {task.force:g} N for {task.hold:g} s, goes back"
        f" {1e3 * task.retreat:g} mm, rests"
    )
    stops = (
        f"stops at {limits.force:g} N, {1e3 * limits.speed:g} mm/s, {1e3 * limits.travel:g} mm from here, after"
        f" {limits.seconds:g} s, on Ctrl-C, and {last:.3g} ms after the last reading at the latest"
    )
    kept = f"record: {record}" if record is not None else "no record is kept (--record DIR keeps one)"
    arms = f"arm: {arm.title}; gains for {gains.arm.title}"
    return [arms, does, stops, f"if this process dies: {arm.watchdog}", kept]


def _ask(yes: bool) -> None:
    if yes:
        return
    if not sys.stdin.isatty():
        raise InputError(
            "the arm would move, and nobody can be asked here; look with --dry-run first, then add --yes"
        )
    say(f"the arm will move; type {_WORD} to go on")
    if sys.stdin.readline().strip() != _WORD:
        raise InputError("nothing was moved, as nobody said so")


def _looked(air: Air, plan: list[str], json: bool) -> int:
    found = f"in the air: bias {', '.join(f'{b:.3g}' for b in air.bias)} N, noise {air.noise:.2g} N, {air.rate:.4g} Hz"
    if json:
        print_json({"plan": plan, "bias_N": air.bias.tolist(), "noise_N": air.noise, "rate_Hz": air.rate})
    else:
        print_lines(found, "dry run: nothing was moved")
    return 0


def _print(outcome: Outcome, words: str, where: Path | None, json: bool) -> int:
    if json:
        print_json(outcome.to_json() | {"priority": words, "record": None if where is None else str(where)})
        return 0 if outcome.ok else 1
    lines = [f"ended: {outcome.ended}; the arm rests"]
    if outcome.force is not None:
        settled = (
            f"within 5 % after {outcome.settled:.2g} s" if outcome.settled is not None else "never within 5 %"
        )
        lines.append(f"force {outcome.force:.4g} N, {settled}")
    if outcome.stiffness is not None:
        value, std = outcome.stiffness
        lines.append(f"stiffness as the arm feels it {value:.4g} N/m (std {std:.2g})")
    lines += [*outcome.lateness.told(), words]
    if where is not None:
        lines.append(f"written: {where}; palpate identify {where} reads it")
    print_lines(*lines)
    return 0 if outcome.ok else 1
