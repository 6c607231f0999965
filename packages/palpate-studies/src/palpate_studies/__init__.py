"""Many runs: parameters over anything that an experiment has, metrics by name, one table; resumable at any moment.

from palpate_studies import run
frame = run(text_of_a_study, "runs/mine")
"""

from __future__ import annotations

from palpate.bench.metrics import METRICS, Look, Metric
from palpate_studies.run_one import Local
from palpate_studies.run_study import run

__all__ = ["METRICS", "Local", "Look", "Metric", "run"]
