"""An arm under ROS 2 in a process of its own: it publishes wrench and pose, and follows a twist."""

import sys
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from palpate.force import load_arm
from palpate.force.worlds import surface
from palpate.wires import ros2_messages as m
from palpate.wires.sim_arm import OneDirection


def main(domain, arm_file, stiffness, gap, kind, seconds):
    arm = OneDirection(load_arm(arm_file), surface(float(stiffness), 20.0), float(gap), (0.0, 0.0, 1.0), 0)
    participant = DomainParticipant(int(domain))
    qos = Qos(Policy.Reliability.Reliable(10**8), Policy.History.KeepLast(1))
    wrenches = DataWriter(participant, Topic(participant, "rt/ft/wrench", m.WrenchStamped), qos=qos)
    poses = DataWriter(participant, Topic(participant, "rt/tcp/pose", m.PoseStamped), qos=qos)
    taken = {"twist": m.TwistStamped, "array": m.Float64MultiArray, "pose": m.PoseStamped}[kind]
    commands = DataReader(participant, Topic(participant, "rt/command", taken), qos=qos)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    begun, speed, silent, place = time.monotonic(), 0.0, 0, None
    while arm.time < float(seconds):
        time.sleep(max(begun + arm.time - time.monotonic(), 0.0))
        for sample in commands.take(10):
            if type(sample) is not taken:  # a writer that has gone
                continue
            silent = 0
            if kind == "twist":
                speed = -sample.twist.linear.z
            elif kind == "array":
                speed = -sample.data[2]
            else:
                place = 0.3 - sample.pose.position.z
        silent += 1
        if place is not None:
            speed = (place - arm.command) / arm.world.tick if silent < 10 else 0.0
        arm.tick(speed if silent < 10 else 0.0)
        now = time.time_ns()
        header = m.Header(m.Time(now // 10**9, now % 10**9), "base")
        _, _, fz, *_, x, y, z = arm.reading()[:9]
        # The tool points down, turned by 180 degrees about x; the sensor shows the reaction in the tool's axes.
        wrenches.write(
            m.WrenchStamped(header, m.Wrench(m.Vector3(0.0, 0.0, float(fz)), m.Vector3(0.0, 0.0, 0.0)))
        )
        poses.write(m.PoseStamped(header, m.Pose(m.Point(x, y, float(z)), m.Turn(1.0, 0.0, 0.0, 0.0))))


if __name__ == "__main__":
    main(*sys.argv[1:])
