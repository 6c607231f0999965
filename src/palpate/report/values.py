"""Every public value in one line, and for a notebook: what it is, not the arrays that it holds."""

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any

import msgspec
import numpy as np

from palpate.report.page import as_html, write_figure, write_page
from palpate.signals.types import NORMAL
from palpate.text import in_python, printable
from palpate.units import plain, quantity, quantity_between

__all__ = ["facts_of", "html", "line", "view_of", "write_figure", "write_page"]

Facts = list[tuple[str, str]]
_LETTERS = {"M": "kg", "B": "N s/m", "K": "N/m", "offset": "N"}
"""Units of an estimate's parameters by their usual names; others are told without one."""
_VIEWS = {
    "Identification": "identification.answer",
    "Pooled": "many.page",
    "Record": "record",
    "Tuning": "tuning",
    "Weighed": "payload",
}
"""Modules that show a result whole, by the name of its class."""
_SHORT = 8
"""Numbers of an array that are shown; of a longer one its shape."""


def line(value: Any) -> str:
    """One line: `<Parameter: 5238 ± 50 N/m, identified>`."""
    told = ", ".join(f"{name} {text}" if name else text for name, text in facts_of(value) if name != "why")
    return in_python(printable(f"<{type(value).__name__}: {told}>"))


def html(value: Any) -> str:
    """The same as a table, escaped, without a script."""
    facts = facts_of(value)
    head = ", ".join(text for name, text in facts if not name)
    rows = [(name, text) for name, text in facts if name]
    return in_python(as_html(f"{type(value).__name__}: {head}", [("of it", "value"), *rows] if rows else []))


def view_of(result: Any) -> Any:
    """The module that shows a result whole, imported when it is first asked for."""
    name = next(_VIEWS[base.__name__] for base in type(result).__mro__ if base.__name__ in _VIEWS)
    return import_module(f"palpate.report.{name}")


def facts_of(value: Any) -> Facts:
    """Facts of a value by name; one without a name says what it is."""
    known = (_FACTS[base.__name__] for base in type(value).__mro__ if base.__name__ in _FACTS)
    return next(known, _fields)(value)


def _parameter(p: Any) -> Facts:
    if p.value is not None and p.ci95 is not None:
        number = quantity(p.value, p.unit, (p.ci95[1] - p.ci95[0]) / 2)
    elif p.ci95 is not None:
        number = quantity_between(p.ci95[0], p.ci95[1], p.unit)
    else:
        number = "no number" if p.value is None else quantity(p.value, p.unit)
    return [("", number), ("", str(p.verdict)), ("why", p.reason)]


def _working_point(point: Any) -> Facts:
    at = f"at {point.force_N:.3g} N, {1e3 * point.depth_m:.3g} mm, {point.frequency_Hz:.2g} Hz"
    return [*_parameter(point.stiffness)[:2], ("", at)]


def _octave(own: Any) -> Facts:
    storage = quantity(own.storage, "N/m", own.storage_half)
    return [
        ("", f"{own.frequency:.3g} Hz"),
        ("storage", storage),
        ("loss", quantity(own.loss, "N/m", own.loss_half)),
    ]


def _estimate(estimate: Any) -> Facts:
    halves = NORMAL * np.sqrt(np.clip(np.diag(estimate.covariance), 0.0, None))
    numbers = [
        (name, quantity(float(value), _LETTERS.get(name, "1"), float(half)))
        for name, value, half in zip(estimate.names, estimate.theta, halves, strict=True)
    ]
    told = [("", "rejected"), ("why", estimate.rejected)] if estimate.rejected else []
    return [*numbers, ("samples", f"{estimate.samples:.0f}"), *told]


def _serial_arm(arm: Any) -> Facts:
    return [("", arm.title), ("joints", ", ".join(arm.names))]


def _planar(robot: Any) -> Facts:
    lengths = " + ".join(f"{length:g}" for length in robot.arm.length)
    return [("", "three revolute joints in a plane"), ("links", f"{lengths} m")]


def _force_loop(loop: Any) -> Facts:
    estimate = loop.estimate
    known = (
        []
        if estimate is None
        else [("stiffness", quantity(estimate.stiffness, "N/m", NORMAL * estimate.stiffness_std))]
    )
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
    return [
        ("controller", type(bench.loop.controller).__name__),
        (
            "surface",
            ", ".join(_truth(bench.meta.get("truth", {}))) or type(bench.loop.plant.surface).__name__,
        ),
    ]


def _truth(truth: dict[str, Any]) -> list[str]:
    return [f"{name} {quantity(known['value'], known['unit'])}" for name, known in truth.items()]


def _experiment(experiment: Any) -> Facts:
    """Its title, and the tables that differ from their defaults, by their kinds."""
    parts = [
        (name, text) for name, text in _fields(experiment) if name in {"surface", "controller", "identifier"}
    ]
    return [("", experiment.title), *parts]


def _fields(value: Any) -> Facts:
    """Arguments of a value that differ from their defaults; of a part of an experiment its kind too."""
    own = (
        fields(value)
        if is_dataclass(value)
        else msgspec.structs.fields(type(value))
        if _is_struct(value)
        else ()
    )
    shown = [(f.name, getattr(value, f.name)) for f in own if not f.name.startswith("_")]
    defaults = {f.name: f.default for f in own}
    told = [
        (name, _short(part)) for name, part in shown if part is not None and not _same(part, defaults[name])
    ]
    tag = value.__struct_config__.tag if _is_struct(value) else None
    return [("", str(tag)), *told] if tag else told or [("", "all as by default")]


def _is_struct(value: Any) -> bool:
    return isinstance(value, msgspec.Struct)


def _same(part: Any, default: Any) -> bool:
    return type(part) is type(default) and not isinstance(part, np.ndarray) and bool(part == default)


def _short(part: Any) -> str:
    if isinstance(part, float):
        return plain(part, 5)
    if isinstance(part, np.ndarray):
        return np.array2string(part, precision=4) if part.size <= _SHORT else f"array {part.shape}"
    if isinstance(part, str | int):
        return str(part)
    if isinstance(part, Sequence):
        return f"({', '.join(map(_short, part))})" if len(part) <= _SHORT else f"{len(part)} values"
    if _is_struct(part):
        return " ".join(f"{name} {text}".strip() for name, text in facts_of(part))
    return f"{len(part)} values" if isinstance(part, dict) else type(part).__name__


def _of_estimator(estimator: Any) -> Facts:
    return _estimate(estimator.estimate())


_FACTS: dict[str, Callable[[Any], Facts]] = {
    "Bench": _bench,
    "ContactIdentifier": _of_estimator,
    "DynamicStiffness": _octave,
    "Estimate": _estimate,
    "Experiment": _experiment,
    "ForceLoop": _force_loop,
    "Gains": _gains,
    "NeuralProbe": _of_estimator,
    "Parameter": _parameter,
    "Planar3R": _planar,
    "SerialArm": _serial_arm,
    "Streaming": _of_estimator,
    "WorkingPoint": _working_point,
}
"""By the name of a class or of one that it derives from: rooms need not be imported to be shown."""
