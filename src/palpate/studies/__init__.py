"""Many runs: parameters over anything that an experiment has, metrics by name, one table; resumable at any moment.

from palpate.studies import run
frame = run(text_of_a_study, "runs/mine")
"""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate.studies.comparison import comparisons
    from palpate.studies.metrics import METRICS, Metric, Window
    from palpate.studies.plan import plan_runs
    from palpate.studies.run_one import Local
    from palpate.studies.run_study import run
    from palpate.studies.study import parse

__all__ = ["METRICS", "Local", "Metric", "Window", "comparisons", "parse", "plan_runs", "run"]

_HOMES = {
    "study": ("parse",),
    "plan": ("plan_runs",),
    "comparison": ("comparisons",),
    "metrics": ("METRICS", "Window", "Metric"),
    "run_one": ("Local",),
    "run_study": ("run",),
}
__getattr__ = importer(__name__, _HOMES)
