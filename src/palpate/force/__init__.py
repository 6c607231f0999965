"""Force control that certifies itself: gains, the proof of where they are stable, and a law that stays inside.

Its names are looked up when they are first used: what reads an arm's file waits for no proof.
"""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.force.arm import Arm, load_arm
    from palpate.force.certificate import Certificate
    from palpate.force.certifying import certify
    from palpate.force.force_loop import ForceLoop
    from palpate.force.gains import Gains, gains_for, load_gains
    from palpate.force.known_surface import Known, known_from
    from palpate.force.simulated_press import surface
    from palpate.force.slide_table import Slide
    from palpate.force.sliding.sliding_loop import SlidingLoop
    from palpate.force.sliding.turning_tool import TurningTool
    from palpate.force.tuning import Tuning, tune

__all__ = [
    "Arm",
    "Certificate",
    "ForceLoop",
    "Gains",
    "Known",
    "Slide",
    "SlidingLoop",
    "Tuning",
    "TurningTool",
    "certify",
    "gains_for",
    "known_from",
    "load_arm",
    "load_gains",
    "surface",
    "tune",
]

_HOMES = {
    "simulated_press": ("surface",),
    "slide_table": ("Slide",),
    "arm": ("Arm", "load_arm"),
    "certificate": ("Certificate",),
    "certifying": ("certify",),
    "force_loop": ("ForceLoop",),
    "gains": ("Gains", "load_gains", "gains_for"),
    "known_surface": ("Known", "known_from"),
    "sliding.sliding_loop": ("SlidingLoop",),
    "sliding.turning_tool": ("TurningTool",),
    "tuning": ("Tuning", "tune"),
}
__getattr__ = importer(__name__, _HOMES)
