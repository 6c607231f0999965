"""A certified log: its motion, its forces, starting values, and the certified parameters."""

from importlib.resources import files
from typing import Any

import msgspec
import numpy as np

from palpate.certified_logs.models import MODELS, ClosedForm, SineMotion


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
