"""`palpate tune`: gains for a force loop, their predicted performance, and the proof of their stability."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli._program import command, print_result
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

    The same of a servo that gives way and whose encoders show it, from a log with one push of a hand at rest:

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
    from palpate.report.tuning import answer_of

    tuning, loop = _tune(arm, press, surface, columns, found)
    tuning = replace(tuning, gains=(slide or force.SlideTuningOptions()).tuned_for(tuning.gains))
    written = _write(tuning, output.out, report)
    print_result(answer_of(tuning, loop, written, verbose=output.verbose), json=output.json)
    return 0 if tuning.proved else 1


def _tune(
    arm: force.LoopArmOptions,
    press: force.PressOptions,
    surface: force.SurfaceOptions,
    columns: force.ColumnOptions,
    found: Path | None,
) -> tuple[Tuning, dict[str, Any] | None]:
    """The tuned loop, and the inner loop that a log identifies, as plain JSON values."""
    from palpate.force import tune as tune_loop

    one, inner = arm.load(columns)
    theta = inner.theta(one) if inner is not None and inner.stiffness is not None else None
    tuning = tune_loop(
        one,
        press.force.si,
        _surface_of(found, surface, columns),
        cap=si(surface.stiffness_cap),
        peak=si(press.peak),
        surface_speed=surface.surface_speed,
        theta=None if theta is None else theta.high,
    )
    return tuning, None if inner is None else inner.to_json() | (
        {"theta_s": theta.to_json()} if theta else {}
    )


def _surface_of(
    found: Path | None, surface: force.SurfaceOptions, columns: force.ColumnOptions
) -> Known | None:
    from palpate.force import Known, known_from
    from palpate.from_log import log_identifier

    highest = si(surface.damping_max)
    if found is not None and surface.stiffness is not None:
        raise InputError("give a file or --stiffness, not both")
    if surface.stiffness is not None:
        return Known.of_range(surface.stiffness.si, highest)
    if found is None:
        raise InputError(
            "the surface is missing; give FOUND.json of palpate identify --json, a log, or --stiffness LOW:HIGH"
        )
    if found.suffix.lower() == ".json":
        return known_from(read_found(found), str(found)).with_damping_up_to(highest)
    identified, _ = log_identifier(columns.of_press).identify(found)
    return known_from(identified.to_json(), str(found)).with_damping_up_to(highest)


def _write(tuning: Tuning, out: Path | None, page: Path | None) -> list[Path]:
    if out is not None:
        write_text(out, tuning.gains.to_toml())
    if page is not None:
        from palpate.report.tuning import page as page_of

        write_text(page, page_of(tuning, command()))
    return [path for path in (out, page) if path is not None]
