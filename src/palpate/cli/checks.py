"""`palpate checks`: the conformance suite, run on a part of the user."""

from __future__ import annotations

from palpate.cli._program import print_answer
from palpate.cli._terminal import console, show_table
from palpate.cli.options.common import JsonOption, PluginOptions
from palpate.errors import InputError


def checks(
    name: str | None = None, /, *, own: PluginOptions | None = None, output: JsonOption | None = None
) -> int:
    """Run palpate's conformance suite on your own controller, surface or identifier.

    palpate checks student:Damped

    Parameters
    ----------
    name
        Your part, module:Class, or an experiment's TOML file that names some. The module is searched among the
        installed ones, beside the file and in the current folder. Its name here imports it; a name in a file only with
        --plugins.
    """
    if name is None:
        raise InputError(
            "nothing to check; give module:Class, as in student:Damped, or an experiment's TOML file"
        )
    from palpate.checks.check import outcomes
    from palpate.checks.of_plugin import checks_of

    with (own or PluginOptions()).consent(given=name):
        found = {subject: list(outcomes(some)) for subject, some in checks_of(name).items()}
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
