"""Experiments of either kind by one name: the thesis' arm on the bench, or any arm along one direction.

The user's parts are tried before the first run: an error is reported once, not by every run.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from palpate.bench.bench import Bench
from palpate.bench.build import build
from palpate.bench.one_direction import OneDirection, OneDirectionBench, build_one_direction
from palpate.bench.sequence import COLUMNS
from palpate.bench.simulation import diagnose, is_own, not_finite
from palpate.bench.tables import Experiment, convert, parse
from palpate.bench.tick import start_at, tick
from palpate.bench.toml_parts import TomlFiles
from palpate.errors import InputError, PartError
from palpate.files import read_toml

AnyExperiment: TypeAlias = Experiment | OneDirection
ARM = "arm"
"""The key that says that a file is of one direction: which arm presses."""
FILES = TomlFiles("experiment", "an", "palpate.bench", ("experiments", "presses"))


def load_any(name: str) -> AnyExperiment:
    """An experiment by its name, or from a TOML file.

    Raises:
        InputError: no such experiment or file, TOML that does not parse, an unknown key, a value out of range.
    """
    return parse_any(FILES.source(name), name)


def parse_any(text: str, where: str) -> AnyExperiment:
    """An experiment from TOML; `where` names the text in errors."""
    tables = read_toml(text, where)
    return convert(tables, where, OneDirection) if ARM in tables else parse(text, where)


def build_any(experiment: AnyExperiment) -> Bench | OneDirectionBench:
    """The bench of an experiment.

    Raises:
        InputError: numbers that do not go together.
    """
    return build_one_direction(experiment) if isinstance(experiment, OneDirection) else build(experiment)


TICKS = 3
"""Ticks that are compiled and run."""


def check_parts(bench: object, waiting: Callable[[], None] | None = None) -> None:
    """Steps each part of the user's once in plain Python, and compiles the loop with them.

    Args:
        bench: whose parts; one along one direction has none of the user's.
        waiting: called when the loop has to be compiled first.

    Raises:
        InputError: a part raises, gives a number that is none, or cannot be compiled; one line says which and where.
    """
    if not isinstance(bench, Bench):
        return
    try:
        _check(bench, waiting)
    except PartError as error:
        raise InputError(str(error)) from error


def _check(bench: Bench, waiting: Callable[[], None] | None) -> None:
    if not any(map(is_own, (bench.loop.controller, bench.loop.plant.surface))):
        _check_identifier(bench)
        return
    state = start_at(bench.loop, bench.q)
    wrong = not_finite(bench.loop, state)
    if wrong:
        raise PartError(wrong)
    try:
        tick(bench.loop, state, 0, 0.0, np.empty(len(COLUMNS)))
    except Exception as error:
        raise diagnose(bench.loop, state) from error
    _check_trouble(bench.loop.controller, state.controller)
    bench.run(TICKS * bench.loop.tick, waiting=waiting)
    _check_identifier(bench)


def _check_trouble(controller: Any, state: Any) -> None:
    if not isinstance(controller.trouble(state), str):
        raise PartError(
            f"trouble of the controller {type(controller).__name__} must return a text, '' if nothing is"
        )


def _check_identifier(bench: Bench) -> None:
    """An identifier must take a sample and have an estimate."""
    if bench.identifier is None:
        return
    from palpate.bench.estimators import after

    identifier = bench.identifier()
    for k in range(TICKS):
        after(identifier, np.array([0.1, 0.01 * (k + 1), 1e-3]), 5.0 + k, k * bench.loop.tick)
