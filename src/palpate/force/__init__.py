"""Force control that certifies itself: gains, the proof of where they are stable, and a law that stays inside."""

from palpate.force.arm import Arm, load_arm
from palpate.force.certificate import Certificate
from palpate.force.certifying import certify
from palpate.force.force_loop import ForceLoop
from palpate.force.gains import Gains, load_gains
from palpate.force.known_surface import Known, known_from
from palpate.force.sliding.sliding_loop import SlidingLoop
from palpate.force.sliding.turning_tool import TurningTool
from palpate.force.tuning import Tuning, tune

__all__ = [
    "Arm",
    "Certificate",
    "ForceLoop",
    "Gains",
    "Known",
    "SlidingLoop",
    "Tuning",
    "TurningTool",
    "certify",
    "known_from",
    "load_arm",
    "load_gains",
    "tune",
]
