"""A serial arm that slides around a circle in the browser; MuJoCo moves its joints."""

from math import cos, sin
from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.bench.summary import CONTACT
from palpate.errors import InputError
from palpate.force.gains import Gains
from palpate.force.sliding.slide_domain import numbers_of
from palpate.force.sliding.slide_state import ALL, TOUCHES
from palpate.force.sliding.sliding_loop import Z_95
from palpate.live.source import ShownArm
from palpate.live.view import Event, Slider
from palpate.slide.ground import Ground
from palpate.slide.jointed_arm import HeldTip, JointedArm, JointedSlide
from palpate.slide.world import COLUMNS

PLACE = {name: i for i, name in enumerate(COLUMNS)}
"""Index of each column of a slide."""
MAX_FRICTION = 1.0
"""End of the friction slider; above mu_max the law refutes its normal."""


class SlidingArm(ShownArm):
    """An arm that slides around a circle as long as somebody watches.

    Args:
        arm: the arm before the surface.
        gains: with a table `slide`.
        ground: the surface.
        radius: of the circle [m].
        into: direction in which the law looks for the surface, shape (3,).
        seed: of the noise.
        tool: that is kept perpendicular; None for one that does not turn.

    Raises:
        InputError: an arm of more joints than are drawn, or gains of another kind of arm.
    """

    # More than seven arguments: those of a slide, and the circle.
    def __init__(
        self, arm: JointedArm, gains: Gains, ground: Ground, radius: float, into: Any, seed: int = 0,
        tool: HeldTip | None = None,
    ):  # fmt: skip
        self._jointed, self._ground, self._radius, self._into, self._tool = arm, ground, radius, into, tool
        self._speed = numbers_of(gains).speed
        self._series = gains.arm.series if gains.arm.kind == "position" else np.inf
        self._touches = numbers_of(gains).touches > 0.0
        least, K = max(1.0, 10.0 * gains.arm.sensor.noise), ground.stiffness
        sliders = (
            Slider("force", "desired force", "N", least, 0.8 * gains.force_limit, gains.force),
            Slider("speed", "speed along the surface", "mm/s", 0.0, 1e3 * self._speed, 1e3 * self._speed),
            Slider("stiffness", "surface K", "N/m", K / 20, 20 * K, K, True, "K"),
            Slider("friction", "friction", "", 0.0, MAX_FRICTION, ground.friction),
        )  # fmt: skip
        first = "three touches for the normal, then " if self._touches else ""
        super().__init__(
            arm.arm, arm.place, gains, sliders,
            f"{first}the law of palpate tune --slide around a circle, MuJoCo", seed,
            quantities={"K": ("Stiffness K", "N/m"), "B": ("Friction mu", "1")},
        )  # fmt: skip
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Return to the beginning; the sliders stay."""
        self.state.restart(seed)
        self._restart_clock()
        self._run = JointedSlide(
            self._jointed, self._gains, self._surface, self._direction, self._into, self.state.seed,
            tool=self._tool,
        )  # fmt: skip
        self._run.loop.desired = self.state.values["force"]
        self._angle, self._row_of_slide = 0.0, np.zeros(len(COLUMNS))

    def _direction(self, _: float) -> list[float]:
        share = 1e-3 * self.state.values["speed"] / self._speed
        return [share * cos(self._angle), share * sin(self._angle), 0.0]

    def _apply(self, key: str) -> None:
        self._run.loop.desired = self.state.values["force"]
        self._run.engine.ground = self._surface

    @property
    def _surface(self) -> Ground:
        values = self.state.values
        return self._ground._replace(
            stiffness=values["stiffness"], friction=values["friction"], sticking=values["friction"]
        )

    def _tick(self) -> float:
        before, row = self._run.sequence.touch, self._row_of_slide
        try:
            self._run.tick(row)
        except InputError as error:
            self.state.ended = str(error)
        now, trouble = self._now + self._gains.arm.tick, self._run.loop.trouble
        if self._run.sequence.touch and not before:
            self.state.add_event(Event(now, "slides"))
        known = int(self._run.loop.state[TOUCHES])
        self.state.stage = f"touching, {known + 1} of {ALL:g}" if self._touches and known < ALL else ""
        self._angle += row[PLACE["speed"]] * self._gains.arm.tick / self._radius
        if trouble and trouble != self.state.warning:
            self.state.add_event(Event(now, trouble.partition(":")[0], "fail"))
        self.state.warning = trouble
        return float(row[PLACE["fx"] : PLACE["fz"] + 1] @ row[PLACE["nx"] : PLACE["nz"] + 1])

    def _values(self) -> dict[str, float]:
        row, values = self._row_of_slide, self.state.values
        slides = row[PLACE["sliding"]] == 1.0
        columns: dict[str, Any] = {
            "force": row[PLACE["normal_force"]],
            "desired": values["force"] if slides else 0.0,
            "depth": 1e3 * self._run.engine.slid.tip.depth,
            "K_true": values["stiffness"],
            "B_true": values["friction"],
            "wall": self._place.place,
            "phase": CONTACT if row[PLACE["normal_force"]] > 0.0 else 0.0,
        }
        if slides:
            stiffness, std = row[PLACE["stiffness"]], row[PLACE["stiffness_std"]]
            factor = 1.0 / (
                1.0 - stiffness / self._series
            )  # encoders before a spring see the surface through it
            columns |= {"K": stiffness * factor, "K_half": Z_95 * std * factor**2}
            columns |= {"B": row[PLACE["mu"]], "B_half": Z_95 * row[PLACE["mu_std"]]}
        return columns

    def _joints(self) -> Array:
        return self._run.tip.truth.q
