"""The page of many identifications: what they say together, a row each, and forest plots."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from palpate.identification.pooling import Pooled, PooledParameter
from palpate.report.identification.page import TONES, picture, split
from palpate.report.identification.words import CALLED, Source, facts_of, formatted, interval
from palpate.report.look.assets import TABLES, scripts
from palpate.report.many import forest
from palpate.report.many.table import (
    POINT,
    LogRow,
    failures,
    json_of,
    place,
    quantities,
    quantities_with_number,
    sentence,
)
from palpate.report.numbers import quantity
from palpate.report.page import render
from palpate.text import printable

_COLOURED = {POINT: "K", "K": "K", "B": "B", "M": "M"}
_HALF, _NARROW = 560, 360


def page(rows: Sequence[LogRow], pooled: Pooled) -> str:
    """The page as HTML."""
    source = rows[0].source if rows else Source("")
    point = pooled.working_point
    return render(
        "many.html",
        "palpate.report.many",
        "palpate.report.identification",
        room="identify",
        made=source.made,
        scripts=scripts(*TABLES),
        title=f"{len(rows)} logs",
        sentence=sentence(rows, pooled),
        failures=failures(rows),
        place=place(rows, point) if point else "",
        cards=[_card(name, own, pooled) for name, own in quantities(pooled).items()],
        names=list(quantities(pooled)),
        rows=[_row(row, pooled) for row in rows],
        figures=[_figure(rows, pooled, name) for name in quantities_with_number(rows, pooled)],
        json=json.dumps(json_of(rows, pooled), indent=1),
        source=Source("", source.options, None, source.command, source.made),
        file="",
        options=", ".join(f"{printable(str(k))} {printable(str(v))}" for k, v in source.options.items()),
        command=printable(source.command),
    )


def _card(name: str, own: PooledParameter, pooled: Pooled) -> dict[str, Any]:
    p = own.parameter
    return {
        "name": "Stiffness" if name == POINT else name,
        "called": "at the working point" if name == POINT else CALLED.get(name, ""),
        "colour": _COLOURED.get(name, "other"),
        "number": split(p),
        "tone": TONES[p.verdict],
        "verdict": str(p.verdict),
        "interval": interval(p.ci95, p.unit),
        "next": interval(own.prediction95, p.unit),
        "between": "" if own.between is None else quantity(own.between, p.unit, digits=2),
        "count": f"{len(own.logs)} of {pooled.count}",
        "reason": printable(p.reason),
    }


def _row(row: LogRow, pooled: Pooled) -> dict[str, Any]:
    found = row.found
    point = found.working_point if found else None
    values = [row.value_of(name) for name in quantities(pooled)]
    return {
        "name": row.source.title,
        "sha256": row.source.sha256,
        "error": printable(row.error),
        "cells": [formatted(p) if p is not None and p.value is not None else "–" for p in values],
        "place": ", ".join(facts_of(found, point)) if found and point else "–",
        "model": found.model if found else "–",
        "tone": TONES[point.stiffness.verdict] if point else "fail" if found is None else "warn",
        "verdict": str(point.stiffness.verdict) if point else "no contact" if found else "not identified",
        "codes": ", ".join(found.codes) if found else "",
    }


def _figure(rows: Sequence[LogRow], pooled: Pooled, name: str) -> dict[str, str]:
    title = "Stiffness at the working point" if name == POINT else f"{name}, {CALLED.get(name, name)}"
    own = quantities(pooled)[name].parameter
    words = (
        f"Pooled: {formatted(own)}. Each log's value with its 95 % interval; the diamond is the mean of all with its"
        " own, the brackets hold where the next press falls. Pale: not pooled."
    )
    return picture(title, words, [forest.one(rows, pooled, name, width) for width in (_HALF, _NARROW)])
