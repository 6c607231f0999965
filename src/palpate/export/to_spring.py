"""A plate on a slide joint with a spring and a damper, in MJCF: exact in the plate's own displacement."""

from pathlib import Path
from xml.sax.saxutils import quoteattr

from palpate.errors import InputError
from palpate.export.contact import Contact
from palpate.export.pressing import RigPress
from palpate.robots.serial.loading import mujoco, refusals

HALF_SIZE = (0.05, 0.05, 0.005)
"""Half of the plate's size [m]."""
JOINT_NOTE = (
    "K and B hold for the displacement of the plate's joint; the probe also penetrates the plate, by the scene's"
    " contact law"
)
PLACE_NOTE = "at rest the plate's upper side is at z = 0 and its joint at 0; a press moves it down"


def plate(contact: Contact, name: str) -> str:
    """The plate, as a model of its own that can be compiled, attached or included.

    Args:
        contact: with a mass.
        name: of body, joint and geom.

    Raises:
        InputError: the contact has no mass.
    """
    if contact.mass is None:
        raise InputError(
            f"{contact.source}: a plate on a spring has a mass, and none is identified; give a small one with --mass"
            " (kg), far below that of the probe"
        )
    title = quoteattr(name)
    K, B, M = contact.stiffness.value, contact.damping.value, contact.mass.value
    size = " ".join(f"{half:g}" for half in HALF_SIZE)
    return f"""<mujoco model={title}>
  <worldbody>
    <body name={title}>
      <joint name={title} type="slide" axis="0 0 -1" stiffness="{K:.17g}" damping="{B:.17g}"/>
      <geom name={title} type="box" size="{size}" pos="0 0 {-HALF_SIZE[2]:g}" mass="{M:.17g}"/>
    </body>
  </worldbody>
</mujoco>
"""


def read_joint(path: Path, force: float) -> RigPress:
    """K and B of the plate's joint in a file, from the forces with which MuJoCo answers a displacement and a speed.

    Args:
        path: of the file.
        force: of the press [N].
    """
    with refusals(str(path)):
        model = mujoco().MjModel.from_xml_path(str(path))
    stiffness = -_passive_force(model, 1.0, 0.0)
    damping = -_passive_force(model, 0.0, 1.0)
    return RigPress(
        stiffness=stiffness,
        damping=damping,
        depth=force / stiffness,
        force=force,
        residual=0.0,
        mass=float(model.body_mass[1]),
        time_step=float(model.opt.timestep),
        samples=2,
    )


def _passive_force(model: object, position: float, velocity: float) -> float:
    """Force of spring and damper on the joint at a position [m] and a velocity [m/s]."""
    data = mujoco().MjData(model)
    data.qpos[0], data.qvel[0] = position, velocity
    mujoco().mj_forward(model, data)
    return float(data.qfrc_passive[0])
