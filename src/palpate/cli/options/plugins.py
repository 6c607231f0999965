"""Code that a file names: it runs only by the user's word."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated

from cyclopts import Group, Parameter

from palpate.cli._terminal import confirmed, console
from palpate.cli.options.flags import FLAG


@Parameter(name="*", group=Group("Your own code", sort_key=2))
@dataclass(frozen=True, kw_only=True)
class PluginOptions:
    """Consent to run code."""

    plugins: Annotated[bool, FLAG] = False
    """Import and run the code that the file names, kind = "module:Class", with your rights. Without it, a
    question is asked at a terminal; elsewhere such a file is refused."""

    @contextmanager
    def consent(self, given: str = "") -> Iterator[None]:
        """Within the block, names of code are imported if the user agrees.

        Args:
            given: a name on the command line itself, which is the user's own word.
        """
        from palpate.plugins import consent

        with consent(lambda name: self.plugins or name == given or _asked(name)):
            yield


def _asked(name: str) -> bool:
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    return confirmed(
        console(stderr=True), f"the file names code, {name}, which runs with your rights. Run it?"
    )
