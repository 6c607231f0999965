"""`palpate export --to c`: a law as a folder of C, and the check that it is Python's to the last bit."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from palpate import __version__
from palpate.cli.options.values import vector
from palpate.cli.toolkit import command, console, head, place, print_answer
from palpate.errors import InputError
from palpate.files import fresh_folder
from palpate_native.exporting import LawRequest, exported_law
from palpate_native.replay import compiler

if TYPE_CHECKING:
    from palpate.cli.export import ExportOutput, LawOptions


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
    if output.out is None and not output.check:
        raise InputError("nothing to do: give --out FOLDER, or --check, or both")
    into = vector("--into", options.into, "number")
    request = LawRequest(gains=gains, **{**asdict(options), "into": into})
    using = compiler()[0] if output.check else None
    with console(stderr=True).status("exporting") as status:
        place_of = (
            fresh_folder(output.out, replace=output.replace) if output.out is not None else nullcontext()
        )
        with place_of as draft:
            law = exported_law(request, status.update)
            if draft is not None:
                law.fill(draft, __version__)
        status.update(f"checking {law.module.name} by {using}")
        ticks, unequal = law.check() if output.check else (0, 0)
    if output.json:
        checked = {"compiler": using, "ticks": ticks, "unequal": unequal} if output.check else None
        out = str(output.out) if output.out is not None else None
        print_answer(
            {
                "law": request.law, "name": law.module.name, "notes": list(law.module.notes), "out": out,
                "state_bytes": 8 * law.sources.numbers, "check": checked, "command": command(), "version": __version__,
            }
        )  # fmt: skip
        return int(unequal > 0)
    screen = console()
    head(screen, request.law, f": {law.module.name}, a state of {8 * law.sources.numbers} bytes")
    if output.check:
        screen.print(f"- {ticks} ticks by {using} beside Python: {unequal} differ in a bit", soft_wrap=True)
    if output.out is not None:
        place(screen, "written:", output.out)
    return int(unequal > 0)
