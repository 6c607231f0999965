"""Whether a relaxing surface had come back before it was touched again."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from palpate.identification.estimators.answer import Answer


def unrecovered(found: Answer) -> str:
    """Why what a branch still had of the contact before speaks against the answer; empty if it does not.

    A model's branch follows the probe into the air. The surface does not: left alone it comes back with tau (1 + K1/K),
    the creep time of a standard linear solid. What is then left of the branch at the next touch has to be less than K1
    is known to.
    """
    spans = found.problem.contacts.spans
    if "K1" not in found.names or len(spans) < 2:
        return ""
    stiffness, branch = found["K"], found["K1"]
    if stiffness <= 0 or branch <= 0:
        return ""
    gaps = [after[0] - before[1] for before, after in pairwise(spans)]
    creep = found["tau"] * (1 + branch / stiffness)
    left = float(np.exp(-min(gaps) * found.problem.motion.chain.dt / creep))
    if left <= found.half_of("K1") / branch:
        return ""
    return f"the surface is touched again before it has recovered: {left:.0%} of its branch is left"
