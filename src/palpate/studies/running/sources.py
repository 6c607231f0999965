"""Whose numbers these are: the version of palpate, and a hash of the sources that a run consists of."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from palpate._jit.registry import PACKAGE

OF_A_RUN = (
    "_vector.py",
    "bench",
    "controllers",
    "environments",
    "force",
    "friction.py",
    "identifiers",
    "instruments",
    "networks",
    "plugins.py",
    "references",
    "robots",
    "signals",
    "studies/running/run_one.py",
)
"""Files and folders of the package that a row depends on; what reads studies and draws pages may change."""


@cache
def sources() -> str:
    """A hash of the sources of a run, wherever they are installed."""
    digest = hashlib.sha256()
    for name in OF_A_RUN:
        place = PACKAGE / name
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(_name(file) + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def _name(file: Path) -> bytes:
    return file.relative_to(PACKAGE).as_posix().encode()
