"""Names that a shell completes: arms, experiments, studies, presets, models. Others are taken too, as of files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cyclopts import Parameter

QUIET = Parameter(show_choices=False)
"""An option whose names are completed, and not listed in the help."""
MODELS = (
    "kelvin-voigt",
    "kelvin-voigt-mass",
    "standard-linear-solid",
    "hunt-crossley",
    "quasi-linear-viscoelastic",
)
"""Those of `palpate.identification.models`, which the help does not import."""


def _known(*names: str) -> Any:
    """One of these names, or another."""
    return Literal[names] | str


def _shipped(*folders: str) -> Any:
    """The same of the files that come with palpate in some of its folders."""
    files = [path for folder in folders for path in (Path(__file__).parents[2] / folder).glob("*.toml")]
    return _known(*sorted(path.stem for path in files))


if TYPE_CHECKING:
    Controller = str
    Experiment = str
    LoopArm = str
    Model = str
    Mode = str
    Physics = str
    Preset = str
    SerialArm = str
    Study = str
else:
    Controller = _known("cautious", "hybrid", "proportional-integral", "impedance")
    Experiment = _shipped("bench/experiments", "bench/presses")
    LoopArm = _shipped("force/arms")
    Model = _known(*MODELS)
    Mode = _known("torque", "position")
    Physics = _known("own", "mujoco")
    Preset = _shipped("logs/presets")
    SerialArm = _shipped("robots/serial/arms")
    Study = _shipped("studies/shipped")
