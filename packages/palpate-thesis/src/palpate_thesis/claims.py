"""Claims of the thesis and their verdicts; their texts are in claims.toml."""

import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any, Literal, get_args

import numpy as np

from palpate.report.page import Table

Verdict = Literal["reproduced", "reproduced in a plausible laboratory", "contradicted", "not checkable"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
Of = Literal["experiment", "cited", "ours"]
CONCLUSION = "conclusion"
"""Beginning of the names of the claims of section 7.1, which are of the experiments, too, and counted apart."""
KINDS: Mapping[str, str] = {
    "experiment": "about the experiments",
    CONCLUSION: "of the conclusions, section 7.1",
    "cited": "about the set-up and the schemes that it cites",
    "ours": "that we add, checks and explanations",
}
"""Subjects of the sentences that are counted together, in the order of the counts, which are never summed."""
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
        verdict: one of `VERDICTS`.
        note: one paragraph: the reason, the chosen values and their effect, the range of validity.
        of: sentence of the thesis about its experiments; about its set-up or a cited scheme; or ours.
    """

    id: str
    source: str
    claim: str
    thesis: str
    measured: str
    tolerance: str
    verdict: Verdict
    note: str
    of: Of = "ours"


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


def verdict_of(id_: str, holds: bool) -> Verdict:
    """Verdict of a claim that can be checked, in the laboratory of its runs.

    A sentence about an experiment that does not hold there may hold in another shipped laboratory, which keeps all
    printed values too and was found for it: see `plausible_laboratories`.
    """
    if holds:
        return "reproduced"
    return "reproduced in a plausible laboratory" if id_ in plausible_laboratories() else "contradicted"


@cache
def plausible_laboratories() -> Mapping[str, str]:
    """Name of a laboratory in which a sentence holds, by the sentence; see `sentences` in its file."""
    folder = resources.files("palpate_thesis") / "laboratories"
    files = {f.name.removesuffix(".toml"): tomllib.loads(f.read_text("utf-8")) for f in folder.iterdir()}
    return {id_: name for name, file in sorted(files.items()) for id_ in file.get("sentences", ())}


@cache
def experiment_sentences() -> frozenset[str]:
    """Names of the sentences of the thesis about its experiments: those of halves.toml."""
    text = (resources.files("palpate_thesis") / "inference" / "halves.toml").read_text("utf-8")
    figures = tomllib.loads(text).values()
    return frozenset(
        id_
        for figure in figures
        for id_ in (*figure.get("states", ()), *figure["claims"], *figure.get("besides", ()))
    )


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
    texts = {name: text.format(**values) for name, text in row.items()}
    filled: dict[str, Any] = {"of": "ours", "thesis": "in words", **texts}
    if id_ in experiment_sentences() or id_.startswith(CONCLUSION):
        filled["of"] = "experiment"
    return ThesisClaim(id=id_, verdict=holds if isinstance(holds, str) else verdict_of(id_, holds), **filled)


def count_verdicts(claims: Sequence[ThesisClaim]) -> dict[str, Counter[str]]:
    """Number of claims by kind and verdict; kinds without a claim are left out."""

    def kind(claim: ThesisClaim) -> str:
        return CONCLUSION if claim.id.startswith(CONCLUSION) else claim.of

    counted = {name: Counter[str](c.verdict for c in claims if kind(c) == name) for name in KINDS}
    return {name: counts for name, counts in counted.items() if counts}


def count_in_words(claims: Sequence[ThesisClaim]) -> list[str]:
    """A line for each kind: "49 sentences about the experiments: 41 reproduced, 4 contradicted"."""
    lines = []
    for kind, counts in count_verdicts(claims).items():
        parts = ", ".join(
            f"{counts[verdict]} {verdict}"
            for verdict in VERDICTS
            if counts[verdict] or verdict == "reproduced"
        )
        lines.append(f"{counts.total()} sentence{'s' * (counts.total() != 1)} {KINDS[kind]}: {parts}")
    return lines
