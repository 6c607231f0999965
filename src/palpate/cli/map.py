"""`palpate map`: the stiffness of a surface at every place, from presses at some, and where to press next."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group

from palpate.cli._streams import notice_signals
from palpate.cli.identify import OneLog
from palpate.cli.options.common import WRITTEN, JsonOption, ReportOption
from palpate.cli.options.log import ArmOptions, FrameOptions, LogOptions, ModelOptions
from palpate.cli.options.values import FLAG, Stiffness, options, si
from palpate.cli.toolkit import OutputFile, bar, command, console, guard_picture, print_result
from palpate.errors import InputError
from palpate.files import check_place, fresh_folder, with_author, write_json, write_text

if TYPE_CHECKING:
    from palpate.cli.options.press import AskOptions, PhantomOptions, SimulatedOptions
    from palpate.maps.presses import Presses
    from palpate.maps.result import MapRequest, MapResult

MAP = Group("The map", sort_key=2)
ENDINGS = {"figure": (".png", ".svg", ".pdf"), "csv": (".csv",)}
"""Endings of the files of a map, by option."""
PLACES = "places.csv"
"""Table of the places of a slide with dither and of `palpate press --map`, in their folders: a line each."""


@options(MAP)
class PlaceOptions:
    """Where the presses are."""

    table: Path | None = None
    """A table with a row a press instead of logs: columns x, y (and z), stiffness and half, the half-width of
    its 95 % interval; a name such as x_mm carries its unit. A column line numbers the slide or session of a press,
    whose presses share an error."""
    columns: str | None = None
    "Columns of the table, as x:mm,y:mm,K:N/mm,half:N/mm."
    place: str | None = None
    "Columns of a log that hold its place, as x:mm,y:mm or x,y,z; the pose's position if not given."
    each_contact: Annotated[bool, FLAG] = False
    "Each contact of a log is a press of its own, at its own place; else a log is one press."


@options(MAP)
class MapOptions:
    """Options of the map itself."""

    next: int = 5
    "How many next presses to choose."
    stiffer_than: Stiffness | None = None
    """A stiffness, as 2000 or 2:kN/m: lumps above it, their areas, and the probability at each place; the next
    presses seek their edges."""
    until: float | None = None
    "Target half-width of the interval, in per cent: print how many more presses reach it."
    common: float = 0.0
    "Standard deviation of an error that all presses share, such as the sensor's scale, in per cent."

    def request(self) -> MapRequest:
        """The options as the library takes them."""
        from palpate.maps.result import MapRequest

        if self.until is not None and not 0.0 < self.until < 1e3:
            raise InputError(f"--until must be above 0 %, got {self.until:g}")
        if not 0.0 <= self.common < 100.0:
            raise InputError(f"--common must be from 0 to 100 %, got {self.common:g}")
        if not 0 <= self.next <= 1000:
            raise InputError(f"--next must be from 0 to 1000, got {self.next}")
        if self.stiffer_than is not None and self.stiffer_than.si <= 0.0:
            raise InputError(f"--stiffer-than must be above 0, got {str(self.stiffer_than)!r}")
        half = None if self.until is None else self.until / 100.0
        return MapRequest(self.next, si(self.stiffer_than), half, self.common / 100.0)


@options(WRITTEN)
class OutputOptions(ReportOption, JsonOption):
    """Files of a map, and their formats."""

    figure: Path | None = None
    "Where to write a picture of the map, PNG, SVG or PDF by its ending."
    csv: Path | None = None
    "Where to write the map as a table: place, stiffness, both intervals."

    @property
    def files(self) -> dict[str, Path]:
        """Paths that are written, by option."""
        paths = {name: getattr(self, name) for name in ("report", *ENDINGS)}
        return {name: path for name, path in paths.items() if path is not None}

    def check(self) -> None:
        """Check every path before any work is done."""
        self.page()
        for name, endings in ENDINGS.items():
            if (path := self.files.get(name)) is not None:
                ending = path.suffix.lower()
                check_place(path, f"--{name}", ending=ending if ending in endings else endings[0])


def map(  # noqa: A001 - the command's name
    *logs: Path,
    places: PlaceOptions | None = None,
    mapping: MapOptions | None = None,
    source: LogOptions | None = None,
    frame: FrameOptions | None = None,
    arm: ArmOptions | None = None,
    fitted: ModelOptions | None = None,
    output: OutputOptions | None = None,
) -> int:
    """Map the stiffness of a surface from presses at places, and choose the next presses.

    A folder of logs, each of one press with the pose of the probe; options are those of palpate identify:

    palpate map presses/ --report map.html

    A table with a row a press; lumps stiffer than 2 kN/m, and where to press to find their edges:

    palpate map --table places.csv --stiffer-than 2:kN/m --next 5

    Each place has a 95 % interval, of the surface and of a next press. Outside the hull of the presses nothing is said.
    Exit code 1: presses of the folder are left out, since they give no stiffness.

    Parameters
    ----------
    logs
        Logs or folders of logs.
    """
    places, output = places or PlaceOptions(), output or OutputOptions()
    output.check()
    request = (mapping or MapOptions()).request()
    if (places.table is None) == (not logs):
        raise InputError("palpate map needs logs or a folder of them, or --table with places and stiffnesses")
    if places.table is not None and (places.each_contact or any((source, frame, arm, fitted))):
        raise InputError(
            "--each-contact and the options of logs, frames, arms and models are of logs; a table's places and "
            "stiffnesses stand as they are: leave these options out"
        )
    from palpate.maps.result import map_of

    log_options = OneLog(
        fitted or ModelOptions(), source or LogOptions(), frame or FrameOptions(), arm or ArmOptions()
    )
    name = places.table.name if places.table else logs[0].name
    result = map_of(_presses(logs, places, log_options), request)
    _show(result, output, name)
    return 1 if result.presses.refused else 0


def _presses(logs: Sequence[Path], places: PlaceOptions, log_options: OneLog) -> Presses:
    from palpate.maps.presses import merge_presses, read_logs, read_table

    if places.table is not None:
        if places.place is not None:
            raise InputError("--place is of logs; the columns of a table are given with --columns")
        return read_table(places.table, places.columns.split(",") if places.columns else ())
    if places.columns is not None:
        raise InputError("--columns is of --table; the place in logs is given with --place")
    from palpate.logs.formats import gather_logs

    with bar(console(stderr=True)) as progress:

        def track(paths: Sequence[Path]) -> Iterable[Path]:
            return progress.track(paths, description="identifying")

        named = places.place.split(",") if places.place else ()
        tables = [log / PLACES for log in logs if (log / PLACES).is_file()]
        press_logs = [log for log in logs if log / PLACES not in tables]
        parts = [replace(part, line=0.0 * part.stiffness) for part in (read_table(table) for table in tables)]
        if press_logs:
            parts.append(
                read_logs(gather_logs(press_logs), log_options.identifier, named, places.each_contact, track)
            )
        return merge_presses(parts)


def _files(result: MapResult, output: OutputOptions, name: str) -> list[OutputFile]:
    """The files of a map, to be written."""

    def write_figure(path: Path) -> None:
        from palpate.maps.report import draw_map
        from palpate.report.style import save

        save(draw_map(result), path)

    def write_page(path: Path) -> None:
        from palpate.maps.report import page

        write_text(path, page(result, f"Stiffness map of {name}", command()))

    writers: dict[str, Callable[[Path], object]] = {
        "figure": write_figure,
        "csv": result.write_csv,
        "report": write_page,
    }
    return [OutputFile(f"{kind}:", path, partial(writers[kind], path)) for kind, path in output.files.items()]


def _show(result: MapResult, output: OutputOptions, name: str) -> None:
    from palpate.maps.report import build_answer

    print_result(build_answer(result), json=output.json, files=_files(result, output, name))


def press_map(press: AskOptions, simulated: SimulatedOptions, phantom: PhantomOptions, *, json: bool) -> int:
    """Press a phantom at places that the map chooses, and write presses, map and page into the folder of results.

    Returns:
        0; 130 if it was interrupted: the map of the presses until then is written.

    Raises:
        InputError: the phantom, the arm or an option is wrong, or an interruption before a map could be drawn.
    """
    from palpate.environments.models import KelvinVoigt
    from palpate.maps import report as page
    from palpate.maps.phantom import load_phantom, palpate_phantom
    from palpate.units import plain

    assert phantom.map is not None
    if phantom.page is not None:
        check_place(phantom.page, "--page", ending=".html")
    surface = load_phantom(phantom.map)
    title = f"Map of {phantom.map.stem}, {' × '.join(plain(1e3 * side, 3) for side in surface.size)} mm"
    request = MapOptions(stiffer_than=phantom.stiffer_than).request()
    spec = simulated.spec(press, KelvinVoigt(surface.stiffness, surface.damping, 0.0))
    folder = simulated.out if simulated.out is not None else Path("runs") / f"map-{phantom.map.stem}"
    with notice_signals() as interrupted, fresh_folder(folder, replace=simulated.replace) as fresh:
        with bar(console(stderr=True)) as progress:
            task = progress.add_task("pressing", total=phantom.presses)

            def show(done: int, last: str) -> bool:
                progress.update(task, completed=done, description=last)
                return not interrupted()

            def grow(result: MapResult) -> None:
                if phantom.page is not None:
                    with guard_picture(phantom.page):
                        write_text(phantom.page, page.page(result, title, command(), live=True))

            result = palpate_phantom(spec, surface, phantom.presses, request, show, grow)
        result.write_presses(fresh / PLACES)
        result.write_csv(fresh / "map.csv")
        write_json(fresh / "summary.json", with_author({"command": command(), **result.to_json()}))
        for path in filter(None, (fresh / "report.html", phantom.page)):
            with guard_picture(path.name):
                write_text(path, page.page(result, title, command()))
    print_result(page.build_answer(result), json=json, files=[("report:", folder / "report.html")])
    return interrupted.code if interrupted() else 0
