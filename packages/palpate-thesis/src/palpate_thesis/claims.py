"""Claims of the thesis and their verdicts; their texts are in claims.toml."""

import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any, Literal, get_args

import numpy as np

from palpate.report.page import Table

Verdict = Literal["reproduced", "reproduced in a plausible laboratory", "contradicted", "not checkable"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
TEXTS = ("source", "claim", "thesis", "measured", "tolerance", "note")
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
ENOUGH, MAJORITY = 0.9, None
"""Fraction of the runs in which a claim has to hold, and no fraction where more than half suffice."""


@dataclass(frozen=True)
class ThesisClaim:
    """One row of claims.json."""

    id: str  # the claim, "least-squares-foam-level"; with a suffix, ".K", if one sentence makes several claims
    source: str  # where the thesis says it
    claim: str  # its statement, in our words
    thesis: str  # its value, with unit; the claim itself where it gives none
    measured: str  # ours, with spread over the seeds, unit and seeds: see `spread`
    tolerance: str  # the threshold that decides, stated before looking
    verdict: Verdict  # one of `VERDICTS`
    note: str  # one paragraph: the reason, the chosen values and their effect, the range of validity
    of: Of = "ours"  # of the thesis about its experiments, or its set-up and cited schemes; or ours


@dataclass
class Done:
    """Study that has been measured, with its claims."""

    number: str  # of its figure
    title: str
    caption: str
    claims: list[ThesisClaim]  # decided by it
    seconds: float  # that it took
    tables: list[Table] = field(default_factory=list)  # shown under the figure


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
    """Names of the sentences of the thesis about its experiments: those of figures that are in a half."""
    return frozenset(id_ for id_, row in rows().items() if "half" in row)


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
def figures() -> Mapping[str, Mapping[str, Any]]:
    """Figures of claims.toml with their claims, each text on one line."""
    tables = tomllib.loads((resources.files("palpate_thesis") / "claims.toml").read_text("utf-8"))
    return {number: _on_one_line(figure) for number, figure in tables.items()}


def _on_one_line(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _on_one_line(item) for key, item in value.items()}
    return " ".join(value.split()) if isinstance(value, str) else value


@cache
def rows() -> Mapping[str, Mapping[str, Any]]:
    """Claims of claims.toml: what a row lacks comes from the row named in `like`, then from its figure."""
    tables = {id_: row for figure in figures().values() for id_, row in figure.get("claims", {}).items()}

    def complete(row: Mapping[str, Any]) -> Mapping[str, Any]:
        return {**complete(tables[row["like"]]), **row} if "like" in row else row

    return {
        id_: {**figure, **complete(row), "figure": number}
        for number, figure in figures().items()
        for id_, row in figure.get("claims", {}).items()
    }


def texts(number: str) -> tuple[str, str]:
    """Title and caption of a figure."""
    return figures()[number]["title"], figures()[number]["caption"]


def claim(id_: str, holds: bool | Verdict, /, **numbers: Any) -> ThesisClaim:
    """A row of claims.json.

    Args:
        id_: its key in claims.toml.
        holds: True if the claim is reproduced; or its verdict.
        numbers: values of the placeholders in its texts; a list with one value a seed is written as its spread.
    """
    row = {"thesis": rows()[id_]["claim"], "measured": "{values}", **rows()[id_]}
    values = {k: _Spread(v) if isinstance(v, list | np.ndarray) else v for k, v in numbers.items()}
    filled = {name: row[name].format(**values) for name in TEXTS}
    of: Of = "experiment" if "half" in row or id_.startswith(CONCLUSION) else row.get("of", "ours")
    verdict = holds if isinstance(holds, str) else verdict_of(id_, holds)
    return ThesisClaim(id=id_, verdict=verdict, of=of, **filled)


@dataclass(frozen=True, eq=False)
class Sentence:
    """A sentence of the thesis as a condition on one run."""

    id: str  # of its claim
    holds: Callable[[Any], bool]  # True if it holds in one run, by the result of the figure's metric
    value: Callable[[Any], float] = lambda _: np.nan  # number of a run that its text prints
    unit: str = ""  # of that number
    fraction: float | None = ENOUGH  # of the runs in which it has to hold; or `MAJORITY`
    numbers: Mapping[str, Any] = field(default_factory=dict)  # further values of placeholders

    def is_true(self, held: int, runs: int) -> bool:
        """True if the sentence holds in enough of the runs."""
        return 2 * held > runs if self.fraction is None else held >= self.fraction * runs

    def judge(self, results: Sequence[Any], surface: str = "", **numbers: Any) -> ThesisClaim:
        """The claim from all runs, with the spread of its number: "foam 7.2 kN/m (7 to 7.4, 10 seeds)"."""
        held = sum(map(self.holds, results))
        values = f"{surface} {spread(list(map(self.value, results)), self.unit)}".strip()
        common = {"values": values, "surface": surface, "good": held, "runs": len(results)}
        return claim(self.id, self.is_true(held, len(results)), **{**common, **self.numbers, **numbers})


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
