"""Stands between a master and an arm under ROS 2, in two domains, and from SIGUSR1 on holds back what the arm says.

`python dds_relay.py ARM-DOMAIN MASTER-DOMAIN delay|jitter`. What it hands on has the arm's own stamps, in their order.
"""

import contextlib
import os
import random
import signal
import sys
import time
from collections import deque

DELAY, JITTER = 0.8, 0.06
"""For which all is held back, and the most of what each sample is held back for at random [s]."""
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
        self._held = deque()

    def hand_on(self, hold):
        """What came, after `hold()` seconds, and never before what came before it."""
        for sample in self._reader.take(8):
            if type(sample) is self._kind:
                due = time.monotonic() + hold()
                self._held.append((max(due, self._held[-1][0]) if self._held else due, sample))
        while self._held and self._held[0][0] <= time.monotonic():
            self._writer.write(self._held.popleft()[1])


def main():
    from cyclonedds.domain import DomainParticipant

    arm, master = (DomainParticipant(int(domain)) for domain in sys.argv[1:3])
    rng = random.Random(0)
    faults = {"delay": lambda: DELAY, "jitter": lambda: JITTER * rng.random()}
    spoiled, on = faults[sys.argv[3]], []
    signal.signal(signal.SIGUSR1, lambda *_: on.append(True))
    said = [Line(arm, master, name, kind) for name, kind in SAID.items()]
    told = [Line(master, arm, name, kind) for name, kind in TOLD.items()]
    sys.stdout.write(f"ros2:{sys.argv[2]}\n")
    sys.stdout.flush()
    with contextlib.suppress(OSError):  # where the system gives it: a relay is not to be late by itself
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(40))
    while True:
        for line in said:
            line.hand_on(spoiled if on else lambda: 0.0)
        for line in told:
            line.hand_on(lambda: 0.0)
        time.sleep(5e-4)


if __name__ == "__main__":
    main()
