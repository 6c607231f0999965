"""Others' force controllers on a spring, with delay: where they are stable, proved, and corrected numbers."""

from palpate.analysis.delayed_contact import DelayedContact
from palpate.analysis.others_controllers import certify_controller

__all__ = ["DelayedContact", "certify_controller"]
