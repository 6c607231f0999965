"""A simulation that runs as long as somebody watches: its sliders, its rows, and the arm that the page draws."""

from typing import Any

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.force.gains import Gains
from palpate.live.view import AT, COLUMNS, MAX_JOINTS, STRIDE, Scene, Slider, SourceState, View
from palpate.press.setting import Place
from palpate.robots.serial.serial_arm import SerialArm
from palpate.text import printable

LONGEST = 3600.0
"""Simulated time after which a simulation ends [s]."""
OVER = f"done: an hour of simulated time ({LONGEST:.0f} s) is over; reset to start again"
_PATCH = 0.12
"""Half the side of the drawn surface [m]."""


class LiveSource:
    """Simulation that the player advances; a subclass has `advance`, `reset` and `_apply`.

    Args:
        view: description of the simulation.
        seed: of the noise.

    Raises:
        InputError: a seed below 0.
    """

    def __init__(self, view: View, seed: int):
        self.view, self.state = view, SourceState({slider.key: slider.value for slider in view.sliders})
        self.state.restart(seed)

    def reset(self, seed: int | None = None) -> None:
        """Return to the beginning, with another seed if one is given; the sliders stay.

        Raises:
            InputError: a seed below 0.
        """
        raise NotImplementedError

    def advance(self, seconds: float) -> Array:
        """Rows of the next seconds, shape (n, len(COLUMNS)); none after the end."""
        raise NotImplementedError

    def set(self, key: str, value: float) -> None:
        """Move a slider.

        Raises:
            InputError: an unknown slider, or a value that is out of range or refused.
        """
        self.view.check(key, value)
        before = self.state.values[key]
        if value == before:
            return
        self.state.values[key] = value
        try:
            self._apply(key)
        except InputError:
            self.state.values[key] = before
            raise

    def _apply(self, key: str) -> None:
        """Use the new value of a slider."""
        raise NotImplementedError


class ShownArm(LiveSource):
    """Simulation of a serial arm; a subclass has `_tick`, `_values` and `_joints`.

    Args:
        arm: the arm.
        place: configuration before the surface.
        gains: of its force loop.
        sliders: of the page.
        law: name of the control law.
        seed: of the noise.
        more: further fields of the view.

    Raises:
        InputError: an arm of more joints than are drawn, or a seed below 0.
    """

    # More than seven arguments: those of an arm and those of its page.
    def __init__(
        self,
        arm: SerialArm,
        place: Place,
        gains: Gains,
        sliders: tuple[Slider, ...],
        law: str,
        seed: int,
        **more: Any,
    ):
        if arm.joints > MAX_JOINTS:
            raise InputError(f"{arm.title} has {arm.joints} joints; at most {MAX_JOINTS} are drawn")
        self._arm, self._place, self._gains = arm, place, gains
        self._ticks_per_row = max(1, round(STRIDE * gains.arm.rate))
        view = View(
            title=printable(arm.title), about=printable(f"{gains.arm.title}; {law}"), rate=float(gains.arm.rate),
            stride=self._ticks_per_row * gains.arm.tick, sliders=sliders, rest=tuple(map(float, place.q)),
            scene=scene_of(arm, place), **more,
        )  # fmt: skip
        super().__init__(view, seed)
        self._restart_clock()

    @property
    def _now(self) -> float:
        """Time of the simulation since its start [s]."""
        return self._count * self._gains.arm.tick

    def _restart_clock(self) -> None:
        self._count, self._due, self._show_highest = 0, 0.0, True

    def advance(self, seconds: float) -> Array:
        """Rows of the next seconds; the measured force is by turns the highest and the lowest since the last row."""
        self._due += seconds
        last_tick = self._due * self._gains.arm.rate + 1e-6
        rows: list[Array] = []
        while not self.state.ended and self._count + self._ticks_per_row <= last_tick:
            readings: list[float] = []
            while len(readings) < self._ticks_per_row and not self.state.ended:
                readings.append(self._tick())
                self._count += 1
            row = self._row(max(readings) if self._show_highest else min(readings))
            self._show_highest = not self._show_highest
            if self._now >= LONGEST:
                self.state.ended = self.state.ended or OVER
            if np.isfinite(row[: AT["depth"] + 1]).all():
                rows.append(row)
        return np.array(rows).reshape(-1, len(COLUMNS))

    def _row(self, measured: float) -> Array:
        """Row of the present tick, which a record has at the time before it."""
        row = np.full(len(COLUMNS), np.nan)
        columns = {"t": self._now - self._gains.arm.tick, "measured": measured, **self._values()}
        row[[AT[name] for name in columns]] = list(columns.values())
        row[AT["q1"] : AT["q1"] + self._arm.joints] = self._joints()
        return row

    def _tick(self) -> float:
        """Run one tick; returns the force reading [N]."""
        raise NotImplementedError

    def _values(self) -> dict[str, float]:
        """Columns of the present tick, but time, measured force and joints."""
        raise NotImplementedError

    def _joints(self) -> Array:
        """Joint positions [rad, m], shape (n,)."""
        raise NotImplementedError


def scene_of(arm: SerialArm, place: Place) -> Scene:
    """The arm's joints and the surface around the tip, for the page."""
    chain = arm.chain
    tip = place.pose[:3, 3]
    centre = tip + (place.place - place.normal @ tip) * place.normal
    u, v = _PATCH * place.axes[1], _PATCH * place.axes[2]
    return Scene(
        at=_tuples(chain.at),
        turn=tuple(_tuples(axes) for axes in chain.turn),
        slide=tuple(bool(slides) for slides in chain.slide),
        tip=tuple(map(float, chain.tip)),
        normal=tuple(map(float, place.normal)),
        patch=_tuples(np.array([centre + u + v, centre + u - v, centre - u - v, centre - u + v])),
    )


def _tuples(rows: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in rows)
