"""Options that name the signals of a log and how they are read."""

# No annotations from the future: cyclopts looks at those of a base class in the module of whoever inherits them.
from dataclasses import dataclass
from typing import Annotated

from cyclopts import Group, Parameter

from palpate.cli.options.values import SIGNED
from palpate.logs.signals import Rotation, Signals  # noqa: F401 - cyclopts looks for Rotation here


@Parameter(name="*", group=Group("Signals of the log", sort_key=1))
@dataclass(frozen=True, kw_only=True)
class LogOptions(Signals):
    """Columns or topics of a log, and which rows of it."""

    force: Annotated[str | None, Parameter(name=["--force-column", "--force"])] = None
    "Column of the force, in N if no unit is given; g is the reading of a scale. TOPIC.FIELD of a bag."
    start: Annotated[float | None, SIGNED] = None
    "Leave out the rows before, in seconds from the first row."
    missing: Annotated[tuple[str, ...], Parameter(allow_leading_hyphen=True, negative=())] = ()
    'A value that means "no reading", as -1; may be repeated. Common ones are detected.'
