"""`palpate export`: an identified surface as the contact of a simulator's scene, or a law as C."""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, Literal

from palpate.cli.options import values
from palpate.cli.options.common import QUIET, WRITTEN, FileOptions, LoopArm, read_found
from palpate.cli.options.values import FLAG, SIGNED, only, options, vector
from palpate.cli.toolkit import STYLE, command, console, head, place, print_answer, show_table
from palpate.errors import InputError
from palpate.files import MADE, fresh_folder, whole, with_author, write_json, write_text

if TYPE_CHECKING:
    from palpate.export.contact import Given
    from palpate.export.exporting import Checked, Exported
    from palpate.force import Gains


@options("The scene", 1)
class SceneOptions:
    """The scene and its contact."""

    to: Literal["mujoco", "drake", "mjcf-spring", "c"]
    """mujoco, drake, mjcf-spring: a plate on a slide joint; or c: a law, with the gains of palpate
    tune."""
    model: Path | None = None
    "The scene: MJCF for mujoco, SDF or URDF for drake."
    geom: str | None = None
    "The surface: a geom of MJCF, a collision of SDF or URDF; without a scene, a name for it."
    probe: str | None = None
    "The probe: a geom or a collision; every one that can touch the surface if not given."


@options("Given parameters", 2)
class GivenOptions:
    """Numbers in place of identified ones."""

    stiffness: values.Stiffness | None = None
    "K in N/m, or with a unit as 20:kN/m: without a log, where K is not identified, or to override it."
    damping: values.Damping | None = None
    "B in N s/m, likewise; 0 for a pure spring."
    mass: values.Mass | None = None
    "M in kg of the plate of mjcf-spring, likewise."
    arm: Annotated[LoopArm | None, QUIET] = None
    """Arm by which the log was measured, as for palpate tune: its compliance is taken out of K where the log includes
    it, and a B that is not identified is assumed at the upper end of its interval."""
    working_point: Annotated[bool, FLAG] = False
    """Use the stiffness at the working point instead of the model's K, for a surface that no linear model
    explains."""

    def given(self) -> "Given":
        """The numbers, as `palpate.export` takes them."""
        from palpate.export.contact import Given
        from palpate.force import load_arm

        return Given(
            stiffness=values.si(self.stiffness),
            damping=values.si(self.damping),
            mass=values.si(self.mass),
            working_point=self.working_point,
            arm=None if self.arm is None else load_arm(self.arm),
        )


@options("A law in C", 3)
class LawOptions:
    """A law and its numbers."""

    law: str = "force-loop"
    "force-loop, from a gains file; sliding-loop, from gains of palpate tune --slide; or recursive-least-squares."
    into: Annotated[str, SIGNED] = "0,0,-1"
    "Direction into the surface for sliding-loop, x,y,z in the base's axes."
    parameters: Annotated[int, SIGNED] = 3
    "Number of parameters of recursive-least-squares, 3 or 4."
    forgetting: Annotated[float, SIGNED] = 1.0
    "Forgetting factor of recursive-least-squares."
    force: values.Force | None = None
    "Desired force for force-loop: with FOUND.json or --stiffness, and --arm, gains are tuned for it first."


@options(WRITTEN)
class ExportOutput(FileOptions):
    """Where the scene or the law is written."""

    out: Path | None = None
    """File to write, or folder for C; SCENE-GEOM beside the scene if not given. A comment in the file, and FILE.json
    beside it, list intervals and assumptions."""
    replace: Annotated[bool, FLAG] = False
    "Replace an earlier export."
    check: Annotated[bool, FLAG] = False
    """Press the contact in the simulator and print the errors of K and B; exit code 1 if one is above 0.1 %. For C:
    compile it here and repeat a million ticks of Python's; exit code 1 if one differs in a bit."""


def export(
    found: Path | None = None,
    /,
    *,
    scene: SceneOptions,
    parameters: GivenOptions | None = None,
    law: LawOptions | None = None,
    output: ExportOutput | None = None,
) -> int:
    """Write an identified surface as the contact of a simulator's scene, or a law in C.

    palpate identify press.csv --time time_s --position position_mm:mm --force force_N:N --json > found.json

    palpate export found.json --to mujoco --model scene.xml --geom foam --check

    palpate export gains.toml --to c --out force_loop --check

    palpate export --stiffness 20:kN/m --damping 50 --to drake --geom slab

    The scene's own file is not changed: the new file includes it (MuJoCo) or is a copy (Drake).

    Parameters
    ----------
    found
        The output of palpate identify --json; for a force loop in C the gains file of palpate tune.
    """
    parameters, output = parameters or GivenOptions(), output or ExportOutput()
    law = law or LawOptions()
    if scene.to != "c":
        only(law, "a law; add --to c")
        return export_scene(found, scene, parameters, output)
    if parameters.stiffness is None and (found is None or found.suffix.lower() != ".json"):
        only(replace(parameters, arm=None), "a scene; leave out --to c")
        return export_law(found, law, output)
    with TemporaryDirectory() as folder:
        gains = Path(folder) / "gains.toml"
        write_text(gains, _tuned(found, parameters, law).to_toml())
        return export_law(gains, law, output)


def _tuned(identified: Path | None, parameters: GivenOptions, law: LawOptions) -> "Gains":
    """Gains of a force loop for an identified surface or for given numbers.

    Raises:
        InputError: no arm or no force.
    """
    from palpate.force import Known, known_from, load_arm, tune
    from palpate.force.ceiling import usual_force_max

    if parameters.arm is None or law.force is None:
        raise InputError(
            "a law in C is of gains for an arm and a force; add --arm and --force, as --force 15:N"
        )
    if parameters.stiffness is None:
        assert identified is not None
        known = known_from(read_found(identified), str(identified))
    else:
        known = Known.of_range((parameters.stiffness.si,) * 2)
    arm, force = load_arm(parameters.arm), law.force.si
    known = known.with_damping_up_to(values.si(parameters.damping))
    return tune(arm, force, known, force_max=usual_force_max(force, arm.sensor)).gains


def export_scene(
    found: Path | None, scene: SceneOptions, parameters: GivenOptions, output: ExportOutput
) -> int:
    """Write the contact of an identified surface, and press it if that is wanted.

    Returns:
        The exit code: 1 if a press was wanted and an error is above the tolerance, or none was possible.

    Raises:
        InputError: nothing to export, a parameter that is not identified, a scene without such a surface.
    """
    from palpate.export.contact import contact_from, given_contact
    from palpate.export.exporting import Request, prepare

    given = parameters.given()
    request = Request(scene.to, scene.model, scene.geom, scene.probe)
    out = output.out or request.default_place()
    beside = out.with_name(f"{out.name}.json")
    _check_places((out, beside), output, scene.model)
    contact = given_contact(given) if found is None else contact_from(read_found(found), found.name, given)
    exported = prepare(contact, request, out)
    checked = _write(exported, out, output.check)
    answer = _as_json(exported, out, checked)
    write_json(beside, with_author(answer))
    _print(exported, answer, checked, (out, beside), json=output.json)
    verdicts = [check.within_tolerance for check in checked if check.within_tolerance is not None]
    return 1 if output.check and not (verdicts and all(verdicts)) else 0


def _check_places(places: tuple[Path, ...], output: ExportOutput, model: Path | None) -> None:
    for path in places:
        if model is not None and path.absolute() == model.absolute():
            raise InputError(f"--out {path} is the scene itself; name another file")
        output.check_new(path)


def _write(exported: "Exported", out: Path, check: bool) -> "list[Checked]":
    """Write the file and press its contact; a file that the engine refuses is removed."""
    from palpate import __version__

    mark = MADE.removeprefix("# ")
    with whole(out) as draft:
        draft.write_text(exported.with_comment(f"{mark} {__version__}"), encoding="utf-8", newline="\n")
        exported.validate(draft)
        return exported.check(draft) if check else []


def _as_json(exported: "Exported", out: Path, checked: "list[Checked]") -> dict[str, Any]:
    from palpate import __version__

    return {
        "file": str(out),
        **exported.to_json(),
        "check": [check.to_json() for check in checked] or None,
        "command": command(),
        "version": __version__,
    }


def _print(
    exported: "Exported",
    answer: dict[str, Any],
    checked: "list[Checked]",
    places: tuple[Path, ...],
    *,
    json: bool,
) -> None:
    if json:
        print_answer(answer)
        return
    screen = console()
    contact = exported.contact
    head(screen, exported.target, f": K = {contact.stiffness}; B = {contact.damping}")
    if checked:
        show_table(screen, _table(checked, exported.target))
        for check in checked:
            if check.note:
                screen.print(f"- pressed by {check.probe}: {check.note}", soft_wrap=True)
    for note in exported.notes:
        screen.print(f"- {note}", style=STYLE if "unstable" in note else "", soft_wrap=True)
    for path in places:
        place(screen, "written:", path)


def _table(checked: "list[Checked]", target: str) -> Any:
    from palpate.report.page import Table

    title = f"pressed in {target}"
    return Table(
        title, ("by", "K [N/m]", "error", "B [N s/m]", "error", "check"), [_row(check) for check in checked]
    )


def _row(check: "Checked") -> tuple[str, ...]:
    measured = check.pressed
    if measured is None:
        return check.probe, "-", "-", "-", "-", "failed" if check.reached else "not pressed"
    errors = [f"{100 * (error or 0.0):.2g} %" for error in (check.error_K, check.error_B)]
    numbers = f"{measured.stiffness:.7g}", errors[0], f"{measured.damping:.6g}", errors[1]
    return (check.probe, *numbers, "passed" if check.within_tolerance else "failed")


def export_law(gains: Path | None, options: LawOptions, output: ExportOutput) -> int:
    """Write a law as C, or check it, or both.

    Args:
        gains: a gains file, of the laws that have one.
        options: which law, and its numbers.
        output: where to, and whether to check.

    Returns:
        The exit code: 1 if a tick differs in a bit.

    Raises:
        InputError: nothing to do, no such law, a folder that is not ours, no compiler for the check.
    """
    from palpate import __version__
    from palpate.native.exporting import exported_law
    from palpate.native.replay import compiler

    if output.out is None and not output.check:
        raise InputError("nothing to do: give --out FOLDER, or --check, or both")
    into = vector("--into", options.into, "number")
    using = compiler()[0] if output.check else None
    with console(stderr=True).status("exporting") as status:
        place_of = (
            fresh_folder(output.out, replace=output.replace) if output.out is not None else nullcontext()
        )
        with place_of as draft:
            law = exported_law(
                options.law,
                gains,
                into=into,
                parameters=options.parameters,
                forgetting=options.forgetting,
                progress=status.update,
            )
            if draft is not None:
                law.fill(draft)
        status.update(f"checking {law.module.name} by {using}")
        ticks, unequal = law.check() if output.check else (0, 0)
    if output.json:
        checked = {"compiler": using, "ticks": ticks, "unequal": unequal} if output.check else None
        out = str(output.out) if output.out is not None else None
        print_answer(
            {
                "law": options.law,
                "name": law.module.name,
                "notes": list(law.module.notes),
                "out": out,
                "state_bytes": 8 * law.sources.numbers,
                "check": checked,
                "command": command(),
                "version": __version__,
            }
        )
        return int(unequal > 0)
    screen = console()
    head(screen, options.law, f": {law.module.name}, a state of {8 * law.sources.numbers} bytes")
    if output.check:
        screen.print(f"- {ticks} ticks by {using} beside Python: {unequal} differ in a bit", soft_wrap=True)
    if output.out is not None:
        place(screen, "written:", output.out)
    return int(unequal > 0)
