"""A simulated arm maps a phantom: `palpate press --map`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from palpate.cli._answer import print_answer
from palpate.cli._program import command
from palpate.cli._streams import notice_signals
from palpate.cli._terminal import bar, console, show_answer
from palpate.cli._terminal import place as show_place
from palpate.cli.map import MapOptions
from palpate.cli.options.press import AskOptions, PhantomOptions, SimulatedOptions
from palpate.files import check_place, fresh_folder, with_author, write_json, write_text

if TYPE_CHECKING:
    from palpate.maps.result import MapResult


def press_map(asked: AskOptions, simulated: SimulatedOptions, phantom: PhantomOptions, *, json: bool) -> int:
    """Press a phantom at places that the map chooses, and write presses, map and page into the folder of results.

    Returns:
        0; 130 if it was interrupted: the map of the presses until then is written.

    Raises:
        InputError: the phantom, the arm or an option is wrong, or an interruption before a map could be drawn.
    """
    from palpate.environments.kelvin_voigt import KelvinVoigt
    from palpate.maps.phantom import load_phantom, palpate_phantom
    from palpate.report import map as page
    from palpate.report.numbers import plain

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
        result.write_presses(fresh / "places.csv")
        result.write_csv(fresh / "map.csv")
        write_json(fresh / "summary.json", with_author({"command": command(), **result.to_json()}))
        for path in filter(None, (fresh / "report.html", phantom.page)):
            write_text(path, page.page(result, title, command()))
    if json:
        print_answer(result.to_json())
    else:
        text = f": {page.sentence(result)}"
        screen = show_answer(f"{len(result.map)} presses", text, page.tables(result), page.warnings(result))
        show_place(screen, "report:", folder / "report.html")
    return interrupted.code if interrupted() else 0
