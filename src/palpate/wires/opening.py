"""Opens a wire by its address: KIND:WHERE without any default, or module:Class of the user's."""

import re
import sys

from palpate.errors import InputError, unknown
from palpate.plugins import plugin
from palpate.wires.ros2 import FORM
from palpate.wires.wire import Wire

KINDS = {"sim": "sim:HOST:PORT", "rtde": "rtde:ADDRESS", "franka": "franka:ADDRESS", "ros2": FORM}
_OWN = re.compile(r"([a-zA-Z_][\w.]*:[a-zA-Z_]\w*)(?:\?(.*))?")
"""`module:Class?WHERE`: a class of the user's."""


def open_wire(address: str) -> Wire:
    """The wire at an address such as `sim:127.0.0.1:4000`.

    Raises:
        InputError: an address that is none, a library that is missing, an arm that does not answer.
    """
    kind, colon, where = address.partition(":")
    name, wire_class = wire_class_name(address)
    if name is not None:
        return _own(name, wire_class)
    if kind not in KINDS:
        raise unknown("wire", kind, [*KINDS, "module:Class"])
    if not colon or not where.strip():
        raise InputError(
            f"--wire needs the arm's address, as {KINDS[kind]}, got {address!r}; there is no default"
        )
    return _OPENERS[kind](where.strip())


def wire_class_name(address: str) -> tuple[str | None, str]:
    """The code that an address names, `module:Class`, and what is given to it; None of a wire that palpate has."""
    match = _OWN.fullmatch(address)
    if match is None or address.partition(":")[0] in KINDS:
        return None, ""
    return match[1], match[2] or ""


def _own(name: str, where: str) -> Wire:
    from palpate.wires.subprocess_wire import SubprocessWire

    path = [folder for folder in (plugin(name).folder, *sys.path) if folder]
    return SubprocessWire("host", [name, where, *path], f"{name} does not open its arm")


def _sim(where: str) -> Wire:
    from palpate.wires.sim import SimWire

    host, colon, port = where.rpartition(":")
    if not colon or not port.isdecimal() or not 0 < int(port) < 65536:
        raise InputError(f"--wire needs {KINDS['sim']}, as sim:127.0.0.1:4000, got 'sim:{where}'")
    return SimWire(host, int(port))


def _rtde(where: str) -> Wire:
    from palpate.wires.ur import UrWire

    _check_no_port("rtde", where, "30004 and others")
    return UrWire(where)


def _ros2(where: str) -> Wire:
    from palpate.wires.ros2 import Ros2Wire

    return Ros2Wire(where)


def _franka(where: str) -> Wire:
    from palpate.wires.franka import FrankaWire

    _check_no_port("franka", where, "1337")
    return FrankaWire(where)


def _check_no_port(kind: str, where: str, ports: str) -> None:
    address, colon, rest = where.partition("?")[0].partition(":")
    if colon and ":" not in rest:  # an IPv6 address has more of them
        raise InputError(
            f"--wire {kind}:{where} has a port; it is {ports} on every controller: {kind}:{address}"
        )


_OPENERS = {"franka": _franka, "ros2": _ros2, "sim": _sim, "rtde": _rtde}
