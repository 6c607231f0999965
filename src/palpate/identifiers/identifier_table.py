"""The table by which an experiment asks for an identifier that watches its run."""

from typing import Any

from palpate.signals.types import Table


class IdentifierTable(Table, tag_field="kind"):
    """The [identifier] table of an experiment. Derive from it beside the estimator, with its `kind` as tag."""

    def made(self, tick: float) -> Any:
        """The estimator of (M, B, K) at its start, for a time between samples [s]."""
        raise NotImplementedError


VAGUE = (10.0, 1e4, 1e6)
"""Standard deviation of M [kg], B [N s/m] and K [N/m] before anything is known."""
NAMES = ("M", "B", "K")
