"""A simulated arm that speaks as a UR does, to rehearse with: RTDE, dashboard and script port, on a loopback address.

`python -m palpate_rehearsal.rtde_arm --address 127.0.0.9`. It knows of ur-rtde's control script what a press needs:
speedL, servoL and their stops, zeroFtSensor, the watchdog, the end. Every other command ends the script, and is named
on standard error. Of the variables of RTDE, time, pose, force, status and the registers of ur-rtde are simulated;
others are 0, and an unknown one is refused.
"""

from __future__ import annotations

import selectors
import socket
import struct
import sys
import time
from dataclasses import dataclass, field
from typing import Any

from palpate_rehearsal.rehearsal import START, ToolAxisArm, arm_of, loopback, ready, ticks, words_of

RTDE, SCRIPT, DASHBOARD = 30004, 30003, 29999
_VERSION = (5, 15, 0, 0)
_RUNNING, _STOPPED = 2, 1
READY, DONE = 1, 2
# Numbers of ur-rtde's commands.
NOTHING, ZERO, SPEEDL, SPEED_STOP, SERVO_STOP, SERVOL, WATCHDOG, STOP = 0, 8, 10, 15, 16, 24, 35, 255
_DONE = {ZERO, SPEED_STOP, SERVO_STOP, WATCHDOG}
_TYPES = {
    "VECTOR6D": "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current"
    " actual_current_window joint_control_output actual_TCP_pose actual_TCP_speed actual_TCP_force target_TCP_pose"
    " target_TCP_speed joint_temperatures actual_joint_voltage payload_inertia ft_raw_wrench external_force_torque",
    "VECTOR3D": "actual_tool_accelerometer elbow_position elbow_velocity payload_cog",
    "VECTOR6INT32": "joint_mode",
    "UINT64": "actual_digital_input_bits actual_digital_output_bits",
    "UINT32": "runtime_state robot_status_bits safety_status_bits analog_io_types euromap67_input_bits"
    " euromap67_output_bits tool_mode tool_analog_input_types output_bit_registers0_to_31 output_bit_registers32_to_63"
    " input_bit_registers0_to_31 input_bit_registers32_to_63 script_control_line speed_slider_mask",
    "INT32": "robot_mode safety_mode safety_status tool_output_voltage time_scale_source",
    "UINT8": "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode standard_digital_output_mask"
    " configurable_digital_output_mask standard_digital_output configurable_digital_output standard_analog_output_mask"
    " standard_analog_output_type",
    "DOUBLE": "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum actual_main_voltage"
    " actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1 standard_analog_output0"
    " standard_analog_output1 standard_analog_output_0 standard_analog_output_1 io_current euromap67_24V_voltage"
    " euromap67_24V_current tool_analog_input0 tool_analog_input1 tool_output_current tool_temperature tcp_force_scalar"
    " payload joint_position_deviation_ratio collision_detection_ratio speed_slider_fraction",
}
_TYPE_OF = {name: kind for kind, names in _TYPES.items() for name in names.split()}
_REGISTERS = {"bit_register_": "BOOL", "int_register_": "INT32", "double_register_": "DOUBLE"}
_DASHBOARD = {
    "PolyscopeVersion": "URSoftware 5.15.0.1202319 (Aug 22 2023)",
    "is in remote control": "true",
    "running": "Program running: true",
    "robotmode": "Robotmode: RUNNING",
    "stop": "Stopped",
    "get serial number": "20235500001",
    "get robot model": "UR5",
}


def kind_of(name: str) -> str:
    """The type of a variable of RTDE, as its guide has it; NOT_FOUND of an unknown one."""
    way, _, rest = name.partition("_")
    register = next((kind for prefix, kind in _REGISTERS.items() if rest.startswith(prefix)), None)
    if way in {"input", "output"} and register is not None:
        return register
    return _TYPE_OF.get(name, "NOT_FOUND")


_CODES = {
    "VECTOR6D": "6d", "VECTOR3D": "3d", "VECTOR6INT32": "6i", "UINT64": "Q", "UINT32": "I", "INT32": "i", "UINT8": "B",
    "BOOL": "?", "DOUBLE": "d",
}  # fmt: skip


@dataclass
class Client:
    """One connection to RTDE.

    Args:
        socket: of it.
        buffer: what has come and is no whole packet yet.
        outputs: variables that it asked for.
        inputs: recipes that it sends, by number.
        started: whether it wants packets.
    """

    socket: socket.socket
    buffer: bytes = b""
    outputs: list[str] = field(default_factory=list)
    inputs: dict[int, list[str]] = field(default_factory=dict)
    started: bool = False


class Controller:
    """The arm, and what a control script would do with it.

    Args:
        arm: the simulated arm.
    """

    def __init__(self, arm: ToolAxisArm):
        self.arm = arm
        self.running, self.state = False, READY
        self.speed, self.zero = 0.0, 0.0
        self.height: float | None = None
        self.least, self.heard = 0.0, 0.0
        self.commands: list[int] = []
        self.master: Client | None = None

    def start_script(self) -> None:
        """A control script has come, and runs."""
        self.running, self.state = True, READY
        self.least, self.heard, self.speed, self.height = 0.0, self.arm.time, 0.0, None

    def obey(self, numbers: dict[str, Any]) -> None:
        """A packet of registers."""
        command = int(numbers.get("input_int_register_0", 0))
        self.heard = self.arm.time
        if command == NOTHING:
            self.state = READY
            return
        if not self.running:
            return
        self.commands.append(command)
        value = [float(numbers.get(f"input_double_register_{i}", 0.0)) for i in range(8)]
        if command in {SPEEDL, SERVOL}:
            self.speed, self.height = -value[2], (value[2] if command == SERVOL else None)
            self.arm.aside = value[:2] if command == SPEEDL else (0.0, 0.0)
            return
        if command in {SPEED_STOP, SERVO_STOP, STOP}:
            self.speed, self.height = 0.0, None
        if command == ZERO:
            self.zero = self.arm.reading()[2]
        if command == WATCHDOG:
            self.least = value[0]
        if command == STOP:
            self.running = False
        elif command not in _DONE:
            self._refuse(command)
            return
        self.state = DONE

    def _refuse(self, command: int) -> None:
        """End the script, as a controller does with a command that it cannot execute."""
        sys.stderr.write(f"rtde_arm: command {command} of ur-rtde is not simulated: the script has ended\n")
        self.speed, self.height, self.running = 0.0, None, False

    def tick(self) -> None:
        """Go on by one tick."""
        if self.least and self.arm.time - self.heard > 1.0 / self.least:
            self.speed, self.height, self.running = 0.0, None, False
        if self.height is not None:
            self.speed = (START - self.height - self.arm.command) / self.arm.world.tick
        self.arm.tick(self.speed)

    def value(self, name: str) -> Any:
        """Value of a variable, by its name."""
        fx, fy, fz, *_, x, y, z = self.arm.reading()[:9]
        code = _CODES[kind_of(name)]
        known = {
            "timestamp": self.arm.time,
            "actual_TCP_pose": (x, y, z, 3.14159, 0.0, 0.0),
            # The controller shows what the surface exerts on the tool.
            "actual_TCP_force": (-fx, -fy, self.zero - fz, 0.0, 0.0, 0.0),
            "robot_status_bits": 1 | (2 if self.running else 0),
            "safety_status_bits": 1,
            "runtime_state": _RUNNING if self.running else _STOPPED,
            "output_int_register_0": self.state,
        }
        zeros = struct.unpack(f">{code}", bytes(struct.calcsize(f">{code}")))
        return known.get(name, zeros if len(zeros) > 1 else zeros[0])


class Server:
    """The three ports.

    Args:
        address: of the loopback.
        controller: of the arm.
    """

    def __init__(self, address: str, controller: Controller):
        self.controller = controller
        self.clients: dict[socket.socket, Client] = {}
        self.selector = selectors.DefaultSelector()
        for port in (RTDE, SCRIPT, DASHBOARD):
            listening = socket.socket()
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listening.bind((address, port))
            listening.listen()
            listening.setblocking(False)
            self.selector.register(listening, selectors.EVENT_READ, ("accept", port))

    def serve(self, seconds: float) -> None:
        """Run at real time until the seconds of the arm are over."""
        for _ in ticks(self.controller.arm, seconds, self._listen):
            self.controller.tick()
            for client in list(self.clients.values()):
                if client.started:
                    self._send(client, "U", self._packet(client))

    def _listen(self, seconds: float) -> None:
        """Handle messages for so long, and once at least."""
        due = time.monotonic() + seconds
        while True:
            for key, _ in self.selector.select(max(due - time.monotonic(), 0.0)):
                self._handle(key.fileobj, *key.data)
            if time.monotonic() >= due:
                return

    def _handle(self, one: Any, what: str, port: int) -> None:
        if what == "accept":
            made, _ = one.accept()
            made.setblocking(False)
            made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.selector.register(made, selectors.EVENT_READ, ("data", port))
            if port == RTDE:
                self.clients[made] = Client(made)
            if port == DASHBOARD:
                made.send(b"Connected: Universal Robots Dashboard Server\n")
            return
        try:
            data = one.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._lose(one)
        elif port == RTDE:
            self._rtde(self.clients[one], data)
        elif port == DASHBOARD:
            self._dashboard(one, data)
        else:
            self.controller.start_script()

    def _lose(self, one: socket.socket) -> None:
        self.selector.unregister(one)
        client = self.clients.pop(one, None)
        if client is not None and client is self.controller.master:
            self.controller.master = None  # its script runs on: the watchdog alone ends the motion
        one.close()

    def _dashboard(self, one: socket.socket, data: bytes) -> None:
        for line in data.decode(errors="replace").splitlines():
            one.send((_DASHBOARD.get(line.strip(), "could not understand") + "\n").encode())

    def _rtde(self, client: Client, data: bytes) -> None:
        client.buffer += data
        while len(client.buffer) >= 3:
            size = struct.unpack_from(">H", client.buffer)[0]
            if size < 3 or len(client.buffer) < size:
                return
            kind, body = chr(client.buffer[2]), client.buffer[3:size]
            client.buffer = client.buffer[size:]
            self._answer(client, kind, body)

    def _answer(self, client: Client, kind: str, body: bytes) -> None:
        if kind == "V":
            self._send(client, "V", b"\x01")
        elif kind == "v":
            self._send(client, "v", struct.pack(">4I", *_VERSION))
        elif kind == "O":
            asked = [name for name in body[8:].decode(errors="replace").split(",") if name]
            kinds = [kind_of(name) for name in asked]
            client.outputs = [] if "NOT_FOUND" in kinds else asked
            self._send(client, "O", bytes([bool(client.outputs)]) + ",".join(kinds).encode())
        elif kind == "I":
            self._inputs(client, [name for name in body.decode().split(",") if name])
        elif kind in "SP":
            client.started = kind == "S"
            self._send(client, kind, b"\x01")
        elif kind == "U":
            names = client.inputs.get(body[0], [])
            code = ">" + "".join(_CODES[kind_of(name)] for name in names)
            if names and len(body) == 1 + struct.calcsize(code):
                self.controller.obey(dict(zip(names, struct.unpack(code, body[1:]), strict=True)))

    def _inputs(self, client: Client, names: list[str]) -> None:
        """Registers belong to one client at a time, as on the real controller."""
        master = self.controller.master
        if master is not None and master is not client:
            self._send(client, "I", b"\x00" + ",".join("IN_USE" for _ in names).encode())
            return
        kinds, number = [kind_of(name) for name in names], 0
        if "NOT_FOUND" not in kinds:
            self.controller.master = client
            number = len(client.inputs) + 1
            client.inputs[number] = names
        self._send(client, "I", bytes([number]) + ",".join(kinds).encode())

    def _packet(self, client: Client) -> bytes:
        parts = [b"\x01"]
        for name in client.outputs:
            value, code = self.controller.value(name), ">" + _CODES[kind_of(name)]
            parts.append(struct.pack(code, *value) if isinstance(value, tuple) else struct.pack(code, value))
        return b"".join(parts)

    def _send(self, client: Client, kind: str, body: bytes) -> None:
        try:
            client.socket.send(struct.pack(">HB", 3 + len(body), ord(kind)) + body)
        except OSError:
            return


def main() -> None:
    """Read the words, bind, say where, and serve."""
    words = words_of("rtde_arm", __doc__)
    words.add_argument("--address", default="127.0.0.9", help="of the loopback")
    told = words.parse_args()
    address = loopback(words, told.address)
    arm = arm_of(told, (0.0, 0.0, 3.0))
    server = Server(address, Controller(arm))
    ready(f"rtde:{address}")
    server.serve(told.seconds)


if __name__ == "__main__":
    main()
