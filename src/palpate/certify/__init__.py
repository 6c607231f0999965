"""Stability of force loops: certificates of tuned gains and their independent check, and laws of other projects."""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.certify.controller_answer import LawVerdict
    from palpate.certify.linear_law import certify_law, transfer_function

__all__ = ["LawVerdict", "certify_law", "transfer_function"]
__getattr__ = importer(
    __name__,
    {"controller_answer": ("LawVerdict",), "linear_law": ("certify_law", "transfer_function")},
)
