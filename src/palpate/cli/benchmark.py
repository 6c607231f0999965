"""`palpate benchmark force`: a test of force control that others can enter."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from palpate.cli.options.common import PluginOptions
from palpate.cli.options.values import (
    FLAG,
    WHOLE,
    Force,
    StiffnessRange,
    options,
    quantity_default,
    spread_default,
)
from palpate.cli.toolkit import COMPILING, console, head, print_answer, progress_of_pieces, show_table

if TYPE_CHECKING:
    from palpate.benchmark.simulated import ForceResult


@options("The test of force control", 1)
class ForceOptions:
    """The test of force control.

    Parameters
    ----------
    arm
        Arm of palpate's law: ur5e, fr3, iiwa14, panda, or a TOML file; an entry names its own.
    force
        Desired force, N.
    stiffness
        Range of the surfaces, LOW:HIGH in N/m.
    surfaces
        Number of surfaces, evenly spaced in the logarithm of the stiffness.
    repeats
        Presses on each surface, with a damping and noise of their own.
    seed
        Seed of damping and noise.
    """

    arm: str = "ur5e"
    force: Force = quantity_default("20", "force")
    stiffness: StiffnessRange = spread_default("1e3:1e5", "stiffness")
    surfaces: Annotated[int, WHOLE] = 5
    repeats: Annotated[int, WHOLE] = 5
    seed: Annotated[int, WHOLE] = 0


def benchmark(
    test: Literal["force"],
    files: Annotated[tuple[Path, ...], Parameter(consume_multiple=True)] = (),
    *,
    options: ForceOptions | None = None,
    plugins: PluginOptions | None = None,
    json: Annotated[bool, FLAG] = False,
) -> int:
    """Test force control by metrics over a range of stiffness.

    An arm with palpate's law, in simulation:

    palpate benchmark force --arm ur5e

    A controller of your own, which a file names as module:Class:

    palpate benchmark force mine.toml --plugins

    Exit code 0: every press passed; 1: not.

    Parameters
    ----------
    test
        force.
    files
        Entries of the test, TOML files; palpate's own law if none is given.
    json
        Print one JSON object.
    """
    from palpate.benchmark.summary import as_values, sentence, table_rows
    from palpate.report.page import Table

    with (plugins or PluginOptions()).consent():
        results = _run_entries(files, options or ForceOptions())
    if json:
        print_answer(as_values(results))
    else:
        screen = console()
        head(screen, "", sentence(results))
        rows = table_rows(results)
        show_table(screen, Table(results[0].arm, list(rows[0]), [list(row.values()) for row in rows]))
    return 0 if all(result.passes == len(result.runs) for result in results) else 1


def _run_entries(files: tuple[Path, ...], options: ForceOptions) -> list[ForceResult]:
    from palpate.benchmark.simulated import CAUTIOUS, ForceEntry, Surfaces, load_entry, press_surfaces

    force = options.force.si
    surfaces = Surfaces(*options.stiffness.si, options.surfaces, options.repeats, options.seed)
    entries = [load_entry(file) for file in files] or [ForceEntry({"kind": CAUTIOUS}, arm=options.arm)]
    for entry in entries:  # a fault of the last entry is reported before the first is run
        entry.build(entry.gains(force))
    screen = console(stderr=True)
    announced: list[bool] = []

    def waiting() -> None:
        if not announced:
            announced.append(True)
            screen.print(COMPILING)

    with progress_of_pieces(screen) as show:
        return [
            press_surfaces(entry, force, surfaces, partial(show, entry.name), waiting) for entry in entries
        ]
