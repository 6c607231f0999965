"""The process that holds a maker's library, or a class of the user's: `python -m palpate.wires.host KIND WHERE SOCKET`.

One thread reads the arm and hands its readings on; the other takes commands. If no command comes for twice the silence
that the loop bears, or the loop's process has gone, the arm is brought to rest.
"""

import os
import select
import signal
import socket
import sys
import threading
from contextlib import suppress

from palpate.errors import InputError
from palpate.plugins import permit, plugin, reason
from palpate.wires import subprocess_wire as messages
from palpate.wires.wire import SILENCE, ConnectionLostError, NoReadingError, WatchdogStopError, Wire

_WAIT = 0.1
"""Longest wait of the reading thread for a reading [s]."""
_FOREVER = 3600.0


class Host:
    """A link between an arm and the process of its loop.

    Args:
        wire: to the arm.
        theirs: socket to the loop's process.
    """

    def __init__(self, wire: Wire, theirs: socket.socket):
        self._wire, self._link = wire, theirs
        self._silence, self._moving = SILENCE, False

    def run(self) -> None:
        """Serve until the loop's process has gone."""
        threading.Thread(target=self._forward_readings, daemon=True).start()
        try:
            while (message := self._next()) is not None:
                self._obey(message)
        finally:
            self._wire.stop()

    def _forward_readings(self) -> None:
        """Forward the arm's readings; send the reason when no more will come."""
        while True:
            try:
                sense = self._wire.read(_WAIT)
                self._link.send(messages.pack_reading(sense), socket.MSG_DONTWAIT)
            except (
                NoReadingError,
                BlockingIOError,
            ):  # nothing there, or nobody takes it: the loop knows by its clock
                continue
            except OSError:
                return
            except Exception as error:  # noqa: BLE001 - whatever a maker's library throws is the wire's fault
                self._send_text(messages.FAILED, line(error))
                return

    def _next(self) -> bytes | None:
        """The next message, the newest of several commands; None when the loop's process has gone."""
        message = b""
        while True:
            wait = 0.0 if message else 2.0 * self._silence if self._moving else _FOREVER
            if not select.select([self._link], [], [], wait)[0]:
                if message:
                    return message
                if self._moving:
                    self._rest()
                    lack = (
                        f"no command came for {2e3 * self._silence:.3g} ms, and the arm was brought to rest"
                    )
                    self._send_text(messages.LAPSED, lack)
                continue
            try:
                message = self._link.recv(messages.MAX_MESSAGE)
            except OSError:
                return None
            if not message:
                return None
            if message[0] != messages.MOVE:
                return message

    def _obey(self, message: bytes) -> None:
        try:
            kind = message[0]
            if kind == messages.TARE:
                self._wire.tare()
                self._send_text(messages.TARED)
            elif kind == messages.BEGIN:
                self._begin(messages.unpack_begin(message))
            elif kind == messages.MOVE and self._moving:
                self._wire.write(messages.unpack_command(message))
            elif kind == messages.REST:
                self._rest()
                self._send_text(messages.RESTED)
        except InputError as error:
            self._send_text(messages.REFUSED, line(error))
        except Exception as error:  # noqa: BLE001 - likewise
            self._send_text(
                messages.LAPSED if isinstance(error, WatchdogStopError) else messages.UNSENT, line(error)
            )

    def _begin(self, silence: float) -> None:
        self._wire.begin(silence)
        self._silence, self._moving = silence, True
        self._send_text(messages.BEGUN)

    def _rest(self) -> None:
        self._moving = False
        self._wire.stop()

    def _send_text(self, kind: int, words: str = "") -> None:
        try:
            self._link.send(messages.pack_text(kind, words))
        except OSError:  # the loop's process has gone: the next message says so
            return


def line(error: BaseException) -> str:
    """The first line of an error's text."""
    return (str(error).splitlines() or [type(error).__name__])[0]


def prepare() -> None:
    """Leave this process to its loop: a signal to a group ends the loop, which tells this one.

    What a maker's library prints goes to standard error: the loop's standard output may be JSON.
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)
    with suppress(OSError):  # closed by whoever started this program
        os.dup2(2, 1)


def open_hosted(kind: str, where: str) -> Wire:
    """The wire of an address, in this process; a kind `module:Class` was permitted in the loop's process."""
    if ":" in kind:
        permit(kind)
        wire: Wire = plugin(kind).value()(where)
        return wire
    if kind == "rtde":
        from palpate.wires.ur import RtdeWire

        return RtdeWire(where)
    from palpate.wires.ros2 import DdsWire, topics_of

    return DdsWire(*topics_of(where))


def main() -> None:
    """Connect, say so, and serve until the loop's process has gone."""
    prepare()
    kind, where, *path, number = sys.argv[1:]
    sys.path += [folder for folder in path if folder not in sys.path]
    theirs = socket.socket(fileno=int(number))
    theirs.send(messages.pack_text(messages.STARTED))
    try:
        wire = open_hosted(kind, where)
        theirs.send(
            messages.pack_text(
                messages.READY, f"{wire.title}\n{wire.watchdog}\n{getattr(wire, 'source', '')}"
            )
        )
        Host(wire, theirs).run()
        wire.close()
    except InputError as error:
        theirs.send(messages.pack_text(messages.REFUSED, line(error)))
    except ConnectionLostError as error:
        theirs.send(messages.pack_text(messages.FAILED, line(error)))
    except Exception as error:  # noqa: BLE001 - whatever a class of the user's raises
        theirs.send(messages.pack_text(messages.REFUSED, reason(error)))
    finally:
        os._exit(0)  # a maker's destructors may wait for a controller that has gone


if __name__ == "__main__":
    main()
