"""Claims of the thesis and their verdicts; their texts are in claims.toml."""

import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any, Literal

import numpy as np

from palpate.report.page import Table

Verdict = Literal["reproduced", "differs", "not checkable"]
ENOUGH = 0.9
"""Fraction of the runs in which a claim has to hold."""


@dataclass(frozen=True)
class ThesisClaim:
    """One row of claims.json.

    Args:
        id: the claim, "least-squares-foam-level"; with a suffix, ".K", if one sentence makes several claims.
        source: where the thesis says it.
        claim: its statement, in our words.
        thesis: its value, with unit; or "in words" where it gives none.
        measured: ours, with spread over the seeds, unit and seeds: see `spread`.
        tolerance: the threshold that decides, stated before looking: "within 10 % of the value at 4 s by 0.12 s".
        verdict: reproduced, differs, or not checkable.
        note: one paragraph: the reason, the chosen values and their effect, the range of validity.
        group: True if the row only sums up its parts; then it is not counted.
    """

    id: str
    source: str
    claim: str
    thesis: str
    measured: str
    tolerance: str
    verdict: Verdict
    note: str
    group: bool = False


@dataclass
class Done:
    """Study that has been measured, with its claims.

    Args:
        number, title, caption: of its figure.
        claims: decided by it.
        seconds: that it took.
        beside: what the folded figure shows; empty without one.
        tables: shown under the figure.
    """

    number: str
    title: str
    caption: str
    claims: list[ThesisClaim]
    seconds: float
    beside: str = ""
    tables: list[Table] = field(default_factory=list)


def verdict_of(holds: bool) -> Verdict:
    """Verdict of a claim that can be checked."""
    return "reproduced" if holds else "differs"


def often(holds: Iterable[bool]) -> bool:
    """True if a claim holds in enough of the runs."""
    runs = list(holds)
    return sum(map(bool, runs)) >= ENOUGH * len(runs)


def spread(values: Sequence[float], unit: str = "", digits: int = 3) -> str:
    """Median and range over the seeds: "7.21 kN/m (7.05 to 7.38, 10 seeds)"."""
    v = np.asarray(values, dtype=float)
    finite = v[np.isfinite(v)]
    suffix = f" {unit}" if unit else ""
    if not len(finite):
        return f"never ({len(v)} seeds)"
    missing = f", {len(v) - len(finite)} without a value" if len(finite) < len(v) else ""
    low, middle, high = (f"{x:.{digits}g}" for x in (finite.min(), np.median(finite), finite.max()))
    return f"{middle}{suffix} ({low} to {high}, {len(v)} seeds{missing})"


def on_one_line(name: str) -> str:
    """Name of a variation without its line breaks."""
    return name.replace("\n", " ")


class _Spread(list[Any]):
    """Values over the seeds, for a placeholder in a text: "{error:N 2}" is their spread in newtons, to two digits.

    "{press.off:% 2}" is the spread of an attribute of measured objects, converted from SI to the placeholder's unit.
    """

    scales: Mapping[str, float] = {}

    def __getattr__(self, name: str) -> "_Spread":
        values = _Spread(getattr(item, name) for item in self)
        values.scales = {"%": 100.0, "mm": 1e3, "kN/m": 1e-3}
        return values

    def __format__(self, spec: str) -> str:
        unit, _, digits = spec.rpartition(" ")
        if not digits.isdigit():
            unit, digits = spec, "3"
        return spread([self.scales.get(unit, 1.0) * value for value in self], unit, int(digits))


@cache
def tables() -> Mapping[str, Mapping[str, Mapping[str, str]]]:
    """Figures and claims of claims.toml, each text on one line."""
    tables = tomllib.loads((resources.files("palpate_thesis") / "claims.toml").read_text("utf-8"))
    return {
        kind: {key: {name: " ".join(text.split()) for name, text in row.items()} for key, row in rows.items()}
        for kind, rows in tables.items()
    }


def texts(number: str) -> tuple[str, str]:
    """Title and caption of a figure."""
    figure = tables()["figures"][number]
    return figure["title"], figure["caption"]


def claim(id_: str, holds: bool | Verdict, /, **numbers: Any) -> ThesisClaim:
    """A row of claims.json.

    Args:
        id_: its key in claims.toml. A row there takes texts that it lacks from the row named in `like`.
        holds: True if the claim is reproduced; or its verdict.
        numbers: values of the placeholders in its texts; a list with one value a seed is written as its spread.
    """
    row = dict(tables()["claims"][id_])
    while "like" in row:
        row = {**tables()["claims"][row.pop("like")], **row}
    values = {k: _Spread(v) if isinstance(v, list | np.ndarray) else v for k, v in numbers.items()}
    filled: dict[str, Any] = {name: text.format(**values) for name, text in row.items()}
    return ThesisClaim(id=id_, verdict=holds if isinstance(holds, str) else verdict_of(holds), **filled)


def claims_of_studies(studies: Sequence[Done]) -> list[ThesisClaim]:
    """Claims of the studies with the rows that sum up their parts: see `with_wholes`."""
    return with_wholes([claim for study in studies for claim in study.claims])


def with_wholes(claims: Sequence[ThesisClaim]) -> list[ThesisClaim]:
    """Insert a row "a" before the first of the parts "a.K", "a.B" of a claim that was measured in parts only.

    Such a row is reproduced if all its parts are; "not checkable" if all are not checkable.
    """
    ids = {claim.id for claim in claims}
    rows: list[ThesisClaim] = []
    for claim in claims:
        name = _name(claim)
        if name not in ids:
            ids.add(name)
            rows.append(_whole(name, [c for c in claims if _name(c) == name]))
        rows.append(claim)
    return rows


def count_verdicts(claims: Sequence[ThesisClaim]) -> Counter[str]:
    """Number of claims by verdict, without the rows that sum up others."""
    return Counter(claim.verdict for claim in claims if not claim.group)


def count_in_words(claims: Sequence[ThesisClaim]) -> str:
    """The counts as a sentence: "87 claims measured: 48 reproduced, 38 differ, 1 not checkable"."""
    counts = count_verdicts(claims)
    words = {"reproduced": "reproduced", "differs": "differ", "not checkable": "not checkable"}
    parts = ", ".join(f"{counts[verdict]} {word}" for verdict, word in words.items())
    return f"{counts.total()} claim{'s' * (counts.total() != 1)} measured: {parts}"


def _name(claim: ThesisClaim) -> str:
    """Name of the claim without that of the part: "a" of "a.K"."""
    return claim.id.partition(".")[0]


def _whole(name: str, parts: Sequence[ThesisClaim]) -> ThesisClaim:
    verdicts = {part.verdict for part in parts}
    verdict: Verdict = verdicts.pop() if len(verdicts) == 1 else "differs"
    measured = [f"{part.id.rpartition('.')[2]}: {part.verdict}" for part in parts]
    return ThesisClaim(
        id=name,
        source="; ".join(dict.fromkeys(part.source for part in parts)),
        claim=" ".join(dict.fromkeys(part.claim for part in parts)),
        thesis="; ".join(dict.fromkeys(part.thesis for part in parts)),
        measured="; ".join(measured),
        tolerance="each part by its own threshold",
        verdict=verdict,
        note="One sentence of the thesis makes several claims. Each is measured separately: see the rows "
        f"{', '.join(part.id for part in parts)}.",
        group=True,
    )
