"""`palpate export --to c`: a law as a folder of C, and the check that it is Python's to the last bit."""

# No annotations from the future: cyclopts looks at them in the module of the command.
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

from palpate.cli._answer import print_answer
from palpate.cli._program import command
from palpate.cli._terminal import console, head, place
from palpate.cli.options.flags import SIGNED
from palpate.cli.options.values import vector
from palpate.errors import InputError


@Parameter(name="*", group=Group("The law, of C", sort_key=3))
@dataclass(frozen=True, kw_only=True)
class LawOptions:
    """A law and its numbers.

    Parameters
    ----------
    law
        force-loop, of a gains file; sliding-loop, of one of palpate tune --slide; contact-identifier; or
        recursive-least-squares.
    into
        Of sliding-loop: direction into the surface, x,y,z in the base's axes.
    parameters
        Of recursive-least-squares, 3 or 4.
    forgetting
        Of recursive-least-squares: its forgetting factor.
    low_pass
        Of contact-identifier: the force sensor's low-pass.
    rate
        Of contact-identifier: ticks a second in Hz.
    lag
        Of contact-identifier: how late the force is, its low-pass included, in s.
    sampling
        Of contact-identifier: samples of the force sensor a second in Hz, if not one a tick.
    """

    law: str = "force-loop"
    into: Annotated[str, SIGNED] = "0,0,-1"
    parameters: Annotated[int, SIGNED] = 3
    forgetting: Annotated[float, SIGNED] = 1.0
    low_pass: str = "butterworth3:120"  # noqa: S105 - a filter
    rate: Annotated[float, SIGNED] = 1000.0
    lag: Annotated[float, SIGNED] = 0.003
    sampling: Annotated[float | None, SIGNED] = None


def export_law(gains: Path | None, options: LawOptions, output: Any) -> int:
    """Writes a law as C, or checks it, or both; exit code 1 if a tick differs in a bit."""
    from contextlib import nullcontext
    from dataclasses import asdict

    from palpate import __version__
    from palpate.files import fresh_folder
    from palpate.native.exporting import LawRequest, exported_law
    from palpate.native.replay import compiler

    if output.out is None and not output.check:
        raise InputError("nothing to do: give --out FOLDER, or --check, or both")
    into = vector("into", options.into, "number")
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
