"""A certificate: what is proved of a tuned loop, with the norms that prove it; verified by norms alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from palpate.errors import InputError
from palpate.files import signed, write_json
from palpate.force.arm import Table
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
SHARES = {"position": (0.05, 2.0), "torque": (0.1, 2.0)}
"""g theta K_eff/alpha within which the adapting law is proved."""
Finite = Annotated[float, Meta(ge=-1e300, le=1e300)]
Number = Annotated[float, Meta(ge=0, le=1e300)]


class ProvedCell(Table):
    """A box of surfaces and L, row by row, with |L^T Phi L^-T| < 1 at every tick."""

    low: Number
    high: Number
    least: Number
    most: Number
    norm: tuple[tuple[Finite, ...], ...]

    @property
    def cell(self) -> Cell:
        """As `cover` has it."""
        return Cell(Box(self.low, self.high, self.least, self.most), np.array(self.norm))


class Claim(Table):
    """One statement about the loop in contact.

    `held`: with g held, every surface whose K + B/theta is within low ... high [N/m] and whose B/K is within
    least ... most [s] is pressed on stably. K and B may change within a cell from tick to tick. `adapting`: the same
    for every constant surface while g theta K_eff/alpha goes anywhere within the shares, from tick to tick; for a
    position arm that holds for every stiffness, since only the product counts.
    """

    kind: Literal["held", "adapting"]
    low: Number
    high: Number
    least: Number
    most: Number
    shares: tuple[Number, Number]
    jitter: Annotated[int, Meta(ge=0, le=10)]
    cells: tuple[ProvedCell, ...] = ()

    @property
    def box(self) -> Box:
        """Of the surfaces."""
        return Box(self.low, self.high, self.least, self.most)

    def prover(self, gains: Gains) -> Prover:
        """What has to contract."""
        own = gains.seen_cap if gains.arm.kind == "position" else None
        loop = SampledLoop(gains.arm, self.jitter, own)
        unit = gains.alpha if self.kind == "adapting" else gains.gain
        ends = self.shares[0] * unit, self.shares[1] * unit
        return Prover(loop, gains.theta, ends, self.jitter, relative=self.kind == "adapting")


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
    """What is proved of a tuned loop."""

    form: Literal["palpate force certificate 1"]
    gains: Gains
    claims: tuple[Claim, ...]
    written_by: str = ""

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
        write_json(path, signed({k: v for k, v in msgspec.to_builtins(self).items() if v != ""}))

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
            prover = claim.prover(self.gains)
            if not _tiled(claim):
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


def _tiled(claim: Claim) -> bool:
    """Whether the cells cover the claim's box: every rectangle between two neighbouring edges lies in a cell."""
    if not claim.cells:
        return False
    edges = np.array([[c.low, c.high, c.least, c.most] for c in claim.cells])
    bounds = _cuts(edges[:, :2], claim.low, claim.high)
    times = _cuts(edges[:, 2:], claim.least, claim.most)
    for a, b in bounds:
        own = edges[(edges[:, 0] <= a) & (edges[:, 1] >= b)]
        if not all(((own[:, 2] <= s) & (own[:, 3] >= t)).any() for s, t in times):
            return False
    return True


def _cuts(ends: np.ndarray, low: float, high: float) -> list[tuple[float, float]]:
    if low == high:
        return [(low, high)]
    inside = np.unique(np.clip(ends, low, high))
    all_of = np.unique(np.concatenate([inside, [low, high]]))
    return [(a, b) for a, b in pairwise(all_of.tolist())]


def proved_claim(gains: Gains, claim: Claim, starts: Sequence[Box] | None = None) -> Claim | None:
    """The claim with the cells that prove it; None if some of it cannot be proved.

    Args:
        gains: of the loop.
        claim: without cells.
        starts: boxes that tile it, from which the search for cells begins.
    """
    prover = claim.prover(gains)
    cells: list[Cell] = []
    for box in starts or _starts(claim.box):
        found, left = covered(prover, box)
        if left:
            return None
        cells += found
    proved = tuple(
        ProvedCell(
            low=c.box.low, high=c.box.high, least=c.box.least, most=c.box.most,
            norm=tuple(tuple(map(float, row)) for row in c.L),
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
    return [Box(a, b, box.least, box.most) for b, a in pairwise(edges)]


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


def adapting_claim(gains: Gains, low: float, most: float, jitter: int = 0, margin: float = 1.0) -> Claim:
    """That the loop is stable whatever the estimator does within the shares.

    Args:
        gains: of the loop.
        low: for a torque arm, the softest surface [N/m]; a position arm's proof is of all.
        most: longest B/K [s].
        jitter: ticks.
        margin: factor that all gains may grow by.
    """
    least, top = SHARES[gains.arm.kind]
    high = gains.seen_cap
    low = high if gains.arm.kind == "position" else low
    return Claim(
        kind="adapting", low=low, high=high, least=0.0, most=most, shares=(least, top * margin), jitter=jitter
    )


def exact_interval(gains: Gains, damping_time: float = 0.0) -> tuple[float, float]:
    """K + B/theta, as felt, on which the loop with K_u = cap is stable, for B/K of this size [N/m].

    Exact for a position arm. For a torque arm the upper end is the cap: its gain is chosen for all below it.
    """
    if gains.arm.kind == "torque":
        return 0.0, gains.seen_cap
    cap = gains.seen_cap
    K = cap / (1.0 + damping_time / gains.theta)
    most = ultimate_gain(SampledLoop(gains.arm), K, damping_time * K)  # g K at the boundary
    return 0.0, cap * most / (gains.gain * K)


def certify(
    gains: Gains,
    stiffness: tuple[float, float] | None = None,
    damping_time: float | None = None,
    jitter: int = 1,
    margin: float = 1.0,
    adapting: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Certificate:
    """Proves what can be proved of a tuned loop.

    Args:
        gains: of the loop.
        stiffness: of the surfaces, lowest and highest K + B/theta, their own [N/m]; by default from a thousandth of
            the cap to 99 % of what is stable at all.
        damping_time: longest B/K [s]; theta by default for a position arm, 0 for a torque arm.
        jitter: ticks by which the age of a reading may change from tick to tick while the law adapts.
        margin: factor that all gains may grow by.
        adapting: prove the adapting law too.
        progress: told what is being proved.

    Returns:
        The claims that were proved; those that were not are left out.
    """
    position = gains.arm.kind == "position"
    most = damping_time if damping_time is not None else gains.theta if position else 0.0
    low, high = _felt(gains, stiffness, most, margin)
    wanted = [held_claim(gains, low, high, most, 0, margin)]
    if adapting:
        softest = max(low, SOFTEST * gains.seen_cap)
        wanted.append(adapting_claim(gains, softest, most, jitter, margin))
    claims = []
    for claim in wanted:
        if progress is not None:
            progress(f"the {claim.kind} law")
        proved = proved_claim(gains, claim)
        if proved is not None:
            claims.append(proved)
    return Certificate(form=FORM, gains=gains, claims=tuple(claims))


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
