"""The law of propagation (GUM) against Monte Carlo (JCGM 101) on every certified log.

    python benchmarks/identification/propagation.py [--draws 4000] [--logs REGEX]

The measurand is the certified model's least-squares parameters. By the GUM a standard uncertainty is the certified
standard deviation, the root of s^2 (J^T J)^-1. By Monte Carlo the force is drawn again, the certified model's with
normal noise of the certified residual standard deviation, each draw is fitted by Gauss and Newton, and the standard
uncertainty is the standard deviation of the fits. Each row has the parameter whose ratio of the two is farthest from
1, then the shares of draws in the 95 % intervals of the GUM, least and most over the parameters. The standard error of
a ratio is 1/sqrt(2 draws).
"""

from __future__ import annotations

import argparse
import re

import numpy as np
from numpy.typing import NDArray

from palpate_references.models import FLOATS, ClosedForm, SineMotion
from palpate_references.problem import CertifiedProblem, motion_and_force, problems

Array = NDArray[np.float64]

CLOSE = 0.05
ROUNDS = 8
"""Of Gauss and Newton: from the certified parameters a draw needs three or four."""


def predicted(law: ClosedForm, path: SineMotion, names: tuple[str, ...], theta: Array) -> Array:
    """Force of a model, shape (n,)."""
    at = dict(zip(names, theta.tolist(), strict=True))
    return np.column_stack(law.columns(path, at, FLOATS)) @ theta[: len(law.linear)]


def jacobian(law: ClosedForm, path: SineMotion, names: tuple[str, ...], theta: Array) -> Array:
    """Its derivatives, shape (n, p)."""
    at = dict(zip(names, theta.tolist(), strict=True))
    columns = list(law.columns(path, at, FLOATS))
    for j in range(len(law.linear), len(names)):
        h = 1e-4 * abs(theta[j])
        move = h * np.eye(len(names))[j]
        up, down = (predicted(law, path, names, theta + s * move) for s in (1.0, -1.0))
        columns.append((up - down) / (2.0 * h))
    return np.column_stack(columns)


def fits(problem: CertifiedProblem, draws: int) -> tuple[Array, Array, Array]:
    """Certified parameters and deviations, shapes (p,), and those of each draw, shape (draws, p)."""
    path, _ = motion_and_force(problem)
    law = problem.law
    names = (*law.linear, *law.nonlinear)
    true = np.array([float(problem.certified[name].value) for name in names])
    std = np.array([float(problem.certified[name].std) for name in names])
    force, noise = predicted(law, path, names, true), float(problem.residual_std)
    rng = np.random.default_rng([len(problem.name), *problem.name.encode()])
    found = np.empty((draws, len(true)))
    inverse = np.linalg.pinv(jacobian(law, path, names, true) * std)
    for k in range(draws):
        drawn = force + rng.normal(0.0, noise, len(force))
        theta = true + std * (inverse @ (drawn - force))
        for _ in range(ROUNDS if law.nonlinear else 0):
            J = jacobian(law, path, names, theta) * std
            step = np.linalg.lstsq(J, drawn - predicted(law, path, names, theta), rcond=None)[0]
            theta = theta + std * step
            if np.abs(step).max() < 1e-6:
                break
        found[k] = theta
    return true, std, found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=4000)
    parser.add_argument("--logs", default=".", help="regular expression of their names")
    asked = parser.parse_args()
    worst = []
    print(f"{'log':26}{'parameter':>11}{'GUM / Monte Carlo':>20}{'95 % hold':>18}")
    for problem in problems():
        if not re.search(asked.logs, problem.name):
            continue
        true, std, found = fits(problem, asked.draws)
        ratios = std / found.std(axis=0, ddof=1)
        held = (np.abs(found - true) <= 1.96 * std).mean(axis=0)
        j = int(np.argmax(np.abs(ratios - 1.0)))
        name = (*problem.law.linear, *problem.law.nonlinear)[j]
        worst.append(abs(ratios[j] - 1.0))
        print(f"{problem.name:26}{name:>11}{ratios[j]:20.3f}{held.min():11.1%} to {held.max():.1%}")
    close = sum(w <= CLOSE for w in worst)
    print(
        f"\n{close} of {len(worst)} logs within {CLOSE:.0%} in every parameter, {max(worst):.1%} off at most;"
        f" {asked.draws} draws, standard error of a ratio {1.0 / np.sqrt(2.0 * asked.draws):.3f}"
    )


if __name__ == "__main__":
    main()
