"""A plate on a slide joint with a spring and a damper, in MJCF: exact of the plate's own displacement, in any scene."""

from __future__ import annotations

from typing import Any
from xml.sax.saxutils import quoteattr

from palpate.errors import InputError
from palpate.export.contact import Contact
from palpate.export.mujoco_rig import MuJoCoRig
from palpate.export.rig import Pressed, press, touch
from palpate.robots.serial._extra import mujoco, refusals

_HALF = (0.05, 0.05, 0.005)
"""Of the plate [m]."""
_PROBE = 1.0
"""Mass of the sphere that presses on it in a check [kg]."""

_OWN = (
    "K and B are those of the plate's own displacement, the joint's; a probe sinks into the plate besides, as the"
    " scene's contact has it"
)
NOTES = (
    _OWN,
    "unpressed, the plate's upper side is at z = 0 and its joint at 0; it goes down as it is pressed",
)


def check_mass(contact: Contact, source: str) -> None:
    """Refuse a contact without a mass: a plate has one.

    Raises:
        InputError: none was identified or given.
    """
    if contact.mass is None:
        raise InputError(
            f"{source}: a plate on a spring has a mass, and none is identified; give a small one with --mass (kg),"
            " far below that of the probe"
        )


def xml(contact: Contact, name: str) -> str:
    """The plate, as a model of its own that can be compiled, attached or included.

    Args:
        contact: with a mass.
        name: of body, joint and geom.
    """
    assert contact.mass is not None
    own = quoteattr(name)
    K, B, M = contact.stiffness.value, contact.damping.value, contact.mass.value
    size = " ".join(f"{half:g}" for half in _HALF)
    return f"""<mujoco model={own}>
  <worldbody>
    <body name={own}>
      <joint name={own} type="slide" axis="0 0 -1" stiffness="{K:.17g}" damping="{B:.17g}"/>
      <geom name={own} type="box" size="{size}" pos="0 0 {-_HALF[2]:g}" mass="{M:.17g}"/>
    </body>
  </worldbody>
</mujoco>
"""


def press_plate(text: str, contact: Contact, name: str, force: float) -> Pressed | None:
    """Press the plate with a sphere, and read K and B of the plate's displacement."""
    probe = (
        '<body name="palpate-probe" pos="0 0 0.1"><joint type="slide" axis="0 0 1"/>'
        f'<geom name="palpate-probe" type="sphere" size="0.02" mass="{_PROBE:g}"/></body>'
    )
    pair = f'<contact><pair geom1={quoteattr(name)} geom2="palpate-probe"/></contact>'
    whole = text.replace("</worldbody>", f"{probe}</worldbody>{pair}")
    with refusals("the plate"):
        model = mujoco().MjModel.from_xml_string(whole)
    rig = MuJoCoRig(model, _geom(model, name), _geom(model, "palpate-probe"), plate=0)
    if touch(rig) is None:
        return None
    return press(rig, contact.stiffness.value, force)


def _geom(model: Any, name: str) -> int:
    return int(mujoco().mj_name2id(model, mujoco().mjtObj.mjOBJ_GEOM, name))
