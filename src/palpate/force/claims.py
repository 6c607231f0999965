"""Claims about a tuned loop: kinds of statements, the surfaces of each, and the cells that prove it."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from palpate.arrays import Array
from palpate.force.arm import Table
from palpate.force.cells import Box, Prover
from palpate.force.gains import Gains
from palpate.force.sampled_loop import SampledLoop, law_for

SHARES = {
    "position": ((0.05, (2.0, 1.5, 1.2), 0), (1e-4, (1.5, 1.2), 1)),
    "torque": ((0.05, (2.0, 1.5, 1.2), 0),),
    "servo": ((0.5, (1.5, 1.2), 0),),
}
"""g theta K_eff/alpha, or of a servo (K + B/theta)/K_u, from and to which the adapting law is proved, the first upper
end that can be; ticks by which its readings may be later than the jitter that is asked for.
Down to next to nothing, Popov's and the circle criterion end at theta/(alpha times the sum of all lags), which is 2.0
for the UR5e without jitter: hence two claims. Down to the cap, a servo's lead that goes to and fro between those of a
stiff and of a soft surface makes the loop grow (tests/force/test_servo.py)."""
FADING_SHARE = 0.01
"""Share below which the gain of a claim counts as one that may fade."""
LOST_CONTACT_FRACTION = 1e-4
"""Fraction of the cap that is left of a surface after the tip has left it, see `one_sided_claim`."""
Finite = Annotated[float, Meta(ge=-1e300, le=1e300)]
Number = Annotated[float, Meta(ge=0, le=1e300)]
Age = Annotated[int, Meta(ge=0, le=200)]


class ProvedCell(Table):
    """A box of surfaces and L, row by row, with |L^T Phi L^-T| < 1 at every tick."""

    low: Number
    high: Number
    least: Number
    most: Number
    norm: tuple[tuple[Finite, ...], ...]
    part: Annotated[int, Meta(ge=0, le=10_000)] = 0
    loss: Annotated[int, Meta(ge=0, le=100)] = 0

    @classmethod
    def of(cls, box: Box, L: Array) -> ProvedCell:
        """A box with its norm."""
        rows = tuple(tuple(map(float, row)) for row in L)
        return cls(box.low, box.high, box.least, box.most, rows, box.part, box.loss)

    @property
    def box(self) -> Box:
        """The surfaces, the part of the inner loop and the loss of delay."""
        return Box(self.low, self.high, self.least, self.most, self.part, self.loss)

    @property
    def L(self) -> Array:
        """The norm, shape (n, n)."""
        return np.array(self.norm)


class Claim(Table):
    """One statement about the loop in contact.

    `held`: with g held, every surface whose K + B/theta is within low ... high [N/m] and whose B/K is within
    least ... most [s] is pressed on stably. K and B may change within a cell from tick to tick. `adapting`: the same
    for every constant surface while g theta K_eff/alpha goes anywhere within the shares, from tick to tick; for a
    position arm that holds for every stiffness, since only the product counts; for a servo K_u goes anywhere within
    K + B/theta over the shares, and gain and lead with it; the reading in use is of any age within
    `ages`, from tick to tick. The others are of readings of one age, the oldest. `one-sided`: as held, while K and B
    together go anywhere within low ... high, from tick to tick, as where contact is lost and found again.
    """

    kind: Literal["held", "adapting", "one-sided"]
    low: Number
    high: Number
    least: Number
    most: Number
    shares: tuple[Number, Number]
    ages: tuple[Age, Age]
    """Youngest and oldest age of the reading in use [ticks]; the sensor's own period counts, rounded up."""
    state: tuple[str, ...] = ()
    """Order of the numbers in which the norms are, see `SampledLoop.state`."""
    units: dict[str, Number] = msgspec.field(default_factory=dict)
    """Units of these numbers, see `SampledLoop.units`."""
    parts: Annotated[int, Meta(ge=1, le=100)] = 1
    cells: tuple[ProvedCell, ...] = ()

    def jitter(self, gains: Gains) -> int:
        """Ticks by which a reading may be older than the sensor's period, rounded up."""
        return self.ages[1] - gains.arm.sensor_ticks

    def fault(self, gains: Gains) -> str:
        """Why it says nothing of these gains, whatever its norms; empty otherwise."""
        adapting, (low, high), (young, old) = self.kind == "adapting", self.shares, self.ages
        if not (0.0 < low <= high if adapting else low == 1.0 <= high):
            return "the shares are not of the law's gain"
        fit = young <= old and self.jitter(gains) >= 0 and (adapting or young == old)
        return (
            "" if fit and (young or gains.arm.low_pass.sections) else "the ages are not those of the sensor"
        )

    def boxes(self, gains: Gains) -> list[Box]:
        """Set that its cells have to cover: the surfaces, for each part of the inner loop and each possible delay."""
        losses = range(gains.arm.unsure_ticks + 1) if self.kind != "adapting" else (0,)
        return [
            Box(self.low, self.high, self.least, self.most, part, loss)
            for part in range(self.parts**2)
            for loss in losses
        ]

    def prover(self, gains: Gains) -> Prover:
        """Prover of the claim: the loops that have to contract."""
        unit_of_force = gains.seen_cap if gains.arm.kind == "position" else _between(gains)
        loop = SampledLoop(gains.arm, self.jitter(gains), unit_of_force)
        relative = self.kind == "adapting"
        servo = gains.arm.kind == "servo"
        unit = (1.0 if servo else gains.alpha) if relative else gains.gain
        ends = self.shares[0] * unit, self.shares[1] * unit
        younger = self.ages[1] - self.ages[0] + gains.arm.unsure_ticks
        fading: Literal["", "gain", "surface"] = "surface" if self.kind == "one-sided" else ""
        if self.kind == "adapting" and gains.arm.kind == "position" and self.shares[0] < FADING_SHARE:
            fading = "gain"
        return Prover(
            loop, gains.theta, ends, younger, bound=gains.seen_cap,
            at=(lambda bound: law_for(gains.arm, gains.gain_at(bound), bound)) if relative and servo else None,
            relative=relative, fading=fading, parts=self.parts,
        )  # fmt: skip

    def tiled(self, box: Box) -> bool:
        """True if the cells cover a box: every rectangle between two neighbouring edges lies in a cell."""
        cells = [c for c in self.cells if (c.part, c.loss) == (box.part, box.loss)]
        if not cells:
            return False
        edges = np.array([[c.low, c.high, c.least, c.most] for c in cells])
        if self.kind == "one-sided" and not (
            (edges[:, 0] <= self.low).all() and (edges[:, 1] >= self.high).all()
        ):
            return False  # one norm for the surface and for what is left of it
        bounds = _cuts(edges[:, :2], self.low, self.high)
        times = _cuts(edges[:, 2:], self.least, self.most)
        for a, b in bounds:
            across = edges[(edges[:, 0] <= a) & (edges[:, 1] >= b)]
            if not all(((across[:, 2] <= s) & (across[:, 3] >= t)).any() for s, t in times):
                return False
        return True


def _cuts(ends: np.ndarray, low: float, high: float) -> list[tuple[float, float]]:
    if low == high:
        return [(low, high)]
    inside = np.unique(np.clip(ends, low, high))
    all_of = np.unique(np.concatenate([inside, [low, high]]))
    return [(a, b) for a, b in pairwise(all_of.tolist())]


def held_claim(gains: Gains, low: float, high: float, most: float) -> Claim:
    """Claim that the loop with K_u = cap is stable on surfaces as the measured position feels them.

    Args:
        gains: of the loop.
        low: K + B/theta from [N/m].
        high: to [N/m].
        most: longest B/K [s].
    """
    ages = (gains.arm.sensor_ticks,) * 2
    return Claim(kind="held", low=low, high=high, least=0.0, most=most, shares=(1.0, 1.0), ages=ages)


def adapting_claims(gains: Gains, low: float, most: float, jitter: int = 0) -> list[list[Claim]]:
    """Claims that the loop is stable whatever the estimator does; of each list, the first provable one counts.

    Args:
        gains: of the loop.
        low: for a torque arm, the softest surface [N/m]; a position arm's proof is of all.
        most: longest B/K [s].
        jitter: ticks by which a reading may be older than the sensor's period, rounded up; the highest gain comes
            first, with fewer ticks where it has to.
    """
    high = gains.seen_cap
    oldest = gains.arm.sensor_ticks
    low = high if gains.arm.kind == "position" else low
    youngest = (
        0 if gains.arm.low_pass.sections else 1
    )  # without a low-pass a reading is of the surface itself
    return [
        [
            Claim(
                kind="adapting", low=low, high=high, least=0.0, most=most, shares=(least, top),
                ages=(youngest, oldest + late),
            )
            for top in tops
            for late in sorted({jitter + more, more if top == tops[0] else jitter + more}, reverse=True)
        ]
        for least, tops, more in SHARES[gains.arm.kind]
    ]  # fmt: skip


def one_sided_claim(gains: Gains, most: float) -> Claim:
    """Claim that a position arm's loop with K_u = cap is stable also where contact is lost and found again.

    About the state of rest under F_d, a force max(K x + B xdot, 0) is k (K x~ + B xdot~) with k between 0 and 1: a
    sector. It is F_d/(F_d + K gap) at least, over a gap to the surface.

    Args:
        gains: of the loop.
        most: longest B/K [s].
    """
    cap = gains.seen_cap
    ends = (1.0, 1.0)
    ages = (gains.arm.sensor_ticks,) * 2
    return Claim(
        kind="one-sided",
        low=LOST_CONTACT_FRACTION * cap,
        high=cap,
        least=0.0,
        most=most,
        shares=ends,
        ages=ages,
    )


def _between(gains: Gains) -> float:
    """A unit of stiffness for a torque arm, in which neither its spring nor a soft surface is out of size [N/m]."""
    return float(np.sqrt(gains.arm.series * min(gains.cap, gains.arm.series)))
