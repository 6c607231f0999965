"""Interface of a file under `figures/` or `explanations/`, and the discovery of these files."""

import pkgutil
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType
from typing import Any, Protocol, cast

from palpate.errors import unknown
from palpate_thesis import explanations, figures
from palpate_thesis.claims import ThesisClaim
from palpate_thesis.claims import figures as texts_of_all
from palpate_thesis.drawing import Figure
from palpate_thesis.runs import Runs


class FigureModule(Protocol):
    """A module or object with one figure.

    ``NUMBER`` is the thesis' number of the figure ("6.11"), or our own name of an explanation
    ("why-negative-mass"), by which claims.toml has its title and caption. It may have ``tables(data)``.
    """

    NUMBER: str

    def run(self, runs: Runs) -> Any:
        """Measured values for `check` and `plot`, and no others."""
        ...

    def check(self, data: Any) -> Sequence[ThesisClaim]:
        """A row for each claim that this figure decides."""
        ...

    def plot(self, data: Any) -> Figure:
        """The figure, with labels and units."""
        ...


def studies() -> list[FigureModule]:
    """All figures in the thesis' order, then all explanations: as in claims.toml."""
    modules = [*_studies_in(figures), *_studies_in(explanations)]
    return sorted(modules, key=lambda study: list(texts_of_all()).index(study.NUMBER))


EXPERIMENTS = ("4.2", "4.4", "6.", "7.")
"""Beginnings of the numbers of the figures that show the thesis' own experiments."""


def is_experiment(number: str) -> bool:
    """True if the figure shows an experiment, which is measured in the chosen laboratory; others are on the bench."""
    return number.startswith(EXPERIMENTS)


def study(number: str) -> FigureModule:
    """The figure or explanation of this number.

    Raises:
        InputError: there is no such figure; the error lists the known ones.
    """
    known = {s.NUMBER: s for s in studies()}
    if number not in known:
        raise unknown("figure", number, known)
    return known[number]


def _studies_in(package: ModuleType) -> list[FigureModule]:
    """The modules of a package, or their `STUDIES`, in the order of their names."""
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    modules = [import_module(f"{package.__name__}.{name}") for name in names]
    return [
        cast("FigureModule", study) for module in modules for study in getattr(module, "STUDIES", (module,))
    ]
