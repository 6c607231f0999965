"""`palpate press --wire` and `palpate slide --wire`: a real arm moves."""

from __future__ import annotations

import sys
import threading
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from palpate.cli import _streams
from palpate.cli.options.common import PluginOptions
from palpate.cli.options.press import AskOptions, LimitOptions, WireOptions
from palpate.cli.options.values import si
from palpate.cli.toolkit import command, print_answer, print_lines, say
from palpate.errors import InputError
from palpate.force import ForceLoop
from palpate.force.ceiling import check_same_force_max, reading_error
from palpate.force.expected import press_time
from palpate.force.sliding.slide_domain import start_time
from palpate.press.engines import mass_note
from palpate.press.free_stroke import MAX_STROKE, subtraction_notes
from palpate.wires.at_rest import AtRest, check_at_rest, retune_for_noise, tool_notes
from palpate.wires.opening import open_wire, wire_class_name
from palpate.wires.order import (
    STROKE_FRACTION,
    Order,
    PressLimits,
    PressTask,
    check_order,
    safe_travel,
    stiffest_contact,
)
from palpate.wires.order import Path as SlidePath
from palpate.wires.outcome import Outcome, Rows, recover
from palpate.wires.pressing import press
from palpate.wires.realtime import realtime_priority
from palpate.wires.wire import Wire

if TYPE_CHECKING:
    from palpate.contact_frame.payload import Payload
    from palpate.force.gains import Gains

RETREAT = 0.002
"""Distance of the retreat if none is given [m]."""


def press_over(
    request: AskOptions,
    options: WireOptions,
    limits: LimitOptions,
    *,
    json: bool,
    path: SlidePath | None = None,
) -> int:
    """Press with a real arm, or slide with it along a path, or only read it, or recover a record.

    Returns:
        0 if it pressed for the requested time, 1 if not, 128 and the number of a signal that ended it.

    Raises:
        InputError: a fault found before the arm moves.
    """
    if options.recover is not None:
        print_lines(f"written: {recover(options.recover)}")
        return 0
    task, press_limits = press_task(request, options, limits)
    if json and not (options.yes or options.dry_run):
        raise InputError("--json cannot ask for confirmation; add --yes or --dry-run")
    if options.record is not None and options.record.exists():
        raise InputError(f"{options.record} exists; choose another place for --record")
    assert request.gains is not None
    loop = ForceLoop.load(request.gains, options.certificate)
    check_same_force_max(loop.gains.force_max, si(request.force_max))
    if path is not None:
        if si(options.free_stroke):
            raise InputError("--free-stroke is for a press; leave it out, or give 0")
        task = replace(task, path=path, free_stroke=0.0)
    order = check_order(loop, task, press_limits)
    tool = request.tool
    with PluginOptions().consent(given=wire_class_name(str(options.wire))[0] or ""):
        arm = open_wire(str(options.wire))
    try:
        plan = _describe_plan(arm, order, options.record)
        if not json:
            print_lines(*plan)
        if options.dry_run or tool is not None:
            rest = check_at_rest(arm, order)
            _, note = retune_for_noise(rest, order)
            notes = [*([] if note is None else [note]), *([] if tool is None else tool_notes(tool, rest))]
            if options.dry_run:
                return _print_dry_run(rest, [*plan, *notes], notes, json)
            if not json:
                print_lines(*notes)
        _confirm(options.yes, "press" if path is None else "slide")
        return _press_and_print(arm, order, options, _record_header(arm, order, tool), json)
    finally:
        arm.close()


def press_task(request: AskOptions, wire: WireOptions, limits: LimitOptions) -> tuple[PressTask, PressLimits]:
    """The task of a real arm; the direction and every limit have to be given.

    Raises:
        InputError: one is missing or invalid.
    """
    from palpate.force.gains import load_gains

    needed = {
        "--wire": wire.wire,
        "--gains": request.gains,
        "--force": request.force,
        "--normal": request.normal,
        "--force-limit": limits.force_limit,
        "--speed-limit": limits.speed_limit,
        "--time-limit": limits.time_limit,
    }
    lacking = [name for name, value in needed.items() if value is None]
    normal = request.normal
    if not (normal and limits.force_limit and limits.speed_limit and limits.time_limit and not lacking):
        raise InputError(f"a press with a real arm needs {', '.join(lacking)}; none of them has a default")
    force = limits.force_limit.si
    if limits.travel_limit is None:
        travel = safe_travel(load_gains(Path(str(request.gains))), force)
    else:
        travel = limits.travel_limit.si
    retreat = min(RETREAT, travel) if wire.retreat is None else wire.retreat.si
    usual = min(MAX_STROKE, STROKE_FRACTION * travel)
    stroke = usual if wire.free_stroke is None else wire.free_stroke.si
    press_limits = PressLimits(force, limits.speed_limit.si, travel, limits.time_limit.si)
    task = PressTask(
        request.desired_force,
        normal.si,
        request.seconds,
        retreat,
        request.probe or 0.0,
        None,
        request.end,
        stroke,
    )
    return task, press_limits


def _record_header(arm: Wire, order: Order, tool: Payload | None) -> dict[str, Any]:
    """Header of the record, as plain values."""
    task = order.task
    return {
        "command": command(),
        "title": arm.title,
        "normal": list(task.direction),
        "desired_N": task.force,
        "hold_s": task.hold,
        "path": task.path and task.path.name,
        "probe": task.probe,
        "theta_s": order.loop.gains.theta,
        # The encoders of a servo show how it gives way, so that nothing is in series with the surface.
        "position_from": "tip" if order.loop.gains.arm.kind == "servo" else "joints",
        **({} if tool is None else tool.meta),
    }


def _press_and_print(arm: Wire, order: Order, options: WireOptions, about: dict[str, Any], json: bool) -> int:
    """Press, keep the record and print the outcome, whatever signal comes; returns the exit code."""
    with _streams.notice_signals() as signals:
        outcome, words, where = _write_record(arm, order, options, about, signals)
        try:
            code = _print_outcome(outcome, words, where, json)
        except OSError:  # nobody reads any more: a terminal that hung up
            if not signals():
                raise
            _streams.drop(sys.stdout)
    return signals.code if signals() else code


def _write_record(
    arm: Wire, order: Order, options: WireOptions, about: dict[str, Any], signals: _streams.Noticed
) -> tuple[Outcome, str, Path | None]:
    """The outcome, the priority that was given, and where the record is; its rows are kept whatever happens."""
    rows = Rows(options.record, order.most, about)
    try:
        with realtime_priority(not options.ordinary_priority) as words:
            outcome = press(arm, order, rows, lambda: signals.reason, _start_printer().put)
    except BaseException as error:
        if rows.count or rows.folder is not None:
            rows.finish({"ended": str(error) or type(error).__name__, "ok": False})
        raise
    arm.close()
    return outcome, words, rows.finish(outcome.to_json() | {"priority": words})


def _start_printer() -> SimpleQueue[str]:
    """A queue of sentences for standard error, printed by a thread of its own, as a terminal may block."""
    sentences: SimpleQueue[str] = SimpleQueue()

    def run() -> None:
        with suppress(OSError, ValueError):
            while True:
                say(sentences.get())

    threading.Thread(target=run, daemon=True).start()
    return sentences


def _describe_plan(arm: Wire, order: Order, record: Path | None) -> list[str]:
    task, limits, gains = order.task, order.limits, order.loop.gains
    x, y, z = task.direction
    lowered = f" (lowered by {100.0 * task.probe:g} % three times)" if task.probe else ""
    behind = (
        "no F_max: a hard surface behind a soft layer is met at the speed limit; palpate tune --force-max bounds that"
        if gains.force_max is None
        else f"if something hard lies behind: at most {gains.force_max:g} N, by a commanded speed of at most"
        f" {1e3 * gains.speed_at(task.force):.3g} mm/s, while a reading is off by at most"
        f" {reading_error(gains.arm, task.force):.3g} N; {press_time(gains)}"
    )
    last = 1e3 * (gains.theta + gains.arm.tick)
    path = task.path
    along = (
        ""
        if path is None
        else f" while it slides along a {path.name} of {1e3 * path.length:.3g} mm, begun within"
        f" {start_time(gains):.2g} s of the first contact"
    )
    back = f"goes back to free motion and {1e3 * task.retreat:g} mm, rests"
    stroke = (
        f"goes back {1e3 * order.stroke.length:.3g} mm and returns at {1e3 * order.stroke.speed:.3g} mm/s, "
        if order.stroke
        else ""
    )
    end = "rests in contact" if task.end == "hold" else back
    does = (
        f"rests 0.5 s in free motion and tares, {stroke}approaches along ({x:.3g}, {y:.3g}, {z:.3g}) of the base at"
        f" {1e3 * gains.approach:.3g} mm/s at most, presses with {task.force:g} N for {task.hold:g} s{lowered}{along},"
        f" {end}"
    )
    stops = (
        f"stops at {limits.force:g} N, {1e3 * limits.speed:g} mm/s, {1e3 * limits.travel:.3g} mm from here, after"
        f" {limits.seconds:g} s, on Ctrl-C and every other signal that can be caught, and {last:.3g} ms after the last"
        " reading at the latest; then it goes back at the speed limit, to free motion or where the force shows none, as"
        f" far as it came, for {order.retreat_time:.2g} s at most, which no second signal ends"
    )
    record_line = f"record: {record}" if record else "no record is kept (--record DIR keeps one)"
    arms = f"arm: {arm.title}; gains for {gains.arm.title}"
    massless = mass_note(gains)
    notes = [f"note: {massless}"] if massless else []
    if gains.arm.sensor.accuracy is not None:
        notes.append(
            f"note: a force is as true as its sensor, ± {gains.arm.sensor.accuracy:g} N by its maker"
        )
    dies = f"if this process dies: {arm.watchdog}"
    return [arms, does, stops, dies, behind, _describe_lying_sensor(gains, limits), record_line, *notes]


def _describe_lying_sensor(gains: Gains, limits: PressLimits) -> str:
    """Largest force if the sensor lies, in a sentence."""
    cap, travel, short = stiffest_contact(gains), limits.travel, safe_travel(gains, limits.force)
    less = ""
    if travel > short:
        less = f"; --travel-limit {1e3 * short:.2g}:mm, or none, keeps that below the force limit"
    return (
        f"if the sensor lies (frozen, or its gain too small): at most K_cap x travel, {cap:.3g} N/m x"
        f" {1e3 * travel:.3g} mm = {cap * travel:.3g} N, unless the arm's own safety stops it before{less}"
    )


def _confirm(yes: bool, word: str) -> None:
    if yes:
        return
    if not sys.stdin.isatty():
        raise InputError(
            "the arm would move, and there is no terminal to ask for confirmation; use --dry-run first, then add --yes"
        )
    say(f"the arm will move; type {word} to go on")
    if sys.stdin.readline().strip() != word:
        raise InputError("not confirmed; nothing was moved")


def _print_dry_run(rest: AtRest, plan: list[str], notes: list[str], json: bool) -> int:
    bias = ", ".join(f"{b + 0.0:.3g}" for b in rest.bias.round(4))
    drift = f"drift {rest.drift:.2g} ± {rest.drift_std:.2g} N/s"
    readings = f"in free motion: bias {bias} N, noise {rest.noise:.2g} N, {drift}, {rest.rate:.4g} Hz"
    if json:
        print_answer({"plan": plan, **rest.to_json()})
    else:
        print_lines(readings, *notes, "dry run: nothing was moved")
    return 0


def _print_outcome(outcome: Outcome, words: str, where: Path | None, json: bool) -> int:
    if json:
        print_answer(outcome.to_json() | {"priority": words, "record": where and str(where)})
        return 0 if outcome.ok else 1
    lines = [f"ended: {outcome.ended}; the arm rests", outcome.unloading.how]
    if not outcome.touched:
        lines.append("no surface was held before that; --normal is the direction into it, in the base's axes")
    lines += subtraction_notes(outcome.free_stroke)
    lines += [f"trouble in {ticks} ticks: {trouble}" for trouble, ticks in outcome.troubles.items()]
    if outcome.force is not None:
        settled = (
            f"within 5 % after {outcome.settled:.2g} s" if outcome.settled is not None else "never within 5 %"
        )
        lines.append(f"force {outcome.force:.4g} N, {settled}")
    if outcome.stiffness:
        value, std = outcome.stiffness
        lines.append(f"stiffness as the arm feels it {value:.4g} N/m (std {std:.2g})")
    if outcome.surface:
        n, cone, mu = outcome.surface.values()
        friction = "unknown" if mu is None else " to ".join(f"{end:.2f}" for end in mu["ci95"])
        normal = "unknown" if cone is None else "{:.3f}, {:.3f}, {:.3f} within {:.2g} deg".format(*n, cone)
        lines.append(f"normal {normal}, friction {friction}")
    lines += [*outcome.lateness.sentences(), words]
    if where:
        lines.append(f"written: {where}; palpate identify {where} reads it")
    print_lines(*lines)
    return 0 if outcome.ok else 1
