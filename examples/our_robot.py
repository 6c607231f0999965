"""A robot of our own, and the wire by which palpate moves it: the class that `--wire our_robot:OurWire?WHERE` names.

The robot is a stand-in: an arm of one direction, a clock of its own, a force sensor that is 2 N off. In its place stand
the calls of your robot's library.
"""

import sys
import threading
import time
from pathlib import Path

from palpate.force import load_arm, surface
from palpate.wires import SILENCE, ArmReading, Command, ConnectionLostError, NoReadingError

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "rehearsal"))
from tool_axis_arm import REST, ToolAxisArm, ticks


class OurWire:
    """The wire to our robot.

    Args:
        where: what stands behind the question mark of `--wire`: the robot's address; here the file of its arm.
    """

    def __init__(self, where: str):
        self.title = f"our robot at {where}"  # in one line, for the plan
        self.watchdog = f"the robot rests after {1e3 * SILENCE:g} ms without a command"
        self._robot = ToolAxisArm(load_arm(where), surface(4000.0, 20.0), 0.002, (0.0, 0.0, 2.0), 0)
        self._velocity, self._silence, self._heard = REST, SILENCE, 0.0
        self._zero = (0.0, 0.0, 0.0)
        self._fresh, self._newest, self._closed = threading.Event(), None, False
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        """The robot's controller: it moves as commanded, measures, and rests by itself if nobody speaks."""
        for _ in ticks(self._robot, 600.0):
            if self._closed:
                return
            if time.monotonic() - self._heard > self._silence:
                self._velocity = REST
            self._robot.tick(self._velocity)
            v = self._robot.reading()
            force = tuple(f - z for f, z in zip(v[:3], self._zero, strict=True))
            # The force that the tool exerts on the surface, about the point whose position is given, in the base.
            self._newest = ArmReading(time.monotonic(), self._robot.time, force, v[3:6], v[6:9], v[9:13])
            self._fresh.set()

    def read(self, timeout: float) -> ArmReading:
        """The next fresh reading."""
        if self._closed:
            raise ConnectionLostError("the wire is closed")
        if not self._fresh.wait(timeout):
            raise NoReadingError("", timeout)
        self._fresh.clear()
        return self._newest

    def tare(self):
        """The driver takes its sensor's present reading for zero; one that cannot does nothing."""
        self._zero = self._robot.reading()[:3]

    def begin(self, silence: float = SILENCE):
        """From here on commands move it; after so long without one it is to rest by itself [s]."""
        self._silence, self._heard = silence, time.monotonic()

    def write(self, command: Command):
        """A robot takes the velocity, or the position that it has led to."""
        self._velocity, self._heard = command.velocity, time.monotonic()

    def stop(self):
        """Rest, whatever was before."""
        self._velocity = REST

    def close(self):
        """Let go."""
        self.stop()
        self._closed = True
