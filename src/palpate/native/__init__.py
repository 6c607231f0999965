"""Laws in C: a translator of the subset of Python that laws are written in, and packages of its output."""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.native.exporting import exported_law

__all__ = ["exported_law"]

__getattr__ = importer(__name__, {"exporting": ("exported_law",)})
