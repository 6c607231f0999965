"""Columns or topics, units and frames of the recorders that come with usual robots, a TOML file each."""

import tomllib
from importlib.resources import files
from typing import Any

from palpate.errors import unknown


def presets() -> list[str]:
    """Names of the presets that come with palpate."""
    return sorted(f.name.removesuffix(".toml") for f in files(__name__).iterdir() if f.name.endswith(".toml"))


def preset(name: str) -> dict[str, Any]:
    """The options of a preset, by their names on the command line.

    Raises:
        InputError: no such preset.
    """
    if name not in presets():
        raise unknown("preset", name, presets())
    return tomllib.loads(files(__name__).joinpath(f"{name}.toml").read_text(encoding="utf-8"))
