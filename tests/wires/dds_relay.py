"""Stands between a master and an arm under ROS 2, in two domains, and from SIGUSR1 on spoils what the arm says.

`python dds_relay.py ARM-DOMAIN MASTER-DOMAIN delay|jitter|reorder|replay|flip`. Stamps are those of the arm.
"""

import contextlib
import os
import random
import signal
import struct
import sys
import time
from collections import deque

DELAY, JITTER = 0.8, 0.06
"""For which all is held back, and the most of what each sample is held back for at random [s]."""
RNG = random.Random(0)
HELD = {
    "delay": lambda: DELAY,
    "jitter": lambda: JITTER * RNG.random(),
    "reorder": lambda: JITTER * RNG.random(),
}
SAID = {"/ft/wrench": "geometry_msgs/msg/WrenchStamped", "/tcp/pose": "geometry_msgs/msg/PoseStamped"}
TOLD = {"/command": "geometry_msgs/msg/TwistStamped"}


class Line:
    """One topic, from one domain to another.

    Args:
        source: participant that it is read by.
        target: participant that it is written by.
        name: of the topic.
        kind: of its messages.
    """

    def __init__(self, source, target, name, kind):
        from cyclonedds.core import Policy, Qos
        from cyclonedds.pub import DataWriter
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        from palpate.wires import ros2_messages

        self._kind = ros2_messages.message(kind)
        qos = Qos(Policy.Reliability.Reliable(10**8), Policy.History.KeepLast(8))
        self._reader = DataReader(source, Topic(source, f"rt{name}", self._kind), qos=qos)
        self._writer = DataWriter(target, Topic(target, f"rt{name}", self._kind), qos=qos)
        self._held, self._past = [], deque(maxlen=50)

    def hand_on(self, fault=None):
        """What came, in its order unless that is the fault."""
        for sample in self._reader.take(8):
            if type(sample) is self._kind:
                due = time.monotonic() + HELD.get(fault, lambda: 0.0)()
                ordered = self._held and fault != "reorder"
                self._held.append(
                    (max(due, self._held[-1][0]) if ordered else due, self._spoiled(sample, fault))
                )
        while due := [pair for pair in self._held if pair[0] <= time.monotonic()]:
            first = min(due, key=lambda pair: pair[0])
            self._held.remove(first)
            self._writer.write(first[1])

    def _spoiled(self, sample, fault):
        if fault == "replay":
            self._past.rotate(-1)
            return self._past[0]
        if fault == "flip":
            vector = sample.wrench.force if hasattr(sample, "wrench") else sample.pose.position
            (bits,) = struct.unpack("<Q", struct.pack("<d", vector.z))
            (vector.z,) = struct.unpack("<d", struct.pack("<Q", bits ^ 1 << RNG.randrange(64)))
        elif fault is None:
            self._past.append(sample)
        return sample


def main():
    from cyclonedds.domain import DomainParticipant

    arm, master = (DomainParticipant(int(domain)) for domain in sys.argv[1:3])
    fault, on = sys.argv[3], []
    signal.signal(signal.SIGUSR1, lambda *_: on.append(True))
    said = [Line(arm, master, name, kind) for name, kind in SAID.items()]
    told = [Line(master, arm, name, kind) for name, kind in TOLD.items()]
    sys.stdout.write(f"ros2:{sys.argv[2]}\n")
    sys.stdout.flush()
    with contextlib.suppress(OSError):  # where the system gives it: a relay is not to be late by itself
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(40))
    while True:
        for line in said:
            line.hand_on(fault if on else None)
        for line in told:
            line.hand_on()
        time.sleep(5e-4)


if __name__ == "__main__":
    main()
