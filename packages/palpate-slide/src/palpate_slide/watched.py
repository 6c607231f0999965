"""A slide that goes on as long as somebody watches, for the page of palpate-live; MuJoCo moves the arm's joints."""

from __future__ import annotations

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
from palpate_live.pressing import WatchedArm
from palpate_live.stability import OfArm
from palpate_live.view import AT, LONGEST, OVER, Happened, Slider
from palpate_live.view import COLUMNS as SHOWN
from palpate_slide.ground import Ground
from palpate_slide.jointed_arm import HeldTip, JointedArm, JointedSlide
from palpate_slide.world import COLUMNS

PLACE = {name: i for i, name in enumerate(COLUMNS)}
FRICTION = 1.0
"""Largest friction of the slider; above mu_max the law refutes its normal."""


class WatchedSlide(WatchedArm):
    """An arm that slides around a circle.

    Args:
        at: the arm before the surface.
        gains: with a table `slide`.
        ground: the surface.
        radius: of the circle [m].
        into: direction in which the law looks for the surface, shape (3,).
        seed: of the noise.
        tool: that is kept perpendicular; None for one that does not turn.

    Raises:
        InputError: an arm of more joints than are drawn, gains of another kind of arm.
    """

    # More than seven arguments: as of a slide, and the circle.
    def __init__(
        self, at: JointedArm, gains: Gains, ground: Ground, radius: float, into: Any, seed: int = 0,
        tool: HeldTip | None = None,
    ):  # fmt: skip
        self._tool = tool
        self._at, self._ground, self._radius, self._into = at, ground, radius, into
        self._speed, self._tick = numbers_of(gains).speed, gains.arm.tick
        self._series = gains.arm.series if gains.arm.kind == "position" else np.inf
        least, K = max(1.0, 10.0 * gains.arm.sensor.noise), ground.stiffness
        sliders = (
            Slider("force", "desired force", "N", least, 0.8 * gains.force_limit, gains.force),
            Slider("speed", "speed along the surface", "mm/s", 0.0, 1e3 * self._speed, 1e3 * self._speed),
            Slider("stiffness", "surface K", "N/m", K / 20, 20 * K, K, True, "K"),
            Slider("friction", "friction", "", 0.0, FRICTION, ground.friction),
        )  # fmt: skip
        self._touches = numbers_of(gains).touches > 0.0
        first = "three touches for the normal, then " if self._touches else ""
        super().__init__(
            at.arm, at.place, gains, sliders,
            f"{first}the law of palpate tune --slide around a circle, MuJoCo", seed,
            quantities={"K": ("Stiffness K", "N/m"), "B": ("Friction mu", "1")},
        )  # fmt: skip
        self.reset()

    @property
    def loop_asked(self) -> OfArm:
        """The loop as it now is, for `palpate_live.stability`."""
        return OfArm(self._gains, self.state.values["stiffness"], self._ground.damping)

    def reset(self, seed: int | None = None) -> None:
        """To the beginning, the sliders where they stand."""
        self.state.begin(seed)
        asked = self._at, self._gains, self._surface, self._direction, self._into, self.state.seed or 0
        self._run = JointedSlide(*asked, tool=self._tool)
        self._run.loop.desired = self.state.values["force"]
        self._k, self._angle, self._own = 0, 0.0, np.zeros(len(COLUMNS))

    def _direction(self, _: float) -> list[float]:
        share = 1e-3 * self.state.values["speed"] / self._speed
        return [share * cos(self._angle), share * sin(self._angle), 0.0]

    def advance(self, seconds: float) -> Array:
        """The rows of the time to come: one a stride."""
        rows, until = [], self._k + round(seconds / self._tick)
        while not self.state.ended and self._k + self._stride <= until:
            for _ in range(self._stride):
                if not self.state.ended:
                    self._step()
            rows.append(self._row())
        return np.array(rows).reshape(-1, len(SHOWN))

    def set(self, key: str, value: float) -> None:
        """Moves a slider.

        Raises:
            InputError: none of that key, or a value out of range.
        """
        self.view.check(key, value)
        self.state.values[key] = value
        self._run.loop.desired = self.state.values["force"]
        self._run.engine.ground = self._surface

    @property
    def _surface(self) -> Ground:
        values = self.state.values
        return self._ground._replace(
            stiffness=values["stiffness"], friction=values["friction"], sticking=values["friction"]
        )

    def _step(self) -> None:
        before = self._run.sequence.touch
        try:
            self._run.tick(self._own)
        except InputError as error:
            self.state.ended = str(error)
        self._k += 1
        now, trouble = self._k * self._tick, self._run.loop.trouble
        if self._run.sequence.touch and not before:
            self.state.note(Happened(now, "slides"))
        known = int(self._run.loop.state[TOUCHES])
        self.state.stage = f"touching, {known + 1} of {ALL:g}" if self._touches and known < ALL else ""
        self._angle += self._own[PLACE["speed"]] * self._tick / self._radius
        if trouble and trouble != self.state.warning:
            self.state.note(Happened(now, trouble.partition(":")[0], "fail"))
        self.state.warning = trouble
        if now >= LONGEST:
            self.state.ended = OVER

    def _row(self) -> Array:
        own, values, row = self._own, self.state.values, np.full(len(SHOWN), np.nan)
        slides = own[PLACE["sliding"]] == 1.0
        known: dict[str, Any] = {
            "t": (self._k - 1) * self._tick,
            "measured": own[PLACE["fx"] : PLACE["fz"] + 1] @ own[PLACE["nx"] : PLACE["nz"] + 1],
            "force": own[PLACE["normal_force"]],
            "desired": values["force"] if slides else 0.0,
            "depth": 1e3 * self._run.engine.slid.tip.depth,
            "K_true": values["stiffness"],
            "B_true": values["friction"],
            "wall": self._at.place.place,
            "phase": CONTACT if own[PLACE["normal_force"]] > 0.0 else 0.0,
        }
        if slides:
            felt, std = own[PLACE["stiffness"]], own[PLACE["stiffness_std"]]
            times = 1.0 / (1.0 - felt / self._series)  # encoders before a spring see the surface through it
            known |= {"K": felt * times, "K_half": Z_95 * std * times**2}
            known |= {"B": own[PLACE["mu"]], "B_half": Z_95 * own[PLACE["mu_std"]]}
        row[[AT[name] for name in known]] = list(known.values())
        row[AT["q1"] : AT["q1"] + self._at.arm.joints] = self._run.tip.truth.q
        return row
