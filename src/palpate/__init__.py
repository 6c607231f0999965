"""palpate: identify the surface that a robot touches, and press on it with exactly the desired force.

The first three lines:

    import palpate
    found = palpate.identify("press.csv", time="time_s", position="position_mm:mm", force="force_N:N")
    print(found.K)

A log is a file, a DataFrame, an Arrow table, or a `Record` by `palpate.read_log`; `palpate.pool` takes many. A result
is printed, shown by a notebook, drawn (`.plot()`), written as a page (`.report("press.html")`) and compared (`==`). A
fault in a file or a number is an `InputError`, in one line. Numbers are in SI units; a column's own unit follows its
name, as `position_mm:mm`.

The rooms, each `palpate.ROOM`:

    identification  from a record to stiffness, damping and mass, with intervals and verdicts
    identifiers     the same on line, sample by sample: RecursiveLeastSquares, ContactIdentifier, ...
    logs            files in and out: text, Parquet, MATLAB, ROS bags, MCAP
    contact_frame   an arm's wrench and pose along the contact's normal; weighing a tool
    maps            a surface's stiffness from presses at places, and where to press next
    force           a force loop for any arm: tune, certify, ForceLoop
    wires           force loops on real arms: UR, Franka, ROS 2
    robots          kinematics and dynamics: Planar3R, SerialArm.named("ur5e")
    press           any serial arm presses on a surface, in simulation
    bench           the thesis' closed loop: arm, sensors, surface, controller, identifier
    controllers     of force and motion
    environments    surfaces: Kelvin-Voigt, Hunt-Crossley, standard linear solid
    instruments     encoders, force sensors, filters, each with its lag
    report          figures, tables, pages

Names and rooms are imported when they are first used, so that `import palpate` costs next to nothing. The same from
a shell: `palpate --help`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from palpate import lazy

if TYPE_CHECKING:
    from palpate.calls import identify, identify_friction, identify_log, pool, read_log
    from palpate.errors import InputError, PalpateError
    from palpate.identification import Identification
    from palpate.records import Record

_ROOMS = (
    "bench",
    "contact_frame",
    "controllers",
    "environments",
    "force",
    "identification",
    "identifiers",
    "instruments",
    "logs",
    "maps",
    "press",
    "report",
    "robots",
    "wires",
)

__all__ = [
    "Identification",
    "InputError",
    "PalpateError",
    "Record",
    "identify",
    "identify_friction",
    "identify_log",
    "pool",
    "read_log",
]


lazy.report = lambda: import_module("palpate.report.values")


_HOMES = {
    "calls": ("identify", "identify_friction", "identify_log", "pool", "read_log"),
    "errors": ("InputError", "PalpateError"),
    "identification": ("Identification",),
    "records": ("Record",),
}
_import_name = lazy.importer(__name__, _HOMES)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("palpate")
    return import_module(f"palpate.{name}") if name in _ROOMS else _import_name(name)


def __dir__() -> list[str]:
    return sorted([*__all__, *_ROOMS, "__version__"])
