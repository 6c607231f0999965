"""Claims of the thesis and their verdicts; their texts are in claims.toml."""

import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Literal

import numpy as np

Verdict = Literal["reproduced", "differs", "not checkable"]
ENOUGH = 0.9
"""Share of the runs that a claim has to hold for."""


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
        group: whether it only sums up the rows of its parts, and is no claim of its own when claims are counted.
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
    """One study as it stands on disk."""

    number: str
    title: str
    caption: str
    claims: list[ThesisClaim]
    seconds: float


def verdict_of(holds: bool) -> Verdict:
    """The verdict of a claim that can be checked."""
    return "reproduced" if holds else "differs"


def often(holds: Iterable[bool]) -> bool:
    """Whether a claim holds in enough of the runs."""
    runs = list(holds)
    return sum(map(bool, runs)) >= ENOUGH * len(runs)


def spread(values: Sequence[float], unit: str = "", digits: int = 3) -> str:
    """Median and range over the seeds: "7.21 kN/m (7.05 to 7.38, 10 seeds)"."""
    v = np.asarray(values, dtype=float)
    good = v[np.isfinite(v)]
    tail = f" {unit}" if unit else ""
    if not len(good):
        return f"never ({len(v)} seeds)"
    lost = f", {len(v) - len(good)} without a value" if len(good) < len(v) else ""
    low, middle, high = (f"{x:.{digits}g}" for x in (good.min(), np.median(good), good.max()))
    return f"{middle}{tail} ({low} to {high}, {len(v)} seeds{lost})"


def on_one_line(name: str) -> str:
    """A variation's name, which a figure breaks, for a sentence."""
    return name.replace("\n", " ")


class _Spread(list[Any]):
    """Values over the seeds, for a place of a text: "{error:N 2}" has their spread in newtons, to two digits.

    Of measured objects "{press.off:% 2}" has the spread of an attribute, a number without prefix, in the place's unit.
    """

    scales: Mapping[str, float] = {}

    def __getattr__(self, name: str) -> "_Spread":
        found = _Spread(getattr(one, name) for one in self)
        found.scales = {"%": 100.0, "mm": 1e3, "kN/m": 1e-3}
        return found

    def __format__(self, spec: str) -> str:
        unit, _, digits = spec.rpartition(" ")
        unit, some = (unit, int(digits)) if digits.isdigit() else (spec, 3)
        return spread([self.scales.get(unit, 1.0) * value for value in self], unit, some)


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
        id_: its key in claims.toml; a row there has the texts of another if it is `like` that one.
        holds: whether it is reproduced; or its verdict.
        numbers: for the places of its texts; a list of one value a seed is written as its spread.
    """
    row = dict(tables()["claims"][id_])
    while "like" in row:
        row = {**tables()["claims"][row.pop("like")], **row}
    places = {k: _Spread(v) if isinstance(v, list | np.ndarray) else v for k, v in numbers.items()}
    filled: dict[str, Any] = {name: text.format(**places) for name, text in row.items()}
    return ThesisClaim(id=id_, verdict=holds if isinstance(holds, str) else verdict_of(holds), **filled)


def rows_of(studies: Sequence[Done]) -> list[ThesisClaim]:
    """The claims of these studies, one count for the page, claims.json and the terminal: see `with_wholes`."""
    return with_wholes([claim for done in studies for claim in done.claims])


def with_wholes(claims: Sequence[ThesisClaim]) -> list[ThesisClaim]:
    """The claims, and before the first part of each that was only measured in parts ("a.K", "a.B") the whole, "a".

    A whole is reproduced if all its parts are; "not checkable" if all are that.
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
    """How many claims came to each verdict; rows that only sum up others are none."""
    return Counter(claim.verdict for claim in claims if not claim.group)


def count_in_words(claims: Sequence[ThesisClaim]) -> str:
    """The count, the same everywhere: "87 claims measured: 48 reproduced, 38 differ, 1 not checkable"."""
    found = count_verdicts(claims)
    parts = [("reproduced", "reproduced"), ("differs", "differ"), ("not checkable", "not checkable")]
    told = ", ".join(f"{found[verdict]} {word}" for verdict, word in parts)
    return f"{found.total()} claim{'s' * (found.total() != 1)} measured: {told}"


def _name(claim: ThesisClaim) -> str:
    """The claim that this one is, or is a part of: "a" of "a.K"."""
    return claim.id.partition(".")[0]


def _whole(name: str, parts: Sequence[ThesisClaim]) -> ThesisClaim:
    verdicts = {part.verdict for part in parts}
    verdict: Verdict = verdicts.pop() if len(verdicts) == 1 else "differs"
    told = [f"{part.id.rpartition('.')[2]}: {part.verdict}" for part in parts]
    return ThesisClaim(
        id=name,
        source="; ".join(dict.fromkeys(part.source for part in parts)),
        claim=" ".join(dict.fromkeys(part.claim for part in parts)),
        thesis="; ".join(dict.fromkeys(part.thesis for part in parts)),
        measured="; ".join(told),
        tolerance="each part by its own threshold",
        verdict=verdict,
        note="One sentence of the thesis makes several claims. Each is measured separately: see the rows "
        f"{', '.join(part.id for part in parts)}.",
        group=True,
    )
