"""A certificate: claims of a tuned loop in a file, with the norms that prove them; verified by norms alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from palpate.errors import InputError
from palpate.files import read_bytes, with_author, write_json
from palpate.force.arm import PositionLoop, Table
from palpate.force.cells import Prover
from palpate.force.claims import Claim, ProvedCell
from palpate.force.gains import Gains

FORM: Literal["palpate force certificate 2"] = "palpate force certificate 2"
_LARGEST = 1 << 26


@dataclass(frozen=True)
class CertificateVerdict:
    """Result of a check.

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
    """Proof of a tuned loop.

    Args:
        form: of the file.
        gains: of the loop.
        claims: each with the norms that prove it.
        measured: the inner loop that the proof is of, where a log told it better than the gains' arm.
        written_by: the mark of the file.
    """

    form: Literal["palpate force certificate 2"]
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
        """Read a certificate from its file.

        Raises:
            InputError: no certificate.
        """
        data = read_bytes(path, _LARGEST, "a certificate")
        try:
            return msgspec.structs.replace(msgspec.json.decode(data, type=cls), written_by="")
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise InputError(f"{path}: no certificate of palpate certify: {error}") from None
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all."""
        write_json(
            path, with_author({k: v for k, v in msgspec.to_builtins(self).items() if v not in ("", None)})
        )

    def check_of(self, gains: Gains) -> None:
        """Refuse gains that the certificate is not of.

        Raises:
            InputError: another arm, rate, law, lag or cap.
        """
        certified = self.gains
        for name, mine, other in (
            ("rate", certified.arm.rate, gains.arm.rate),
            ("law", certified.law, gains.law),
            ("arm", certified.arm, gains.arm),
            ("theta", certified.theta, gains.theta),
            ("alpha", certified.alpha, gains.alpha),
            ("relief", certified.relief, gains.relief),
            ("cap", certified.cap, gains.cap),
        ):
            if mine != other:
                what = f" ({mine:g} and {other:g})" if isinstance(mine, float) else ""
                raise InputError(
                    f"the certificate is of another {name}{what} than the gains; certify them again"
                )

    def check(self) -> CertificateVerdict:
        """Check the certificate by norms alone."""
        worst = 0.0
        rounding = 0.0
        count = 0
        if not self.claims:
            return CertificateVerdict(False, np.inf, 0.0, 0, "it claims nothing")
        for claim in self.claims:
            fault = claim.fault(self.proved_gains)
            prover = claim.prover(self.proved_gains)
            if fault or (claim.state, claim.units) != (prover.loop.state, prover.loop.units):
                why = fault or "the state is another"
                return CertificateVerdict(False, np.inf, 0.0, count, f"{why}, in its {claim.kind} claim")
            if not all(claim.tiled(box) for box in claim.boxes(self.proved_gains)):
                return CertificateVerdict(
                    False, np.inf, 0.0, count, f"the cells of its {claim.kind} claim leave a gap"
                )
            for cell in claim.cells:
                if [len(row) for row in cell.norm] != [prover.loop.size] * prover.loop.size:
                    return CertificateVerdict(False, np.inf, 0.0, count, "a norm is not of the loop's size")
                size, error = _contraction(prover, cell)
                worst = max(worst, size)
                rounding = max(rounding, error)
                count = count + 1
                if not size + error < 1.0:
                    return CertificateVerdict(False, worst, rounding, count, "a cell does not contract")
        return CertificateVerdict(True, worst, rounding, count)


def _contraction(prover: Prover, cell: ProvedCell) -> tuple[float, float]:
    try:
        return prover.contraction(cell.box, cell.L)
    except (np.linalg.LinAlgError, FloatingPointError, ValueError):
        return np.inf, 0.0


def with_inner(gains: Gains, inner: PositionLoop) -> Gains:
    """The gains with another inner loop, the law and its theta as they are."""
    return msgspec.structs.replace(gains, arm=msgspec.structs.replace(gains.arm, inner=inner))
