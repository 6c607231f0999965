"""Values in Python: each public value in one line, and results as text, as a table in a notebook, figure and page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np

from palpate.files import check_place, write_text
from palpate.report import style
from palpate.report.page import answer_html, data_address, safe
from palpate.report.terminal import answer_text
from palpate.signals.types import NORMAL
from palpate.text import in_python, printable
from palpate.units import plain, quantity, quantity_between

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

Facts = list[tuple[str, str]]
"""Names and texts; a text without a name says what the value is."""
_UNITS = {"M": "kg", "B": "N s/m", "K": "N/m", "offset": "N"}
"""Units of an estimate's parameters by their usual names; others are printed without one."""
_VIEWS = {
    "AxisFriction": "friction",
    "Identification": "identification.answer",
    "Pooled": "many.page",
    "Record": "record",
    "Tuning": "tuning",
    "Weighed": "payload",
}
"""Modules with `line`, `build_answer`, `draw` and `page` of a result, by the name of its class."""
_MAX_ITEMS = 8
"""Numbers of an array that are printed; of a longer one its shape is."""


def line(value: Any) -> str:
    """One line: `<Parameter: 5238 ± 50 N/m, identified>`."""
    view = _view_module(value)
    if view is not None:
        text = view.line(value)
    else:
        text = ", ".join(f"{name} {fact}" if name else fact for name, fact in _facts(value))
    return in_python(printable(f"<{type(value).__name__}: {text}>"))


def text(result: Any) -> str:
    """The output of the result's command."""
    return in_python(answer_text(_view_module(result).build_answer(result)))


def html(result: Any) -> str:
    """The result's sentence, tables and picture for a notebook, escaped and without a script.

    The answer depends on no picture: where none can be drawn, the reason stands in its place.
    """
    view = _view_module(result)
    try:
        source = data_address(style.svg(view.draw(result)), "image/svg+xml")
        picture = f'<img src="{source}" alt="{safe(line(result))}" style="max-width: 100%">'
    except Exception as error:  # noqa: BLE001 - a drawing fails in as many ways as there are logs
        picture = f"<p>no picture: {safe(in_python(str(error)))}</p>"
    return in_python(answer_html(view.build_answer(result))) + picture


def plot(result: Any, path: Path | None) -> Figure:
    """Draw a result; write the figure if a path is given, atomically.

    Raises:
        InputError: nothing can be drawn, palpate may not write there, or the name has another ending.
    """
    if path is not None:
        check_place(path)
    figure: Figure = _view_module(result).draw(result)
    if path is not None:
        style.save(figure, path)
    return figure


def write_page(result: Any, path: Path) -> Path:
    """Write a page of a result, atomically; a place that will not do is refused before.

    Raises:
        InputError: palpate may not write there, or the name has another ending.
    """
    check_place(path, ending=".html")
    write_text(path, _view_module(result).page(result))
    return path


def _view_module(value: Any) -> Any:
    """The module that shows a result; None for a plain value."""
    name = next((_VIEWS[base.__name__] for base in type(value).__mro__ if base.__name__ in _VIEWS), None)
    return name and import_module(f"palpate.report.{name}")


def _facts(value: Any) -> Facts:
    known = (_FACTS[base.__name__] for base in type(value).__mro__ if base.__name__ in _FACTS)
    return next(known, _fields)(value)


def _parameter(p: Any) -> Facts:
    if p.value is not None and p.ci95 is not None:
        number = quantity(p.value, p.unit, (p.ci95[1] - p.ci95[0]) / 2)
    elif p.ci95 is not None:
        number = quantity_between(p.ci95[0], p.ci95[1], p.unit)
    else:
        number = "no number" if p.value is None else quantity(p.value, p.unit)
    return [("", number), ("", str(p.verdict))]


def _working_point(point: Any) -> Facts:
    place = f"at {point.force_N:.3g} N, {1e3 * point.depth_m:.3g} mm, {point.frequency_Hz:.2g} Hz"
    return [*_parameter(point.stiffness), ("", place)]


def _octave(octave: Any) -> Facts:
    storage = quantity(octave.storage, "N/m", octave.storage_half)
    loss = quantity(octave.loss, "N/m", octave.loss_half)
    return [("", f"{octave.frequency:.3g} Hz"), ("storage", storage), ("loss", loss)]


def _estimate(estimate: Any) -> Facts:
    halves = NORMAL * np.sqrt(np.clip(np.diag(estimate.covariance), 0.0, None))
    numbers = [
        (name, quantity(float(value), _UNITS.get(name, "1"), float(half)))
        for name, value, half in zip(estimate.names, estimate.theta, halves, strict=True)
    ]
    rejected = [("", "rejected")] if estimate.rejected else []
    return [*numbers, ("samples", f"{estimate.samples:.0f}"), *rejected]


def _estimator(estimator: Any) -> Facts:
    return _estimate(estimator.estimate())


def _arm(arm: Any) -> Facts:
    return [("", arm.title), ("joints", ", ".join(arm.names))]


def _planar(robot: Any) -> Facts:
    lengths = " + ".join(f"{length:g}" for length in robot.arm.length)
    return [("", "three revolute joints in a plane"), ("links", f"{lengths} m")]


def _force_loop(loop: Any) -> Facts:
    known = [] if loop.estimate is None else [("stiffness", quantity(loop.estimate.stiffness, "N/m"))]
    return [("", loop.phase), *known, ("trouble", loop.trouble or "none"), *_gains(loop.gains)]


def _gains(gains: Any) -> Facts:
    return [
        ("force", quantity(gains.force, "N")),
        ("arm", f"{gains.arm.kind} at {gains.arm.rate:g} Hz"),
        ("theta", quantity(gains.theta, "s")),
        ("cap", quantity(gains.cap, "N/m")),
        ("approach", f"{1e3 * gains.approach:.3g} mm/s"),
        ("force_limit", quantity(gains.force_limit, "N")),
    ]


def _bench(bench: Any) -> Facts:
    truth = bench.meta.get("truth", {}).items()
    surface = ", ".join(f"{name} {quantity(known['value'], known['unit'])}" for name, known in truth)
    return [
        ("controller", type(bench.loop.controller).__name__),
        ("surface", surface or type(bench.loop.plant.surface).__name__),
    ]


def _experiment(experiment: Any) -> Facts:
    parts = {"surface", "controller", "identifier"}
    return [("", experiment.title), *(fact for fact in _fields(experiment) if fact[0] in parts)]


def _fields(value: Any) -> Facts:
    """Fields of a value that differ from their defaults; of a part of an experiment its kind too."""
    is_struct = isinstance(value, msgspec.Struct)
    declared: Sequence[Any] = ()
    if is_struct:
        declared = msgspec.structs.fields(type(value))
    elif is_dataclass(value):
        declared = fields(value)
    facts = []
    for attribute in declared:
        part = getattr(value, attribute.name)
        if part is not None and not attribute.name.startswith("_") and not _same(part, attribute.default):
            facts.append((attribute.name, _short(part)))
    kind = value.__struct_config__.tag if is_struct else None
    return [("", str(kind)), *facts] if kind else facts or [("", "all as by default")]


def _same(part: Any, default: Any) -> bool:
    return type(part) is type(default) and not isinstance(part, np.ndarray) and bool(part == default)


def _short(part: Any) -> str:
    if isinstance(part, float):
        return plain(part, 5)
    if isinstance(part, np.ndarray):
        return np.array2string(part, precision=4) if part.size <= _MAX_ITEMS else f"array {part.shape}"
    if isinstance(part, str | int):
        return str(part)
    if isinstance(part, Sequence) and len(part) <= _MAX_ITEMS:
        return f"({', '.join(map(_short, part))})"
    if isinstance(part, msgspec.Struct):
        return " ".join(f"{name} {fact}".strip() for name, fact in _facts(part))
    return f"{len(part)} values" if isinstance(part, dict | Sequence) else type(part).__name__


_FACTS: dict[str, Callable[[Any], Facts]] = {
    "Bench": _bench,
    "ContactIdentifier": _estimator,
    "DynamicStiffness": _octave,
    "Estimate": _estimate,
    "Experiment": _experiment,
    "ForceLoop": _force_loop,
    "Gains": _gains,
    "NeuralProbe": _estimator,
    "Parameter": _parameter,
    "Planar3R": _planar,
    "SerialArm": _arm,
    "Streaming": _estimator,
    "WorkingPoint": _working_point,
}
"""Functions by the name of a class or of a base class, so that no room is imported."""
