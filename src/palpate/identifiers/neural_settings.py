"""The thesis' scales and probes of its neural identifier, by surface (sec. 6.2)."""

from typing import NamedTuple


class Setting(NamedTuple):
    """For one surface, in the order displacement, velocity, acceleration.

    Args:
        scale: factors before the network.
        values: where it is asked [m, m/s, m/s^2].
    """

    scale: tuple[float, float, float]
    values: tuple[float, float, float]


SETTINGS = {
    "foam": Setting((1e3, 1e2, 1.0), (2e-3, 1e-2, 1.0)),
    "rubber": Setting((1e4, 1e2, 1.0), (2e-4, 1e-2, 0.5)),
}
