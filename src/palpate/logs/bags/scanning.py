"""Output of the bag scanners, and the intact part of a file."""

from __future__ import annotations

from typing import NamedTuple


class Channel(NamedTuple):
    """A topic as one file holds it.

    Args:
        number: its own in this file.
        topic: its name.
        kind: the type of its messages, as `geometry_msgs/msg/Pose`.
        encoding: of the definition: ros1msg, ros2msg, ros2idl; or something that cannot be read.
        definition: of the type.
    """

    number: int
    topic: str
    kind: str
    encoding: str
    definition: str


class Raw(NamedTuple):
    """A message as it lies in the file.

    Args:
        channel: the number of its topic in this file.
        received: when the recorder got it [ns].
        data: serialised.
    """

    channel: int
    received: int
    data: bytes


class End(NamedTuple):
    """Where the whole part of a file ends.

    Args:
        finished: the recorder closed the file, and its end is there.
        share: of the file that is lost, 0 if only its index is; None if the file does not tell how long it was to be.
    """

    finished: bool
    share: float | None = None
