"""Certifies the parameters of the logs by two algorithms in 60 decimal digits.

    python tests/oracles/certify_references.py     # every log again: names those whose certificate differs

First: Gauss and Newton on all parameters, the Jacobian by central differences of 1e-25, each step by Householder's QR.
Second: the linear parameters by Cholesky's factors of the normal equations, the nonlinear ones by Newton's method on
the gradient of the remaining sum of squares. Both have to agree to 20 digits; 15 are written, 11 are certified.
"""

import sys
from typing import Any

import msgspec
import numpy as np
from mpmath import mp  # type: ignore[import-untyped]

from palpate.certified_logs.models import (
    Certified,
    CertifiedProblem,
    Functions,
    SineMotion,
    motion_and_force,
    problems,
)

mp.dps = 60
AGREE = mp.mpf(10) ** -20
EXACT = Functions(
    np.frompyfunc(mp.sin, 1, 1), np.frompyfunc(mp.cos, 1, 1), np.frompyfunc(mp.power, 2, 1), +mp.pi
)


def gauss_newton(law: Any, path: SineMotion, force: Any, start: dict[str, Any]) -> tuple[dict[str, Any], Any]:
    """Parameters by Gauss and Newton with QR, and the Jacobian there."""
    names, step = [*law.linear, *law.nonlinear], mp.mpf(10) ** -25
    columns = mp.matrix(np.column_stack(law.columns(path, start, EXACT)).tolist())
    theta = dict(zip(law.linear, mp.qr_solve(columns, mp.matrix(list(force)))[0], strict=True)) | start

    def predict(at: dict[str, Any]) -> Any:
        columns = law.columns(path, at, EXACT)
        return sum(at[k] * column for k, column in zip(law.linear, columns, strict=True))

    for _ in range(60):
        jacobian = mp.matrix(len(force), len(names))
        for j, name in enumerate(names):
            h = step * max(abs(theta[name]), mp.mpf(10) ** -6)
            slope = (
                predict({**theta, name: theta[name] + h}) - predict({**theta, name: theta[name] - h})
            ) / (2 * h)
            for i in range(len(force)):
                jacobian[i, j] = slope[i]
        change, _ = mp.qr_solve(jacobian, mp.matrix(list(force - predict(theta))))
        if all(
            abs(change[j]) <= mp.mpf(10) ** -30 * max(abs(theta[k]), mp.mpf(10) ** -12)
            for j, k in enumerate(names)
        ):
            return theta, jacobian
        theta = {k: theta[k] + change[j] for j, k in enumerate(names)}
    raise ArithmeticError("Gauss and Newton did not converge")


def profile_newton(law: Any, path: SineMotion, force: Any, start: dict[str, Any]) -> dict[str, Any]:
    """Parameters by Newton's method on the profile of the sum of squares, with Cholesky's factors."""

    def linear(q: dict[str, Any]) -> tuple[Any, Any]:
        columns = law.columns(path, q, EXACT)
        size = [mp.sqrt((c * c).sum()) for c in columns]
        scaled = [c / s for c, s in zip(columns, size, strict=True)]
        gram = mp.matrix([[(a * b).sum() for b in scaled] for a in scaled])
        right = mp.matrix([(a * force).sum() for a in scaled])
        theta = [t / s for t, s in zip(mp.cholesky_solve(gram, right), size, strict=True)]
        residual = force - sum(t * c for t, c in zip(theta, columns, strict=True))
        return theta, (residual * residual).sum()

    def at(*moves: tuple[str, int]) -> Any:
        moved = dict(values)
        for name, sign in moves:
            moved[name] += sign * h * max(abs(values[name]), mp.mpf(10) ** -3)
        return linear(moved)[1]

    names, values = list(law.nonlinear), dict(start)
    h = mp.mpf(10) ** -12
    for _ in range(60 if names else 0):
        size = {k: h * max(abs(values[k]), mp.mpf(10) ** -3) for k in names}

        gradient = mp.matrix([(at((k, 1)) - at((k, -1))) / (2 * size[k]) for k in names])
        hessian = mp.matrix(len(names), len(names))
        for i, a in enumerate(names):
            for j, b in enumerate(names):
                hessian[i, j] = (
                    at((a, 1), (b, 1)) - at((a, 1), (b, -1)) - at((a, -1), (b, 1)) + at((a, -1), (b, -1))
                ) / (4 * size[a] * size[b])
        change = mp.lu_solve(hessian, -gradient)
        values = {k: values[k] + change[i] for i, k in enumerate(names)}
        if all(
            abs(change[i]) <= mp.mpf(10) ** -22 * max(abs(values[k]), mp.mpf(10) ** -6)
            for i, k in enumerate(names)
        ):
            break
    return dict(zip(law.linear, linear(values)[0], strict=True)) | values


def certify(problem: CertifiedProblem) -> CertifiedProblem:
    """The problem with its certified parameters.

    Raises:
        ArithmeticError: the two algorithms disagree.
    """
    path, force = motion_and_force(problem, mp.mpf)
    law = problem.law
    start = {k: mp.mpf(f"{float(problem.certified[k].value):.2g}") for k in law.nonlinear}
    first, jacobian = gauss_newton(law, path, force, start)
    second = profile_newton(law, path, force, {k: first[k] * (1 + mp.mpf(10) ** -4) for k in law.nonlinear})
    for name, value in first.items():
        if abs(value - second[name]) > AGREE * abs(value):
            raise ArithmeticError(
                f"{problem.name}: {name} is {mp.nstr(value, 25)} or {mp.nstr(second[name], 25)}"
            )
    columns = law.columns(path, first, EXACT)
    residual = force - sum(first[k] * c for k, c in zip(law.linear, columns, strict=True))
    names = [*law.linear, *law.nonlinear]
    variance = (residual * residual).sum() / (len(force) - len(names))
    covariance = mp.inverse(jacobian.T * jacobian) * variance
    certified = {
        k: Certified(mp.nstr(first[k], 15), mp.nstr(mp.sqrt(covariance[j, j]), 15))
        for j, k in enumerate(names)
    }
    return msgspec.structs.replace(problem, certified=certified, residual_std=mp.nstr(mp.sqrt(variance), 15))


def main() -> int:
    """Print the logs whose certificate is not what is shipped; the exit code."""
    different = [problem.name for problem in problems() if certify(problem) != problem]
    print("every certificate is made again to its last digit" if not different else "\n".join(different))
    return int(bool(different))


if __name__ == "__main__":
    sys.exit(main())
