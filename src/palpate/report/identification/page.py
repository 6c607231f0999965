"""The page of an identification: the answer, what the log shows, the model's parameters, and how far to trust them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from palpate.identification.result import Identification, Traces
from palpate.identification.uncertainty import Parameter, Verdict
from palpate.report.identification import figure, words
from palpate.report.identification.details import BUDGET_HEAD, BUDGET_WORDS, METHOD, budgets, correlation
from palpate.report.identification.figure import Panel, both_parts, one, shown_by
from palpate.report.identification.spectra import over_noise, whiteness_of
from palpate.report.page import data_address, render
from palpate.report.style import svg
from palpate.text import printable
from palpate.units import plain, quantity, with_half

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOUBTED = 1e-3
"""Probability below which residuals count as not white."""
_FAR = 1000.0
"""Times beyond which a ratio of powers says no more by its figures."""
_AS_LARGE = 1.3
"""Times the noise out of contact up to which a misfit is no larger than that."""


def no_contact(found: Identification, traces: Traces) -> str:
    """Of a log without a contact."""
    return "The force over the whole log: it never leaves its resting level for long enough."


def spectrum(found: Identification, traces: Traces) -> str:
    """Of storage and loss by frequency."""
    octaves = found.dynamic_stiffness
    if not octaves:
        return "The contact is too short to tell frequencies apart."
    told = [o.frequency for o, yes in zip(octaves, shown_by(octaves, "storage"), strict=True) if yes]
    if not told:
        where = "No octave shows it with an interval narrower than its value"
    else:
        where = f"The log shows the storage from {plain(told[0], 2)} to {plain(told[-1], 2)} Hz"
        where = where if len(told) > 1 else f"The log shows the storage about {plain(told[0], 2)} Hz"
    return (
        f"Force over position, by octave, whatever the model. {where}. Storage gives the force back, loss turns it into"
        " heat. Flat storage and loss in proportion to frequency are a spring beside a damper; storage that falls with"
        " the square of the frequency is a mass."
    )


def press(found: Identification, traces: Traces) -> str:
    """Of force over depth."""
    own = found.press
    if own is None:
        return "The log has no loading long enough for a slope."
    force = words.units_of(found)[0]
    told = ["The slope is the stiffness, the width of the loop the lost work. The ring is the working point."]
    if own.hysteresis_loss is not None:
        told.append(f"{words.work_loss(own.hysteresis_loss)}.")
    if own.relaxation is not None:
        r = own.relaxation
        told.append(
            f"In a hold of {plain(r.duration, 2)} s the force falls by {100 * r.share:.2g} %,"
            f" half of that within {plain(r.half_time, 2)} s."
        )
    if len(own.tangent) > 1:
        first, last = own.tangent[0], own.tangent[-1]
        told.append(
            f"From {quantity(first.force, force)} to {quantity(last.force, force)} the slope goes from"
            f" {plain(first.stiffness, 3)} ± {plain(first.half, 2)} to {plain(last.stiffness, 3)} ±"
            f" {plain(last.half, 2)}{_of_stiffness(found)}."
        )
    return " ".join(told)


def _of_stiffness(found: Identification) -> str:
    unit = found.working_point.stiffness.unit if found.working_point else "1"
    return "" if unit == "1" else f" {unit}"


def force(found: Identification, traces: Traces) -> str:
    """Of the force over time."""
    count = len(found.contacts)
    seconds = sum(end - start for start, end in found.contacts)
    each = f"{count} contacts" if count != 1 else "One contact"
    return f"{each} of {plain(seconds, 3)} s in all. The model is drawn where it was fitted."


def residual(found: Identification, traces: Traces) -> str:
    """Of the misfit over time."""
    return (
        "Noise looks the same all along. Waves, steps, or a shape that repeats in every contact are forces that the"
        " model cannot follow."
    )


def noise(found: Identification, traces: Traces) -> str:
    """Of the misfit's spectrum."""
    p, times = whiteness_of(found, traces), over_noise(found, traces)
    size = f" It is {_times(times)} the usual noise out of contact." if times is not None else ""
    if p is None:
        return "Too few samples to test whether the misfit is white."
    chance = f"p = {p:.2g}" if p >= 1e-4 else "p < 0.0001"
    band = "White noise would stay within the shaded band."
    if p >= DOUBTED:
        return f"{band} The misfit is consistent with white noise ({chance}).{size}"
    if times is not None and times < _AS_LARGE:
        return f"{band} The misfit is not white ({chance}), but no noise here seems to be.{size}"
    return (
        f"{band} The misfit is not white ({chance}): the noise is coloured, or the model lacks something. The 95 %"
        f" interval allows for both; the one that holds if the model does allows for the colour alone.{size}"
    )


def _times(ratio: float) -> str:
    """A force that is rounded to nothing out of contact has a noise of nothing."""
    return f"{plain(ratio, 2)} times" if ratio < _FAR else "far above"


Drawn = Callable[[Identification, Traces, int, int], "Figure"]

TONES = {Verdict.IDENTIFIED: "ok", Verdict.NOT_IDENTIFIABLE: "warn", Verdict.REJECTED: "fail"}
_COLOURED = ("K", "B", "M")
_WIDE, HALF, NARROW = 1150, 560, 360
"""Pixels of a panel: of a page's width, of half of it, of a telephone's."""
_SHARE = 0.25
"""Of the value: the ends of the bar that shows how narrow an interval is, the same on all cards."""
_MOST_CONTACTS = 20
"""That a page lists one by one."""


def page(found: Identification, source: words.Source) -> str:
    """The page of an identification as HTML."""
    listed = found.contacts[:_MOST_CONTACTS]
    return render(
        "identification.html",
        "palpate.report.identification",
        room="identify",
        made=source.made,
        scripts=(),
        title=source.title,
        sentence=words.sentence(found),
        model_line=words.model_line(found),
        subtitle=words.subtitle(found),
        notes=[printable(note) for note in source.notes],
        point=_point(found),
        first=_evidence(found),
        cards=[_card(name, p) for name, p in found.parameters.items()],
        warnings=[
            {"code": w.code.word, "text": printable(w.text), "advice": words.advice(w.code)}
            for w in found.warnings
        ],
        figures=_figures(found),
        budgets=list(budgets(found)),
        budget_head=BUDGET_HEAD,
        budget_words=BUDGET_WORDS,
        budget_notes=[note for note in (correlation(found), METHOD) if note],
        models=_models(found),
        octaves=_octaves(found),
        unit=_of(found.working_point.stiffness.unit if found.working_point else "1"),
        force_unit=_of(words.units_of(found)[0]),
        contacts=listed,
        more=len(found.contacts) - len(listed),
        json=json.dumps(words.as_json(found, source), indent=1),
        source=source,
        options=", ".join(
            f"{printable(str(k))} {printable(str(v))}" for k, v in _describe(found, source).items()
        ),
        file=printable(source.file),
        command=printable(source.command),
    )


def _describe(found: Identification, source: words.Source) -> dict[str, Any]:
    return {**source.options, **found.options}


def _point(found: Identification) -> dict[str, Any] | None:
    """The card of the working point."""
    point = found.working_point
    if point is None:
        return None
    own, limit = point.stiffness, words.limited_by(found)
    force, depth, frequency = words.facts_of(found, point)
    return {
        "number": split(own),
        "tone": TONES[own.verdict],
        "verdict": str(own.verdict),
        "interval": words.interval(own.ci95, own.unit),
        "force": force,
        "depth": depth,
        "frequency": frequency,
        "next": words.interval(point.prediction95, own.unit),
        "reason": printable(own.reason),
        "limit": f"{limit.described}. {limit.remedy.capitalize()}.",
        "scale": _scale(own, found),
        "source": {"octave": "the most excited octave", "press": "the slope of the loading"}.get(
            point.source, printable(point.source)
        ),
    }


def _scale(p: Parameter, found: Identification) -> str:
    """Effect of a wrong scale, if the calibration is not given."""
    if p.value is None or found.options.get("calibration"):
        return ""
    share = quantity(abs(p.value) / 100, p.unit, digits=2)
    return f"A scale of force or position that is off by 1 % would add ± {share}; no log shows it."


def _card(name: str, p: Parameter) -> dict[str, Any]:
    return {
        "name": name,
        "called": words.CALLED.get(name, ""),
        "colour": name if name in _COLOURED else "other",
        "value": p.value,
        "number": split(p),
        "tone": TONES[p.verdict],
        "verdict": str(p.verdict),
        "reason": printable(p.reason),
        "interval": words.interval(p.ci95, p.unit),
        "own": words.interval(p.ci95_if_model_holds, p.unit),
        "bar": _bar(p),
        "budget": _budget(p),
    }


def split(p: Parameter) -> dict[str, Any]:
    """A number, its half-width and its unit, to be written large and less large."""
    if p.value is None:
        return {"value": None, "text": words.NO_NUMBER, "half": "", "unit": ""}
    text = words.full_number(p)
    plus, _, unit = text.rpartition(" ") if p.unit != "1" else (text, "", "")
    if p.unit != "1" and " " in p.unit:  # N s/m: two words
        head, _, first = plus.rpartition(" ")
        plus, unit = head, f"{first} {unit}"
    value, _, half = plus.partition(" ± ")
    return {"value": p.value, "text": value, "half": half, "unit": unit}


def _bar(p: Parameter) -> dict[str, float] | None:
    """Where the intervals lie on a line from a quarter below the value to a quarter above it [%]."""
    if p.value is None or p.ci95 is None or not p.value or not all(map(math.isfinite, p.ci95)):
        return None

    def place(x: float) -> float:
        share = (x - p.value) / abs(p.value) / _SHARE if p.value else 0.0
        return round(50 + 50 * max(-1.0, min(1.0, share)), 2)

    low, high = (place(x) for x in p.ci95)
    found = {"left": low, "width": round(max(high - low, 0.5), 2)}
    if p.ci95_if_model_holds is not None:
        a, b = (place(x) for x in p.ci95_if_model_holds)
        found |= {"own_left": a, "own_width": round(max(b - a, 0.5), 2)}
    return found


def _budget(p: Parameter) -> list[dict[str, Any]]:
    """The causes of an interval, largest first, on one scale; what is not known is hatched."""
    parts = sorted(p.budget.items(), key=lambda item: -item[1])
    assumed = "calibration" not in p.budget and p.value is not None and p.unit not in {"1", "s"}
    longest = max([half for _, half in parts] + ([abs(p.value or 0) / 100] if assumed else []), default=0.0)
    rows = [_row(printable(name), half, longest, p, assumed=False) for name, half in parts]
    if assumed and p.value is not None:
        rows.append(_row("scale, if 1 %", abs(p.value) / 100, longest, p, assumed=True))
    return rows


def _row(name: str, half: float, longest: float, p: Parameter, *, assumed: bool) -> dict[str, Any]:
    share = half / longest if longest > 0 else 0.0
    return {
        "name": name,
        "half": quantity(half, p.unit, digits=2),
        "width": round(100 * share, 1),
        "assumed": assumed,
        "first": share >= 1 and not assumed,
    }


def _evidence(found: Identification) -> list[dict[str, str]]:
    """The evidence without a model."""
    if found.traces is None or not found.contacts:
        return []
    return [
        _figure(found, "Dynamic stiffness", both_parts, spectrum, (HALF, 430)),
        _figure(found, "Press", partial(one, figure.press), press, (HALF, 430)),
    ]


def _figures(found: Identification) -> list[dict[str, str]]:
    """How the model follows the log, in the order to be read."""
    traces = found.traces
    if traces is None:
        return []
    if not len(traces.fitted_time):
        return [_panel(found, "Force over time", figure.force, no_contact, (_WIDE, 260))]
    return [
        _panel(found, "Force over time", figure.force, force, (_WIDE, 260)),
        _panel(found, "Misfit over time", figure.residual, residual, (HALF, 260)),
        _panel(found, "Is the misfit noise?", figure.residual_spectrum, noise, (HALF, 260)),
    ]


def _panel(
    found: Identification,
    title: str,
    panel: Panel,
    caption: Callable[[Identification, Traces], str],
    size: tuple[int, int],
) -> dict[str, str]:
    return _figure(found, title, partial(one, panel), caption, size)


def _figure(
    found: Identification,
    title: str,
    drawn: Drawn,
    caption: Callable[[Identification, Traces], str],
    size: tuple[int, int],
) -> dict[str, str]:
    """A picture at the two widths at which it is looked at, so that its letters keep their size."""
    traces = found.traces
    assert traces is not None
    narrow = (NARROW, min(size[1], 330))
    drawn_at = [drawn(found, traces, *own) for own in (size, narrow)]
    return picture(title, caption(found, traces), drawn_at, full=size[0] > HALF)


def picture(title: str, caption: str, drawn: Sequence[Figure], *, full: bool = False) -> dict[str, str]:
    """A figure on a page, drawn wide and narrow, with its caption."""
    wide, narrow = (data_address(svg(one), "image/svg+xml") for one in drawn)
    return {
        "title": title,
        "wide": wide,
        "narrow": narrow,
        "alt": f"{title}. {caption}",
        "caption": caption,
        "full": "full" if full else "",
    }


def _octaves(found: Identification) -> list[list[str]]:
    """The dynamic stiffness as rows of text."""
    return [
        [
            plain(o.frequency, 3),
            with_half(o.storage, o.storage_half),
            with_half(o.loss, o.loss_half),
            str(o.blocks),
            f"{100 * o.share:.2g} %",
        ]
        for o in found.dynamic_stiffness
    ]


def _models(found: Identification) -> list[dict[str, Any]]:
    chosen = [math.isclose(c.rmse, found.rmse, rel_tol=1e-9) for c in found.comparison]
    return [
        {
            "name": found.model if taken else c.model,  # the mass may have been taken out of it since
            "chosen": taken,
            "r2": f"{c.r2:.4f}",
            "rmse": plain(c.rmse, 3),
            "note": printable(c.note),
        }
        for c, taken in zip(found.comparison, chosen, strict=True)
    ]


def _of(unit: str) -> str:
    return "" if unit == "1" else f" [{unit}]"
