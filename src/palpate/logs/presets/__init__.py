"""Columns or topics, units and frames of the recorders that come with usual robots, a TOML file each."""

import tomllib
from collections.abc import Container
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


def preset_among(names: Container[str]) -> str | None:
    """The preset all of whose columns or topics are among some names; None if there is no such one."""
    for name in presets():
        options = preset(name)
        needed = [
            column
            for key in ("time", "wrench", "pose")
            for column in str(options.get(key, "")).split(",")
            if column
        ]
        if all(column in names for column in needed):
            return name
    return None
