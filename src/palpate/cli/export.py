"""`palpate export`: an identified surface as the contact of a simulator's scene, or a law as C."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Group, Parameter

from palpate.cli._answer import print_answer
from palpate.cli._export_law import LawOptions, export_law
from palpate.cli._one_log import read_found
from palpate.cli._program import command
from palpate.cli._terminal import STYLE, console, head, place, show_table
from palpate.cli.options.flags import FLAG, SIGNED
from palpate.cli.options.written import WRITTEN, FileOptions
from palpate.errors import InputError
from palpate.files import MADE, signed, whole, write_json

if TYPE_CHECKING:
    from palpate.export import Checked, Exported


@Parameter(name="*", group=Group("The scene", sort_key=1))
@dataclass(frozen=True, kw_only=True)
class SceneOptions:
    """The scene and its contact.

    Parameters
    ----------
    to
        mujoco, drake, newton, mjcf-spring: a plate on a slide joint; or c: a law, with the gains of palpate tune.
    model
        The scene: MJCF for mujoco, SDF or URDF for drake.
    geom
        The surface: a geom of MJCF, a collision of SDF or URDF; without a scene, its name.
    probe
        The probe, likewise; every geom that can touch the surface if not given.
    """

    to: Literal["mujoco", "drake", "newton", "mjcf-spring", "c"]
    model: Path | None = None
    geom: str | None = None
    probe: str | None = None


@Parameter(name="*", group=Group("Given parameters", sort_key=2))
@dataclass(frozen=True, kw_only=True)
class GivenOptions:
    """Numbers in place of identified ones.

    Parameters
    ----------
    damping
        B in N s/m, if it was not identified, or to override it; 0 for a pure spring.
    mass
        M in kg of the plate of mjcf-spring, likewise.
    working_point
        Use the stiffness at the working point instead of the model's K, for a surface that no linear model explains.
    """

    damping: Annotated[float | None, SIGNED] = None
    mass: Annotated[float | None, SIGNED] = None
    working_point: Annotated[bool, FLAG] = False


@Parameter(name="*", group=WRITTEN)
@dataclass(frozen=True, kw_only=True)
class OutputOptions(FileOptions):
    """Files to write.

    Parameters
    ----------
    out
        The file; SCENE-GEOM beside the scene if not given. A comment in it, and FILE.json beside it, list intervals
        and assumptions. Of C the folder.
    replace
        Replace an earlier export.
    check
        Press the contact in the simulator, and state the error in K and B; exit code 1 if one is above 0.1 %. Of C:
        compile it here, and repeat a million ticks of Python's; exit code 1 if one differs in a bit.
    """

    out: Path | None = None
    replace: Annotated[bool, FLAG] = False
    check: Annotated[bool, FLAG] = False


def export(
    found: Path | None = None,
    /,
    *,
    scene: SceneOptions,
    given: GivenOptions | None = None,
    law: LawOptions | None = None,
    output: OutputOptions | None = None,
) -> int:
    """Write an identified surface as the contact of a simulator's scene, and press it there; or a law as C.

    palpate identify press.csv --time time_s --position position_mm:mm --force force_N:N --json > found.json

    palpate export found.json --to mujoco --model scene.xml --geom foam --check

    palpate export gains.toml --to c --out force_loop --check

    The scene's own file is not changed: the new file includes it (MuJoCo) or is a copy (Drake).

    Parameters
    ----------
    found
        The output of palpate identify --json; for a force loop in C the gains file of palpate tune.
    """
    given, output = given or GivenOptions(), output or OutputOptions()
    if scene.to == "c":
        return export_law(found, law or LawOptions(), output)
    from palpate.export import Request, contact_from, prepare

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
    write_json(beside, signed(told))
    _print(exported, told, checked, (out, beside), json=output.json)
    verdicts = [one.within_tolerance for one in checked if one.within_tolerance is not None]
    return 1 if output.check and not (verdicts and all(verdicts)) else 0


def _check_places(places: tuple[Path, ...], output: OutputOptions, model: Path | None) -> None:
    for path in places:
        if model is not None and path.absolute() == model.absolute():
            raise InputError(f"--out {path} is the scene itself; name another file")
        output.check_new(path)


def _write(exported: Exported, out: Path, wanted: bool) -> list[Checked]:
    """Write the file and press its contact; a file that the engine refuses is removed."""
    from palpate import __version__
    from palpate.export import check

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
