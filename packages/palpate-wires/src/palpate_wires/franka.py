"""The wire to a Franka, by pylibfranka in a process of its own: the controller's state in, speeds of the tool out."""

from importlib.util import find_spec

from palpate.errors import InputError
from palpate_wires.apart import ApartWire

PORT = 1337
FORM = "franka:ADDRESS"
_SIGNS = {"": 1.0, "force-sign=action": 1.0, "force-sign=reaction": -1.0}


class FrankaWire(ApartWire):
    """A Franka at an address, unlocked, with its interface (FCI) activated.

    The wrench is the controller's own estimate from the joints' torques, at the stiffness frame, in the base's axes;
    the pose is that of the end effector that the controller was told of. It follows the speed under joint
    impedance.

    Args:
        where: address of the controller, and `?force-sign=reaction` if its wrench turns out to have the other sign.

    Raises:
        InputError: pylibfranka is missing, or nothing at the address speaks as a Franka does.
    """

    answer = 5.0

    def __init__(self, where: str):
        address, _, sign = where.partition("?")
        if not address or sign not in _SIGNS:
            raise InputError(
                f"--wire needs {FORM} or {FORM}?force-sign=reaction (or action), got 'franka:{where}'"
            )
        if find_spec("pylibfranka") is None:
            raise InputError(
                "this wire needs pylibfranka: pip install 'palpate[franka]' (it has wheels for Linux alone)"
            )
        super().__init__(
            "franka_driver",
            [address, str(_SIGNS[sign])],
            f"no Franka answers at {address}, port {PORT}; check the address, that FCI is activated in Desk, and that"
            " no other program is connected",
        )
