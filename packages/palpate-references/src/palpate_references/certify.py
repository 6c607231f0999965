"""Makes the logs, and certifies their parameters by two algorithms in 60 decimal digits.

    python -m palpate_references.certify

First: Gauss and Newton on all parameters, the Jacobian by central differences of 1e-25, each step by Householder's QR.
Second: the linear parameters by Cholesky's factors of the normal equations, the nonlinear ones by Newton's method on
the gradient of what is left of the sum of squares. Both have to agree to 20 digits; 15 are written, 11 are certified.
"""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from mpmath import mp  # type: ignore[import-untyped]

from palpate_references.models import FLOATS, MODELS, Functions, SineMotion
from palpate_references.problem import Certified, CertifiedProblem, motion_and_force

mp.dps = 60
HERE = Path(__file__).parent
SEED = 20260101
AGREE = mp.mpf(10) ** -20
EXACT = Functions(
    np.frompyfunc(mp.sin, 1, 1), np.frompyfunc(mp.cos, 1, 1), np.frompyfunc(mp.power, 2, 1), +mp.pi
)
_FEW = (("0.0012", "1.3", "0.4"), ("0.0007", "3.1", "1.9"), ("0.0003", "7.7", "5.2"))
_MANY = (*_FEW, ("0.0001", "17.9", "2.2"), ("0.00004", "31.3", "0.9"))
_SLOW = (("0.0015", "0.31", "0.4"), ("0.0002", "0.47", "1.1"))
_THIRD = ("0.0002", "2.1", "2.6")
_K, _B, _M, _F0 = 4321.5, 37.25, 1.375, 0.625
_TRUE = {
    "K": _K,
    "B": _B,
    "M": _M,
    "F0": _F0,
    "D": 0.31,
    "Fc": 0.85,
    "lag": 0.0043,
    "T": 0.0031,
    "K1": 2750.0,
    "tau": 0.083,
}
_POWER = {"K": 2.5e6, "B": 6.0e5, "n": 1.5, "x0": 0.0003}
_OF_POWER = {"hertz", "hunt-crossley"}
_FAR = {
    "lag": ("0", "0.012"),
    "T": ("0.0005", "0.02"),
    "tau": ("0.02", "0.4"),
    "n": ("1", "2.2"),
    "x0": ("0.00015", "0.0004"),
}
"""Two starting values of each nonlinear parameter, on both sides of its value."""


def conditions(model: str) -> list[tuple[str, str, dict[str, Any]]]:
    """Level, deviation and numbers of the logs of a model."""
    rows = [
        ("easy", "many frequencies, noise of 1e-4 N", {"sines": _MANY, "noise": 1e-4}),
        ("average", "three frequencies, noise of 0.1 N", {"sines": _FEW, "noise": 0.1}),
        (
            "average",
            "three frequencies, forces rounded to 0.1 N",
            {"sines": _FEW, "noise": 0.05, "digits": 1},
        ),
        ("hard", "two slow frequencies, noise of 0.02 N", {"sines": _SLOW, "noise": 0.02}),
    ]
    if model == "kelvin-voigt-mass-lag":  # five parameters are not in two frequencies
        rows[-1] = (
            "hard",
            "three slow frequencies, noise of 1e-3 N",
            {"sines": (*_SLOW, _THIRD), "noise": 1e-3},
        )
    if not MODELS[model].nonlinear:
        rows.append(("hard", "an offset of 1e5 N", {"sines": _FEW, "noise": 0.05, "offset": 1e5}))
    return rows


def motion(sines: tuple[tuple[str, str, str], ...], time: np.ndarray, number: Any) -> SineMotion:
    """SineMotion of a table of sines in a number type."""
    kind = float if number is float else object
    columns = (np.array([number(row[i]) for row in sines], dtype=kind) for i in range(3))
    return SineMotion(time, number("0.003"), *columns)


def log(
    name: str,
    model: str,
    sines: tuple[tuple[str, str, str], ...],
    noise: float,
    digits: int = 8,
    offset: float = 0.0,
) -> None:
    """Writes a log of 150 rows; the noise is white and normal, of a seed by the name."""
    law, rng = MODELS[model], np.random.default_rng([SEED, *name.encode()])
    n, rate = 150, 100.0 if len(sines) > 2 else 25.0
    time = np.arange(n) / rate
    known = _TRUE | (_POWER if model in _OF_POWER else {}) | {"F0": _F0 + offset}
    values = {k: known[k] for k in (*law.linear, *law.nonlinear)}
    path = motion(sines, time, float)
    force = np.column_stack(law.columns(path, values, FLOATS)) @ [values[k] for k in law.linear]
    force = force + noise * rng.standard_normal(n)
    x = path.derivative(0, FLOATS)
    lines = [f"{t:.2f},{p:.10f},{f:.{digits}f}" for t, p, f in zip(time, x, force, strict=True)]
    (HERE / "logs").mkdir(exist_ok=True)
    (HERE / "logs" / f"{name}.csv").write_text(
        "time_s,position_m,force_N\n" + "\n".join(lines) + "\n", encoding="utf-8"
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
    true = _POWER if problem.model in _OF_POWER else _TRUE
    start = {k: mp.mpf(true[k]) for k in law.nonlinear}
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


def main() -> None:
    """Writes every log and the table of certified parameters."""
    table = []
    for model in MODELS:
        for number, (level, about, numbers) in enumerate(conditions(model)):
            name = f"{model}-{number + 1}"
            log(name, model, **numbers)
            amplitude, frequency, phase = zip(*numbers["sines"], strict=True)
            problem = CertifiedProblem(
                name=name, level=level, about=about, model=model, mean="0.003", amplitude=amplitude,
                frequency=frequency, phase=phase, starts={k: _FAR[k] for k in MODELS[model].nonlinear}, certified={},
                residual_std="0", rows=150,
            )  # fmt: skip
            table.append(certify(problem))
            print(name, {k: c.value for k, c in table[-1].certified.items()})  # noqa: T201
    text = msgspec.json.format(msgspec.json.encode(table), indent=1)
    (HERE / "certified.json").write_bytes(text + b"\n")


if __name__ == "__main__":
    main()
