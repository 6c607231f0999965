"""Problems as the identification makes them of a log, for tests of the stages after it."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from palpate.identification.contacts import contacts_of
from palpate.identification.options import Options
from palpate.identification.problem import Problem, build_problem
from palpate.identification.sampling import channels_of
from palpate.records import Record


def problem(log: Record, lag: float | None = 0.0, **said: Any) -> Problem:
    """Of a log whose lag is told; None for one that nobody has calibrated.

    Args:
        log: with time, position and force.
        lag: [s].
        said: further options of `identify`.
    """
    options = Options.of(lag=lag, **said)
    channels, chain, contacts = contacts_of(channels_of(log), options)
    return build_problem(channels, chain, contacts, options)


def contradictions(answer: dict[str, Any]) -> list[tuple[str, str]]:
    """Pairs of stiffnesses at one force, of an answer as JSON has it, whose intervals exclude each other.

    A branch that relaxes (K1) is in the tangents and not in K; an octave has another frequency than the tangents.
    """
    point, parameters = answer["working_point"], answer["parameters"]
    if not point or point["source"] != "press":
        return []
    stiffness, force = point["stiffness"], point["force_N"]
    intervals = {"working point": stiffness["ci95"]}
    K = parameters["K"]
    if K["verdict"] == "identified" and K["unit"] == stiffness["unit"] and "K1" not in parameters:
        intervals["K"] = K["ci95"]
    rows = [(t["force_N"], t["stiffness"], t["half"]) for t in answer["press"]["tangent"]]
    if len(rows) > 1 and rows[0][0] <= force <= rows[-1][0]:
        forces, values, halves = np.transpose(rows)
        intervals["tangents"] = [float(np.interp(force, forces, values + sign * halves)) for sign in (-1, 1)]
    pairs = combinations(intervals.items(), 2)
    return [(a, b) for (a, (low, high)), (b, (bottom, top)) in pairs if low > top or bottom > high]
