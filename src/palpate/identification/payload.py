"""The mass whose inertia the force has in the air: of what lies between the sensor and the surface."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate.arrays import Array
from palpate.identification.filters.position_noise import position_noise
from palpate.identification.filters.state_variable import Chain
from palpate.identification.free_motion import FreeMotion
from palpate.identification.least_squares import noise_of
from palpate.identification.pooling import Mean, random_effects
from palpate.identification.sampling import Channels

_SEEN = 10.0
"""Power of the acceleration over that of the position's noise in it, at least: the mass would be off by a tenth."""
_FEWEST = 20
"""Rows of a stay in the air that its own level is taken from."""
_LEAST = 0.05
"""Of the sum of squares of the acceleration in the part that has most, what a part needs to tell the mass again."""
_MOST = 0.5
_OTHERS = 2.0
"""Share of the force's power that the acceleration accounts for at least, and over that of speed or place: as measured
by `benchmarks/identification/free_motion_constants.py`."""


@dataclass(frozen=True)
class Payload:
    """A mass seen in the air [kg]: negative if more than the tool's inertia was taken out before.

    Args:
        mass, std: [kg].
    """

    mass: float
    std: float

    @property
    def text(self) -> str:
        """Its meaning, as a sentence."""
        seen = f"in the air the force follows a mass of {self.mass:.3g} kg (std {self.std:.2g})"
        if self.mass > 0:
            return f"{seen}: it moves beyond the force sensor, and its inertia is removed"
        return f"{seen}: a tool's inertia was compensated with the wrong sign, or too much; it is restored"


def payload_of(
    channels: Channels, chain: Chain, air: FreeMotion, lag: float, *, alone: bool = False
) -> Payload | None:
    """The mass that the force in the air tells, both channels as they count in the log; None if it tells none.

    Least squares of the filtered force on the filtered acceleration, in each stay on its own level.

    Args:
        channels: of the log.
        chain: filter of both.
        air: of the log.
        lag: of the force behind the position [s].
        alone: whether it has to be told from a soft spring too, which one frequency does not do.
    """
    memory = int(np.ceil((chain.settling + abs(lag)) / chain.dt))
    stays = [(a + memory, b) for a, b in air.among(channels.position) if b - a - memory >= _FEWEST]
    if not stays:
        return None

    def own(filtered: Array) -> Array:
        return np.concatenate([filtered[i:j] - filtered[i:j].mean() for i, j in stays])

    force, motion = own(chain(channels.force)), own(chain(channels.position, 2, lag))
    size = float(motion @ motion)
    spread = chain.noise_spread(position_noise([channels.position[i:j] for i, j in stays]))[2, 2]
    others = (own(chain(channels.position, k, lag)) for k in ((1, 0) if alone else (1,)))
    if size <= _SEEN * len(motion) * float(spread) or not _of_inertia(force, motion, others):
        return None
    noise = noise_of(force - float(motion @ force) / size * motion, np.arange(len(force)), len(stays) + 1)
    level = noise.variance * len(force) / noise.effective
    mean = _of_parts(force, motion, stays, level)
    return Payload(mean.value, mean.half / 1.96) if abs(mean.value) > mean.half else None


def _of_parts(force: Array, motion: Array, stays: list[tuple[int, int]], level: float) -> Mean:
    """The mass that both halves of each stay tell: a tone in the force goes with some of the motion, not with all.

    Args:
        force: in the stays, one after the other, shape (n,) [N].
        motion: acceleration there, shape (n,) [m/s^2].
        stays: for their lengths.
        level: of the noise: variance of a mass is this over the sum of the motion's squares.
    """
    ends = np.cumsum([0, *(b - a for a, b in stays)])
    edges = np.sort(np.concatenate([ends, (ends[:-1] + ends[1:]) // 2]))
    parts = [(motion[a:b] - motion[a:b].mean(), force[a:b]) for a, b in pairwise(edges.tolist())]
    size = np.array([float(own @ own) for own, _ in parts])
    told = size > _LEAST * size.max()
    masses = np.array([float(own @ f) for own, f in parts])[told] / size[told]
    return random_effects(masses, level / size[told])


def _of_inertia(force: Array, motion: Array, others: Iterable[Array]) -> bool:
    """Whether the acceleration accounts for more of the force than all else, and for twice what others do.

    A force that is read late, or that sinks after a contact, goes with the speed as well.
    """
    by_motion = _accounts(motion, force)
    return by_motion > _MOST and all(by_motion > _OTHERS * _accounts(own, force) for own in others)


def _accounts(column: Array, force: Array) -> float:
    """Share of the force's power that a column accounts for."""
    return float(column @ force) ** 2 / max(float(column @ column) * float(force @ force), 1e-300)
