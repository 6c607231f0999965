"""`palpate benchmark silverbox`: the circuit by output error, its numbers with intervals, and its tests."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.cli.toolkit import console, head, print_answer, progress_of_pieces, show_table

if TYPE_CHECKING:
    from palpate_benchmark.duffing import FittedEquation
    from palpate_benchmark.silverbox import Silverbox

WANTED = 0.005
"""NRMSE of the first test."""


def silverbox(path: Path, *, json: bool) -> int:
    """Identify the circuit from a record, and print its numbers and tests; 0 if the best model reaches 0.5 %."""
    from palpate_benchmark.duffing import MODELS, fit, nrmse
    from palpate_benchmark.silverbox import STATE_ROWS, load_silverbox

    data = load_silverbox(path)
    fitted: dict[str, FittedEquation] = {}
    with progress_of_pieces(console(stderr=True)) as show:
        for name, numbers in MODELS.items():
            fitted[name] = fit(data.estimation, numbers)
            show("output error", len(fitted), len(MODELS))
    errors = {
        name: {test: nrmse(own, part, STATE_ROWS) for test, part in data.tests.items()}
        for name, own in fitted.items()
    }
    best = list(MODELS)[-1]
    if json:
        print_answer(_values(data, fitted, errors))
    else:
        _show(data, fitted, errors, best)
    return 0 if next(iter(errors[best].values())) <= WANTED else 1


def _values(
    data: Silverbox, fitted: dict[str, FittedEquation], errors: dict[str, dict[str, float]]
) -> dict[str, Any]:
    from palpate_benchmark.duffing import UNITS

    return {
        "official": data.official,
        "rows": {
            "estimation": len(data.estimation.x),
            **{name: len(own.x) for name, own in data.tests.items()},
        },
        "models": {
            name: {
                "parameters": {
                    key: {
                        "value": own.values[key],
                        "std": own.std[key],
                        "ci95": list(own.ci95(key)),
                        "unit": unit,
                    }
                    for key, unit in UNITS.items()
                    if key in own.values
                },
                "nrmse": errors[name],
            }
            for name, own in fitted.items()
        },
    }


def _show(
    data: Silverbox, fitted: dict[str, FittedEquation], errors: dict[str, dict[str, float]], best: str
) -> None:
    from palpate.report.page import Table
    from palpate.units import with_half
    from palpate_benchmark.duffing import UNITS

    own, screen = fitted[best], console()
    first = next(iter(data.tests))
    split = (
        "official split"
        if data.official
        else "not the benchmark's record: estimated on the first three quarters"
    )
    head(
        screen,
        f"NRMSE {100 * errors[best][first]:.3f} % on {first}",
        f", by output error: {best}; {split}",
    )
    rows = [(name, *(f"{100 * e:.2f} %" for e in errors[name].values())) for name in fitted]
    show_table(
        screen, Table("Error of the prediction over the position's deviation", ("model", *data.tests), rows)
    )
    numbers = []
    for key, unit in UNITS.items():
        low, high = own.ci95(key)
        numbers.append((key, with_half(own.values[key], (high - low) / 2.0), unit))
    show_table(
        screen, Table(f"{best}: value and half-width of the 95 % interval", ("", "value", "unit"), numbers)
    )
