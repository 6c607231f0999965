"""Interface of a file under `figures/` or `explanations/`, and the discovery of these files."""

import pkgutil
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType
from typing import Any, Protocol, cast

from palpate.errors import unknown
from palpate_thesis import explanations, figures
from palpate_thesis.claims import ThesisClaim
from palpate_thesis.look import Figure
from palpate_thesis.runs import Runs


class FigureModule(Protocol):
    """A module with one figure.

    ``NUMBER`` is the thesis' number of the figure ("6.11"), or our own name of an explanation
    ("why-negative-mass"), by which claims.toml has its title and caption.
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
    """All figures in the thesis' order, then all explanations."""
    return [*sorted(_of(figures), key=_place), *_of(explanations)]


def _place(figure: FigureModule) -> tuple[int, ...]:
    return tuple(map(int, figure.NUMBER.split(".")))


def study(number: str) -> FigureModule:
    """One of them.

    Raises:
        InputError: there is no such figure; the error lists those there are.
    """
    known = {s.NUMBER: s for s in studies()}
    if number not in known:
        raise unknown("figure", number, known)
    return known[number]


def _of(package: ModuleType) -> list[FigureModule]:
    """Each module of a package is a study, or has several as `STUDIES`."""
    found = (m.name for m in pkgutil.iter_modules(package.__path__))
    names = sorted(found, key=lambda name: (len(name.partition("_")[0]), name))  # e9_... before e10_...
    modules = [import_module(f"{package.__name__}.{name}") for name in names]
    return [
        cast("FigureModule", study) for module in modules for study in getattr(module, "STUDIES", (module,))
    ]
