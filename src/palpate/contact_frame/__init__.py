"""Force and position along the contact's normal, from a wrench and a pose in three dimensions.

A wrist's force sensor shows f = R^T (s F + w) + b: the force F that the tool exerts, turned into the tool's axes by
its rotation R and with a sign s that drivers choose, the tool's weight w and the sensor's bias b. The pose p, R of a
frame on the tool gives the point that touches, p + R r. Along the normal n these are F n and (p + R r) n.

Its names are looked up when they are first used: a record of one axis waits for no weighing.
"""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.contact_frame.arm import ArmDynamics, describe, robot_stiffness, with_arm
    from palpate.contact_frame.axis_friction import AxisFriction, identify_friction
    from palpate.contact_frame.payload import Payload, load_payload, load_text
    from palpate.contact_frame.press_or_slide import identify_contact
    from palpate.contact_frame.projecting import project
    from palpate.contact_frame.signals_in_base import ContactFrame
    from palpate.contact_frame.tool_payload import Weighed, weigh

__all__ = [
    "ArmDynamics",
    "AxisFriction",
    "ContactFrame",
    "Payload",
    "Weighed",
    "describe",
    "identify_contact",
    "identify_friction",
    "load_payload",
    "load_text",
    "project",
    "robot_stiffness",
    "weigh",
    "with_arm",
]

_HOMES = {
    "arm": ("ArmDynamics", "describe", "robot_stiffness", "with_arm"),
    "axis_friction": ("AxisFriction", "identify_friction"),
    "press_or_slide": ("identify_contact",),
    "payload": ("Payload", "load_payload", "load_text"),
    "projecting": ("project",),
    "signals_in_base": ("ContactFrame",),
    "tool_payload": ("Weighed", "weigh"),
}
__getattr__ = importer(__name__, _HOMES)
