"""The test in simulation: an entry, an arm with a controller, on surfaces over a range of stiffness."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_type_hints

import msgspec
import numpy as np

from palpate._jit import part
from palpate.arrays import Array
from palpate.bench.toml_parts import Role, check_protocol
from palpate.benchmark.metrics import CABLE, LAYER, SWAY, SWAY_FORCE, ForcePlan, RunMetrics, run_metrics
from palpate.errors import InputError, unknown
from palpate.files import read_table, read_text
from palpate.force import load_arm
from palpate.force.ceiling import usual_force_max
from palpate.force.gains import Gains, gains_for
from palpate.force.simulated_press import pressed, surface, world_of
from palpate.plugins import is_plugin, look_in, plugin, reason

CAUTIOUS = "cautious"
"""Kind of palpate's own law, that of `palpate.force.ForceLoop`."""
CONTROLLER = Role(
    "controller", {"start": ("", "state"), "step": ("state, desired, force, position", "(speed, state)")}
)
NOISE_LEVELS = 4.0
"""Standard deviations of the noise that end the approach of the test."""


class ForceEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An entry.

    Args:
        controller: its `kind` and its numbers.
        title: of the entry; that of the controller if left out.
        arm: name of a shipped arm, or its file.
        approach: `given` lets the test approach at the speed that is safe for the arm until a reading exceeds four
            standard deviations of the noise; `own` gives the controller the free motion too.
    """

    controller: dict[str, Any]
    title: str = ""
    arm: str = "ur5e"
    approach: Literal["given", "own"] = "given"

    @property
    def kind(self) -> str:
        """Kind of the controller."""
        return str(self.controller.get("kind", ""))

    @property
    def name(self) -> str:
        """Title, or the kind of the controller."""
        return self.title or self.kind

    def gains(self, force: float) -> Gains:
        """Numbers of the arm and of the law that is tuned for it, for a desired force [N]."""
        arm = load_arm(self.arm)
        return gains_for(arm, force, force_max=usual_force_max(force, arm.sensor))

    def build(self, gains: Gains) -> Any:
        """The controller as the simulator takes it.

        Raises:
            InputError: an unknown kind, a plug-in that is no controller or refuses its numbers.
        """
        numbers = {name: value for name, value in self.controller.items() if name != "kind"}
        if is_plugin(self.kind):
            noise = gains.arm.sensor.noise if self.approach == "given" else -inf
            return ApproachThenControl(_load_controller(self.kind, numbers, gains), gains.approach, noise)
        if self.kind != CAUTIOUS:
            raise unknown("controller", self.kind, [CAUTIOUS, "module:Class"])
        if numbers:
            raise InputError(
                f"{self.kind} takes no numbers here, got {', '.join(numbers)}; it is tuned for the arm"
            )
        return gains.cautious()


@part
class ApproachThenControl(NamedTuple):
    """A controller behind an approach at a constant speed.

    Args:
        law: the controller.
        approach: speed in free motion [m/s].
        noise: standard deviation of a reading [N]; minus infinity if the controller approaches by itself.
    """

    law: Any
    approach: float
    noise: float

    def start(self):
        return 0.0, self.law.start()

    def step(self, state, desired, force, position):
        touched, inner = state
        if touched == 0.0 and force < NOISE_LEVELS * self.noise:
            return self.approach, state
        speed, inner = self.law.step(inner, desired, force, position)
        return speed, (1.0, inner)

    def stiffness_bound(self, state):
        """No bound is known of another controller."""
        return 0.0


def load_entry(name: str | Path) -> ForceEntry:
    """An entry from its file; modules are looked for beside it.

    Raises:
        InputError: no such file, an unknown key, a controller without a kind.
    """
    path = Path(name)
    entry = read_table(read_text(path, "an entry"), str(path), ForceEntry)
    look_in(path.parent)
    if not entry.kind:
        raise InputError(f'{path}: [controller] needs kind = "module:Class", or "{CAUTIOUS}"')
    arm = path.parent / entry.arm
    return msgspec.structs.replace(entry, arm=str(arm)) if arm.is_file() else entry


def _load_controller(name: str, numbers: Mapping[str, Any], gains: Gains) -> Any:
    cls = plugin(name).value()
    check_protocol(CONTROLLER, cls, name)
    part(cls)
    unknown_keys = [key for key in numbers if key not in cls._fields]
    if unknown_keys:
        raise unknown(f"key of [controller] for {name}", unknown_keys[0], cls._fields)
    numbers_by_name = {
        "tick": gains.arm.tick,
        "theta": gains.theta,
        "approach": gains.approach,
        "noise": gains.arm.sensor.noise,
        "force": gains.force,
        **numbers,
    }
    values = {key: value for key, value in numbers_by_name.items() if key in cls._fields}
    missing = [key for key in cls._fields if key not in values and key not in cls._field_defaults]
    if missing:
        raise InputError(f"{name} needs {missing[0]}; give it in [controller]")
    hints = get_type_hints(cls)
    values = {key: float(value) if hints.get(key) is float else value for key, value in values.items()}
    try:
        return cls(**values)
    except Exception as error:  # whatever the user's own code raises
        raise InputError(f"{name} refuses its numbers: {reason(error)}") from error


DAMPING_RATIO = (0.01, 1.0)
"""Range of a surface's damping ratio, of a mass of 1 kg or of the torque arm's tip."""
GAP = 0.3
"""Time from the start to the surface at the speed of the approach [s]."""


@dataclass(frozen=True)
class Surfaces:
    """Surfaces of the test.

    Args:
        low, high: ends of the range of stiffness [N/m].
        count: of stiffnesses, even in their logarithms.
        repeats: presses on each, with a damping, noise and phase of the sensor's clock of their own.
        seed: of those; the same seed gives every entry the same presses.

    Raises:
        InputError: a range that is none, no surface, no press.
    """

    low: float = 1e3
    high: float = 1e5
    count: int = 5
    repeats: int = 5
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0.0 < self.low <= self.high:
            raise InputError(f"the stiffness must be LOW:HIGH above 0, got {self.low:g}:{self.high:g}")
        for name, value in (("surfaces", self.count), ("repeats", self.repeats)):
            if not 1 <= value <= 1000:
                raise InputError(f"--{name} must be from 1 to 1000, got {value}")

    @property
    def stiffness(self) -> Array:
        """Stiffnesses [N/m], shape (count,)."""
        return np.geomspace(self.low, self.high, self.count)


@dataclass(frozen=True)
class ForceResult:
    """An entry's result.

    Args:
        name: of the entry.
        arm: in words.
        plan: of the desired force.
        surfaces: metrics of the presses on each stiffness [N/m], softest first.
    """

    name: str
    arm: str
    plan: ForcePlan
    surfaces: dict[float, tuple[RunMetrics, ...]]

    @property
    def runs(self) -> list[RunMetrics]:
        """Metrics of every press."""
        return [run for runs in self.surfaces.values() for run in runs]

    @property
    def passes(self) -> int:
        """Presses that settled, were at most 10 % over, and kept contact."""
        return sum(run.touch.passed for run in self.runs)


def press_surfaces(
    entry: ForceEntry,
    force: float,
    surfaces: Surfaces,
    show: Callable[[int, int], None] = lambda _done, _of: None,
    waiting: Callable[[], None] | None = None,
) -> ForceResult:
    """Result of an entry in simulation.

    Args:
        entry: arm and controller.
        force: F_d [N].
        surfaces: to press on.
        show: called with the number of finished presses, and of all.
        waiting: called when the loop has to be compiled first.

    Raises:
        InputError: an unknown arm or controller, a force that the arm cannot hold.
    """
    gains = entry.gains(force)
    control = entry.build(gains)
    plan = ForcePlan(force, gains.arm.rate)
    results = {}
    for k, stiffness in enumerate(surfaces.stiffness.tolist()):
        presses = []
        for i in range(surfaces.repeats):
            presses.append(
                _press(gains, control, plan, (stiffness, surfaces.high), [surfaces.seed, k, i], waiting)
            )
            show(k * surfaces.repeats + i + 1, surfaces.count * surfaces.repeats)
        results[stiffness] = tuple(presses)
    return ForceResult(entry.name, gains.arm.title, plan, results)


def _press(
    gains: Gains,
    control: Any,
    plan: ForcePlan,
    stiffness: tuple[float, float],
    seed: Sequence[int],
    waiting: Callable[[], None] | None,
) -> RunMetrics:
    """Metrics of presses on a stiffness: at rest, swaying, before the hardest of the test, and with a cable."""
    arm, (K, hardest) = gains.arm, stiffness
    rng = np.random.default_rng([*seed, 0])
    mass = arm.inner.mass if arm.kind != "position" else 1.0
    B = 2.0 * float(np.exp(rng.uniform(*np.log(DAMPING_RATIO)))) * np.sqrt(K * (mass or 1.0))
    world = world_of(arm, noise=arm.sensor.noise, phase=float(rng.uniform(0.0, 1.0 / arm.sensor.sampling)))
    gap = GAP * gains.approach
    at_rest = SWAY_FORCE * plan.force
    series = K if arm.kind == "torque" else arm.seen(K)
    rows = pressed(world, surface(K, B), control, gap, plan.desired_force(), [*seed, 1], waiting)[:, 0]
    moving, layers, cable = (
        pressed(world, surface(K, B, **others), control, gap, plan.steady(), [*seed, 2 + i], waiting)[:, 0]
        for i, others in enumerate(
            (
                {"sway": at_rest / series, "frequency": 2.0 * np.pi * SWAY},
                {"thickness": LAYER * plan.force / K, "behind": hardest - K},
                {"cable": CABLE * plan.force / gap},
            )
        )
    )
    return run_metrics(plan, rows, moving, at_rest, layers, cable)
