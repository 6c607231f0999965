"""`palpate export` to a simulator: the scene with the contact, its check by a press, and the answer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli.options.common import read_found
from palpate.cli.toolkit import STYLE, command, console, head, place, print_answer, show_table
from palpate.errors import InputError
from palpate.files import MADE, whole, with_author, write_json
from palpate_export.contact import contact_from
from palpate_export.exporting import Request, check, prepare

if TYPE_CHECKING:
    from palpate.cli.export import ExportOutput, GivenOptions, SceneOptions
    from palpate_export.exporting import Checked, Exported


def export_scene(found: Path | None, scene: SceneOptions, given: GivenOptions, output: ExportOutput) -> int:
    """Write the contact of an identified surface, and press it if that is wanted.

    Returns:
        The exit code: 1 if a press was wanted and an error is above the tolerance, or none was possible.

    Raises:
        InputError: nothing to export, a parameter that is not identified, a scene without such a surface.
    """
    if found is None:
        raise InputError("nothing to export; give the output of palpate identify --json")
    request = Request(scene.to, scene.model, scene.geom, scene.probe)
    out = output.out or request.default_place()
    beside = out.with_name(f"{out.name}.json")
    _check_places((out, beside), output, scene.model)
    contact = contact_from(
        read_found(found),
        found.name,
        damping=given.damping,
        mass=given.mass,
        working_point=given.working_point,
    )
    exported = prepare(contact, request, out)
    checked = _write(exported, out, output.check)
    told = _as_json(exported, out, checked)
    write_json(beside, with_author(told))
    _print(exported, told, checked, (out, beside), json=output.json)
    verdicts = [one.within_tolerance for one in checked if one.within_tolerance is not None]
    return 1 if output.check and not (verdicts and all(verdicts)) else 0


def _check_places(places: tuple[Path, ...], output: ExportOutput, model: Path | None) -> None:
    for path in places:
        if model is not None and path.absolute() == model.absolute():
            raise InputError(f"--out {path} is the scene itself; name another file")
        output.check_new(path)


def _write(exported: Exported, out: Path, wanted: bool) -> list[Checked]:
    """Write the file and press its contact; a file that the engine refuses is removed."""
    from palpate import __version__

    mark = MADE.removeprefix("# ")
    with whole(out) as draft:
        draft.write_text(exported.with_comment(f"{mark} {__version__}"), encoding="utf-8", newline="\n")
        exported.validate(draft)
        return check(exported, draft) if wanted else []


def _as_json(exported: Exported, out: Path, checked: list[Checked]) -> dict[str, Any]:
    from palpate import __version__

    return {
        "file": str(out),
        **exported.to_json(),
        "check": [one.to_json() for one in checked] or None,
        "command": command(),
        "version": __version__,
    }


def _print(
    exported: Exported, told: dict[str, Any], checked: list[Checked], places: tuple[Path, ...], *, json: bool
) -> None:
    if json:
        print_answer(told)
        return
    screen = console()
    own = exported.contact
    head(screen, exported.target, f": K = {own.stiffness}; B = {own.damping}")
    if checked:
        show_table(screen, _table(checked, told))
        for one in checked:
            if one.note:
                screen.print(f"- pressed by {one.probe}: {one.note}", soft_wrap=True)
    for note in exported.notes:
        screen.print(f"- {note}", style=STYLE if "unstable" in note else "", soft_wrap=True)
    for path in places:
        place(screen, "written:", path)


def _table(checked: list[Checked], told: dict[str, Any]) -> Any:
    from palpate.report.page import Table

    title = f"pressed in {told['to']}"
    return Table(
        title, ("by", "K [N/m]", "error", "B [N s/m]", "error", "check"), [_row(one) for one in checked]
    )


def _row(one: Checked) -> tuple[str, ...]:
    measured = one.pressed
    if measured is None:
        return one.probe, "-", "-", "-", "-", "failed" if one.reached else "not pressed"
    errors = [f"{100 * (error or 0.0):.2g} %" for error in (one.error_K, one.error_B)]
    numbers = f"{measured.stiffness:.7g}", errors[0], f"{measured.damping:.6g}", errors[1]
    return (one.probe, *numbers, "passed" if one.within_tolerance else "failed")
