"""The wire to an arm of ours in another process, over loopback: `tests/rehearsal/sim_arm.py` is that arm."""

import math
import secrets
import socket
import struct

from palpate.errors import InputError
from palpate.wires.realtime import CLOCK, Clock
from palpate.wires.wire import SILENCE, ArmReading, Command, ConnectionLostError, NoReadingError

MAGIC = b"palpate1"
HELLO, WELCOME, BUSY, STATE, MOVE, STOP = range(6)

_HEAD = struct.Struct("<8sBI")
_STATE = struct.Struct("<Id13d")
_MOVE = struct.Struct("<I3d")
_WELCOME = struct.Struct("<d")


def pack(kind: int, session: int, body: bytes = b"") -> bytes:
    """Bytes of a datagram."""
    return _HEAD.pack(MAGIC, kind, session) + body


def unpack(data: bytes) -> tuple[int, int, bytes] | None:
    """Kind, session and body of a datagram; None of one that is none."""
    if len(data) < _HEAD.size:
        return None
    magic, kind, session = _HEAD.unpack_from(data)
    if magic != MAGIC or kind > STOP:
        return None
    return kind, session, data[_HEAD.size :]


def state(number: int, time: float, values: tuple[float, ...]) -> bytes:
    """The body of a reading."""
    return _STATE.pack(number, time, *values)


def read_state(body: bytes) -> tuple[int, float, tuple[float, ...]] | None:
    """A reading's number, the arm's time [s], force, torque, position, quaternion; None of a body that is none."""
    if len(body) != _STATE.size:
        return None
    number, time, *values = _STATE.unpack(body)
    return number, time, tuple(values)


def move(number: int, velocity: tuple[float, float, float]) -> bytes:
    """The body of a command: its number and the tool's speed [m/s]."""
    return _MOVE.pack(number, *velocity)


def read_move(body: bytes) -> tuple[int, tuple[float, float, float]] | None:
    """A command's number and speed; None of a body that is none."""
    if len(body) != _MOVE.size:
        return None
    number, x, y, z = _MOVE.unpack(body)
    return number, (x, y, z)


def welcome(rate: float) -> bytes:
    """The body of a welcome: readings a second."""
    return _WELCOME.pack(rate)


def read_welcome(body: bytes) -> float | None:
    """Readings a second, by the arm's welcome."""
    return float(_WELCOME.unpack(body)[0]) if len(body) == _WELCOME.size else None


_GREETING_TIMEOUT = 1.0
"""Longest time until an arm answers a greeting [s]."""


class SimWire:
    """A simulated arm at HOST:PORT.

    Args:
        host: a loopback address.
        port: UDP.
        clock: by which readings are received, and waited for.
        datagrams: a socket for them; of UDP if none is given.

    Raises:
        InputError: nothing answers there, or something else does, or it has another master.
    """

    def __init__(self, host: str, port: int, clock: Clock = CLOCK, datagrams: socket.socket | None = None):
        self._where = f"{host}:{port}"
        self._session = secrets.randbits(32)
        self._sent, self._last, self._now = 0, -1, clock.monotonic
        self._broken: ConnectionLostError | None = None
        self._socket = datagrams or socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.connect((host, port))
            self.rate = self._greet()
        except OSError as error:
            self._socket.close()
            raise InputError(
                f"no simulated arm answers at {self._where} ({error.strerror or error}); start one with"
                f" python tests/rehearsal/sim_arm.py --port {port}, in palpate's sources"
            ) from None
        except InputError:
            self._socket.close()
            raise

    @property
    def title(self) -> str:
        """Name of the far end."""
        return f"a simulated arm at {self._where}, {self.rate:g} readings a second"

    @property
    def watchdog(self) -> str:
        """The arm's stop if this process dies."""
        return "the simulated arm rests after 10 ticks without a command"

    def _greet(self) -> float:
        end = self._now() + _GREETING_TIMEOUT
        while (remaining := end - self._now()) > 0:
            self._socket.send(pack(HELLO, self._session))
            self._socket.settimeout(min(remaining, 0.2))
            try:
                data = self._socket.recv(512)
            except TimeoutError:
                continue
            message = unpack(data)
            if message is None:
                raise InputError(f"{self._where} speaks another protocol; is it the port of a simulated arm?")
            kind, session, body = message
            if kind == BUSY:
                raise InputError(f"the arm at {self._where} has another master; end that one first")
            rate = read_welcome(body)
            if kind == WELCOME and session == self._session and rate:
                return rate
        raise TimeoutError(0, f"no answer within {_GREETING_TIMEOUT:g} s")

    def read(self, timeout: float) -> ArmReading:
        """The next reading; what is no reading of this session is passed over."""
        end = self._now() + timeout
        strange = 0
        while (remaining := end - self._now()) > 0:
            self._socket.settimeout(remaining)
            try:
                data = self._socket.recv(512)
            except TimeoutError:
                break
            except OSError as error:  # nobody has the arm's port any more: a command would not say so
                self._broken = ConnectionLostError(f"the wire broke: {error.strerror or error}")
                raise self._broken from None
            sense = self._latest(self._sense(data))
            if sense is not None:
                return sense
            strange += 1
        raise NoReadingError("", timeout, f", only {strange} datagrams that are none" if strange else "")

    def _latest(self, sense: ArmReading | None) -> ArmReading | None:
        """The newest of what has come: a late loop does not answer what is past."""
        self._socket.settimeout(0.0)
        while True:
            try:
                sense = self._sense(self._socket.recv(512)) or sense
            except OSError:  # nothing more, or broken: the next read says so
                return sense

    def _sense(self, data: bytes) -> ArmReading | None:
        received = self._now()
        message = unpack(data)
        if message is None or message[0] != STATE or message[1] != self._session:
            return None
        number, stamp, v = read_state(message[2]) or (-1, math.nan, ())
        if number <= self._last or not math.isfinite(stamp):
            return None
        self._last = number
        return ArmReading(received, stamp, v[0:3], v[3:6], v[6:9], v[9:13])  # type: ignore[arg-type]

    def tare(self) -> None:
        """The simulated sensor has no zero of its own."""

    def begin(self, silence: float = SILENCE) -> None:
        """The greeting has taken it over; the arm rests after ten ticks without a command."""
        self._broken = None

    def write(self, command: Command) -> None:
        """Send the desired speed."""
        if self._broken is not None:
            raise self._broken
        self._sent += 1
        try:
            self._socket.send(pack(MOVE, self._session, move(self._sent, command.velocity)))
        except OSError as error:
            raise ConnectionLostError(f"a command could not be sent: {error.strerror or error}") from None

    def stop(self) -> None:
        """Rest; said three times, as a datagram may be lost."""
        for _ in range(3):
            try:
                self._socket.send(pack(STOP, self._session))
            except OSError:
                return

    def close(self) -> None:
        """Close the wire's socket."""
        self._socket.close()
