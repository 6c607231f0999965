"""Scores into tables: by surface and nuisance, by either alone, and of all."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from foreign.scoring import FAR, WORKING_POINT, Answer, Score

NAMES = ("K", "B", "M")
ENOUGH, LEAST = 40, 0.88
"""A row with this many answers of which fewer than this share hold the truth is flagged."""


def row(name: str, scores: list[Score]) -> dict[str, Any]:
    """The figures of some logs.

    Args:
        name: of the row.
        scores: of its logs.
    """
    answers = [a for s in scores for a in s.answers]
    sure = [a for a in answers if a.defined and a.name != WORKING_POINT]
    known = [s for s in scores if "K" in s.known]
    seconds = [s.seconds for s in scores if s.outcome == "answered"]
    figures: dict[str, Any] = {"name": name, "logs": len(scores), "all": counts(sure)}
    for parameter in NAMES:
        figures[parameter] = counts([a for a in sure if a.name == parameter])
    figures["other"] = counts([a for a in sure if a.name not in NAMES])
    figures["apparent"] = counts([a for a in answers if not a.defined])
    figures[WORKING_POINT] = counts([a for a in answers if a.name == WORKING_POINT])
    figures["K known"] = len(known)
    figures["K known and given"] = sum(any(a.name == "K" for a in s.answers) for s in known)
    figures["K sharp"] = sum(any(_sharp(a) for a in s.answers) for s in known)
    figures["lag given"] = sum(s.lag_given for s in scores)
    figures["lag false"] = sum(s.lag_false for s in scores)
    figures["lag invented"] = sum(s.lag_invented for s in scores)
    figures["no contact"] = sum(s.outcome == "answered" and not s.contacts for s in scores)
    figures["refused"] = sum(s.outcome == "refused" for s in scores)
    figures["crashed"] = sum(s.outcome == "crashed" for s in scores)
    figures["seconds"] = float(np.mean(seconds)) if seconds else None
    figures["megabytes"] = max((s.megabytes for s in scores), default=0.0)
    every = figures["all"]
    figures["flag"] = every["answers"] >= ENOUGH and every["hold"] < LEAST * every["answers"]
    return figures


_SHARP, _FINE = 3.0, 0.01


def _sharp(a: Answer) -> bool:
    """Whether K is as narrow as this many times the knowing estimator's interval, or to this share of its value."""
    return a.name == "K" and a.bound is not None and a.half <= max(_SHARP * a.bound, _FINE * abs(a.value))


def counts(answers: list[Answer]) -> dict[str, Any]:
    """How many answers, how many hold, are wrong, and their width over the bound."""
    widths = [a.half / a.bound for a in answers if a.bound]
    return {
        "answers": len(answers),
        "hold": sum(a.holds for a in answers),
        "wrong": sum(a.wrong for a in answers),
        "width": float(np.median(widths)) if widths else None,
    }


def tables(scores: list[Score]) -> dict[str, list[dict[str, Any]]]:
    """All tables, in the order in which they are printed: cells, nuisances, surfaces, motions, total."""

    def grouped(key: Callable[[Score], str]) -> list[dict[str, Any]]:
        keys = dict.fromkeys(key(s) for s in scores)
        return [row(name, [s for s in scores if key(s) == name]) for name in keys]

    return {
        "surface x nuisance": grouped(lambda s: "/".join(s.cell.split("/")[:2])),
        "nuisance": grouped(lambda s: s.cell.split("/")[1]),
        "surface": grouped(lambda s: s.cell.split("/")[0]),
        "motion": grouped(lambda s: s.motion),
        "total": [row("all", scores)] if scores else [],
    }


HEAD = (
    f"{'':28}{'logs':>5} {'K id hold wrong':>17} {'B id hold wrong':>17} {'M id hold wrong':>17} "
    f"{'all id hold wrong':>19} {'apparent':>15} {'working point':>17} {'K known':>9} {'sharp':>6} {'width':>6} "
    f"{'lag':>5} {'none':>5} {'err':>4} {'s':>6}"
)


def line(figures: dict[str, Any]) -> str:
    """One row of a table, in plain text."""
    known = figures["K known"]
    given = f"{figures['K known and given'] / known:.0%}" if known else "-"
    sharp = f"{figures['K sharp'] / known:.0%}" if known else "-"
    width = figures["K"]["width"]
    seconds = figures["seconds"]
    return (
        f"{figures['name']:28.28}{figures['logs']:5} {_three(figures['K']):>17} {_three(figures['B']):>17} "
        f"{_three(figures['M']):>17} {_three(figures['all']):>19} {_three(figures['apparent']):>15} "
        f"{_three(figures['working point']):>17} {given + f' of {known}':>9} {sharp:>6} "
        f"{_short(width):>6} "
        f"{figures['lag invented']:>5} {figures['no contact'] + figures['refused']:5} {figures['crashed']:4} "
        f"{_short(seconds):>6}{'  < 88 %' if figures['flag'] else ''}"
    )


def _three(c: dict[str, Any]) -> str:
    if not c["answers"]:
        return "-"
    return f"{c['answers']} {c['hold'] / c['answers']:.0%} {c['wrong']}"


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.2g}" if value < 100 else f"{value:.0f}"


def summary(scores: list[Score]) -> list[str]:
    """The figures that the table How good asks for, one a line."""
    if not scores:
        return []
    total = row("all", scores)
    every, point = total["all"], total[WORKING_POINT]
    alone = row("", [s for s in scores if "/mixture/" not in s.cell])["all"]
    mixed = row("", [s for s in scores if "/mixture/" in s.cell])["all"]
    narrow = [a for s in scores for a in s.answers if a.name == WORKING_POINT]
    narrow = [a for a in narrow if a.high - a.low <= 2 * FAR * abs(a.value)]
    lines = [
        _share("ci95 of everything identified holds the truth", every["hold"], every["answers"]),
        _share("  one nuisance at a time", alone["hold"], alone["answers"]),
        _share("  random mixtures", mixed["hold"], mixed["answers"]),
        _share("confidently wrong", every["wrong"], every["answers"]),
        *(
            _share(f"{n}: ci95 holds", total[n]["hold"], total[n]["answers"])
            for n in (*NAMES, "other", "apparent")
        ),
        *(
            _share(f"{n}: confidently wrong", total[n]["wrong"], total[n]["answers"])
            for n in (*NAMES, "apparent")
        ),
        _share("stiffness at the working point given", point["answers"], len(scores)),
        _share("stiffness at the working point given to 25 %", len(narrow), len(scores)),
        _share("stiffness at the working point holds", point["hold"], point["answers"]),
        _share("stiffness at the working point confidently wrong", point["wrong"], point["answers"]),
        _share(
            "K given where a knowing estimator has it to 5 %", total["K known and given"], total["K known"]
        ),
        _share("K sharp where a knowing estimator has it to 5 %", total["K sharp"], total["K known"]),
        *(
            _share(f"{n} given where it has that, and the lag is told", *_given(scores, n))
            for n in ("B", "M")
        ),
        *(
            f"{f'{n}: half-width over a knowing estimator, median':55}{_short(total[n]['width']):>6}"
            for n in NAMES
        ),
        _share("lags false by their own bound, of those given", total["lag false"], total["lag given"]),
        f"{'lags invented where there is none':55}{total['lag invented']:6}",
        f"{'crashes':55}{total['crashed']:6}",
        f"{'seconds a log, mean; MB at most':55}{total['seconds'] or 0:6.2f}  {total['megabytes']:.0f} MB",
    ]
    return lines


def _given(scores: list[Score], name: str) -> tuple[int, int]:
    known = [s for s in scores if name in s.known and s.lag_told]
    return sum(any(a.name == name for a in s.answers) for s in known), len(known)


def _share(name: str, part: int, whole: int) -> str:
    return f"{name:55}{part:6} of {whole:6}  {part / whole:7.1%}" if whole else f"{name:55}{'not given':>6}"


def flagged(figures: Iterable[dict[str, Any]]) -> list[str]:
    """Names of the rows that are flagged."""
    return [f["name"] for f in figures if f["flag"]]


def markdown(scores: list[Score]) -> str:
    """The tables of the scores as a document has them.

    Args:
        scores: of at least one log.
    """
    every = tables(scores)
    told = [
        line for line in summary(scores) if not line.startswith(("seconds", "  ")) and "not given" not in line
    ]
    low = flagged(every["surface x nuisance"])
    told.append(
        f"cells with {ENOUGH} answers or more of which fewer than {LEAST:.0%} hold: {', '.join(low) or 'none'}"
    )
    return "```\n" + "\n".join(told) + "\n```\n" + _markdown([*every["nuisance"], *every["surface"]])


def _markdown(rows: list[dict[str, Any]]) -> str:
    columns = ("K", "apparent", WORKING_POINT)
    lines = [f"| nuisance, surface | logs | {' | '.join(columns)} |", "|---" * 5 + "|"]
    for figures in rows:
        cells = [figures["name"], str(figures["logs"]), *(_three(figures[c]) for c in columns)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)
