"""A certificate: what is proved of a tuned loop, with the norms that prove it; verified by norms alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from palpate.errors import InputError
from palpate.files import signed, write_json
from palpate.force.arm import PositionLoop, Table
from palpate.force.cells import Box, Prover
from palpate.force.cover import Cell, covered
from palpate.force.gains import Gains
from palpate.force.lag import ultimate_gain
from palpate.force.sampled_loop import SampledLoop

FORM: Literal["palpate force certificate 1"] = "palpate force certificate 1"
_LARGEST = 1 << 26
SOFTEST = 1e-3
"""Of the cap: as far down as a held gain is proved by default."""
EXACT_SHARE = 0.99
"""Of the exact interval of a held gain: as far up as it is proved by default."""
SHARES = {
    "position": ((0.05, (2.0, 1.5, 1.2), 0), (1e-4, (1.5, 1.2), 1)),
    "torque": ((0.05, (2.0, 1.5, 1.2), 0),),
}
"""g theta K_eff/alpha from and to which the adapting law is proved, the first upper end that can be; further jitter.

Down to next to nothing, Popov's and the circle criterion end at theta/(alpha times the sum of all lags), which is 2.0
for the UR5e without jitter: hence two claims.
"""
PART = 0.06
"""Relative width of w^2 and of 2 z w that one norm is asked to serve."""
MOST_JITTER = 10
FADED = 0.01
"""Share below which the gain of a claim counts as one that may fade."""
GONE = 1e-4
"""Of the cap: what is left of a surface that the tip has left, see `one_sided_claim`."""
Finite = Annotated[float, Meta(ge=-1e300, le=1e300)]
Number = Annotated[float, Meta(ge=0, le=1e300)]


class ProvedCell(Table):
    """A box of surfaces and L, row by row, with |L^T Phi L^-T| < 1 at every tick."""

    low: Number
    high: Number
    least: Number
    most: Number
    norm: tuple[tuple[Finite, ...], ...]
    part: Annotated[int, Meta(ge=0, le=10_000)] = 0
    loss: Annotated[int, Meta(ge=0, le=100)] = 0

    @property
    def cell(self) -> Cell:
        """As `cover` has it."""
        return Cell(
            Box(self.low, self.high, self.least, self.most, self.part, self.loss), np.array(self.norm)
        )


class Claim(Table):
    """One statement about the loop in contact.

    `held`: with g held, every surface whose K + B/theta is within low ... high [N/m] and whose B/K is within
    least ... most [s] is pressed on stably. K and B may change within a cell from tick to tick. `adapting`: the same
    for every constant surface while g theta K_eff/alpha goes anywhere within the shares, from tick to tick; for a
    position arm that holds for every stiffness, since only the product counts. `one-sided`: as held, while K and B
    together go anywhere within low ... high, from tick to tick, as where contact is lost and found again.
    """

    kind: Literal["held", "adapting", "one-sided"]
    low: Number
    high: Number
    least: Number
    most: Number
    shares: tuple[Number, Number]
    jitter: Annotated[int, Meta(ge=0, le=MOST_JITTER)]
    parts: Annotated[int, Meta(ge=1, le=100)] = 1
    cells: tuple[ProvedCell, ...] = ()

    def boxes(self, gains: Gains) -> list[Box]:
        """What its cells have to cover: the surfaces, for each part of the inner loop and each delay it may have."""
        losses = range(gains.arm.unsure_ticks + 1) if self.kind != "adapting" else (0,)
        return [
            Box(self.low, self.high, self.least, self.most, part, loss)
            for part in range(self.parts**2)
            for loss in losses
        ]

    def prover(self, gains: Gains) -> Prover:
        """What has to contract."""
        own = gains.seen_cap if gains.arm.kind == "position" else _between(gains)
        loop = SampledLoop(gains.arm, self.jitter, own)
        unit = gains.alpha if self.kind == "adapting" else gains.gain
        ends = self.shares[0] * unit, self.shares[1] * unit
        younger = self.jitter + gains.arm.unsure_ticks
        fading: Literal["", "gain", "surface"] = "surface" if self.kind == "one-sided" else ""
        if self.kind == "adapting" and gains.arm.kind == "position" and self.shares[0] < FADED:
            fading = "gain"
        relative = self.kind == "adapting"
        return Prover(loop, gains.theta, ends, younger, relative=relative, fading=fading, parts=self.parts)


@dataclass(frozen=True)
class Verdict:
    """What a check found.

    Args:
        holds: whether every cell contracts and the cells leave no gap.
        contraction: the largest norm of any cell.
        rounding: bound of what rounding may have added to it.
        cells: how many were checked.
        why: what does not hold; empty if all does.
    """

    holds: bool
    contraction: float
    rounding: float
    cells: int
    why: str = ""


class Certificate(Table):
    """What is proved of a tuned loop.

    Args:
        form: of the file.
        gains: of the loop.
        claims: each with the norms that prove it.
        measured: the inner loop that the proof is of, where a log told it better than the gains' arm.
        written_by: the mark of the file.
    """

    form: Literal["palpate force certificate 1"]
    gains: Gains
    claims: tuple[Claim, ...]
    measured: PositionLoop | None = None
    written_by: str = ""

    @property
    def proved_gains(self) -> Gains:
        """The gains with the inner loop that the proof is of."""
        return self.gains if self.measured is None else with_inner(self.gains, self.measured)

    @classmethod
    def load(cls, path: Path) -> Certificate:
        """From its file.

        Raises:
            InputError: no certificate.
        """
        with path.open("rb") as file:
            data = file.read(_LARGEST + 1)
        if len(data) > _LARGEST:
            raise InputError(f"{path}: more than {_LARGEST} bytes are no certificate; check the path")
        try:
            return msgspec.structs.replace(msgspec.json.decode(data, type=cls), written_by="")
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: no certificate of palpate certify: {error}") from None
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    def save(self, path: Path) -> None:
        """Writes the file, whole or not at all."""
        write_json(path, signed({k: v for k, v in msgspec.to_builtins(self).items() if v not in ("", None)}))

    def check_of(self, gains: Gains) -> None:
        """Refuses to speak of other gains.

        Raises:
            InputError: another arm, rate, law, lag or cap.
        """
        own = self.gains
        for name, mine, other in (
            ("rate", own.arm.rate, gains.arm.rate),
            ("law", own.law, gains.law),
            ("arm", own.arm, gains.arm),
            ("theta", own.theta, gains.theta),
            ("alpha", own.alpha, gains.alpha),
            ("cap", own.cap, gains.cap),
        ):
            if mine != other:
                what = f" ({mine:g} and {other:g})" if isinstance(mine, float) else ""
                raise InputError(
                    f"the certificate is of another {name}{what} than the gains; certify them again"
                )

    def check(self) -> Verdict:
        """Whether it holds, by norms alone."""
        worst, rounding, count = 0.0, 0.0, 0
        if not self.claims:
            return Verdict(False, np.inf, 0.0, 0, "it claims nothing")
        for claim in self.claims:
            prover = claim.prover(self.proved_gains)
            if not all(_tiled(claim, box) for box in claim.boxes(self.proved_gains)):
                return Verdict(False, np.inf, 0.0, count, f"the cells of its {claim.kind} claim leave a gap")
            for proved in claim.cells:
                if [len(row) for row in proved.norm] != [prover.loop.size] * prover.loop.size:
                    return Verdict(False, np.inf, 0.0, count, "a norm is not of the loop's size")
                size, moved = _contraction(prover, proved.cell)
                worst, rounding, count = max(worst, size), max(rounding, moved), count + 1
                if not size + moved < 1.0:
                    return Verdict(False, worst, rounding, count, "a cell does not contract")
        return Verdict(True, worst, rounding, count)


def _contraction(prover: Prover, cell: Cell) -> tuple[float, float]:
    try:
        return prover.contraction(cell.box, cell.L)
    except (np.linalg.LinAlgError, FloatingPointError, ValueError):
        return np.inf, 0.0


def _tiled(claim: Claim, box: Box) -> bool:
    """Whether the cells cover one of a claim's boxes: every rectangle between two neighbouring edges lies in a cell."""
    own = [c for c in claim.cells if (c.part, c.loss) == (box.part, box.loss)]
    if not own:
        return False
    edges = np.array([[c.low, c.high, c.least, c.most] for c in own])
    if claim.kind == "one-sided" and not (
        (edges[:, 0] <= claim.low).all() and (edges[:, 1] >= claim.high).all()
    ):
        return False  # one norm for the surface and for what is left of it
    bounds = _cuts(edges[:, :2], claim.low, claim.high)
    times = _cuts(edges[:, 2:], claim.least, claim.most)
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


def with_inner(gains: Gains, inner: PositionLoop) -> Gains:
    """The gains with another inner loop, the law and its theta as they are."""
    return msgspec.structs.replace(gains, arm=msgspec.structs.replace(gains.arm, inner=inner))


def proved_claim(gains: Gains, claim: Claim, starts: Sequence[Box] | None = None) -> Claim | None:
    """The claim with the cells that prove it; None if some of it cannot be proved.

    Args:
        gains: of the loop.
        claim: without cells.
        starts: boxes that tile it, from which the search for cells begins.
    """
    prover = claim.prover(gains)
    cells: list[Cell] = []
    whole = claim.boxes(gains)
    for start in starts or (whole if prover.fading else [s for box in whole for s in _starts(box)]):
        found, left = covered(prover, start)
        if left:
            return None
        cells += found
    proved = tuple(
        ProvedCell(
            low=c.box.low, high=c.box.high, least=c.box.least, most=c.box.most,
            norm=tuple(tuple(map(float, row)) for row in c.L), part=c.box.part, loss=c.box.loss,
        )
        for c in cells
    )  # fmt: skip
    return msgspec.structs.replace(claim, cells=proved)


def _starts(box: Box) -> list[Box]:
    """The box, its bounds cut into decades from above: a norm seldom serves more."""
    edges = [box.high]
    while edges[-1] / 10.0 > box.low:
        edges.append(edges[-1] / 10.0)
    edges.append(box.low)
    if box.low == box.high:
        return [box]
    return [replace(box, low=a, high=b) for b, a in pairwise(edges)]


def held_claim(
    gains: Gains, low: float, high: float, most: float, jitter: int = 0, margin: float = 1.0
) -> Claim:
    """That the loop with K_u = cap is stable on surfaces as the measured position feels them.

    Args:
        gains: of the loop.
        low: K + B/theta from [N/m].
        high: to [N/m].
        most: longest B/K [s].
        jitter: ticks.
        margin: factor that all gains may grow by.
    """
    return Claim(kind="held", low=low, high=high, least=0.0, most=most, shares=(1.0, margin), jitter=jitter)


def adapting_claims(
    gains: Gains, low: float, most: float, jitter: int = 0, margin: float = 1.0
) -> list[list[Claim]]:
    """That the loop is stable whatever the estimator does; of each list, the first that can be proved.

    Args:
        gains: of the loop.
        low: for a torque arm, the softest surface [N/m]; a position arm's proof is of all.
        most: longest B/K [s].
        jitter: ticks.
        margin: factor that all gains may grow by.
    """
    high = gains.seen_cap
    low = high if gains.arm.kind == "position" else low
    return [
        [
            Claim(
                kind="adapting", low=low, high=high, least=0.0, most=most, shares=(least, top * margin),
                jitter=min(jitter + more, MOST_JITTER),
            )
            for top in tops
        ]
        for least, tops, more in SHARES[gains.arm.kind]
    ]  # fmt: skip


def one_sided_claim(gains: Gains, most: float, margin: float = 1.0) -> Claim:
    """That a position arm's loop with K_u = cap is stable also where contact is lost and found again.

    About the state of rest under F_d, a force max(K x + B xdot, 0) is k (K x~ + B xdot~) with k between 0 and 1: a
    sector. It is F_d/(F_d + K gap) at least, over a gap to the surface.

    Args:
        gains: of the loop.
        most: longest B/K [s].
        margin: factor that all gains may grow by.
    """
    cap = gains.seen_cap
    ends = (1.0, margin)
    return Claim(kind="one-sided", low=GONE * cap, high=cap, least=0.0, most=most, shares=ends, jitter=0)


def exact_interval(gains: Gains, damping_time: float = 0.0) -> tuple[float, float]:
    """K + B/theta, as felt, on which the loop with K_u = cap is stable, for B/K of this size [N/m].

    Exact for a position arm. For a torque arm the upper end is the cap: its gain is chosen for all below it.
    """
    if gains.arm.kind == "torque":
        return 0.0, gains.seen_cap
    cap = gains.seen_cap
    K = cap / (1.0 + damping_time / gains.theta)
    corners = gains.arm.inner.corners if isinstance(gains.arm.inner, PositionLoop) else []
    most = min(ultimate_gain(SampledLoop(gains.arm, inner=c), K, damping_time * K) for c in corners)
    return 0.0, cap * most / (gains.gain * K)  # `most` is g K at the boundary


# More than seven arguments: each is a claim of the certificate, and may be left out.
def certify(
    gains: Gains,
    stiffness: tuple[float, float] | None = None,
    damping_time: float | None = None,
    jitter: int = 1,
    margin: float = 1.0,
    *,
    adapting: bool = True,
    measured: PositionLoop | None = None,
    progress: Callable[[str], None] | None = None,
) -> Certificate:
    """Proves what can be proved of a tuned loop.

    Args:
        gains: of the loop.
        stiffness: of the surfaces, lowest and highest K + B/theta, their own [N/m]; by default from a thousandth of
            the cap to 99 % of what is stable at all.
        damping_time: longest B/K [s]; theta by default, 0 for the adapting law of a torque arm.
        jitter: ticks by which the age of a reading may change from tick to tick while the law adapts.
        margin: factor that all gains may grow by.
        adapting: prove the adapting law too.
        measured: the inner loop as a log told it, instead of the arm's own.
        progress: told what is being proved.

    Returns:
        The claims that were proved; those that were not are left out.
    """
    own_gains, gains = gains, gains if measured is None else with_inner(gains, measured)
    position = gains.arm.kind == "position"
    most = gains.theta if damping_time is None else damping_time
    low, high = _felt(gains, stiffness, most, margin)
    wanted = [[held_claim(gains, low, high, most, 0, margin)]]
    if position:
        wanted.append([one_sided_claim(gains, most, margin)])
    if adapting:
        softest = max(low, SOFTEST * gains.seen_cap)
        own = most if position or damping_time is not None else 0.0
        wanted += adapting_claims(gains, softest, own, jitter, margin)
    parts = _parts(gains)
    if parts > 0:  # an inner loop known to intervals: what spans all surfaces in one norm, and no more
        wanted = [wanted[1], *(tries[1:] for tries in wanted[3:])]
        wanted = [[msgspec.structs.replace(c, parts=parts) for c in tries] for tries in wanted]
    claims = (_first_proved(gains, tries, progress) for tries in wanted)
    proved = tuple(claim for claim in claims if claim is not None)
    return Certificate(form=FORM, gains=own_gains, claims=proved, measured=measured)


def _parts(gains: Gains) -> int:
    """Into how many parts what the inner loop may be is cut each way; 0 where it is known."""
    inner = gains.arm.inner
    if not isinstance(inner, PositionLoop) or (len(inner.corners) == 1 and gains.arm.unsure_ticks == 0):
        return 0
    corners = np.array(inner.corners)
    widest = float((np.ptp(corners, axis=0) / corners.mean(axis=0)).max())
    return max(ceil(widest / PART), 1)


def _first_proved(
    gains: Gains, tries: Sequence[Claim], progress: Callable[[str], None] | None
) -> Claim | None:
    for claim in tries:
        if progress is not None:
            progress(f"the {claim.kind} law, gains of {claim.shares[0]:g} to {claim.shares[1]:g}")
        found = proved_claim(gains, claim)
        if found is not None:
            return found
    return None


def _felt(
    gains: Gains, stiffness: tuple[float, float] | None, most: float, margin: float
) -> tuple[float, float]:
    if stiffness is not None:
        low, high = stiffness
        if gains.arm.kind == "position":
            return gains.arm.seen(low), gains.arm.seen(high)
        return low, high
    cap = gains.seen_cap
    ends = [exact_interval(gains, t)[1] for t in np.linspace(0.0, most, 9).tolist()]
    share = 1.0 if gains.arm.kind == "torque" else EXACT_SHARE / margin
    return SOFTEST * cap, float(share * min(ends))


def _between(gains: Gains) -> float:
    """A unit of stiffness for a torque arm, in which neither its spring nor a soft surface is out of size [N/m]."""
    return float(np.sqrt(gains.arm.series * min(gains.cap, gains.arm.series)))
