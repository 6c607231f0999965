"""An experiment: one TOML file with every number of a run, read and checked at the edge."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

import msgspec
from msgspec import Meta

from palpate.bench.toml_parts import ROLES, TomlFiles, convert_table, not_finite, plugin_table
from palpate.controllers import ControllerTable, HybridController
from palpate.environments import SurfaceTable
from palpate.errors import InputError, PluginError
from palpate.files import read_toml
from palpate.identifiers import IdentifierTable
from palpate.plugins import is_plugin, look_in
from palpate.signals.types import (
    NotNegative,
    NotNegativeTriple,
    Positive,
    PositiveTriple,
    Table,
    Triple,
    any_of,
    example,
    kinds,
)

if TYPE_CHECKING:
    AnyController: TypeAlias = Any  # which fields it has depends on its kind
    AnySurface: TypeAlias = Any
    AnyIdentifier: TypeAlias = Any
else:
    AnyController, AnySurface = any_of(ControllerTable), any_of(SurfaceTable)
    AnyIdentifier = any_of(IdentifierTable)


class Run(Table):
    """Duration and time step."""

    press: Positive = 6.0
    """Seconds of contact after which the run ends."""
    duration: Annotated[float, Meta(gt=0, le=3600)] = 60.0
    """Seconds after which it ends in any case."""
    losses: Annotated[int, Meta(ge=0)] = 3
    """Losses of contact after which it ends; 0 lets it go on."""
    rate: Annotated[int, Meta(ge=100, le=20000)] = 1000
    """Ticks a second."""
    steps: Annotated[int, Meta(ge=1, le=1000)] = 20
    """Steps of the physics between ticks."""


class Robot(Table):
    """The thesis' arm; its masses and lengths are those of appendix D."""

    start: Triple = (0.454, 0.0, 0.0)
    """Pose at the start: x [m], y [m], phi [rad]."""
    elbow: Literal[1, -1] = 1
    torque_limits: PositiveTriple = (16.0, 2.5, 0.6)
    rotor_inertia: NotNegativeTriple = (0.084, 0.009, 2.8e-5)
    """[kg m^2]; in the plant, not in the controller's model."""


class Friction(Table):
    """LuGre friction of the joints."""

    coulomb: PositiveTriple = (3.0, 0.25, 0.03)
    static: PositiveTriple = (3.6, 0.3, 0.036)
    stribeck: PositiveTriple = (0.01, 0.01, 0.01)
    bristle_stiffness: NotNegativeTriple = (15000.0, 1250.0, 150.0)
    bristle_damping: NotNegativeTriple = (120.0, 11.0, 0.65)
    viscous: NotNegativeTriple = (0.0, 0.0, 0.0)
    asymmetry: Annotated[float, Meta(gt=-1, lt=1)] = 0.0
    """Fraction by which both levels are higher forward and lower backward."""


class ElasticTable(Table):
    """The arm gives way along x at its tip, unseen by the encoders: stiffness [N/m], frequency [Hz], damping ratio."""

    stiffness: Positive
    frequency: Positive
    damping: NotNegative = 0.02


class Wall(Table):
    """Place of the surface, and friction of the tip along it."""

    x: float = 0.465
    side_stiffness: Positive = 5000.0
    side_damping: NotNegative = 20.0
    side_friction: NotNegative = 0.7


class Encoders(Table):
    """Counts per turn of the joints' encoders."""

    counts: PositiveTriple = (614400.0, 409600.0, 2000.0)


class ForceSensorTable(Table):
    """Noise and signal chain of the force sensor: low-pass [Hz], sampling [Hz], bits over a full scale [N]."""

    noise: NotNegative = 0.6
    """Standard deviation of a sample [N]."""
    cutoff: Positive = 120.0
    sampling: Annotated[int, Meta(ge=1)] = 480
    phase: NotNegative = 0.0
    """Time of the sensor's first tick [s], less than a period of its sampling."""
    bits: Annotated[int, Meta(ge=2, le=32)] = 12
    full_scale: Positive = 200.0
    analog_filter: bool = False
    """The 190 Hz low-pass of fig. 3.6 between sensor and controller."""
    beyond: NotNegative = 0.0
    """Mass between sensor and tip, whose inertia is read as force [kg]."""
    roughness: NotNegative = 0.0
    """Relative growth of the noise with the speed of the tip [s/m]."""


class Filters(Table):
    """The controller's own low-passes [Hz]."""

    motion: Positive = 35.0
    """Cut-off for Cartesian velocity and acceleration, and for joint 3 [Hz]."""
    force: Positive = 120.0


class ApproachTable(Table):
    """Approach to the surface: a hold [s], then steps of x [m] each period [s]; gains of the position."""

    hold: NotNegative = 5.0
    first: float = 0.456
    step: float = 0.001
    period: Positive = 1.0
    switch: Positive = 5.0
    """Force at which the contact controller takes over [N]."""
    release: float = 0.0
    """Force under which the contact is taken to be lost [N]."""
    wait: NotNegative = 1.0
    kp: NotNegative = 400.0
    kv: NotNegative = 80.0


class ChirpTable(Table):
    """A sine [N] that sweeps from a low to a high frequency [Hz] in so many seconds of contact, once."""

    low: Positive
    high: Positive
    seconds: Positive
    amplitude: float
    logarithmic: bool = False
    """The frequency grows by a constant factor per second instead of a constant difference."""


class MultisineTable(Table):
    """Sines side by side: frequencies [Hz], amplitudes [N], and phases at contact [rad]."""

    frequencies: tuple[Positive, ...]
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]


class DesiredForce(Table):
    """Steps between two forces [N] each period [s], and a sine [N], [Hz] whose clock may restart [s]."""

    first: float = 20.0
    second: float | None = None
    """Force of every other interval [N]; the first if left out."""
    period: Positive = 2.5
    amplitude: float = 0.0
    frequency: NotNegative = 0.5
    restart: NotNegative = 0.0
    chirp: ChirpTable | None = None
    multisine: MultisineTable | None = None


class CompensationTable(Table):
    """Compensation of friction by Coulomb's law with a blend through zero; none at level zero."""

    level: NotNegativeTriple = (0.0, 0.0, 0.0)
    blend: PositiveTriple = (0.002, 0.002, 0.002)


class IdentificationTable(Table):
    """The recursive least squares that watches."""

    forgetting: Annotated[float, Meta(gt=0, le=1)] = 1.0
    initial: Triple = (0.0, 0.0, 2e5)
    """M, B, K of the thesis' estimators at the start; the matched one starts from nothing."""
    covariance: Positive = 1e10
    """P(0) is this times the identity."""
    touch: Positive = 2.0
    """Filtered force from which the matched estimator listens [N]."""
    cutoff: Positive = 35.0
    """Cut-off of the matched estimator's state-variable filter [Hz]."""


class Experiment(Table, kw_only=True):
    """Every number of a run."""

    title: str
    about: str = ""
    surface: AnySurface
    run: Run = Run()
    robot: Robot = Robot()
    friction: Friction = Friction()
    elastic: ElasticTable | None = None
    wall: Wall = Wall()
    encoders: Encoders = Encoders()
    force_sensor: ForceSensorTable = ForceSensorTable()
    filters: Filters = Filters()
    approach: ApproachTable = ApproachTable()
    force: DesiredForce = DesiredForce()
    controller: AnyController = HybridController()
    compensation: CompensationTable = CompensationTable()
    identification: IdentificationTable = IdentificationTable()
    identifier: AnyIdentifier | None = None
    """One more that watches, on the channels of the matched estimator; its numbers are columns of the record."""


FILES = TomlFiles("experiment", "an", "palpate.bench", "experiments")
names, source = FILES.names, FILES.source


def load(name: str) -> Experiment:
    """An experiment by its name, or from a TOML file.

    Raises:
        InputError: no such experiment or file, TOML that does not parse, an unknown key, a value out of range.
    """
    return parse(source(name), name)


def parse(text: str, where: str) -> Experiment:
    """An experiment from TOML; `where` names the text in errors, and parts of the user's lie beside it."""
    if where.endswith(".toml"):
        look_in(Path(where).parent)
    return convert(read_toml(text, where), where)


def with_values(experiment: Experiment, changes: Mapping[str, Any]) -> Experiment:
    """The experiment with other values: {"friction.coulomb": (6.0, 0.5, 0.06), "run.press": 20.0}.

    Raises:
        InputError: a key that does not exist, or a value out of range.
    """
    tables = msgspec.to_builtins(experiment)
    for path, value in changes.items():
        *outer, key = path.split(".")
        table = tables
        for name in outer:
            if table.get(name) is None:
                table[name] = {}
            table = table[name]
        table[key] = msgspec.to_builtins(value)
    return convert(tables, ", ".join(changes))


def convert(tables: dict[str, Any], where: str) -> Experiment:
    """The tables as an experiment; `where` names them in errors.

    Raises:
        InputError: a key that does not exist, or a value out of range.
    """
    bad = not_finite(tables)
    if bad is not None:
        raise InputError(f"{where}: {bad}")
    try:
        plugin_tables = _own_parts(tables)
        stand_ins = {key: _STAND_INS[key] for key in plugin_tables}
        converted = convert_table({**tables, **stand_ins}, Experiment)
    except InputError as error:
        raise type(error)(f"{where}: {error}") from error
    return msgspec.structs.replace(converted, **plugin_tables) if plugin_tables else converted


_STAND_INS = {
    key: msgspec.to_builtins(example(kinds(base)[0]))
    for key, base in (
        ("controller", ControllerTable),
        ("surface", SurfaceTable),
        ("identifier", IdentifierTable),
    )
}
"""Tables in whose place those of the user's parts are put: their types are known only when they are named."""


def _own_parts(tables: Mapping[str, Any]) -> dict[str, Any]:
    """The tables that name a plug-in, each of the type that its part gives it."""
    plugin_tables = {}
    for key, role in ROLES.items():
        table = tables.get(key)
        if isinstance(table, dict) and is_plugin(table.get("kind")):
            try:
                kind = plugin_table(role, table["kind"])
            except InputError as error:
                raise PluginError(str(error)) from error
            holder = msgspec.defstruct("Holder", [(key, kind)])
            plugin_tables[key] = getattr(convert_table({key: table}, holder), key)
    return plugin_tables
