"""`palpate map`: the stiffness of a surface at every place, from presses at some, and where to press next."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from time import sleep as wait
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Group

from palpate.cli._streams import notice_signals
from palpate.cli.identify import OneLog
from palpate.cli.options.common import QUIET, WRITTEN, JsonOption, ReportOption
from palpate.cli.options.log import ArmOptions, FrameOptions, LogOptions, ModelOptions
from palpate.cli.options.values import FLAG, Length, Stiffness, options, quantity, si
from palpate.cli.toolkit import bar, command, console, print_result
from palpate.errors import InputError
from palpate.files import check_place, fresh_folder, with_author, write_json, write_text
from palpate.units import split_spec

if TYPE_CHECKING:
    from palpate.cli.press import AskOptions, PhantomOptions, SimulatedOptions
    from palpate_maps.presses import Presses
    from palpate_maps.result import MapRequest, MapResult

MAP = Group("The map", sort_key=2)
ENDINGS = {"figure": (".png", ".svg", ".pdf"), "csv": (".csv",), "ply": (".ply",), "mcap": (".mcap",)}
"""Of the files of a map, by option."""
PLACES = "places.csv"
"""Table of the places of a slide with dither and of `palpate press --map`, in their folders: a line each."""
POLL = 0.5
"""Time between two looks for presses [s]."""


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
    fields: str | None = None
    """Columns of a table that are mapped beside the stiffness, as loss,depth_mm:mm; of logs, relaxation, loss
    and depth are mapped where presses show them."""
    each_contact: Annotated[bool, FLAG] = False
    "Each contact of a log is a press of its own, at its own place; else a log is one press."


@options(MAP)
class MapOptions:
    """Options of the map itself."""

    next: int = 5
    "How many next presses to choose."
    goal: Annotated[Literal["interval", "edge", "maximum"] | None, QUIET] = None
    """Purpose: the interval everywhere, the edge of what is stiffer, or the maximum; edge if
    --stiffer-than is given, else interval."""
    stiffer_than: Stiffness | None = None
    "A stiffness, as 2000 or 2:kN/m: lumps above it, their areas, and the probability at each place."
    until: float | None = None
    "A half-width of the interval in per cent: how many more presses bring it under that."
    common: float = 0.0
    "Standard deviation of an error that all presses share, such as the sensor's scale, in per cent."
    start: str | None = None
    "Where the robot stands, as 10,20:mm; with --way a next press costs the way to it."
    way: Length | None = None
    "That the robot travels in the time of one press, as 50:mm."
    live: Annotated[bool, FLAG] = False
    """Wait for more presses, and map them as they come, until Ctrl-C; a page that is written loads itself
    again."""

    def request(self) -> MapRequest:
        """The same for the library."""
        from palpate_maps.result import MapRequest

        if self.until is not None and not 0.0 < self.until < 1e3:
            raise InputError(f"--until must be above 0 %, got {self.until:g}")
        if not 0.0 <= self.common < 100.0:
            raise InputError(f"--common must be from 0 to 100 %, got {self.common:g}")
        if not 0 <= self.next <= 1000:
            raise InputError(f"--next must be from 0 to 1000, got {self.next}")
        for option, typed in (("--stiffer-than", self.stiffer_than), ("--way", self.way)):
            if typed is not None and typed.si <= 0.0:
                raise InputError(f"{option} must be above 0, got {str(typed)!r}")
        threshold, way = si(self.stiffer_than), float("inf") if self.way is None else self.way.si
        start = None
        if self.start is not None:
            numbers, symbol = split_spec(self.start)
            each = numbers.split(",")
            start = tuple(quantity("--start", f"{number}:{symbol or 'm'}", "length") for number in each)
        goal = self.goal or ("interval" if threshold is None else "edge")
        half = None if self.until is None else self.until / 100.0
        return MapRequest(self.next, goal, threshold, half, self.common / 100.0, start, way)


@options(WRITTEN)
class OutputOptions(ReportOption, JsonOption):
    """Files of a map, and their formats."""

    figure: Path | None = None
    "Where to write a picture of the map, PNG, SVG or PDF by its ending."
    csv: Path | None = None
    "Where to write the map as a table: place, stiffness, both intervals."
    ply: Path | None = None
    "Where to write the map as coloured points, for a viewer of point clouds."
    mcap: Path | None = None
    "Where to write the map as it grew, for Foxglove, Lichtblick and Rerun."

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
    asked: MapOptions | None = None,
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
    request = (asked or MapOptions()).request()
    if (places.table is None) == (not logs):
        raise InputError("palpate map needs logs or a folder of them, or --table with places and stiffnesses")
    if places.table is not None and (places.each_contact or any((source, frame, arm, fitted))):
        raise InputError(
            "--each-contact and the options of logs, frames, arms and models are of logs; a table's places and "
            "stiffnesses stand as they are: leave these options out"
        )
    from palpate_maps.result import map_of

    one = OneLog(
        fitted or ModelOptions(), source or LogOptions(), frame or FrameOptions(), arm or ArmOptions()
    )
    name = places.table.name if places.table else logs[0].name
    if asked is not None and asked.live:
        return _watch(lambda known: _growth(logs, places, one, known), request, output, name)
    result = map_of(_presses(logs, places, one), request)
    _write(result, output, name)
    _show(result, output)
    return 1 if result.presses.refused else 0


Known = dict[Path, tuple[tuple[int, int], "Presses | str", bool]]
"""Of files: time and size; the presses in them or the reason why there are none; whether they are those of now."""


def _watch(growth: Callable[[Known], Presses], request: MapRequest, output: OutputOptions, name: str) -> int:
    """Map again whenever there are other presses than before, until a signal; a map that fails is said once."""
    from palpate_maps.result import map_of

    known: Known = {}
    result: MapResult | None = None
    last: object = None
    with notice_signals() as interrupted:
        while not interrupted():
            try:
                presses = growth(known)
                new = (len(presses.names), len(presses.refused), float(presses.stiffness.sum()))
                if new != last:
                    last, result = new, map_of(presses, request)
                    _write(result, output, name, live=True)
                    _show(result, output)
            except InputError as error:
                if str(error) != last:
                    last = str(error)
                    console(stderr=True).print(f"waiting: {error}", markup=False)
            wait(POLL)
        if result is not None:
            _write(result, output, name)
    return interrupted.code


def _growth(logs: Sequence[Path], places: PlaceOptions, one: OneLog, known: Known) -> Presses:
    """The presses by now; a file is read when it has rested since the last look, and once."""
    from palpate.logs.formats import gather_logs
    from palpate_maps.presses import merge_presses

    for path in [places.table] if places.table is not None else gather_logs(logs):
        mark = ((state := path.stat()).st_mtime_ns, state.st_size)
        last, part, read = known.get(path, (None, "", False))
        if last == mark and not read:
            try:
                part = _presses([] if places.table else [path], places, one)
            except InputError as error:
                part = str(error)
            read = True
        known[path] = (mark, part, read and last == mark)
    found = {path: part for path, (_, part, _) in known.items() if part}
    parts = [part for part in found.values() if not isinstance(part, str)]
    refused = {path.name: part for path, part in found.items() if isinstance(part, str)}
    if not parts:
        raise InputError(next(iter(refused.values()), "no press yet"))
    presses = merge_presses(parts)
    return replace(presses, refused=presses.refused | refused)


def _presses(logs: Sequence[Path], places: PlaceOptions, one: OneLog) -> Presses:
    from palpate_maps.presses import merge_presses, read_logs, read_table

    if places.table is not None:
        if places.place is not None:
            raise InputError("--place is of logs; the columns of a table are given with --columns")
        columns, fields = (each.split(",") if each else () for each in (places.columns, places.fields))
        return read_table(places.table, columns, fields)
    if places.columns is not None or places.fields is not None:
        raise InputError("--columns and --fields are of --table; the place in logs is given with --place")
    from palpate.logs.formats import gather_logs

    with bar(console(stderr=True)) as progress:

        def track(paths: Sequence[Path]) -> Iterable[Path]:
            return progress.track(paths, description="identifying")

        named = places.place.split(",") if places.place else ()
        tables = [log / PLACES for log in logs if (log / PLACES).is_file()]
        rest = [log for log in logs if log / PLACES not in tables]
        parts = [replace(part, line=0.0 * part.stiffness) for part in (read_table(table) for table in tables)]
        if rest:
            parts.append(read_logs(gather_logs(rest), one.identifier, named, places.each_contact, track))
        return merge_presses(parts)


def _write(result: MapResult, output: OutputOptions, name: str, live: bool = False) -> None:
    from palpate_maps import report as page

    if output.figure is not None:
        from palpate.report.style import save

        save(page.draw_map(result), output.figure)
    writers = {"csv": result.write_csv, "ply": result.write_ply, "mcap": result.write_mcap}
    for kind, path in output.files.items():
        if kind in writers:
            writers[kind](path)
    if output.report is not None:
        write_text(output.report, page.page(result, f"Stiffness map of {name}", command(), live=live))


def _show(result: MapResult, output: OutputOptions) -> None:
    from palpate_maps.report import answer_of

    files = [(f"{kind}:", path) for kind, path in output.files.items()]
    print_result(answer_of(result), json=output.json, files=files)


def press_map(asked: AskOptions, simulated: SimulatedOptions, phantom: PhantomOptions, *, json: bool) -> int:
    """Press a phantom at places that the map chooses, and write presses, map and page into the folder of results.

    Returns:
        0; 130 if it was interrupted: the map of the presses until then is written.

    Raises:
        InputError: the phantom, the arm or an option is wrong, or an interruption before a map could be drawn.
    """
    from palpate.environments.kelvin_voigt import KelvinVoigt
    from palpate.units import plain
    from palpate_maps import report as page
    from palpate_maps.phantom import load_phantom, palpate_phantom

    assert phantom.map is not None
    if phantom.page is not None:
        check_place(phantom.page, "--page", ending=".html")
    surface = load_phantom(phantom.map)
    title = f"Phantom {phantom.map.stem}, {' × '.join(plain(1e3 * side, 3) for side in surface.size)} mm"
    request = MapOptions(stiffer_than=phantom.stiffer_than).request()
    question = simulated.question(asked, KelvinVoigt(surface.stiffness, surface.damping, 0.0))
    folder = simulated.out if simulated.out is not None else Path("runs") / f"map-{phantom.map.stem}"
    with notice_signals() as interrupted, fresh_folder(folder, replace=simulated.replace) as fresh:
        with bar(console(stderr=True)) as progress:
            task = progress.add_task("pressing", total=phantom.presses)

            def show(done: int, last: str) -> bool:
                progress.update(task, completed=done, description=last)
                return not interrupted()

            def grow(result: MapResult) -> None:
                if phantom.page is not None:
                    write_text(phantom.page, page.page(result, title, command(), live=True))

            result = palpate_phantom(question, surface, phantom.presses, request, show, grow)
        result.write_presses(fresh / PLACES)
        result.write_csv(fresh / "map.csv")
        write_json(fresh / "summary.json", with_author({"command": command(), **result.to_json()}))
        for path in filter(None, (fresh / "report.html", phantom.page)):
            write_text(path, page.page(result, title, command()))
    _show(result, OutputOptions(report=folder / "report.html", json=json))
    return interrupted.code if interrupted() else 0
