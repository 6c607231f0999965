"""Experiments of either kind by one name: the thesis' arm on the bench, or any arm along one direction."""

from __future__ import annotations

from typing import TypeAlias

from palpate.bench.bench import Bench
from palpate.bench.build import build
from palpate.bench.experiments.tables import Experiment, converted, parse
from palpate.bench.experiments.toml_files import TomlFiles
from palpate.bench.one_direction.bench import OneDirectionBench, build_one_direction
from palpate.bench.one_direction.tables import OneDirection
from palpate.files import read_toml

AnyExperiment: TypeAlias = Experiment | OneDirection
ARM = "arm"
"""The key that says that a file is of one direction: which arm presses."""
FILES = TomlFiles("experiment", "an", "palpate.bench", ("experiments", "one_direction"))


def load_any(name: str) -> AnyExperiment:
    """An experiment by its name, or from a TOML file.

    Raises:
        InputError: no such experiment or file, TOML that does not parse, an unknown key, a value out of range.
    """
    return parse_any(FILES.source(name), name)


def parse_any(text: str, where: str) -> AnyExperiment:
    """An experiment from TOML; `where` names the text in errors."""
    tables = read_toml(text, where)
    return converted(tables, where, OneDirection) if ARM in tables else parse(text, where)


def build_any(experiment: AnyExperiment) -> Bench | OneDirectionBench:
    """The bench of an experiment.

    Raises:
        InputError: numbers that do not go together.
    """
    return build_one_direction(experiment) if isinstance(experiment, OneDirection) else build(experiment)
