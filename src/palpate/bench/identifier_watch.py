"""An identifier beside a run: it only watches, so it is fed with the run's own rows, tick by tick in their order."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel, law
from palpate.arrays import Array
from palpate.bench.estimators import Estimators, listened
from palpate.bench.sequence import CONTACT
from palpate.errors import PartError
from palpate.plugins import reason
from palpate.records import Record
from palpate.signals.types import Estimate

COLUMNS = {
    "M_identifier": "kg",
    "B_identifier": "N s/m",
    "K_identifier": "N/m",
    "M_identifier_std": "kg",
    "B_identifier_std": "N s/m",
    "K_identifier_std": "N/m",
}
"""Columns of an identifier in a record: its estimate after each tick, NaN before its first sample."""


class Identifier(Protocol):
    """Any estimator of `palpate.identifiers` of the three parameters (M, B, K), or one of the user's."""

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Take one sample in: (acceleration, velocity, position), shape (3,), and the force [N]."""

    def estimate(self) -> Estimate:
        """Estimate so far of M [kg], B [N s/m], K [N/m]."""


@law
def feed(estimators, x, force, smooth_force, phase, out):
    """Rows of `out`: whether there is a sample, then its regressor and its force; all of shape (n, ...)."""
    front, centring, listening = estimators.front.start_at(x[0]), estimators.centring.start(), 0.0
    for k in range(len(x)):
        (phi, y), front = estimators.front.step(front, x[k], force[k])
        before, listening = (
            listening,
            listened(listening, phase[k] == CONTACT, smooth_force[k], estimators.touch),
        )
        if listening == 1.0 and before == 0.0:
            centring = estimators.centring.start()
        if listening == 1.0:
            (phi, y), centring = estimators.centring.step(centring, phi, y)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3], out[k, 4] = listening, phi.x, phi.y, phi.z, y


compiled_feed = kernel(feed)


def watched(
    record: Record, identifier: Identifier, estimators: Estimators, *, compiled: bool = True
) -> Record:
    """The record with the columns of an identifier, which continues from its state.

    Args:
        record: of a run.
        identifier: fed with the matched channels, the offset taken out as for the matched estimator.
        estimators: of the bench; their front-end makes the channels.
        compiled: False makes them in plain Python.

    Raises:
        PartError: it raises, or its estimate is not three finite numbers with a covariance.
    """
    fed = np.zeros((len(record), 5))
    if len(record):
        march: Any = compiled_feed if compiled else feed
        names = ("x_measured", "force_sampled", "force_measured", "phase")
        march(estimators, *(np.ascontiguousarray(record[name]) for name in names), fed)
    rows = np.full((len(record), len(COLUMNS)), np.nan)
    now: Any = np.full(len(COLUMNS), np.nan)
    for k in range(len(record)):
        if fed[k, 0] == 1.0:
            now = after(identifier, fed[k, 1:4], float(fed[k, 4]), float(record["t"][k]))
        rows[k] = now
    columns = {name: rows[:, i].copy() for i, name in enumerate(COLUMNS)}
    return Record({**record.columns, **columns}, {**record.units, **COLUMNS}, record.meta)


def after(identifier: Identifier, regressor: Array, force: float, t: float) -> Array:
    """The identifier's numbers after one sample."""
    name = type(identifier).__name__
    try:
        identifier.update(regressor, force)
        found = identifier.estimate()
        theta, P = np.asarray(found.theta, float), np.asarray(found.covariance, float)
    except Exception as error:
        raise PartError(f"the identifier {name} fails at {t:.3f} s: {reason(error)}") from error
    if theta.shape != (3,) or P.shape != (3, 3):
        raise PartError(
            f"the identifier {name} must estimate (M, B, K): theta of shape (3,) and its covariance (3, 3), got "
            f"{theta.shape} and {P.shape}"
        )
    if not np.isfinite(theta).all():
        raise PartError(f"the identifier {name} estimates {theta.tolist()} at {t:.3f} s: not finite numbers")
    with np.errstate(invalid="ignore"):
        return np.concatenate([theta, np.sqrt(np.diag(P))])
