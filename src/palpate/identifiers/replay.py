"""A neural identifier beside a run, after the fact: it only watches, so a record is all it needs."""

from __future__ import annotations

import numpy as np

from palpate.errors import InputError
from palpate.identifiers.neural_probe import NeuralProbe
from palpate.records import Record

SIGNALS = ("displacement", "vx_raw", "ax_measured", "force_measured")
"""Of a bench's record: what the thesis' identifiers are given (sec. 6)."""


def watch(record: Record, probe: NeuralProbe, signals: tuple[str, str, str, str] = SIGNALS) -> Record:
    """Lets the network learn from a run's time in contact, and asks it after every sample.

    Args:
        record: of a bench, or with a column "phase" that is 1 in contact; without one, all of it is contact.
        probe: learns on; its answers are the record's.
        signals: columns of displacement [m], velocity, acceleration and force [N].

    Returns:
        A record with "t" from the first sample in contact, "K", "B", "M" of the probe after each sample, and
        "force_error", what the network's answer lacked before it learned from the sample.

    Raises:
        InputError: no contact in the record, a column that it does not have, samples that are not finite.
    """
    pressing = record["phase"] == 1.0 if "phase" in record.columns else np.ones(len(record), dtype=bool)
    if not pressing.any():
        raise InputError("the record has no contact: nothing to learn from")
    x, v, a, force = (record[name][pressing] for name in signals)
    answers = probe.trajectory(np.column_stack([x, v, a]), force)
    t = record["t"][pressing]
    columns = {"t": t - t[0], **dict(zip(("K", "B", "M", "force_error"), answers.T.copy(), strict=True))}
    units = {"t": "s", "K": "N/m", "B": "N s/m", "M": "kg", "force_error": "N"}
    warnings = [list(w) for w in probe.probe().warnings]
    return Record(columns, units, {**record.meta, "warnings": warnings})
