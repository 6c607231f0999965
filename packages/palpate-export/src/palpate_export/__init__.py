"""An identified contact for a simulator: MuJoCo, Drake, Newton, or a plate on a spring in MJCF."""

from palpate_export.contact import Contact, Quantity, contact_from
from palpate_export.exporting import TARGETS, TOLERANCE, Checked, Exported, Request, check, prepare

__all__ = [
    "TARGETS",
    "TOLERANCE",
    "Checked",
    "Contact",
    "Exported",
    "Quantity",
    "Request",
    "check",
    "contact_from",
    "prepare",
]
