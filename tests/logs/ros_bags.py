"""Bags as a robot's recorder leaves them, written by the library that reads them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

KINDS = ("bag1", "sqlite", "mcap")
BEGIN = 1_700_000_000 * 10**9
"""When the logs made here begin [ns since 1970]."""

STORES = {kind: get_typestore(Stores.ROS1_NOETIC if kind == "bag1" else Stores.ROS2_HUMBLE) for kind in KINDS}


@dataclass
class Sent:
    """One topic's messages.

    `time` [s] is on the sender's clock and stands in the headers; the recorder got each message at `received` [s].
    """

    topic: str
    kind: str
    time: np.ndarray
    values: np.ndarray
    frame: str = "tool0"
    received: np.ndarray | None = None


def wrench(
    topic: str, time: np.ndarray, force: np.ndarray, torque: np.ndarray | None = None, **more: Any
) -> Sent:
    """WrenchStamped; force and torque of shape (n, 3)."""
    torque = np.zeros_like(force) if torque is None else torque
    return Sent(topic, "geometry_msgs/msg/WrenchStamped", time, np.hstack([force, torque]), **more)


def pose(
    topic: str, time: np.ndarray, place: np.ndarray, turn: np.ndarray | None = None, **more: Any
) -> Sent:
    """PoseStamped; place of shape (n, 3), turn a quaternion (x, y, z, w) of shape (n, 4)."""
    turn = np.tile([0.0, 0.0, 0.0, 1.0], (len(time), 1)) if turn is None else turn
    return Sent(
        topic, "geometry_msgs/msg/PoseStamped", time, np.hstack([place, turn]), **{"frame": "base", **more}
    )


def joints(
    topic: str, time: np.ndarray, names: list[str], place: np.ndarray, effort: np.ndarray, **more: Any
) -> Sent:
    """JointState; place and effort of shape (n, joints)."""
    sent = Sent(topic, "sensor_msgs/msg/JointState", time, np.hstack([place, effort]), **more)
    sent.frame = ",".join(names)
    return sent


def write_bag(path: Path, kind: str, sent: Iterable[Sent], extra: str = "", packed: bool = False) -> Path:
    """Write a bag; `extra` names a topic of a type that this bag defines itself, `my_msgs/msg/Grip` with a `grip`.

    `packed` compresses its chunks.
    """
    store, sent = STORES[kind], list(sent)
    rows = sorted(
        (round(1e9 * when), number, i)
        for number, one in enumerate(sent)
        for i, when in enumerate(one.time if one.received is None else one.received)
    )
    if kind == "bag1":
        writer: Any = Writer1(path)
        if packed:
            writer.set_compression(Writer1.CompressionFormat.LZ4)
    else:
        plugin = StoragePlugin.SQLITE3 if kind == "sqlite" else StoragePlugin.MCAP
        writer = Writer2(path, version=9, storage_plugin=plugin)
        if packed:
            writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        own = {one.topic: one.kind for one in sent}
        connections = {
            topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in own.items()
        }
        serialise = store.serialize_ros1 if kind == "bag1" else store.serialize_cdr
        for when, number, i in rows:
            message = _message(store, sent[number], i, ros1=kind == "bag1")
            writer.write(connections[sent[number].topic], BEGIN + when, serialise(message, sent[number].kind))
        if extra:
            _write_extra(writer, extra, kind)
    return path


def storage(path: Path) -> Path:
    """The file that holds the messages of a bag."""
    return (
        path if path.is_file() else next(file for file in path.iterdir() if file.suffix in {".mcap", ".db3"})
    )


def _message(store: Any, one: Sent, i: int, ros1: bool) -> Any:
    types = store.types
    ns = BEGIN + round(1e9 * one.time[i])
    stamp = types["builtin_interfaces/msg/Time"](ns // 10**9, ns % 10**9)
    about = {"seq": i} if ros1 else {}
    frame = "" if one.kind.endswith("JointState") else one.frame
    header = types["std_msgs/msg/Header"](**about, stamp=stamp, frame_id=frame)
    own, v = types[one.kind], one.values[i]
    vector = types["geometry_msgs/msg/Vector3"]
    match one.kind.rsplit("/", 1)[1]:
        case "WrenchStamped":
            return own(header, types["geometry_msgs/msg/Wrench"](vector(*v[:3]), vector(*v[3:])))
        case "PoseStamped":
            point, turn = (
                types["geometry_msgs/msg/Point"](*v[:3]),
                types["geometry_msgs/msg/Quaternion"](*v[3:]),
            )
            return own(header, types["geometry_msgs/msg/Pose"](point, turn))
        case "JointState":
            names = one.frame.split(",")
            n = len(names)
            return own(header, names, v[:n], np.zeros(n), v[n:])
    raise AssertionError(one.kind)


def _write_extra(writer: Any, topic: str, kind: str) -> None:
    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag1" else Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("float64 grip\nstring[] name\nfloat64[] load\n", "my_msgs/msg/Grip"))
    connection = writer.add_connection(topic, "my_msgs/msg/Grip", typestore=store)
    serialise = store.serialize_ros1 if kind == "bag1" else store.serialize_cdr
    for k in range(5):
        grip = store.types["my_msgs/msg/Grip"](0.5 * k, ["left", "right"], np.array([1.0 * k, 2.0 * k]))
        writer.write(connection, BEGIN + k * 10**8, serialise(grip, "my_msgs/msg/Grip"))
