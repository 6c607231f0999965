"""A map for Foxglove and Lichtblick: its points as it grew, one message a step, in an MCAP file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.errors import InputError
from palpate.files import whole
from palpate.maps.result import MapResult

TOPIC, FIELDS = "/palpate/map", ("x", "y", "z", "stiffness", "low", "high")


def write_mcap(result: MapResult, path: Path) -> None:
    """Write the map of ever more presses, a second for each press, as point clouds [m, N/m].

    Raises:
        InputError: foxglove-sdk is not installed, or palpate may not write there.
    """
    try:
        import foxglove
        from foxglove import messages
        from foxglove.channels import PointCloudChannel
        from foxglove.mcap import MCAPWriteOptions
    except ImportError:
        raise InputError('an MCAP file needs foxglove-sdk: pip install "palpate[foxglove]"') from None
    grid, context = result.coarse, foxglove.Context()
    places = np.column_stack([grid.places, np.zeros(len(grid.places))])[:, :3]
    number = messages.PackedElementFieldNumericType.Float32
    fields = [messages.PackedElementField(name=n, offset=4 * i, type=number) for i, n in enumerate(FIELDS)]
    origin = messages.Pose(
        position=messages.Vector3(x=0.0, y=0.0, z=0.0),
        orientation=messages.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
    )
    with whole(path) as draft, draft.open("wb") as file:
        writer = foxglove.open_mcap(file, context=context, writer_options=MCAPWriteOptions(profile="palpate"))
        with writer:
            channel = PointCloudChannel(TOPIC, context=context)
            for count, seen in result.film:
                points = np.column_stack([places, seen.stiffness, seen.ci95])[grid.inside].astype("<f4")
                cloud = messages.PointCloud(
                    timestamp=messages.Timestamp(sec=count, nsec=0), frame_id="surface", pose=origin,
                    point_stride=4 * len(FIELDS), fields=fields, data=points.tobytes(),
                )  # fmt: skip
                channel.log(cloud, log_time=count * 1_000_000_000)
