"""`palpate checks`: the conformance suite, run on a part of the user."""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from palpate.cli.options.common import JsonOption, PluginOptions
from palpate.cli.toolkit import console, print_answer, show_table
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate_checks.check import Check


def checks(
    name: str | None = None, /, *, own: PluginOptions | None = None, output: JsonOption | None = None
) -> int:
    """Check a controller, surface, identifier or wire of your own.

    The laws are those that every part of palpate keeps.

    palpate checks student:Damped

    palpate checks our_robot:OurWire?192.168.0.10

    Parameters
    ----------
    name
        Your part, module:Class, or an experiment's TOML file that names some; of a wire with ?WHERE behind it, its
        robot switched on and at rest. The module is searched among the
        installed ones, beside the file and in the current folder. Its name here imports it; a name in a file only with
        --plugins.
    """
    if name is None:
        raise InputError(
            "nothing to check; give module:Class, as in student:Damped, or an experiment's TOML file"
        )
    from palpate_checks.check import outcomes

    code = name.partition("?")[0]
    with (own or PluginOptions()).consent(given=code):
        found = {subject: list(outcomes(some)) for subject, some in _checks_of(name, code).items()}
    failed = sum(bool(one.failed) for some in found.values() for one in some)
    if output is not None and output.json:
        parts = {
            subject: [{"check": one.sentence, "failed": one.failed or None} for one in some]
            for subject, some in found.items()
        }
        print_answer({"parts": parts, "failed": failed})
        return 1 if failed else 0
    from palpate.report.page import Table

    screen = console()
    for subject, some in found.items():
        rows = [(one.sentence, one.failed or "holds") for one in some]
        show_table(screen, Table(subject, ("", ""), rows), ["red" if one.failed else "green" for one in some])
    total = sum(map(len, found.values()))
    screen.print(f"{failed} of {total} checks failed" if failed else f"all {total} checks hold")
    return 1 if failed else 0


def _checks_of(name: str, code: str) -> dict[str, list[Check]]:
    """The checks of a part, or of a wire with what is given to it, by what they are of."""
    from palpate.plugins import is_plugin, plugin
    from palpate_checks.of_plugin import checks_of

    part: Any = plugin(code).value() if is_plugin(code) and not code.endswith(".toml") else None
    if not all(hasattr(part, method) for method in ("read", "begin", "write", "stop")):
        return checks_of(name)
    for entry in entry_points(group="palpate.checks", name="wire"):
        return {f"wire {name}": entry.load()(lambda: part(name.partition("?")[2]))}
    raise InputError("the laws of a wire are those of palpate-rehearsal: pip install palpate[rehearsal]")
