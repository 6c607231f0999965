"""From a robot's bag to K, B, M: a press is written as an MCAP bag, and identified as wrench and pose.

The arm approaches with a tilted tool, presses foam, and retracts. Its wrist sensor measures the reaction in the
sensor's axes, with the tool's weight and a bias; its pose is that of the flange, 12 cm behind the contact point. The
axes and the lever arm are given; the identification finds the normal, the sign, the weight and the bias.
"""

from pathlib import Path

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from palpate.contact_frame import ContactFrame, describe, identify_contact
from palpate.logs import read_wrench_and_pose

STIFFNESS, DAMPING = 3000.0, 30.0  # of the foam [N/m], [N s/m]
TCP = np.array([0.0, 0.0, 0.12])  # in the tool's axes [m]
TILT = Rotation.from_euler("xyz", [165, 10, 30], degrees=True)
NORMAL = np.array([0.0, 0.0, -1.0])  # into the foam, which lies on a table
WEIGHT, BIAS = np.array([0.0, 0.0, -6.0]), np.array([1.5, -0.7, 2.0])  # [N]

rng = np.random.default_rng(0)
time = np.arange(6000) / 1000
down = np.clip(1.2 * np.sin(np.pi * time / 6), 0, 1) ** 2
depth = -0.01 + 0.014 * down + 5e-4 * np.sin(2 * np.pi * 7 * time)
speed = np.gradient(depth, time)
pressing = np.where(depth > 0, np.maximum(STIFFNESS * depth + DAMPING * speed, 0.0), 0.0)
flange = np.outer(depth, NORMAL) + np.array([0.4, 0.1, 0.02]) - TILT.apply(TCP)
shown = TILT.inv().apply(np.outer(-pressing, NORMAL) + WEIGHT) + BIAS + rng.normal(0, 0.05, (len(time), 3))

store = get_typestore(Stores.ROS2_HUMBLE)
types = store.types


def header(k: int, frame: str) -> object:
    """Stamped at the k-th millisecond."""
    stamp = types["builtin_interfaces/msg/Time"](sec=1_700_000_000 + k // 1000, nanosec=k % 1000 * 1_000_000)
    return types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def wrench(k: int) -> object:
    """What the wrist's sensor shows."""
    vector = types["geometry_msgs/msg/Vector3"]
    own = types["geometry_msgs/msg/Wrench"](force=vector(*shown[k]), torque=vector(0.0, 0.0, 0.0))
    return types["geometry_msgs/msg/WrenchStamped"](header(k, "tool0"), own)


def pose(k: int) -> object:
    """Where the flange is."""
    point, turn = types["geometry_msgs/msg/Point"], types["geometry_msgs/msg/Quaternion"]
    own = types["geometry_msgs/msg/Pose"](position=point(*flange[k]), orientation=turn(*TILT.as_quat()))
    return types["geometry_msgs/msg/PoseStamped"](header(k, "base_link"), own)


with Writer(Path("press"), version=9, storage_plugin=StoragePlugin.MCAP) as writer:
    topics = [
        (writer.add_connection("/wrench", "geometry_msgs/msg/WrenchStamped", typestore=store), wrench, 1),
        (writer.add_connection("/pose", "geometry_msgs/msg/PoseStamped", typestore=store), pose, 4),
    ]
    for k in range(len(time)):
        for connection, message, every in topics:
            if k % every == 0:
                data = store.serialize_cdr(message(k), connection.msgtype)
                writer.write(connection, 1_700_000_000_000_000_000 + 1_000_000 * k, data)

# As on the command line: palpate identify press --wrench-frame tool --tcp 0,0,120:mm --position-from tip
record = read_wrench_and_pose("press")
found, along = identify_contact(record, ContactFrame(wrench_frame="tool", tcp=tuple(TCP)))
for name, parameter in found.parameters.items():
    if parameter.value is None:
        print(f"{name}: {parameter.verdict}: {parameter.reason}")
    else:
        low, high = parameter.ci95
        print(
            f"{name} = {parameter.value:.4g} {parameter.unit} ({low:.4g} to {high:.4g}): {parameter.verdict}"
        )
print("\n".join(describe(along.meta)))
