"""Content of the live page: rows of these columns, a description of their source, and the source that plays a record.

A log or a run's record is played again at the pace at which it was taken.
"""

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
class ViewScene:
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
        quantities: name and unit of each of `K` and `B`: friction, where a tip slides.
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
    scene: ViewScene | None = None
    rest: tuple[float, ...] = ()
    span: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()
    identified: tuple[dict[str, str], ...] = ()
    position: str = "depth in the surface"
    quantities: dict[str, tuple[str, str]] = field(
        default_factory=lambda: {"K": ("Stiffness K", "N/m"), "B": ("Damping B", "N s/m")}
    )
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
class SourceState:
    """How a source stands, beside its rows.

    Args:
        values: of the sliders, by key.
        seed: of the noise; None for a replay.
        ended: why it goes no further; empty while it does.
        happened: the last few moments worth a mark.
        warning: about the running simulation; empty if there is none.
        stage: of what comes before the press, for the header; empty if there is none.
    """

    values: dict[str, float] = field(default_factory=dict)
    seed: int | None = None
    ended: str = ""
    happened: list[Happened] = field(default_factory=list)
    warning: str = ""
    stage: str = ""

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
        self.ended, self.happened, self.warning, self.stage = "", [], "", ""

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


class RowSource(Protocol):
    """The source of rows: a simulation, or a replayed log."""

    view: View
    state: SourceState

    @property
    def loop_asked(self) -> Any:
        """Question to `palpate_live.stability`; None without a loop."""
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


FEWEST = 3
"""Rows that are worth playing."""


@dataclass(frozen=True)
class ReplayedSignals:
    """The replayed columns: any of `COLUMNS`, by name, each of shape (n,), with times that grow.

    Args:
        columns: signals by name; `t` is among them.
        happened: moments to be marked.
    """

    columns: dict[str, Array]
    happened: tuple[Happened, ...] = ()

    def rows(self) -> Array:
        """One row a stride: its last, with the least and the largest measured force by turns."""
        t = self.columns["t"]
        whole = np.full((len(t), len(COLUMNS)), np.nan)
        for name, values in self.columns.items():
            whole[:, AT[name]] = values
        bins = np.floor((t - t[0]) / STRIDE + 1e-9).astype(np.int64)
        first = np.flatnonzero(np.diff(bins, prepend=-1))
        last = np.append(first[1:], len(t)) - 1
        rows = whole[last]
        measured = np.nan_to_num(whole[:, AT["measured"]], nan=-np.inf)
        highest = np.maximum.reduceat(measured, first)
        lowest = np.minimum.reduceat(np.nan_to_num(whole[:, AT["measured"]], nan=np.inf), first)
        turn = np.where(np.arange(len(rows)) % 2 == 0, highest, lowest)
        rows[:, AT["measured"]] = np.where(np.isfinite(turn), turn, np.nan)
        return rows


class Replay:
    """Signals played again.

    Args:
        view: of them; its span is set here.
        signals: at least three rows.
        first: when it begins [s]; at its first row if none is given.

    Raises:
        InputError: too few rows, or times that do not grow.
    """

    def __init__(self, view: View, signals: ReplayedSignals, first: float | None = None):
        t = signals.columns["t"]
        if len(t) < FEWEST:
            raise InputError(f"there is nothing to show: {len(t)} rows")
        if not (np.diff(t) > 0).all():
            raise InputError(
                "the times of the log do not grow from row to row; mend the log, or name its clock"
            )
        self._rows = signals.rows()
        self._times = self._rows[:, AT["t"]]
        self._all = signals.happened
        there = tuple(name for name in COLUMNS if np.isfinite(self._rows[:, AT[name]]).any())
        self.view = View(**{**vars(view), "shown": there, "span": (float(t[0]), float(t[-1]))})
        self.state = SourceState()
        self._first = float(t[0]) if first is None else first
        self._now, self._at = self._first, 0

    @property
    def loop_asked(self) -> None:
        """A log has no loop."""
        return

    def bones(self, row: Array) -> Array:
        """Positions of the joints, see `Source`."""
        return planar_bones(self.view.links, row)

    def reset(self, seed: int | None = None) -> None:
        """To the beginning; a log has no noise to draw again."""
        assert self.view.span is not None
        self.seek(max(self._first, self.view.span[0]))

    def advance(self, seconds: float) -> Array:
        """The rows of the time to come."""
        if self.state.ended:
            return np.empty((0, len(COLUMNS)))
        self._now += seconds
        stop = int(np.searchsorted(self._times, self._now, side="right"))
        rows, self._at = self._rows[self._at : stop], max(stop, self._at)
        for one in self._all:
            if len(rows) and rows[0, 0] <= one.x <= rows[-1, 0] + STRIDE:
                self.state.note(one)
        if self._at >= len(self._rows):
            self.state.ended = "done: the log ends here"
        return rows

    def set(self, key: str, value: float) -> None:
        """Refused: a recording cannot change.

        Raises:
            InputError: always.
        """
        raise InputError("a replayed log has nothing to change")

    def seek(self, time: float) -> None:
        """To a moment; the seconds before it come at once, so that there is something to see.

        Raises:
            InputError: it is no time of the log.
        """
        assert self.view.span is not None
        first, last = self.view.span
        if not first <= time <= last:
            raise InputError(f"the log spans {first:.6g} to {last:.6g} s, got {time:.6g}")
        self._now = time
        self._at = int(np.searchsorted(self._times, time - 10.0, side="left"))
        self.state.ended, self.state.happened = "", []
