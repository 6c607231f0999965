"""The panels of a study's figures as plain values, from which a page draws them."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.report.look.assets import ABSENT, CHARTS, MAPS, OUTCOMES, TABLES, data, scripts, text_of
from palpate.report.page import render, with_captions
from palpate_studies.report.lines import COLORS, Cloud, LinePanel, MetricLine, Points, Scale, decades, middles
from palpate_studies.report.maps import Heat

MOST = 1500
"""Points of a cloud that lie in the page, evenly taken."""


def plain_panels(panels: Sequence[Any]) -> list[dict[str, Any]]:
    """Panels of one kind: clouds, curves or maps."""
    return [_OF[type(one)](one) for one in panels]


def numbers(values: Any) -> list[float | None]:
    """Numbers in six digits, null where there is none."""
    return [float(f"{v:.6g}") if math.isfinite(v) else None for v in np.asarray(values, float).tolist()]


def scale(one: Scale) -> dict[str, Any]:
    """Scale of an axis, with its ticks."""
    shown = [f"{v:g}" if isinstance(v, float) else str(v) for v in one.values]
    return {
        "label": one.label,
        "log": one.log and one.numeric,
        "places": numbers(one.places),
        "names": [] if one.numeric else shown,
        "edges": numbers(one.edges()) if len(one.values) else [],
    }


def cloud(one: Cloud) -> dict[str, Any]:
    """A metric over a parameter that was drawn."""
    every: Array = np.concatenate([p.y for p in one.kinds]) if one.kinds else np.zeros(0)
    return {
        "kind": "cloud",
        "x": scale(one.x),
        "words": list(one.words),
        "log": not one.words and decades(every),
        "series": [_points(p, one.words) for p in one.kinds],
    }


def _points(one: Points, words: Sequence[str]) -> dict[str, Any]:
    rows = np.unique(np.linspace(0, len(one.x) - 1, min(MOST, len(one.x))).astype(int))
    middle = middles(one, words)
    return {
        "label": one.label,
        "x": numbers(one.x[rows]),
        "y": numbers(one.y[rows]),
        "middle": [numbers(middle[:, 0]), numbers(middle[:, 1])],
    }


def curve(one: LinePanel) -> dict[str, Any]:
    """Lines over a parameter; where it has numbers, also as `palpate.chart` draws them."""
    found = {
        "kind": "curve",
        "title": one.title,
        "x": scale(one.x),
        "log": one.log,
        "series": [_line(line) for line in one.lines],
    }
    return found | (chart(one) if one.x.numeric else {})


def chart(one: LinePanel) -> dict[str, Any]:
    """Lines over numbers as `{"spec", "columns"}` of `palpate.chart`: each with a mark at its places and its range."""
    x = np.unique(np.concatenate([line.x for line in one.lines])) if one.lines else np.zeros(0)
    columns: dict[str, Any] = {"t": numbers(x)}
    series: list[dict[str, Any]] = []
    own = 0
    for number, line in enumerate(one.lines):
        names = {key: f"{key}{number}" for key in ("of", "low", "high")}
        rows = dict(zip(names.values(), (line.middle, line.low, line.high), strict=True))
        columns |= {name: _at(x, line.x, values) for name, values in rows.items()}
        look = {"colour": "ink", "kind": "known"} if line.reference else {"colour": f"s{own % len(COLORS)}"}
        own += not line.reference
        ends = {"low": names["low"], "high": names["high"]}
        series += [
            {"kind": "band", "colour": look["colour"], "silent": True, **ends},
            {"label": line.label, "kind": "own", "of": names["of"], "within": ends, **look},
            {"colour": look["colour"], "kind": "own", "of": names["of"], "dots": 6, "silent": True},
        ]
    spec = {"title": one.title, "x": one.x.label, "unit": " ", "height": 190, "series": series}
    return {"spec": spec, "columns": columns}


def _at(x: Array, places: Array, values: Array) -> list[Any]:
    """Values at some of the places x; what has none is absent, so that a line goes on over it."""
    known = dict(zip(places.tolist(), numbers(values), strict=True))
    return [known.get(place, ABSENT) for place in x.tolist()]


def _line(one: MetricLine) -> dict[str, Any]:
    rows = {"x": one.x, "y": one.middle, "low": one.low, "high": one.high}
    return {"label": one.label, "reference": one.reference, **{k: numbers(v) for k, v in rows.items()}}


def heat(one: Heat) -> dict[str, Any]:
    """A map as cells of colour."""
    words = one.values.dtype.kind in "US"
    flat = one.values.ravel()
    return {
        "kind": "map",
        "title": one.title,
        "x": scale(one.x),
        "y": scale(one.y),
        "values": [str(v) for v in flat] if words else numbers(flat),
        "log": not words and decades(np.asarray(flat, float)),
        "failed": one.failed.ravel().astype(int).tolist(),
        "bounds": [{"label": b.label, "x": numbers(b.x), "y": numbers(b.y)} for b in one.bounds],
        "colours": {w: OUTCOMES.get(w, MAPS["map-halo"]) for w in sorted({str(v) for v in flat})}
        if words
        else None,
    }


_OF: dict[type, Any] = {Cloud: cloud, LinePanel: curve, Heat: heat}


def study_page(figures: Mapping[str, Any], pictures: Mapping[Path, str], **values: Any) -> str:
    """The page as HTML.

    Args:
        figures: plain values from which the page draws; empty where there is nothing to draw.
        pictures: the same as PNG files with a caption each, for a browser that runs no scripts.
        values: what `study.html` shows.
    """
    worth = bool(figures.get("figures") or figures.get("comparisons"))
    codes = (*scripts(*TABLES, *CHARTS), text_of("study.js", "palpate_studies.report"))
    return render(
        "study.html",
        "palpate_studies.report",
        room="study",
        charts=data(figures) if worth else "",
        figures=with_captions(pictures),
        scripts=codes if worth else scripts(*TABLES),
        **values,
    )
