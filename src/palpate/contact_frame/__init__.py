"""From a wrench and a pose in three dimensions to a force and a position along the contact's normal.

A wrist's force sensor shows f = R^T (s F + w) + b: the force F that the tool exerts, turned into the tool's axes by
its rotation R and with a sign s that drivers choose, the tool's weight w and the sensor's bias b. The pose p, R of a
frame on the tool gives the point that touches, p + R r. Along the normal n these are F n and (p + R r) n.
"""

from __future__ import annotations

from palpate.contact_frame.arm import describe, robot_stiffness, with_arm
from palpate.contact_frame.load import Payload, load_payload
from palpate.contact_frame.load_files import compare, load_text, read_load
from palpate.contact_frame.projecting import identify_contact, project
from palpate.contact_frame.signals_in_base import ArmDynamics, ContactFrame
from palpate.contact_frame.tool_payload import Weighed, weigh

__all__ = [
    "ArmDynamics",
    "ContactFrame",
    "Payload",
    "Weighed",
    "compare",
    "describe",
    "identify_contact",
    "load_payload",
    "load_text",
    "project",
    "read_load",
    "robot_stiffness",
    "weigh",
    "with_arm",
]
