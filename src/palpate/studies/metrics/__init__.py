"""What is measured of a run: pure functions of its record, by name."""

from __future__ import annotations

from palpate.studies.metrics.claims import CLAIMS
from palpate.studies.metrics.contact import CONTACT_METRICS
from palpate.studies.metrics.following import FOLLOWING
from palpate.studies.metrics.look import Look, Metric, Value
from palpate.studies.metrics.surface import SURFACE

METRICS: dict[str, Metric] = {m.name: m for m in (*FOLLOWING, *CONTACT_METRICS, *SURFACE, *CLAIMS)}
"""All metrics by name, in the order of the documentation."""

__all__ = ["METRICS", "Look", "Metric", "Value"]
