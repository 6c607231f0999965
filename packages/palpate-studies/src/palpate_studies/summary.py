"""Summary of a study: counts, the best settings with their uncertainty, the page, the JSON summary."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.bench.summary import DONE
from palpate.files import with_author, write_json, write_text
from palpate.report.page import Table
from palpate_studies import effects
from palpate_studies.effects import charts
from palpate_studies.figures import draw, figures
from palpate_studies.metrics import metric_of
from palpate_studies.pairing import PairedComparison, comparisons, short, with_unit
from palpate_studies.plan import MAIN, RunPlan
from palpate_studies.preview import MetricMean, Ranked, Ranking, rankings
from palpate_studies.report.plain import study_page

if TYPE_CHECKING:
    from polars import DataFrame

PAGE, SUMMARY = "report.html", "summary.json"
SHOWN = 8
"""Settings in the table of the best."""
NONE = "-"
FAILURES = 5
"""Failures come first where they are one in so many runs, or more."""
EXAMPLES = 2
"""Reasons told of each result that is not the wanted one."""


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


def present(
    frame: DataFrame,
    plan: RunPlan,
    folder: Path,
    source: str,
    command: str,
    endings: Sequence[str] = (),
    dpi: int | None = None,
) -> Findings:
    """Writes figures (PNG, and those of `endings`), page and summary into the folder."""
    compared = comparisons(frame, plan)
    ranked = [] if compared else rankings(frame, plan)
    apart = effects.effects(frame, plan)
    answer = headline(frame, plan, ranked, compared, apart)
    told = with_author(
        {
            "command": command,
            "answer": answer,
            **summary(frame, plan, ranked, compared),
            "factors": effects.as_json(apart),
        }
    )
    own = tables(frame, plan, ranked, compared)
    results = own.pop()
    shown = [*([effects.effects_table(apart)] if apart else []), *own]
    shown = [results, *shown] if _failed(frame) else [*shown, results]
    found = Findings(told, shown, notes(frame, plan, ranked, compared))
    drawn = list(figures(frame, plan))
    described = Table("Metrics", ("metric", "meaning"), [(m, _description(m)) for m in plan.study.metrics])
    page = study_page(
        charts(plan, compared, drawn),
        draw(drawn, folder, endings, dpi),
        title=plan.study.title,
        about=plan.study.about,
        sentence=answer[0],
        answers=answer[1:],
        notes=found.notes,
        tables=found.tables,
        below=[described],
        command=command,
        study=source,
        origin=[
            ("runs", str(len(plan))),
            ("seeds", _seeds(plan)),
            *((p.name, f"sources {p.stamp}") for p in plan.plugins),
        ],
    )
    write_text(folder / PAGE, page)
    write_json(folder / SUMMARY, found.summary)
    return found


def headline(
    frame: DataFrame,
    plan: RunPlan,
    ranked: Sequence[Ranking],
    compared: Sequence[PairedComparison],
    apart: Sequence[PairedComparison] = (),
) -> list[str]:
    """The answer, a sentence each: failures first where they are many, the effect of each factor, the best setting."""
    best, what = plan.study.best, "surfaces" if compared and len(apart) == 1 else "pairs of runs"
    parts = [_failures(frame)] if _failed(frame) else []
    parts += [effects.effect_sentence(one, what) for one in apart[: effects.EFFECTS_SHOWN]]
    if compared and len(apart) != 1:
        parts.append(effects.comparison_sentence(compared[0]))
    elif not compared and best is not None and len(ranked) == 1 and ranked[0].settings:
        one = ranked[0].settings[0]
        at = ", ".join(f"{name} {short(value)}" for name, value in one.at.items())
        side = "least" if best.least else "most"
        parts.append(f"The {side} {with_unit(metric_of(best.metric))} is {interval(one.metric)}, with {at}.")
    elif not parts:
        done = sum(result == DONE for result in frame["result"].to_list())
        parts.append(f"{done} of {len(frame)} runs were completed.")
    return parts


def _failed(frame: DataFrame) -> bool:
    """Whether failures come first: a fifth of the runs or more."""
    return FAILURES * sum(result != DONE for result in frame["result"].to_list()) >= len(frame)


def _failures(frame: DataFrame) -> str:
    """How many runs failed, and the most frequent cause."""
    results = [result for result in frame["result"].to_list() if result != DONE]
    result, count = Counter(results).most_common(1)[0]
    why = frame["why"].filter(frame["result"] == result).to_list()[0]
    most = f", {count} of them so" if count < len(results) else ""
    return f"{len(results)} of {len(frame)} runs failed{most}: {why}."


def _seeds(plan: RunPlan) -> str:
    seeds = plan.parts[0].seeds
    return (
        ", ".join(map(str, seeds)) if len(seeds) <= 8 else f"{seeds[0]} to {seeds[-1]}, {len(seeds)} of them"
    )


def summary(
    frame: DataFrame, plan: RunPlan, ranked: Sequence[Ranking], compared: Sequence[PairedComparison] = ()
) -> dict[str, Any]:
    """JSON summary: runs, results, and the best settings of each ranking, or those on the same surfaces."""
    best = plan.study.best
    return {
        "study": plan.study.title,
        "runs": len(plan),
        "seeds": list(plan.parts[0].seeds),
        "results": dict(Counter(frame["result"].to_list()).most_common()),
        "metric": best.metric if best else None,
        "best": [
            {
                "of": one.of,
                "settings": [asdict(s) for s in one.settings[:SHOWN]],
                "not_told_apart": {name: _span(values) for name, values in one.spans().items()},
            }
            for one in ranked
        ],
        "compared": effects.as_json(compared),
    }


def _span(values: Sequence[Any]) -> list[Any]:
    """The least and the largest of numbers; all of anything else."""
    return [values[0], values[-1]] if all(isinstance(v, int | float) for v in values) else list(values)


def tables(
    frame: DataFrame, plan: RunPlan, ranked: Sequence[Ranking], compared: Sequence[PairedComparison] = ()
) -> list[Table]:
    """The best settings, the best of what the study is compared with, and results."""
    best = plan.study.best
    found = []
    if compared:
        found += [effects.comparison_table(one) for one in compared]
    elif best is not None and best.each:
        found += [each_table(plan, MAIN, ranked)]
        found += [each_table(plan, p.name, rankings(frame, plan, p.name)) for p in plan.parts[1:]]
    elif best is not None:
        found += [best_table(plan, MAIN, r) for r in ranked if r.settings]
        found += [
            best_table(plan, p.name, r)
            for p in plan.parts[1:]
            for r in rankings(frame, plan, p.name)
            if r.settings
        ]
    else:
        found.append(overall_table(frame, plan))
    return [*found, _results(frame)]


def best_table(plan: RunPlan, part: str, ranking: Ranking) -> Table:
    """The best settings: the metric with its 95 % interval, and how far each lies behind the best one."""
    heads = _heads(plan, part, ranking.settings[0].at)
    rows = [
        (f"{i}", *map(short, one.at.values()), interval(one.metric), _behind(one, i))
        for i, one in enumerate(ranking.settings[:SHOWN], 1)
    ]
    title = f"The best settings{_of(part)}, by the mean over the seeds, 95 % intervals"
    return Table(title, ("", *heads, _ranked_by(plan), "behind the best, seed by seed"), rows)


def each_table(plan: RunPlan, part: str, ranked: Sequence[Ranking]) -> Table:
    """The best setting for each combination of what is given, and what cannot be told from it."""
    good = [one for one in ranked if one.settings]
    if not good:
        return Table(f"The best settings{_of(part)}", ("",), [("no setting has all its runs completed",)])
    given, chosen = good[0].of, good[0].settings[0].at
    rows = [
        (
            *map(short, one.of.values()),
            *map(short, one.settings[0].at.values()),
            interval(one.settings[0].metric),
            "; ".join(_range(values) for values in one.spans().values()) or NONE,
            f"{one.failed}",
        )
        for one in good
    ]
    heads = (
        *_heads(plan, part, given),
        *_heads(plan, part, chosen),
        _ranked_by(plan),
    )
    title = f"The best setting{_of(part)} for each, by the mean over the seeds, 95 % intervals"
    return Table(title, (*heads, "as good with these seeds", "settings not ranked"), rows)


def overall_table(frame: DataFrame, plan: RunPlan) -> Table:
    """Each metric over all runs, and over those of each case: of yes or no the share, of quantities the spread."""
    cases = next((a for a in plan.parts[0].axes if a.parameter.cases is not None), None)
    kinds = list(cases.labels()) if cases else []
    groups = [frame, *(frame.filter(frame[cases.name] == kind) for kind in kinds)] if cases else [frame]
    rows = [
        (name, *(_overall(group[name].drop_nulls().to_list(), name) for group in groups))
        for name in plan.study.metrics
    ]
    return Table("Over all runs: median, and 5 to 95 % of them", ("", "all", *map(short, kinds)), rows)


def _overall(values: Sequence[float], name: str) -> str:
    metric = metric_of(name)
    if not values:
        return NONE
    if metric.words:
        counted = Counter(metric.words[round(v)] for v in values)
        return ", ".join(
            f"{word} {100 * counted[word] / len(values):.0f} %" for word in metric.words if counted[word]
        )
    low, middle, high = np.percentile(values, (5.0, 50.0, 95.0))
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"


def notes(
    frame: DataFrame, plan: RunPlan, ranked: Sequence[Ranking], compared: Sequence[PairedComparison] = ()
) -> list[str]:
    """Warnings of the summary."""
    found = []
    for result, count in Counter(frame["result"].to_list()).most_common():
        if result != DONE:
            why = dict.fromkeys(frame["why"].filter(frame["result"] == result).head(1000).to_list())
            more = "; ..." if len(why) > EXAMPLES else ""
            found.append(f"{count} of {len(frame)} runs: {result} ({'; '.join(list(why)[:EXAMPLES])}{more}).")
    settings = [s for one in ranked for s in one.settings]
    if compared:
        return [*found, *_of_pairs(compared[0], plan)]
    if plan.study.best is None:
        return found
    if not settings:
        return [*found, "No setting has all its runs completed, so none is the best."]
    if settings[0].runs == 1:
        found.append("One seed only: the spread is unknown, and the best setting may be best by chance.")
    elif len(ranked) == 1 and len(ranked[0].alike) > 1:
        found.append(_alike(ranked[0]))
    failed = sum(one.failed for one in ranked)
    if failed:
        found.append(f"{failed} settings are not ranked: one of their runs failed, or has no such number.")
    return found


def _of_pairs(one: PairedComparison, plan: RunPlan) -> list[str]:
    """Notes on the counts of a comparison."""
    failed = {e.name: int(e.failed.sum()) for e in one.entrants if e.failed.any()}
    found = []
    if failed:
        told = ", ".join(f"{count} of {name}" for name, count in failed.items())
        found.append(f"A failed run counts as worse than any completed one: {told}.")
    if len(plan.parts[0].seeds) == 1:
        found.append("One seed on each surface: the noise is the same for all settings and is not averaged.")
    return found


def _alike(ranking: Ranking) -> str:
    told = [f"{name} {_range(values)}" for name, values in ranking.spans().items() if len(values) > 1]
    where = f": {'; '.join(told)}" if told else ""
    return f"{len(ranking.alike)} settings do not differ significantly from the best one with these seeds{where}."


def _range(values: Sequence[Any]) -> str:
    """The least to the largest of numbers; all of anything else."""
    if len(values) > 1 and all(isinstance(v, int | float) for v in values):
        return f"{short(values[0])} to {short(values[-1])}"
    return ", ".join(map(short, values))


def _of(part: str) -> str:
    return "" if part == MAIN else f" of {part}"


def _heads(plan: RunPlan, part: str, at: Mapping[str, Any]) -> list[str]:
    axes = {a.name: a.title for p in plan.parts if p.name == part for a in p.axes}
    return [axes[name] for name in at]


def _ranked_by(plan: RunPlan) -> str:
    best = plan.study.best
    return with_unit(metric_of(best.metric)) if best else ""


def _results(frame: DataFrame) -> Table:
    counted = Counter(frame["result"].to_list()).most_common()
    return Table("Results of the runs", ("result", "runs"), [(result, f"{n}") for result, n in counted])


def _description(name: str) -> str:
    metric = metric_of(name)
    return metric.text if metric.unit == "1" else f"{metric.text} [{metric.unit}]"


def _behind(one: Ranked, place: int) -> str:
    if place == 1:
        return "-"
    return (
        interval(one.behind)
        if one.behind.half is None or one.behind.excludes_zero
        else f"{interval(one.behind)}, not significant"
    )


def interval(one: MetricMean) -> str:
    """A mean with its half-width, to two digits of the latter."""
    if one.half is None or one.half <= 0.0:
        return f"{one.value:.4g}"
    digits = max(0, 1 - int(_exponent(one.half)))
    return f"{one.value:.{digits}f} ± {one.half:.{digits}f}"


def _exponent(number: float) -> int:
    return int(f"{number:.1e}".partition("e")[2])
