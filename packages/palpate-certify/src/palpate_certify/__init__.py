"""Others' force controllers on a spring, with delay: where they are stable, proved, and corrected numbers."""

from palpate_certify.controller_file import certify_controller
from palpate_certify.delayed_contact import DelayedContact

__all__ = ["DelayedContact", "certify_controller"]
