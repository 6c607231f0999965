"""Metrics of a run: pure functions of its record, by name."""

from palpate.errors import unknown
from palpate.plugins import is_plugin
from palpate.studies.metrics.following import CONTACT_METRICS, FOLLOWING, SURFACE
from palpate.studies.metrics.verdicts import CLAIMS, own_metric
from palpate.studies.metrics.window import Metric, Value, Window

METRICS: dict[str, Metric] = {m.name: m for m in (*FOLLOWING, *CONTACT_METRICS, *SURFACE, *CLAIMS)}
"""All metrics by name, in the order of the documentation."""


def metric_of(name: str) -> Metric:
    """A metric by its name, or the user's own as ``module:name``.

    Raises:
        InputError: there is none of this name.
    """
    if is_plugin(name):
        return own_metric(name)
    if name not in METRICS:
        raise unknown("metric", name, METRICS)
    return METRICS[name]


__all__ = ["METRICS", "Metric", "Value", "Window", "metric_of"]
