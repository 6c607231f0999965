"""Many runs: parameters over anything that an experiment has, metrics by name, one table; resumable at any moment.

from palpate_studies import run
frame = run(text_of_a_study, "runs/mine")
"""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate_studies.metrics import METRICS, Metric, Window
    from palpate_studies.run_one import Local
    from palpate_studies.run_study import run

__all__ = ["METRICS", "Local", "Metric", "Window", "run"]

_HOMES = {
    "metrics": ("METRICS", "Window", "Metric"),
    "run_one": ("Local",),
    "run_study": ("run",),
}
__getattr__ = importer(__name__, _HOMES)
