"""What is measured of a run: pure functions of its record, by name."""

from __future__ import annotations

from palpate.bench.metrics.contact import CONTACT_METRICS
from palpate.bench.metrics.following import FOLLOWING
from palpate.bench.metrics.surface import SURFACE
from palpate.bench.metrics.verdicts import CLAIMS
from palpate.bench.metrics.window import Look, Metric, Value

METRICS: dict[str, Metric] = {m.name: m for m in (*FOLLOWING, *CONTACT_METRICS, *SURFACE, *CLAIMS)}
"""All metrics by name, in the order of the documentation."""

__all__ = ["METRICS", "Look", "Metric", "Value"]
