"""Names that a shell completes: arms, experiments, presets, models. Others are taken too, as of files."""

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


def _known_names(*names: str) -> Any:
    """One of these names, or another."""
    return Literal[names] | str


def shipped_names(*folders: str, package: Path = Path(__file__).parents[2]) -> Any:
    """One of the names of the TOML files in some folders of a package, or another."""
    files = [path for folder in folders for path in (package / folder).glob("*.toml")]
    return _known_names(*sorted(path.stem for path in files))


if TYPE_CHECKING:
    Controller = str
    Experiment = str
    LoopArm = str
    Model = str
    Mode = str
    Physics = str
    Preset = str
    SerialArm = str
else:
    Controller = _known_names("cautious", "hybrid", "proportional-integral", "impedance")
    Experiment = shipped_names("bench/experiments", "bench/presses")
    LoopArm = shipped_names("force/arms")
    Model = _known_names(*MODELS)
    Mode = _known_names("torque", "position")
    Physics = _known_names("own", "mujoco")
    Preset = shipped_names("logs/presets")
    SerialArm = shipped_names("robots/serial/arms")
