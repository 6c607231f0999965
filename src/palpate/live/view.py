"""Content of the live page: rows of these columns, and a description of their source."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, Protocol

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError

COLUMNS = (
    "t",
    "measured",
    "force",
    "desired",
    "depth",
    "K",
    "K_half",
    "B",
    "B_half",
    "K_true",
    "B_true",
    "wall",
    "phase",
    "q1",
    "q2",
    "q3",
    "q4",
    "q5",
    "q6",
    "q7",
)
"""Time [s]; measured, true and desired force [N]; depth in the surface [mm]; K [N/m] and B [N s/m], half-widths of
their 95 % intervals, and the truth; the undeformed surface [m]; phase (`bench.sequence`); joint positions [rad, m]."""
AT = {name: i for i, name in enumerate(COLUMNS)}
JOINTS = 7
"""That there is room for."""
STRIDE = 0.005
"""Time between two rows that are shown [s]."""

LONGEST = 3600.0
"""Of a simulation [s]; then it stands still."""
OVER = f"done: an hour of simulated time ({LONGEST:.0f} s) is over; reset to start again"
LEAD = 1.5
"""Before the first touch, from where it begins [s]: the long search for the surface is passed over."""


@dataclass(frozen=True)
class Slider:
    """A number that can be changed while it runs.

    Args:
        key: of the experiment, as `force.first`.
        name: what stands at it.
        unit: of the number.
        low, high: ends.
        value: at the start.
        logarithmic: equal factors are equally far apart.
        colour: of the quantity, a token.
    """

    key: str
    name: str
    unit: str
    low: float
    high: float
    value: float
    logarithmic: bool = False
    colour: str = "F"


@dataclass(frozen=True)
class Scene:
    """A serial arm and the surface before it, as they are drawn in space; everything in the base's axes [m].

    Args:
        at: origin of each joint's frame in the one before, shape (n, 3).
        turn: its axes there, shape (n, 3, 3).
        slide: whether each joint is prismatic.
        tip: in the last joint's frame.
        normal: into the surface.
        patch: corners of the surface around the tip, shape (4, 3).
    """

    at: tuple[tuple[float, ...], ...]
    turn: tuple[tuple[tuple[float, ...], ...], ...]
    slide: tuple[bool, ...]
    tip: tuple[float, ...]
    normal: tuple[float, ...]
    patch: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class View:
    """Description of the shown simulation or log.

    Args:
        title: in a few words.
        about: in a sentence.
        kind: `simulation` or `replay`.
        rate: rows a second of the data itself [Hz].
        shown: which of `COLUMNS` there are.
        sliders: what can be changed.
        stride: time between two rows [s].
        links: lengths of a planar arm [m]; empty if there is none to draw.
        scene: a serial arm in space; None if there is none to draw.
        rest: joint angles at the start [rad].
        span: of a replay's time, first and last [s].
        notes: for the reader, such as missing signals of the log.
        identified: what `palpate identify` says of a log, by parameter: text, verdict.
        position: name of the depth.
        units: of the charted columns.
    """

    title: str
    about: str
    kind: str
    rate: float
    shown: tuple[str, ...] = COLUMNS
    stride: float = STRIDE
    sliders: tuple[Slider, ...] = ()
    links: tuple[float, ...] = ()
    scene: Scene | None = None
    rest: tuple[float, ...] = ()
    span: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    identified: tuple[dict[str, str], ...] = ()
    position: str = "depth in the surface"
    units: dict[str, str] = field(default_factory=lambda: {"depth": "mm", "measured": "N"})

    def to_json(self) -> dict[str, Any]:
        """As the page takes it."""
        return {"columns": COLUMNS, **asdict(self)}

    def check(self, key: str, value: float) -> None:
        """Refuses a slider that is not there, or stands elsewhere than it can.

        Raises:
            InputError: it is one.
        """
        slider = next((one for one in self.sliders if one.key == key), None)
        if slider is None:
            raise InputError(f"there is no slider {key!r}")
        if not slider.low <= value <= slider.high:
            raise InputError(
                f"{slider.name} must be from {slider.low:g} to {slider.high:g} {slider.unit}, got {value:g}"
            )


@dataclass(frozen=True)
class Happened:
    """Something at a moment, to be marked in the charts.

    Args:
        x: when [s].
        text: what.
        tone: `fail` where it went wrong.
    """

    x: float
    text: str
    tone: str = ""


@dataclass
class State:
    """How a source stands, beside its rows.

    Args:
        values: of the sliders, by key.
        seed: of the noise; None for a replay.
        ended: why it goes no further; empty while it does.
        happened: the last few moments worth a mark.
        warning: about the running simulation; empty if there is none.
    """

    values: dict[str, float] = field(default_factory=dict)
    seed: int | None = None
    ended: str = ""
    happened: list[Happened] = field(default_factory=list)
    warning: str = ""

    _MOST = 12

    def begin(self, seed: int | None) -> None:
        """At the beginning again, with another seed if one is given.

        Raises:
            InputError: a seed below 0.
        """
        if seed is not None:
            if seed < 0:
                raise InputError(f"the seed must be 0 or above, got {seed}")
            self.seed = seed
        self.ended, self.happened, self.warning = "", [], ""

    def note(self, happened: Happened) -> None:
        """Keeps a moment, and forgets those long ago."""
        self.happened = [*self.happened, happened][-self._MOST :]


def check_ahead(here: float, time: float) -> None:
    """Refuses a moment that a simulation cannot run on to.

    Raises:
        InputError: it lies behind, or beyond the longest run.
    """
    if not here <= time <= LONGEST:
        raise InputError(
            f"a simulation runs on to {here:.3f} s at the earliest and {LONGEST:.0f} s at the latest"
        )


def planar_bones(links: tuple[float, ...], row: Array) -> Array:
    """Places of a planar arm's joints and its tip at a row [m], shape (n + 1, 3); of no links, the base alone."""
    angles = np.cumsum(row[AT["q1"] : AT["q1"] + len(links)])
    ends = np.cumsum(
        np.array(links)[:, None] * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles]), axis=0
    )
    return np.vstack([np.zeros((1, 3)), ends])


class Source(Protocol):
    """The source of rows: a simulation, or a replayed log."""

    view: View
    state: State

    @property
    def loop_asked(self) -> Any:
        """Question to `palpate.live.stability`; None without a loop."""
        ...

    def bones(self, row: Array) -> Array:
        """Places of the joints that are drawn, the base first and the tip last [m], shape (n, 3)."""
        ...

    def advance(self, seconds: float) -> Array:
        """The rows of the time to come, shape (n, len(COLUMNS)); none once it has ended."""
        ...

    def reset(self, seed: int | None = None) -> None:
        """To the beginning, with another seed if one is given."""
        ...

    def set(self, key: str, value: float) -> None:
        """Moves a slider.

        Raises:
            InputError: none of that key, or a value out of range.
        """
        ...

    def seek(self, time: float) -> None:
        """To a moment of a replay [s]; a simulation runs on to it."""
        ...
