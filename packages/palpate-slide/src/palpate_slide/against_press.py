"""Whether a log is of a slide or of a press: which of the two leaves less of the force unexplained.

A press says that the force is a function of the depth along one direction, F = F_0 + n (K d + B d'), with its own n, K
and contacts. A slide says that the force goes on while the tip moves across it: |F| = F_0, at the angle of friction to
the motion. Each is compared with the force in newtons, in the same rows, where the tip moves across the force and in
free motion. Where the zero of the force is unknown, its size is, too, and a slide says its angle alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.arrays import Array
from palpate.contact_frame.signals_in_base import Unloaded
from palpate.identification import Identification, Verdict
from palpate_slide.from_log import BLOCKS, SlideFit, SlideWindows, nearest


def advantage(
    course: SlideWindows,
    found: SlideFit,
    length: float,
    freed: Unloaded,
    press: Identification,
    about: dict[str, Any],
) -> float:
    """How much more of the force a press leaves than a slide does, in standard deviations of the difference.

    The deviation is that of a sum over parts of the log: Vuong's test (Econometrica 57, 1989), of models of which none
    holds the other.

    Args:
        course: of the slide.
        found: its parameters.
        length: on which its friction relaxes [m].
        freed: rows in free motion and in contact by the slide.
        press: its K counts as it is, if it is identified; otherwise the best one does.
        about: normal, sign and bias of the press, as `project` gives them.
    """
    s = course.smooth
    free = np.interp(s.time, course.turns[0], freed.free.astype(float)) > 0.999
    rows = np.flatnonzero(course.slides | free)[:: max(s.rows // 2, 1)]
    slides = course.slides[rows]
    F, angle = (values[rows] for values in course.friction_angle(found, length))
    size = np.linalg.norm(F, axis=1)
    usual = size[slides].mean() if course.known else size
    by_slide = np.where(slides, (size - usual) ** 2 + (size * angle) ** 2, size**2)
    by_press = np.sum(_left_by_press(course, freed, press, about, rows) ** 2, axis=1)
    # Both are normal with a variance of their own: the parts' log-likelihoods against each other.
    one, other = (values / values.mean() for values in (by_press, by_slide))
    parts = np.array([part.mean() for part in np.array_split(one - other, BLOCKS)])
    ratio = np.log(by_press.mean() / by_slide.mean())
    return float(np.sqrt(BLOCKS) * ratio / max(np.std(parts, ddof=1), 1e-300))


def _left_by_press(
    course: SlideWindows,
    freed: Unloaded,
    press: Identification,
    about: dict[str, Any],
    rows: NDArray[np.intp],
) -> Array:
    """Residual of a press [N], shape (n, 3); each contact, and free motion, begins from a force of its own."""
    s = course.smooth
    n, sign = np.array(about["normal"]), 1.0 if about["force_sign"] == "action" else -1.0
    R = course.turns[1][nearest(course.turns[0], s.time[rows])]
    F = sign * (s.force[rows] + freed.load.weight + R @ (freed.load.bias - np.array(about["bias_N"])))
    time = s.time[rows]
    contact = np.zeros(len(rows), int)
    for i, (start, end) in enumerate(press.contacts):
        contact[(time >= start) & (time <= end)] = i + 1
    begins = np.equal.outer(contact, np.unique(contact)).astype(float)
    depth, rate = (np.where(contact > 0, vectors[rows] @ n, 0.0) for vectors in (s.place, s.velocity))
    K = press.parameters["K"]
    claimed = K.value if K.verdict is Verdict.IDENTIFIED and K.value is not None else None
    along = F @ n - (0.0 if claimed is None else claimed * depth)
    columns = np.column_stack([begins, rate] if claimed is not None else [begins, rate, depth])
    left = F - np.outer(F @ n, n)
    left -= begins @ np.linalg.lstsq(begins, left, rcond=None)[0]
    found: Array = left + np.outer(along - columns @ np.linalg.lstsq(columns, along, rcond=None)[0], n)
    return found
