"""`palpate tune`: gains for a force loop, their predicted performance, and the proof of their stability."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli._program import OutputFile, command, print_result
from palpate.cli.options import force
from palpate.cli.options.common import ReportOption, read_found
from palpate.cli.options.values import si
from palpate.errors import InputError
from palpate.files import write_text

if TYPE_CHECKING:
    from palpate.force import Known, Tuning


# More than seven arguments: groups of options.
def tune(
    found: Path | None = None,
    /,
    *,
    arm: force.LoopArmOptions,
    press: force.PressOptions,
    surface: force.SurfaceOptions | None = None,
    columns: force.ColumnOptions | None = None,
    slide: force.SlideTuningOptions | None = None,
    output: force.TuningOutputOptions | None = None,
    page: ReportOption | None = None,
) -> int:
    """Tune a force loop for an arm, and prove on which surfaces it is stable.

    From the output of palpate identify --json, from a log, or from a range of stiffness:

    palpate tune found.json --arm ur5e --force 20 --out gains.toml

    palpate tune press.csv --time time_s --position position_mm:mm --force-column force_N:N --arm ur5e --force 20

    palpate tune --stiffness 1e2:1e6 --arm fr3 --force 10 --out gains.toml

    The arm's inner loop and delay from a log of commanded and measured position, in free motion:

    palpate tune found.json --arm ur5e --force 20 --loop-from sweep.csv --time t --command target_x --position actual_x

    A servo that yields, from such a log in which the tip is also pushed once by hand while the command rests:

    palpate tune found.json --arm ur5e --force 15 --loop-from log.csv --time t --command u --position x --push force

    With --slide --mu-max .9 the gains are for palpate slide and palpate.force.SlidingLoop too.

    The gains are for palpate.force.ForceLoop, which adapts to any surface below the cap. Exit code 1: nothing could be
    proved.

    Parameters
    ----------
    found
        The output of palpate identify --json, as a .json file; or a log.
    """
    surface, columns = surface or force.SurfaceOptions(), columns or force.ColumnOptions()
    output, report = output or force.TuningOutputOptions(), (page or ReportOption()).page()
    output.check_new(output.out, ending=".toml")
    from palpate.report.tuning import build_answer

    slide = slide or force.SlideTuningOptions()
    tuning, loop = _tune(arm, press, surface, columns, found, slides=slide.slide)
    tuning = replace(tuning, gains=slide.tuned_for(tuning.gains))
    written = [output.out] if output.out is not None else []
    for path in written:
        write_text(path, tuning.gains.to_toml())
    files = (
        [OutputFile("report:", report, partial(_write_page, tuning, report))] if report is not None else []
    )
    print_result(build_answer(tuning, loop, written, verbose=output.verbose), json=output.json, files=files)
    return 0 if tuning.proved else 1


def _tune(
    arm: force.LoopArmOptions,
    press: force.PressOptions,
    surface: force.SurfaceOptions,
    columns: force.ColumnOptions,
    source: Path | None,
    *,
    slides: bool,
) -> tuple[Tuning, dict[str, Any] | None]:
    """The tuned loop, and the inner loop that a log identifies, as plain JSON values."""
    from palpate.force import tune as tune_loop

    loaded_arm, inner = arm.load(columns)
    theta = inner.theta(loaded_arm) if inner is not None and inner.stiffness is not None else None
    tuning = tune_loop(
        loaded_arm,
        press.force.si,
        _known_surface(source, surface, columns),
        cap=si(surface.stiffness_cap),
        force_max=press.highest_force(loaded_arm, slides=slides),
        theta=None if theta is None else theta.high,
    )
    return tuning, None if inner is None else inner.to_json() | (
        {"theta_s": theta.to_json()} if theta else {}
    )


def _known_surface(
    source: Path | None, surface: force.SurfaceOptions, columns: force.ColumnOptions
) -> Known | None:
    from palpate.force import Known, known_from
    from palpate.from_log import log_identifier

    highest = si(surface.damping_max)
    if source is not None and surface.stiffness is not None:
        raise InputError("give a file or --stiffness, not both")
    if surface.stiffness is not None:
        return Known.of_range(surface.stiffness.si, highest)
    if source is None:
        raise InputError(
            "the surface is missing; give FOUND.json of palpate identify --json, a log, or --stiffness LOW:HIGH"
        )
    if source.suffix.lower() == ".json":
        return known_from(read_found(source), str(source)).with_damping_up_to(highest)
    identified, _ = log_identifier(columns.press_roles).identify(source)
    return known_from(identified.to_json(), str(source)).with_damping_up_to(highest)


def _write_page(tuning: Tuning, path: Path) -> None:
    from palpate.report.tuning import page

    write_text(path, page(tuning, command()))
