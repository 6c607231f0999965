"""`palpate benchmark`: a test of force control that others can enter, and public data with their official splits."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

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
from palpate.cli.toolkit import (
    COMPILING,
    command,
    console,
    head,
    place,
    print_answer,
    progress_of_pieces,
    show_table,
)

if TYPE_CHECKING:
    from palpate_benchmark.entry import ForceEntry
    from palpate_benchmark.simulated import ForceResult, Surfaces


@options("The test of force control", 1)
class ForceOptions:
    """The test of force control.

    Parameters
    ----------
    arm
        Of palpate's own law and of --shipped: ur5e, fr3, iiwa14, panda, or a TOML file; an entry names its own.
    force
        Desired force, N.
    stiffness
        Range of the surfaces, LOW:HIGH in N/m.
    surfaces
        Stiffnesses in it, even in their logarithms.
    repeats
        Presses on each, with a damping and noise of their own.
    seed
        Of those.
    shipped
        Enter every controller that comes with the test.
    record
        Judge presses of a real arm instead: folders of palpate press --wire ... --record.
    """

    arm: str = "ur5e"
    force: Force = quantity_default("20", "force")
    stiffness: StiffnessRange = spread_default("1e3:1e5", "stiffness")
    surfaces: Annotated[int, WHOLE] = 5
    repeats: Annotated[int, WHOLE] = 5
    seed: Annotated[int, WHOLE] = 0
    shipped: Annotated[bool, FLAG] = False
    record: Annotated[tuple[Path, ...], Parameter(consume_multiple=True)] = ()

    def of_simulation(self) -> Surfaces:
        """Surfaces of the test."""
        from palpate_benchmark.simulated import Surfaces

        low, high = self.stiffness.si
        return Surfaces(low, high, self.surfaces, self.repeats, self.seed)


def benchmark(
    test: Literal["force", "silverbox"],
    files: Annotated[tuple[Path, ...], Parameter(consume_multiple=True)] = (),
    *,
    asked: ForceOptions | None = None,
    own: PluginOptions | None = None,
    out: Path | None = None,
    replace: Annotated[bool, FLAG] = False,
    json: Annotated[bool, FLAG] = False,
) -> int:
    """Test force control by metrics over a range of stiffness, or identify public data with their official splits.

    An arm with palpate's law, in simulation:

    palpate benchmark force --arm ur5e --out ur5e

    A controller of your own, which a file names as module:Class, beside those that are shipped:

    palpate benchmark force mine.toml --shipped --plugins --out board

    Presses of a real arm, recorded over its wire:

    palpate benchmark force --record first second --out my-arm

    The Silverbox, from the file of its authors, by output error with a cubic spring:

    palpate benchmark silverbox SNLS80mV.csv

    Exit code 0: every press passed, or the data are described to 0.5 %; 1: not.

    Parameters
    ----------
    test
        force or silverbox.
    files
        Entries of the test, TOML files; or the file of the data.
    out
        Folder for report.html, its figures and result.json.
    replace
        Replace results of palpate there.
    json
        Print one JSON object.
    """
    from palpate.errors import InputError

    asked = asked or ForceOptions()
    if test == "silverbox":
        from palpate_benchmark.silverbox_command import silverbox

        if len(files) != 1:
            raise InputError(
                "silverbox needs one file, SNLS80mV.csv or SNLS80mV.mat, which you have downloaded"
            )
        if asked != ForceOptions() or out is not None:
            raise InputError(
                "silverbox takes the file and --json alone; leave out the options of the test of force"
            )
        return silverbox(files[0], json=json)
    return _force(files, asked, own or PluginOptions(), (out, replace), json=json)


def _force(
    files: tuple[Path, ...],
    asked: ForceOptions,
    own: PluginOptions,
    where: tuple[Path | None, bool],
    *,
    json: bool,
) -> int:
    from palpate.errors import InputError
    from palpate.files import fresh_folder
    from palpate_benchmark.page import write_page
    from palpate_benchmark.summary import as_values, by_surface, leaderboard, sentence

    if asked.record and (files or asked.shipped):
        raise InputError(
            "--record judges presses of a real arm; leave out entries and --shipped, or test them alone"
        )
    out, replace = where
    kept: AbstractContextManager[Any] = nullcontext() if out is None else fresh_folder(out, replace=replace)
    with own.consent(), kept as folder:
        results = _from_records(asked) if asked.record else _in_simulation(files, asked)
        if folder is not None:
            write_page(results, folder, command())
    if json:
        print_answer(as_values(results))
    else:
        screen = console()
        head(screen, "", sentence(results))
        table = leaderboard(results, narrow=True) if len(results) > 1 else by_surface(results[0], narrow=True)
        show_table(screen, table)
        if out is not None:
            place(screen, "report:", out / "report.html")
    return 0 if all(one.passes == len(one.runs) for one in results) else 1


def _from_records(asked: ForceOptions) -> list[ForceResult]:
    from palpate_benchmark.recorded import judge

    return [judge(asked.record)]


def _in_simulation(files: tuple[Path, ...], asked: ForceOptions) -> list[ForceResult]:
    from palpate_benchmark.simulated import press_surfaces

    surfaces, force = asked.of_simulation(), asked.force.si
    entries = _entries(files, asked)
    screen = console(stderr=True)
    told: list[bool] = []

    def waiting() -> None:
        if not told:
            told.append(True)
            screen.print(COMPILING)

    for entry in entries:
        entry.build(
            entry.gains(force), surfaces.seed
        )  # a fault of the last one is found before the first is run
    with progress_of_pieces(screen) as show:
        return [press_surfaces(one, force, surfaces, partial(show, one.name), waiting) for one in entries]


def _entries(files: tuple[Path, ...], asked: ForceOptions) -> list[ForceEntry]:
    from palpate_benchmark.entry import OWN, ForceEntry, load_entry, shipped_controllers

    entries = [load_entry(file) for file in files]
    if asked.shipped:
        entries += [ForceEntry({"kind": name}, arm=asked.arm) for name in shipped_controllers(asked.arm)]
    return entries or [ForceEntry({"kind": OWN}, arm=asked.arm)]
