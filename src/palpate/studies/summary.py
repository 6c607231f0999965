"""Summary of a study: the answer in a sentence, tables, the page, and the JSON summary."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.bench.summary import DONE
from palpate.files import with_author, write_json, write_text
from palpate.report.page import Table, render, with_captions
from palpate.studies.comparison import (
    Entrant,
    MetricMean,
    PairedComparison,
    PairedDifference,
    Ranked,
    Ranking,
    comparisons,
    rankings,
    short,
)
from palpate.studies.figures import draw
from palpate.studies.metrics import metric_of
from palpate.studies.plan import RunPlan

if TYPE_CHECKING:
    from polars import DataFrame

PAGE, SUMMARY = "report.html", "summary.json"
MAX_ROWS = 12
"""Settings in a table."""
MANY_FAILURES = 0.2
"""Fraction of failed runs from which the answer begins with them."""
MAX_REASONS = 2
"""Reasons listed for each result of failed runs."""
NONE = "-"


@dataclass(frozen=True)
class Findings:
    """Findings of a study.

    Args:
        summary: plain JSON values.
        tables: for terminal and page.
        notes: warnings.
    """

    summary: dict[str, Any]
    tables: list[Table]
    notes: list[str]


# More than seven arguments: how figures are written, beside what they show.
def present(
    frame: DataFrame,
    plan: RunPlan,
    folder: Path,
    source: str,
    command: str,
    endings: Sequence[str] = (),
    dpi: int | None = None,
    guard: AbstractContextManager[None] | None = None,
) -> Findings:
    """Write the summary, then figures (PNG, and those of `endings`) and page, into the folder.

    Args:
        frame: a row for each run.
        plan: of the study.
        folder: that exists.
        source: the study's file.
        command: that made the study.
        endings: of the figures' files.
        dpi: of a PNG.
        guard: context in which figures and page are made.
    """
    compared = comparisons(frame, plan)
    ranked = [] if compared else rankings(frame, plan)
    findings = Findings(
        with_author({"command": command, **summary(frame, plan, ranked, compared)}),
        [*answer_tables(frame, plan, ranked, compared), _results_table(frame)],
        notes(frame, plan, ranked, compared),
    )
    write_json(folder / SUMMARY, findings.summary)
    with guard or nullcontext():
        captions = draw(frame, plan, folder, endings, dpi)
        write_text(folder / PAGE, _page(findings, plan, source, command, captions))
    return findings


def _page(findings: Findings, plan: RunPlan, source: str, command: str, captions: Mapping[Path, str]) -> str:
    metrics = [(name, metric_of(name).text, metric_of(name).unit) for name in plan.study.metrics]
    sentence, *answers = findings.summary["answer"]
    return render(
        "study.html",
        "palpate.studies",
        room="study",
        figures=with_captions(captions),
        title=plan.study.title,
        about=plan.study.about,
        sentence=sentence,
        answers=answers,
        notes=findings.notes,
        tables=findings.tables,
        below=[Table("Metrics", ("metric", "meaning", "unit"), metrics)],
        command=command,
        study=source,
        origin=[
            ("runs", str(len(plan))),
            ("seeds", str(len(plan.seeds))),
            *((plugin.name, f"sources {plugin.stamp}") for plugin in plan.plugins),
        ],
    )


def summary(
    frame: DataFrame, plan: RunPlan, ranked: Sequence[Ranking], compared: Sequence[PairedComparison]
) -> dict[str, Any]:
    """The study in plain JSON values: answer, runs, results, and the settings by the metric."""
    best = plan.study.best
    return {
        "answer": headline(frame, plan, ranked, compared),
        "study": plan.study.title,
        "runs": len(plan),
        "seeds": list(plan.seeds),
        "results": dict(Counter(frame["result"].to_list()).most_common()),
        "metric": best.metric if best else None,
        "best": [
            {
                "of": ranking.of,
                "settings": [asdict(setting) for setting in ranking.settings[:MAX_ROWS]],
                "as_good": ranking.as_good,
                "failed": ranking.failed,
            }
            for ranking in ranked
        ],
        "compared": [_comparison_json(comparison) for comparison in compared],
    }


def _comparison_json(comparison: PairedComparison) -> dict[str, Any]:
    entrants = zip(comparison.entrants, comparison.ranks, comparison.behind, strict=True)
    return {
        "of": comparison.of,
        "metric": comparison.metric,
        "better": "most" if comparison.most else "least",
        "surfaces": len(comparison.entrants[0].values),
        "settings": [
            {
                "name": entrant.name,
                "at": entrant.at,
                "median": _quantile(entrant, 0.5),
                "mean_rank": rank,
                "failed": int(entrant.failed.sum()),
                "less_the_best": asdict(behind) if number else None,
            }
            for number, (entrant, rank, behind) in enumerate(entrants)
        ],
    }


def headline(
    frame: DataFrame, plan: RunPlan, ranked: Sequence[Ranking], compared: Sequence[PairedComparison]
) -> list[str]:
    """The answer, a sentence each: failures if they are many, then the best setting."""
    failed = frame.filter(frame["result"] != DONE)
    sentences = [_failures(frame)] if len(failed) >= MANY_FAILURES * len(frame) else []
    if compared:
        sentences.append(comparison_sentence(compared[0]))
    elif plan.study.best is not None and len(ranked) == 1 and ranked[0].settings:
        best, first = plan.study.best, ranked[0].settings[0]
        at = ", ".join(f"{name} {short(value)}" for name, value in first.at.items())
        side = "least" if best.least else "most"
        sentences.append(f"The {side} {metric_of(best.metric).title} is {interval(first.metric)}, with {at}.")
    elif not sentences:
        sentences.append(f"{len(frame) - len(failed)} of {len(frame)} runs were completed.")
    return sentences


def _failures(frame: DataFrame) -> str:
    """Number of failed runs, and the most frequent cause."""
    failed = frame.filter(frame["result"] != DONE)
    result, count = Counter(failed["result"].to_list()).most_common(1)[0]
    why = failed.filter(failed["result"] == result)["why"][0]
    most = f", {count} of them so" if count < len(failed) else ""
    return f"{len(failed)} of {len(frame)} runs failed{most}: {why}."


def comparison_sentence(comparison: PairedComparison) -> str:
    """Name the best setting, the number of surfaces on which it is better than the next, and the difference."""
    first, second = comparison.entrants[:2]
    pair, metric = comparison.behind[1], metric_of(comparison.metric)
    place = "".join(f" for {name} {short(value)}" for name, value in comparison.of.items())
    count = f"{round(pair.lost * pair.surfaces)} of {pair.surfaces} surfaces"
    if not pair.decided:
        return (
            f"{first.name} and {second.name} do not differ significantly in {metric.phrase}{place}: {first.name} is "
            f"better on {count}, worse on {round(pair.won * pair.surfaces)}."
        )
    more = "larger" if comparison.most else "smaller"
    next_one = "" if len(comparison.entrants) == 2 else f" than {second.name}, the next,"
    lead = f"{first.name} has the {more} {metric.phrase}{place}{next_one} on {count}"
    ends = (pair.median, pair.low, pair.high)
    if not all(end is not None and math.isfinite(end) for end in ends):
        return f"{lead}; on the others {first.name} or {second.name} fails." if pair.won else f"{lead}."
    middle, low, high = (abs(end or 0.0) for end in ends)
    unit = "" if metric.unit == "1" else f" {metric.unit}"
    return f"{lead}, by {number(middle)}{unit} (95 %: {number(min(low, high))} to {number(max(low, high))})."


def answer_tables(
    frame: DataFrame, plan: RunPlan, ranked: Sequence[Ranking], compared: Sequence[PairedComparison]
) -> list[Table]:
    """The settings against each other, or without [best] each metric over all runs."""
    if compared:
        return [comparison_table(comparison) for comparison in compared]
    if plan.study.best is None:
        return [_overall_table(frame, plan)]
    ranked = [ranking for ranking in ranked if ranking.settings]
    return [ranking_table(plan, ranked)] if ranked else []


def comparison_table(comparison: PairedComparison) -> Table:
    """Each setting against the best one, on the same surfaces."""
    rows = []
    for i, (entrant, pair) in enumerate(zip(comparison.entrants, comparison.behind, strict=True)):
        won = f"{100 * pair.won:.0f} % ({100 * pair.won_low:.0f} to {100 * pair.won_high:.0f})"
        worst = _quantile(entrant, 0.1 if comparison.most else 0.9)
        middle = _quantile(entrant, 0.5)
        rows.append(
            (
                entrant.name,
                NONE if middle is None else number(middle),
                NONE if worst is None else number(worst),
                difference(pair) if i else NONE,
                won if i else NONE,
                f"{comparison.ranks[i]:.2f}",
                f"{int(entrant.failed.sum())} of {len(entrant.values)}",
            )
        )
    place = "".join(f", {name} {short(value)}" for name, value in comparison.of.items())
    title = f"On the same surfaces: {metric_of(comparison.metric).title}{place}, 95 % intervals"
    head = (
        "setting",
        "median",
        "worst tenth",
        "difference from the best",
        "better than the best on",
        "mean rank",
        "failed",
    )
    return Table(title, head, rows[:MAX_ROWS])


def _quantile(entrant: Entrant, fraction: float) -> float | None:
    good = entrant.values[~entrant.failed]
    return float(np.quantile(good, fraction)) if len(good) else None


def difference(pair: PairedDifference) -> str:
    """The median difference with its interval."""
    if pair.median is None:
        return NONE
    if math.isinf(pair.median):
        return "fails on most" if pair.won < pair.lost else "the best fails on most"
    if pair.low is None or pair.high is None:
        return f"{_signed(pair.median)} (too few surfaces)"
    return f"{_signed(pair.median)} ({_signed(pair.low)} to {_signed(pair.high)})"


def _signed(value: float) -> str:
    if math.isinf(value):
        return "failure"
    return f"{'+' if value > 0 else '−' if value < 0 else ''}{number(abs(value))}"


def number(value: float) -> str:
    """Three digits; powers of ten only for very small and very large numbers."""
    if value == 0.0 or not 1e-4 <= abs(value) < 1e6:
        return f"{value:.3g}"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def ranking_table(plan: RunPlan, ranked: Sequence[Ranking]) -> Table:
    """The best settings by the mean over the seeds: for each ranking the first ones, at least two."""
    first = ranked[0]
    titles = [plan.axis(name).title for name in (*first.of, *first.settings[0].at)]
    metric = metric_of(plan.study.best.metric).title if plan.study.best else ""
    head = (*titles, metric, "behind the best, seed by seed")
    rows = [
        (
            *map(short, (*ranking.of.values(), *setting.at.values())),
            interval(setting.metric),
            _behind(setting, i),
        )
        for ranking in ranked
        for i, setting in enumerate(ranking.settings[: max(2, MAX_ROWS // len(ranked))])
    ]
    return Table("The best settings, by the mean over the seeds, 95 % intervals", head, rows)


def _behind(setting: Ranked, place: int) -> str:
    if place == 0:
        return NONE
    doubt = "" if setting.behind.half is None or setting.behind.excludes_zero else ", not significant"
    return f"{interval(setting.behind)}{doubt}"


def interval(mean: MetricMean) -> str:
    """A mean with its half-width, to two digits of the latter."""
    if mean.half is None or mean.half <= 0.0:
        return f"{mean.value:.4g}"
    digits = max(0, 1 - math.floor(math.log10(float(f"{mean.half:.1e}"))))
    return f"{mean.value:.{digits}f} ± {mean.half:.{digits}f}"


def _overall_table(frame: DataFrame, plan: RunPlan) -> Table:
    """Each metric over all runs, and over those of each case."""
    cases = next((a for a in plan.axes if a.parameter.cases is not None), None)
    groups = {"all": frame}
    if cases is not None:
        groups |= {str(case): frame.filter(frame[cases.name] == case) for case in cases.labels()}
    rows = [
        (name, *(_overall(group[name].drop_nulls().to_list(), name) for group in groups.values()))
        for name in plan.study.metrics
    ]
    return Table("Over all runs: median, and 5 to 95 % of them", ("", *groups), rows)


def _overall(values: Sequence[float], name: str) -> str:
    words = metric_of(name).words
    if not values:
        return NONE
    if words:
        counts = Counter(words[round(value)] for value in values)
        return ", ".join(f"{word} {100 * counts[word] / len(values):.0f} %" for word in words if counts[word])
    low, middle, high = np.percentile(values, (5.0, 50.0, 95.0))
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"


def _results_table(frame: DataFrame) -> Table:
    counts = Counter(frame["result"].to_list()).most_common()
    return Table("Results of the runs", ("result", "runs"), [(result, f"{n}") for result, n in counts])


def notes(
    frame: DataFrame, plan: RunPlan, ranked: Sequence[Ranking], compared: Sequence[PairedComparison]
) -> list[str]:
    """Warnings of the summary."""
    lines = []
    for result, count in Counter(frame["result"].to_list()).most_common():
        if result != DONE:
            reasons = list(dict.fromkeys(frame["why"].filter(frame["result"] == result).head(1000).to_list()))
            more = "; ..." if len(reasons) > MAX_REASONS else ""
            lines.append(
                f"{count} of {len(frame)} runs: {result} ({'; '.join(reasons[:MAX_REASONS])}{more})."
            )
    if compared:
        if any(entrant.failed.any() for entrant in compared[0].entrants):
            lines.append("A failed run counts as worse than any completed one.")
        if len(plan.seeds) == 1:
            lines.append(
                "One seed on each surface: the noise is the same for all settings and is not averaged."
            )
    elif plan.study.best is not None:
        lines += _ranking_notes(ranked)
    return lines


def _ranking_notes(ranked: Sequence[Ranking]) -> list[str]:
    settings = [setting for ranking in ranked for setting in ranking.settings]
    if not settings:
        return ["No setting has all its runs completed, so none is the best."]
    lines = []
    if settings[0].runs == 1:
        lines.append("One seed only: the spread is unknown, and the best setting may be best by chance.")
    elif len(ranked) == 1 and ranked[0].as_good:
        lines.append(
            f"{ranked[0].as_good} other settings do not differ significantly from the best one with these seeds."
        )
    failed = sum(ranking.failed for ranking in ranked)
    if failed:
        lines.append(f"{failed} settings are not ranked: one of their runs failed, or has no such number.")
    return lines
