"""The closed loop: one tick is sense, think, act, move; a run is a record.

from palpate.bench import build, load
record = build(load("foam-hybrid")).run(duration=60.0, seed=1, press=8.0)

Without arm and control, a tip on a given path: `given_motion(surface).run(path)`.
"""

from palpate._jit import law, part
from palpate._vector import Vec3
from palpate.bench.bench import Bench
from palpate.bench.build import build
from palpate.bench.given_motion import GivenMotion, given_motion
from palpate.bench.plant import Loop, march, start_at
from palpate.bench.summary import summarise
from palpate.bench.tables import Experiment, ForceSensorTable, load, names, source, with_values

__all__ = [
    "Bench",
    "Experiment",
    "ForceSensorTable",
    "GivenMotion",
    "Loop",
    "Vec3",
    "build",
    "given_motion",
    "law",
    "load",
    "march",
    "names",
    "part",
    "source",
    "start_at",
    "summarise",
    "with_values",
]
