"""The part of `palpate press` that moves a real arm, over its wire."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli import _interrupts
from palpate.cli._answer import print_answer
from palpate.cli._program import command
from palpate.cli._terminal import print_lines, say
from palpate.cli.options.press import AskOptions, LimitOptions, WireOptions, task_of
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.contact_frame import Payload
    from palpate.wires import AtRest, Order, Outcome, Rows, Wire

_WORD = "press"


def press_over(asked: AskOptions, options: WireOptions, limits: LimitOptions, *, json: bool) -> int:
    """Press with a real arm, or only read it.

    Returns:
        0 if it pressed for the requested time, 1 if not.

    Raises:
        InputError: a fault found before the arm moves.
    """
    task, most = task_of(asked, options, limits)
    if json and not (options.yes or options.dry_run):
        raise InputError("--json cannot ask for confirmation; add --yes or --dry-run")
    if options.record is not None and options.record.exists():
        raise InputError(f"{options.record} exists; choose another place for --record")
    from palpate.force import ForceLoop
    from palpate.wires import Rows, checked, look, open_wire
    from palpate.wires.tool import notes_on

    assert asked.gains is not None
    order = checked(ForceLoop.load(asked.gains, options.certificate), task, most)
    tool = asked.tool
    arm = open_wire(str(options.wire))
    try:
        plan = _plan(arm, order, options.record)
        if not json:
            print_lines(*plan)
        if options.dry_run or tool is not None:
            air = look(arm, order)
            notes = [] if tool is None else notes_on(tool, air)
            if options.dry_run:
                return _looked(air, [*plan, *notes], notes, json)
            if not json:
                print_lines(*notes)
        _ask(options.yes)
        rows = Rows(options.record, order.most, _about(arm, order, tool))
        outcome, words = _pressed(arm, order, rows, options.ordinary_priority)
    finally:
        arm.close()
    where = rows.finish(outcome.to_json() | {"priority": words})
    return _print(outcome, words, where, json)


def _about(arm: Wire, order: Order, tool: Payload | None) -> dict[str, Any]:
    """The press, as plain values for the record."""
    task = order.task
    return {
        "command": command(),
        "title": arm.title,
        "normal": list(task.direction),
        "desired_N": task.force,
        **({} if tool is None else tool.meta),
    }


def _pressed(arm: Wire, order: Order, rows: Rows, ordinary: bool) -> tuple[Outcome, str]:
    from palpate.wires import press
    from palpate.wires.realtime import hurried

    try:
        with _interrupts.noticed() as came, hurried(not ordinary) as words:
            return press(arm, order, rows, came), words
    except BaseException as error:
        if rows.count or rows.folder is not None:
            rows.finish({"ended": str(error) or type(error).__name__, "ok": False})
        raise


def _plan(arm: Wire, order: Order, record: Path | None) -> list[str]:
    from palpate.press.loops import mass_note

    task, limits, gains = order.task, order.limits, order.loop.gains
    x, y, z = task.direction
    lowered = f" (lowered by {100.0 * task.probe:g} % three times)" if task.probe else ""
    last = 1e3 * (gains.theta + gains.arm.tick)
    does = (
        f"rests 0.5 s in the air and tares, approaches along ({x:.3g}, {y:.3g}, {z:.3g}) of the base at"
        f" {1e3 * gains.approach:.3g} mm/s at most, presses with {task.force:g} N for {task.hold:g} s{lowered}, goes"
        f" back {1e3 * task.retreat:g} mm, rests"
    )
    stops = (
        f"stops at {limits.force:g} N, {1e3 * limits.speed:g} mm/s, {1e3 * limits.travel:g} mm from here, after"
        f" {limits.seconds:g} s, on Ctrl-C, and {last:.3g} ms after the last reading at the latest"
    )
    kept = f"record: {record}" if record is not None else "no record is kept (--record DIR keeps one)"
    arms = f"arm: {arm.title}; gains for {gains.arm.title}"
    massless = mass_note(gains)
    notes = [] if massless is None else [f"note: {massless}"]
    return [arms, does, stops, f"if this process dies: {arm.watchdog}", kept, *notes]


def _ask(yes: bool) -> None:
    if yes:
        return
    if not sys.stdin.isatty():
        raise InputError(
            "the arm would move, and there is no terminal to ask for confirmation; use --dry-run first, then add --yes"
        )
    say(f"the arm will move; type {_WORD} to go on")
    if sys.stdin.readline().strip() != _WORD:
        raise InputError("not confirmed; nothing was moved")


def _looked(air: AtRest, plan: list[str], notes: list[str], json: bool) -> int:
    bias = ", ".join(f"{b + 0.0:.3g}" for b in air.bias.round(4))
    found = f"in the air: bias {bias} N, noise {air.noise:.2g} N, {air.rate:.4g} Hz"
    if json:
        print_answer({"plan": plan, "bias_N": air.bias.tolist(), "noise_N": air.noise, "rate_Hz": air.rate})
    else:
        print_lines(found, *notes, "dry run: nothing was moved")
    return 0


def _print(outcome: Outcome, words: str, where: Path | None, json: bool) -> int:
    if json:
        print_answer(outcome.to_json() | {"priority": words, "record": None if where is None else str(where)})
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
    lines += [*outcome.lateness.sentences(), words]
    if where is not None:
        lines.append(f"written: {where}; palpate identify {where} reads it")
    print_lines(*lines)
    return 0 if outcome.ok else 1
