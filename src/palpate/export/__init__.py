"""An identified contact for a simulator: MuJoCo, Drake, or a plate on a spring in MJCF."""

from palpate.export.contact import Contact, Quantity, contact_from
from palpate.export.exporting import TARGETS, TOLERANCE, Checked, Exported, Request, prepare

__all__ = [
    "TARGETS",
    "TOLERANCE",
    "Checked",
    "Contact",
    "Exported",
    "Quantity",
    "Request",
    "contact_from",
    "prepare",
]
