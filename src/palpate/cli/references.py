"""`palpate references`: certified contact logs, and the digits of solvers on them."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from palpate.cli.options.values import FLAG
from palpate.cli.toolkit import console, place, print_answer, print_lines, progress_of_pieces, show_table

if TYPE_CHECKING:
    from palpate.certified_logs.check import Score
    from palpate.certified_logs.models import CertifiedProblem


def references(
    action: Literal["check", "export"],
    out: Path | None = None,
    *,
    json: Annotated[bool, FLAG] = False,
) -> int:
    """Check solvers against 44 contact logs with parameters certified to 11 digits.

    palpate references check

    palpate references export certified/

    Args:
        action: `check` fits every log by palpate, SciPy and NumPy; `export` writes the logs.
        out: Folder for the logs of `export`.
        json: Print one JSON object.

    Returns:
        0 if palpate's search has 8 digits on every log from both starts, 1 if not.

    Raises:
        InputError: a folder without `export`, or `export` without one.
    """
    from palpate.certified_logs.models import problems
    from palpate.errors import InputError

    if (out is None) == (action == "export"):
        raise InputError("a folder is for export, which makes it: palpate references export FOLDER")
    if out is not None:
        return _export(problems(), out)
    return _check(problems(), json=json)


def _export(logs: list[CertifiedProblem], out: Path) -> int:
    from palpate.files import fresh_folder

    shipped = files("palpate.certified_logs")
    with fresh_folder(out, replace=False) as folder:
        for name in (*(f"logs/{log.name}.csv" for log in logs), "certified.json"):
            (folder / Path(name).name).write_bytes(shipped.joinpath(name).read_bytes())
    place(console(), f"{len(logs)} logs and certified.json:", out)
    return 0


def _check(logs: list[CertifiedProblem], *, json: bool) -> int:
    from palpate.certified_logs.check import REQUIRED_DIGITS, SOLVERS, scores
    from palpate.report.page import Table

    summary: dict[str, dict[str, Any]] = {}
    with progress_of_pieces(console(stderr=True)) as show:
        for solver in SOLVERS:
            rows: list[Score] = []
            for number, log in enumerate(logs):
                rows += scores(log, solver)
                show(solver, number + 1, len(logs))
            summary[solver] = _summary(rows, REQUIRED_DIGITS)
    code = 0 if summary["palpate"]["enough"] == summary["palpate"]["fits"] else 1
    if json:
        print_answer({"enough_digits": REQUIRED_DIGITS, "solvers": summary})
        return code
    head = ("solver", "fits", f"with {REQUIRED_DIGITS:g} digits", "median", "least")
    cells = [
        (name, f"{row['fits']}", f"{row['enough']}", f"{row['median']:.1f}", f"{row['least']:.1f}")
        for name, row in summary.items()
    ]
    show_table(console(), Table("Digits of the worst parameter on the certified logs", head, cells))
    for name, row in summary.items():
        if row["fewer"]:
            print_lines(f"{name} has fewer on {', '.join(row['fewer'])}")
    return code


def _summary(rows: list[Score], enough: float) -> dict[str, Any]:
    digits = sorted(row.digits for row in rows)
    return {
        "fits": len(rows),
        "enough": sum(d >= enough for d in digits),
        "median": digits[len(digits) // 2],
        "least": digits[0],
        "fewer": sorted({f"{row.problem.name} {row.digits:.1f}" for row in rows if row.digits < enough}),
    }
