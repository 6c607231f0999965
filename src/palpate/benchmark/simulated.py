"""The test in simulation: an entry on surfaces over a range of stiffness, some presses on each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.benchmark.entry import ForceEntry
from palpate.benchmark.metrics import RunMetrics, run_metrics
from palpate.benchmark.plan import CABLE, LAYER, SWAY, SWAY_FORCE, ForcePlan
from palpate.errors import InputError
from palpate.force.gains import Gains
from palpate.force.simulated_press import pressed, surface, world_of

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
