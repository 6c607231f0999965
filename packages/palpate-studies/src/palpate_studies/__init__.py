"""Many runs: parameters over anything that an experiment has, metrics by name, one table; resumable at any moment.

from palpate_studies import run
frame = run(text_of_a_study, "runs/mine")
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate_studies.metrics import METRICS, Metric, Window
    from palpate_studies.run_one import Local
    from palpate_studies.run_study import run

_NAMES = {
    "palpate_studies.metrics": ("METRICS", "Window", "Metric"),
    "palpate_studies.run_one": ("Local",),
    "palpate_studies.run_study": ("run",),
}
__all__ = ["METRICS", "Local", "Metric", "Window", "run"]


def __getattr__(name: str) -> Any:
    """A public name, imported when it is first used: the help of the command imports none."""
    for module, names in _NAMES.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"palpate_studies has no {name!r}; it has {', '.join(__all__)}")
