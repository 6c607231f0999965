"""Certified logs and their contact models, which are written once for double and for multiple precision.

Each model is linear in its parameters but for at most two. A function turns the motion, the nonlinear parameters and
the elementary functions of a number type into the columns of the regression; arrays are of floats or of objects.
"""

from collections.abc import Callable, Mapping
from importlib.resources import files
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[Any]


class Functions(NamedTuple):
    """Elementary functions of a number type, elementwise, and the circle's number."""

    sin: Callable[[Numbers], Numbers]
    cos: Callable[[Numbers], Numbers]
    power: Callable[[Numbers, Any], Numbers]
    pi: Any


FLOATS = Functions(np.sin, np.cos, np.power, np.pi)


class SineMotion(NamedTuple):
    """Motion of the tip as a sum of sines: x(t) = mean + sum of a_i sin(2 pi f_i t + phi_i).

    Args:
        time: of the rows [s], shape (n,).
        mean: [m].
        amplitude: a_i [m], shape (m,).
        frequency: f_i [Hz], shape (m,).
        phase: phi_i [rad], shape (m,).
    """

    time: Numbers
    mean: Any
    amplitude: Numbers
    frequency: Numbers
    phase: Numbers

    def derivative(self, order: int, f: Functions, late: Any = 0, real: Any = 1, imag: Any = 0) -> Numbers:
        """The motion or a derivative of it, shape (n,).

        Args:
            order: 0, 1 or 2.
            f: the functions of the number type.
            late: delay [s].
            real: of a filter's answer at each frequency, shape (m,); its mean passes unchanged.
            imag: likewise, shape (m,).
        """
        w = 2 * f.pi * self.frequency
        angle = np.multiply.outer(self.time - late, w) + self.phase
        s = f.sin(angle)
        c = f.cos(angle)
        sine = real * s + imag * c
        cosine = real * c - imag * s
        if order == 0:
            return self.mean + (self.amplitude * sine).sum(axis=1)
        if order == 1:
            return (self.amplitude * w * cosine).sum(axis=1)
        return -(self.amplitude * w * w * sine).sum(axis=1)


Columns = Callable[[SineMotion, Mapping[str, Any], Functions], list[Numbers]]


class ClosedForm(NamedTuple):
    """A contact model.

    Args:
        formula: of the force, as documents print it.
        linear: names of the parameters that the columns stand for.
        nonlinear: names of the others.
        columns: see `Columns`.
    """

    formula: str
    linear: tuple[str, ...]
    nonlinear: tuple[str, ...]
    columns: Columns


def _ones(m: SineMotion) -> Numbers:
    return 0 * m.time + 1


def _kelvin_voigt(m: SineMotion, p: Mapping[str, Any], f: Functions) -> list[Numbers]:
    late = p.get("lag", 0)
    return [m.derivative(0, f, late), m.derivative(1, f, late), _ones(m)]


def _with_mass(m: SineMotion, p: Mapping[str, Any], f: Functions) -> list[Numbers]:
    x, v, ones = _kelvin_voigt(m, p, f)
    return [x, v, m.derivative(2, f, p.get("lag", 0)), ones]


def _drifting(m: SineMotion, p: Mapping[str, Any], f: Functions) -> list[Numbers]:
    return [*_kelvin_voigt(m, p, f), m.time]


def _with_friction(m: SineMotion, p: Mapping[str, Any], f: Functions) -> list[Numbers]:
    x, v, ones = _kelvin_voigt(m, p, f)
    sign = np.where(v > 0, ones, -ones)
    return [x, v, sign, ones]


def _low_pass(m: SineMotion, p: Mapping[str, Any], f: Functions) -> tuple[Numbers, Numbers]:
    """Real and imaginary part of 1/(1 + i w T) at each frequency."""
    turn = 2 * f.pi * m.frequency * p["T"]
    real = 1 / (1 + turn * turn)
    return real, -turn * real


def _behind_filter(m: SineMotion, p: Mapping[str, Any], f: Functions) -> list[Numbers]:
    real, imag = _low_pass(m, p, f)
    return [m.derivative(k, f, 0, real, imag) for k in (0, 1)] + [_ones(m)]


def _standard_linear_solid(m: SineMotion, p: Mapping[str, Any], f: Functions) -> list[Numbers]:
    """The Maxwell branch's stretch is x less x through 1/(1 + i w tau)."""
    real, imag = _low_pass(m, {"T": p["tau"]}, f)
    x = m.derivative(0, f)
    return [x, x - m.derivative(0, f, 0, real, imag), _ones(m)]


def _hertz(m: SineMotion, p: Mapping[str, Any], f: Functions) -> list[Numbers]:
    return [f.power(m.derivative(0, f) - p["x0"], p["n"])]


def _hunt_crossley(m: SineMotion, p: Mapping[str, Any], f: Functions) -> list[Numbers]:
    power = f.power(m.derivative(0, f), p["n"])
    return [power, power * m.derivative(1, f)]


MODELS = {
    "kelvin-voigt": ClosedForm("K x + B v + F0", ("K", "B", "F0"), (), _kelvin_voigt),
    "kelvin-voigt-mass": ClosedForm("K x + B v + M a + F0", ("K", "B", "M", "F0"), (), _with_mass),
    "kelvin-voigt-drift": ClosedForm("K x + B v + F0 + D t", ("K", "B", "F0", "D"), (), _drifting),
    "kelvin-voigt-friction": ClosedForm(
        "K x + B v + Fc sign(v) + F0", ("K", "B", "Fc", "F0"), (), _with_friction
    ),
    "kelvin-voigt-lag": ClosedForm(
        "K x(t - lag) + B v(t - lag) + F0", ("K", "B", "F0"), ("lag",), _kelvin_voigt
    ),
    "kelvin-voigt-mass-lag": ClosedForm(
        "K x(t - lag) + B v(t - lag) + M a(t - lag) + F0", ("K", "B", "M", "F0"), ("lag",), _with_mass
    ),
    "kelvin-voigt-filter": ClosedForm(
        "(K x + B v) through 1/(1 + T s) + F0", ("K", "B", "F0"), ("T",), _behind_filter
    ),
    "hertz": ClosedForm("K (x - x0)^n", ("K",), ("n", "x0"), _hertz),
    "hunt-crossley": ClosedForm("K x^n + B x^n v", ("K", "B"), ("n",), _hunt_crossley),
    "standard-linear-solid": ClosedForm(
        "K x + K1 (x - x through 1/(1 + tau s)) + F0", ("K", "K1", "F0"), ("tau",), _standard_linear_solid
    ),
}


class Certified(msgspec.Struct, frozen=True):
    """A parameter and its standard deviation, as decimal text of 15 digits; 11 are certified."""

    value: str
    std: str


class CertifiedProblem(msgspec.Struct, frozen=True, kw_only=True):
    """One certified log.

    Args:
        name: of the log and of its file.
        level: `easy`, `average` or `hard`.
        about: what deviates from a clean log.
        model: name of the model that is fitted.
        mean, amplitude, frequency, phase: of the motion, exact decimals.
        starts: two values of each nonlinear parameter to start from.
        certified: by parameter.
        residual_std: square root of the residual sum of squares over its degrees of freedom [N], decimal.
        rows: of the log.
    """

    name: str
    level: str
    about: str
    model: str
    mean: str
    amplitude: tuple[str, ...]
    frequency: tuple[str, ...]
    phase: tuple[str, ...]
    starts: dict[str, tuple[str, str]]
    certified: dict[str, Certified]
    residual_std: str
    rows: int

    @property
    def law(self) -> ClosedForm:
        """The model that is fitted."""
        return MODELS[self.model]


def problems() -> list[CertifiedProblem]:
    """Every certified log, in the order of the table."""
    return msgspec.json.decode(
        files(__package__).joinpath("certified.json").read_bytes(), type=list[CertifiedProblem]
    )


def log_text(name: str) -> str:
    """A log as comma-separated text: time_s, position_m, force_N."""
    return files(__package__).joinpath("logs", f"{name}.csv").read_text(encoding="utf-8")


def motion_and_force(problem: CertifiedProblem, number: Any = float) -> tuple[SineMotion, Any]:
    """SineMotion and forces of a log as numbers of a type, from the exact decimals.

    Args:
        problem: which.
        number: a type made of decimal text.
    """
    rows = [line.split(",") for line in log_text(problem.name).splitlines()[1:]]
    kind = float if number is float else object
    time, force = (np.array([number(row[i]) for row in rows], dtype=kind) for i in (0, 2))
    sines = (
        np.array([number(text) for text in texts], dtype=kind)
        for texts in (problem.amplitude, problem.frequency, problem.phase)
    )
    return SineMotion(time, number(problem.mean), *sines), force
