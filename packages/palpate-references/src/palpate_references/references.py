"""`palpate references`: certified contact logs, and the digits of solvers on them."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from palpate.cli.options.values import FLAG
from palpate.cli.toolkit import console, place, print_answer, print_lines, progress_of_pieces, show_table

if TYPE_CHECKING:
    from palpate_references.check import Score
    from palpate_references.problem import CertifiedProblem


def references(
    action: Literal["check", "list", "export"],
    out: Path | None = None,
    *,
    json: Annotated[bool, FLAG] = False,
) -> int:
    """Check solvers against 44 contact logs whose parameters are certified to 11 digits; list the logs, or write them.

    palpate references check

    palpate references export certified/

    Args:
        action: `check` fits every log by palpate, SciPy and NumPy; `list` names the logs; `export` writes them.
        out: folder that `export` makes.
        json: print one JSON object.

    Returns:
        0 if palpate's search has 8 digits on every log from both starts, 1 if not.

    Raises:
        InputError: a folder without `export`, or `export` without one.
    """
    from palpate.errors import InputError
    from palpate.files import fresh_folder
    from palpate.report.page import Table
    from palpate_references.problem import problems

    if (out is None) == (action == "export"):
        raise InputError("a folder is for export, which makes it: palpate references export FOLDER")
    known = problems()
    if action == "list":
        names = ("log", "level", "model", "deviation")
        rows = [(p.name, p.level, p.law.formula, p.about) for p in known]
        if json:
            print_answer({"logs": [dict(zip(names, row, strict=True)) for row in rows]})
        else:
            show_table(console(), Table(f"{len(rows)} certified logs", names, rows))
        return 0
    if out is not None:
        with fresh_folder(out, replace=False) as folder:
            for name in (*(f"logs/{p.name}.csv" for p in known), "certified.json"):
                (folder / Path(name).name).write_bytes(files(__package__).joinpath(name).read_bytes())
        place(console(), f"{len(known)} logs and certified.json:", out)
        return 0
    return _check(known, json=json)


def _check(known: list[CertifiedProblem], *, json: bool) -> int:
    from palpate.report.page import Table
    from palpate_references.check import ENOUGH, SOLVERS, scores

    summary: dict[str, dict[str, Any]] = {}
    with progress_of_pieces(console(stderr=True)) as show:
        for solver in SOLVERS:
            rows: list[Score] = []
            for number, problem in enumerate(known):
                rows += scores(problem, solver)
                show(solver, number + 1, len(known))
            summary[solver] = _summary(rows, ENOUGH)
    good = summary["palpate"]["enough"] == summary["palpate"]["fits"]
    if json:
        print_answer({"enough_digits": ENOUGH, "solvers": summary})
        return 0 if good else 1
    head = ("solver", "fits", f"with {ENOUGH:g} digits", "median", "least")
    cells = [
        (
            name,
            f"{r['fits']}",
            f"{r['enough']}",
            f"{r['median']:.1f}",
            f"{r['least']:.1f}",
        )
        for name, r in summary.items()
    ]
    show_table(console(), Table("Digits of the worst parameter on the certified logs", head, cells))
    for name, row in summary.items():
        if row["fewer"]:
            print_lines(f"{name} has fewer on {', '.join(row['fewer'])}")
    return 0 if good else 1


def _summary(rows: list[Score], enough: float) -> dict[str, Any]:
    digits = sorted(row.digits for row in rows)
    return {
        "fits": len(rows),
        "enough": sum(d >= enough for d in digits),
        "median": digits[len(digits) // 2],
        "least": digits[0],
        "fewer": sorted({f"{row.problem.name} {row.digits:.1f}" for row in rows if row.digits < enough}),
    }
