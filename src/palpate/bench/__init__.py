"""The closed loop: one tick is sense, think, act, move; a run is a record.

from palpate.bench import build, load
record = build(load("foam-hybrid")).run(duration=60.0, seed=1, press=8.0)

Without arm and control, a tip on a given path: `given_motion(surface).run(path)`.

Its names are looked up when they are first used: the summary of a press waits for no bench.
"""

from typing import TYPE_CHECKING

from palpate.lazy import importer

if TYPE_CHECKING:
    from palpate._jit import kernel, law, part
    from palpate._vector import Vec3
    from palpate.bench.bench import Bench
    from palpate.bench.force_input import COLUMNS
    from palpate.bench.from_experiment import build
    from palpate.bench.plant import Loop, march, start_at
    from palpate.bench.summary import summarise
    from palpate.bench.tables import (
        DesiredForce,
        Experiment,
        ForceSensorTable,
        Run,
        load,
        names,
        parse,
        source,
        with_values,
    )
    from palpate.bench.tip_on_path import GivenMotion, given_motion

__all__ = [
    "COLUMNS",
    "Bench",
    "DesiredForce",
    "Experiment",
    "ForceSensorTable",
    "GivenMotion",
    "Loop",
    "Run",
    "Vec3",
    "build",
    "given_motion",
    "kernel",
    "law",
    "load",
    "march",
    "names",
    "parse",
    "part",
    "source",
    "start_at",
    "summarise",
    "with_values",
]

_HOMES = {
    "force_input": ("COLUMNS",),
    "._jit": ("kernel", "law", "part"),
    "._vector": ("Vec3",),
    "bench": ("Bench",),
    "from_experiment": ("build",),
    "tip_on_path": ("GivenMotion", "given_motion"),
    "plant": ("Loop", "march", "start_at"),
    "summary": ("summarise",),
    "tables": (
        "Experiment",
        "ForceSensorTable",
        "load",
        "names",
        "source",
        "with_values",
        "DesiredForce",
        "Run",
        "parse",
    ),
}
__getattr__ = importer(__name__, _HOMES)
