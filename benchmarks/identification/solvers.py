"""Digits of solvers on the certified contact logs, palpate's and others', as a table.

    python benchmarks/identification/solvers.py [--logs REGEX]

The solvers of `palpate references check`, and: MuJoCo's `minimize.least_squares` (the optimiser of `mujoco.sysid`, on
the same closed forms, from the same starts, with tolerances of 1e-15), and filterpy's Kalman filter of parameters
that do not move, on the linear models. A fit that ends in no number has 0 digits.
"""

from __future__ import annotations

import argparse
import io
import re

import numpy as np

from palpate.certified_logs import check
from palpate.certified_logs.check import LINEAR, REQUIRED_DIGITS, SOLVERS, SolverResult, scores
from palpate.certified_logs.models import FLOATS, CertifiedProblem, motion_and_force, problems
from palpate.identification.least_squares import solve


def mujoco_solver(problem: CertifiedProblem, start: dict[str, float]) -> SolverResult:
    """`mujoco.minimize.least_squares` on all parameters at once, scaled by its Jacobian."""
    from mujoco import minimize

    path, force = motion_and_force(problem)
    law, names = problem.law, [*problem.law.linear, *problem.law.nonlinear]
    theta = solve(np.column_stack(law.columns(path, start, FLOATS)), force)

    def residual(points):
        found = []
        for p in points.T:
            at = dict(zip(names, p.tolist(), strict=True))
            parts = zip(law.linear, law.columns(path, at, FLOATS), strict=True)
            found.append(sum((at[k] * c for k, c in parts), -force))
        return np.stack(found, axis=1)

    with np.errstate(all="ignore"):
        best, _ = minimize.least_squares(
            np.array([*theta, *start.values()]), residual, xtol=1e-15, gtol=1e-15, max_iter=300, x_scale="jac",
            verbose=minimize.Verbosity.SILENT, output=io.StringIO(),
        )  # fmt: skip
    return SolverResult(dict(zip(names, best.ravel().tolist(), strict=True)), {})


def filterpy_solver(problem: CertifiedProblem, _start: dict[str, float]) -> SolverResult:
    """`filterpy.kalman.KalmanFilter`, a row at a time, from zero."""
    from filterpy.kalman import KalmanFilter

    path, force = motion_and_force(problem)
    columns = np.column_stack(problem.law.columns(path, {}, FLOATS))
    size = np.sqrt((columns**2).mean(axis=0))
    own = KalmanFilter(dim_x=columns.shape[1], dim_z=1)
    own.P *= 1e8  # of a start of 1e6 to 1e16 the most digits; its update loses them
    for row, value in zip(columns / size, force, strict=True):
        own.H = row[None]
        own.update(value)
    return SolverResult(dict(zip(problem.law.linear, (own.x[:, 0] / size).tolist(), strict=True)), {})


OTHERS = {"mujoco minimize": mujoco_solver, "filterpy Kalman": filterpy_solver}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--logs", default=".", help="regular expression of their names")
    asked = parser.parse_args()
    SOLVERS.update(OTHERS)
    LINEAR.add("filterpy Kalman")
    print(
        "| solver | fits | with 8 digits | median | least | fewer on |", "|---|---|---|---|---|---|", sep="\n"
    )
    for solver in SOLVERS:
        found = []
        for problem in problems():
            if re.search(asked.logs, problem.name):
                try:
                    found += scores(problem, solver)
                except (np.linalg.LinAlgError, ValueError, FloatingPointError):
                    found += [
                        check.Score(problem, solver, k, 0.0, None) for k in range(2 if problem.starts else 1)
                    ]
        digits = sorted(one.digits for one in found)
        few = dict.fromkeys(
            re.sub(r"-\d+$", "", one.problem.name) for one in found if one.digits < REQUIRED_DIGITS
        )
        enough = sum(d >= REQUIRED_DIGITS for d in digits)
        middle = digits[len(digits) // 2] if digits else float("nan")
        least = digits[0] if digits else float("nan")
        print(
            f"| `{solver}` | {len(digits)} | {enough} | {middle:.1f} | {least:.1f} | {', '.join(few) or '-'} |"
        )


if __name__ == "__main__":
    main()
