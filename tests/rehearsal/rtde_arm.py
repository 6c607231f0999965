"""A simulated arm that speaks as a UR does, to rehearse with: RTDE, dashboard and script port, on a loopback address.

`python tests/rehearsal/rtde_arm.py --address 127.0.0.9`. It knows of ur-rtde's control script what a press needs:
speedL, servoL and their stops, zeroFtSensor, the watchdog, questions that its state answers, the end. Every other
command ends the script, and is named on standard error; so are other scripts. The tool keeps pointing down, and the
joints are those of a UR5e. Variables of RTDE that are not simulated are NaN, or 0 where they are integers; an unknown
one is NOT_FOUND.
"""

import selectors
import socket
import struct
import time
from dataclasses import dataclass, field
from typing import Any

from rtde_controller import Controller
from rtde_dictionary import CODES, INPUTS, OUTPUTS, UNKNOWN
from tool_axis_arm import arm_of, loopback, ready, ticks, words_of

RTDE, SCRIPT, DASHBOARD = 30004, 30003, 29999
_VERSION = (5, 15, 0, 0)
_OURS = b"def rtde_control():"
"""By which ur-rtde's control script is known."""
_DASHBOARD = {
    "PolyscopeVersion": "URSoftware 5.15.0.1202319 (Aug 22 2023)",
    "is in remote control": "true",
    "robotmode": "Robotmode: RUNNING",
    "get serial number": "20235500001",
    "get robot model": "UR5",
}


@dataclass
class Client:
    """One connection to RTDE or to the script port.

    Args:
        socket: of it.
        buffer: what has come and is no whole packet yet.
        outputs: variables that it asked for.
        inputs: recipes that it sends, by number.
        started: whether it wants packets.
        every: so many ticks of the arm from one packet to the next.
        script: what has come of one, and is not known yet.
    """

    socket: socket.socket
    buffer: bytes = b""
    outputs: list[str] = field(default_factory=list)
    inputs: dict[int, list[str]] = field(default_factory=dict)
    started: bool = False
    every: int = 1
    script: bytes = b""


class Server:
    """The three ports.

    Args:
        address: of the loopback.
        controller: of the arm.

    Raises:
        OSError: a port is taken.
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
        for number, _ in enumerate(ticks(self.controller.arm, seconds, self._listen)):
            self.controller.tick()
            for client in list(self.clients.values()):
                if client.started and number % client.every == 0:
                    self._send(client, "U", self._packet(client))

    def close(self) -> None:
        """Let go of all connections, and of the ports."""
        for key in list(self.selector.get_map().values()):
            key.fileobj.close()  # type: ignore[union-attr]
        self.selector.close()

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
            if port != DASHBOARD:
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
            self._script(self.clients[one], data)

    def _lose(self, one: socket.socket) -> None:
        self.selector.unregister(one)
        client = self.clients.pop(one, None)
        if client is not None and client is self.controller.master:
            self.controller.master = None  # its script runs on: the watchdog alone ends the motion
        one.close()

    def _script(self, client: Client, data: bytes) -> None:
        """A script ends where its sender says so, or after so much of another one than ur-rtde's."""
        if _OURS in client.script:
            return
        client.script += data
        if _OURS in client.script:
            self.controller.start_script()
        elif client.script.strip() and (b"\nend" in client.script or len(client.script) > len(data)):
            self.controller.end(
                f"a script that is not ur-rtde's ({client.script[:40].decode(errors='replace')!r})"
            )

    def _dashboard(self, one: socket.socket, data: bytes) -> None:
        for line in data.decode(errors="replace").splitlines():
            word = line.strip()
            if word == "stop":
                self.controller.end()
            running = f"Program running: {str(self.controller.running).lower()}"
            known = _DASHBOARD | {"running": running, "stop": "Stopped"}
            one.send((known.get(word, f"could not understand: '{word}'") + "\n").encode())

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
            self._send(client, "V", bytes([body == b"\x00\x02"]))
        elif kind == "v":
            self._send(client, "v", struct.pack(">4I", *_VERSION))
        elif kind == "O":
            asked = [name for name in body[8:].decode(errors="replace").split(",") if name]
            kinds = [OUTPUTS.get(name, UNKNOWN) for name in asked]
            frequency = struct.unpack(">d", body[:8])[0] if len(body) >= 8 else 0.0
            client.every = max(round(self.controller.arm.arm.rate / frequency), 1) if frequency > 0.0 else 1
            client.outputs = [] if UNKNOWN in kinds else asked
            self._send(client, "O", bytes([bool(client.outputs)]) + ",".join(kinds).encode())
        elif kind == "I":
            self._inputs(client, [name for name in body.decode().split(",") if name])
        elif kind in "SP":
            client.started = kind == "S"
            self._send(client, kind, b"\x01")
        elif kind == "U":
            names = client.inputs.get(body[0], [])
            code = ">" + "".join(CODES[INPUTS[name]] for name in names)
            if names and len(body) == 1 + struct.calcsize(code):
                self.controller.obey(dict(zip(names, struct.unpack(code, body[1:]), strict=True)))

    def _inputs(self, client: Client, names: list[str]) -> None:
        """Registers belong to one client at a time, as on the real controller."""
        master = self.controller.master
        if master is not None and master is not client:
            self._send(client, "I", b"\x00" + ",".join("IN_USE" for _ in names).encode())
            return
        kinds, number = [INPUTS.get(name, UNKNOWN) for name in names], 0
        if UNKNOWN not in kinds:
            self.controller.master = client
            number = len(client.inputs) + 1
            client.inputs[number] = names
        self._send(client, "I", bytes([number]) + ",".join(kinds).encode())

    def _packet(self, client: Client) -> bytes:
        parts = [b"\x01"]
        for name in client.outputs:
            value, code = self.controller.value(name), ">" + CODES[OUTPUTS[name]]
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
    try:
        server = Server(address, Controller(arm))
    except OSError as error:
        words.error(f"--address {address}: {error.strerror or error}")
    ready(f"rtde:{address}")
    server.serve(told.seconds)


if __name__ == "__main__":
    main()
