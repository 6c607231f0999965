"""The page of an identification: what was touched, how far to trust it, and what to do better."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.files import write_text
from palpate.identification.result import Identification, Parameter, Traces
from palpate.report import identification_captions as captions
from palpate.report import identification_fit as fit
from palpate.report import identification_trust as trust
from palpate.report.identification import excite, one, settle, several
from palpate.report.identification_words import CALLED, MARKS, advice, headline, number, subtitle, unit
from palpate.report.numbers import between, plain
from palpate.report.page import embedded, render
from palpate.report.svg import svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDE = 200.0
_MOST_CONTACTS = 20


def write_page(
    found: Identification,
    path: Path,
    title: str,
    command: str = "palpate identify",
    notes: Sequence[str] = (),
) -> Path:
    """Write the page of an identification, whole or not at all; it opens without a network.

    Args:
        found: what to show; figures need its traces.
        path: of the HTML file.
        title: what to call the log.
        command: what made it.
        notes: lines on how the log was read, such as the frame that a wrench was turned into.
    """
    text = page(found, title, command, notes)
    write_text(path, text)
    return path


def page(
    found: Identification, title: str, command: str = "palpate identify", notes: Sequence[str] = ()
) -> str:
    """The page of an identification as HTML."""
    shown = found.contacts[:_MOST_CONTACTS]
    return render(
        "identification.html",
        title=title,
        headline=headline(found),
        subtitle=subtitle(found),
        notes=notes,
        cards=[_card(name, p) for name, p in found.parameters.items()],
        warnings=[{"code": w.code.word, "text": w.text, "advice": advice(w.code)} for w in found.warnings],
        figures=_figures(found),
        models=_models(found),
        force_unit=_force_unit(found),
        contacts=shown,
        more=len(found.contacts) - len(shown),
        json=json.dumps(found.to_json(), indent=1),
        command=command,
    )


def _card(name: str, p: Parameter) -> dict[str, Any]:
    return {
        "name": name,
        "called": CALLED.get(name, ""),
        "value": p.value,
        "number": number(p),
        "unit": unit(p),
        "verdict": str(p.verdict),
        "mark": MARKS[p.verdict],
        "reason": p.reason,
        "interval": f"{between(*p.ci95)} {unit(p)}".rstrip() if p.ci95 else "",
        "bar": _bar(p),
    }


def _bar(p: Parameter) -> dict[str, float] | None:
    """Where zero, the interval and the value lie along a line that holds them all."""
    if p.value is None or p.ci95 is None or not all(map(math.isfinite, p.ci95)):
        return None
    low, high = p.ci95
    left, right = min(low, 0.0), max(high, 0.0)
    margin = 0.06 * (right - left) or 1.0
    left, right = left - margin, right + margin

    def place(x: float) -> float:
        return round(_WIDE * (x - left) / (right - left), 2)

    wide = max(place(high) - place(low), 1.0)
    return {"zero": place(0.0), "low": place(low), "width": round(wide, 2), "value": place(p.value)}


def _figures(found: Identification) -> list[dict[str, str]]:
    """The figures that the log has something for, in the order to be read."""
    traces = found.traces
    if traces is None:
        return []
    if not len(traces.fitted_time):
        return [_figure("The force", partial(one, fit.force, found, traces), captions.untouched(found))]
    return [
        _figure("Force against penetration", partial(one, fit.loop, found, traces), captions.loop(found, traces)),
        _figure("Force over time", partial(one, fit.force, found, traces), captions.force(found, traces)),
        _figure("What the model leaves", partial(one, fit.residual, found, traces), captions.residual(found, traces)),
        _figure("Is it noise?", partial(one, trust.residual_spectrum, found, traces), captions.noise(found, traces)),
        _figure("How the estimates settled", partial(several, lambda on: settle(on, found)), captions.settled()),
        _figure(
            "What was excited", partial(several, lambda on: excite(on, found, traces)), captions.excited(found, traces)
        ),
    ]  # fmt: skip


def _figure(title: str, drawn: Callable[[], Figure], caption: str) -> dict[str, str]:
    return {
        "title": title,
        "source": embedded(svg(drawn()), "image/svg+xml"),
        "alt": f"{title}. {caption}",
        "caption": caption,
    }


def _models(found: Identification) -> list[dict[str, Any]]:
    return [
        {
            "name": c.model,
            "chosen": c.model.split(",")[0] == found.model and math.isclose(c.rmse, found.rmse, rel_tol=1e-6),
            "r2": f"{c.r2:.4f}",
            "rmse": plain(c.rmse, 3),
            "note": c.note,
        }
        for c in found.comparison
    ]


def _force_unit(found: Identification) -> str:
    traces: Traces | None = found.traces
    return f" [{traces.force_unit}]" if traces is not None and traces.force_unit != "1" else ""
