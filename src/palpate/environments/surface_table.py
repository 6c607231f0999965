"""The table by which an experiment asks for a surface."""

from typing import Any, ClassVar

from msgspec.structs import asdict

from palpate.signals.types import Table


class SurfaceTable(Table, tag_field="kind"):
    """The [surface] table of an experiment. Derive from it beside the part, with the word that is its `kind` as tag.

    ``part`` is the surface, whose fields bear the names of the table's.
    """

    part: ClassVar[type]

    def build(self) -> Any:
        """The surface that the table describes."""
        return self.part(**{name: float(value) for name, value in asdict(self).items()})
