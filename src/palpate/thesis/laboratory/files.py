"""Laboratories as files: the one that comes with palpate, and any of the user's."""

from __future__ import annotations

from typing import Any

from palpate.bench.experiments.toml_files import TomlFiles, decoded
from palpate.errors import InputError
from palpate.thesis.laboratory.laboratory import CHOSEN, Laboratory, checked, values

BENCH = "bench"
"""The name of the hand-chosen laboratory."""
FILES = TomlFiles("laboratory", "a", "palpate.thesis.laboratory", ("shipped",))
KEYS = {"about", "command", "seed", "unknowns"}


def named(name: str) -> Laboratory:
    """A laboratory by its name, "bench" or "inferred", or from a TOML file.

    Raises:
        InputError: no such laboratory or file, TOML that does not parse, an unknown key, a value out of range.
    """
    if name == BENCH:
        return CHOSEN
    tables = decoded(FILES.source(name), name)
    strange = sorted(set(tables) - KEYS)
    if strange:
        raise InputError(f"{name}: unknown key {strange[0]!r}; a laboratory has {', '.join(sorted(KEYS))}")
    unknowns: Any = tables.get("unknowns")
    if not isinstance(unknowns, dict):
        raise InputError(f"{name}: no table [unknowns]; a laboratory has its values there")
    return checked(unknowns, name)


def text(laboratory: Laboratory, about: str, command: str, seed: int) -> str:
    """A laboratory as a TOML file that `named` reads."""
    import json

    lines = [
        f"about = {json.dumps(about)}",
        f"command = {json.dumps(command)}",
        f"seed = {seed}",
        "",
        "[unknowns]",
    ]
    lines += [f"{name} = {value!r}" for name, value in values(laboratory).items()]
    return "\n".join(lines) + "\n"
