"""`palpate checks`: the conformance suite, run on a part of the user."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from palpate.cli.options.common import JsonOption, PluginOptions
from palpate.cli.toolkit import console, print_answer, show_table
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.testing.check import Check


def checks(
    name: str | None = None, /, *, plugins: PluginOptions | None = None, output: JsonOption | None = None
) -> int:
    """Check a controller, surface, identifier or wire of your own.

    The checks are those that every part of palpate passes.

    palpate checks student:Damped

    palpate checks our_robot:OurWire?192.168.0.10

    Parameters
    ----------
    name
        module:Class of your part, or an experiment's TOML file that names parts. A wire is module:Class?ADDRESS, and
        its robot must be on and at rest. The module is searched for among the installed ones, beside the file and in
        the current folder. A name typed here is imported; a name in a file only with --plugins.
    """
    if name is None:
        raise InputError(
            "nothing to check; give module:Class, as in student:Damped, or an experiment's TOML file"
        )
    from palpate.testing.check import outcomes

    code = name.partition("?")[0]
    with (plugins or PluginOptions()).consent(given=code):
        results = {
            subject: list(outcomes(part_checks)) for subject, part_checks in _part_checks(name, code).items()
        }
    failed = sum(bool(check.failed) for part_checks in results.values() for check in part_checks)
    if output is not None and output.json:
        parts = {
            subject: [{"check": check.sentence, "failed": check.failed or None} for check in part_checks]
            for subject, part_checks in results.items()
        }
        print_answer({"parts": parts, "failed": failed})
        return 1 if failed else 0
    from palpate.report.page import Table

    screen = console()
    for subject, part_checks in results.items():
        rows = [(check.sentence, check.failed or "holds") for check in part_checks]
        show_table(
            screen,
            Table(subject, ("", ""), rows),
            ["red" if check.failed else "green" for check in part_checks],
        )
    total = sum(map(len, results.values()))
    screen.print(f"{failed} of {total} checks failed" if failed else f"all {total} checks hold")
    return 1 if failed else 0


def _part_checks(name: str, code: str) -> dict[str, list[Check]]:
    """The checks of a part, or of a wire with what is given to it, by what they are of."""
    from palpate.plugins import is_plugin, plugin
    from palpate.testing.check import checks_of
    from palpate.testing.wires import wire_checks

    part: Any = plugin(code).value() if is_plugin(code) and not code.endswith(".toml") else None
    if not all(hasattr(part, method) for method in ("read", "begin", "write", "stop")):
        return checks_of(name)
    return {f"wire {name}": wire_checks(lambda: part(name.partition("?")[2]))}
