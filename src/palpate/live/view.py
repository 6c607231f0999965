"""Simulations that run as long as somebody watches: what the page draws, the columns of its rows, and their state."""

from dataclasses import asdict, dataclass, field
from typing import Any

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
"""Index of each column."""
MAX_JOINTS = 7
"""Number of joint columns."""
STRIDE = 0.005
"""Time between two rows that are shown [s]."""
LONGEST = 3600.0
"""Simulated time after which a simulation ends [s]."""
OVER = f"done: an hour of simulated time ({LONGEST:.0f} s) is over; reset to start again"
MAX_EVENTS = 12
"""Number of most recent events that the charts mark."""


@dataclass(frozen=True)
class Slider:
    """A number that the user may change during the run.

    Args:
        key: name in a request, such as `force.first`.
        name: label on the page.
        unit: of the number.
        low, high: range.
        value: at the start.
        logarithmic: True if equal factors are equal distances.
        colour: name of the quantity's colour.
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
    """A serial arm and the surface before it, in the axes of the base [m].

    Args:
        at: origin of each joint's frame in the one before, shape (n, 3).
        turn: axes of each joint's frame in the one before, shape (n, 3, 3).
        slide: True for each prismatic joint.
        tip: position in the last joint's frame.
        normal: direction into the surface.
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
    """Description of a simulation.

    Args:
        title: name in a few words.
        about: description in a sentence.
        rate: ticks per second of the simulation [Hz].
        stride: time between two rows [s].
        sliders: numbers that may be changed.
        links: lengths of a planar arm [m]; empty for a serial arm.
        scene: a serial arm in space; None for a planar arm.
        rest: joint positions at the start [rad, m].
        notes: sentences for the reader.
    """

    title: str
    about: str
    rate: float
    stride: float = STRIDE
    sliders: tuple[Slider, ...] = ()
    links: tuple[float, ...] = ()
    scene: Scene | None = None
    rest: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values for the page."""
        return {"columns": COLUMNS, **asdict(self)}

    def check(self, key: str, value: float) -> None:
        """Check the name and the value of a slider.

        Raises:
            InputError: an unknown slider, or a value out of range.
        """
        slider = next((s for s in self.sliders if s.key == key), None)
        if slider is None:
            raise InputError(f"there is no slider {key!r}")
        if not slider.low <= value <= slider.high:
            raise InputError(
                f"{slider.name} must be from {slider.low:g} to {slider.high:g} {slider.unit}, got {value:g}"
            )


@dataclass(frozen=True)
class Event:
    """A moment that the charts mark.

    Args:
        x: time [s].
        text: label.
        tone: `fail` for a failure.
    """

    x: float
    text: str
    tone: str = ""


@dataclass
class SourceState:
    """State of a simulation, beside its rows.

    Args:
        values: of the sliders, by key.
        seed: of the noise.
        ended: reason of the end; empty while the simulation runs.
        events: the most recent events.
        warning: about the running simulation; may be empty.
    """

    values: dict[str, float] = field(default_factory=dict)
    seed: int = 0
    ended: str = ""
    events: list[Event] = field(default_factory=list)
    warning: str = ""

    def restart(self, seed: int | None) -> None:
        """Clear everything but the sliders, and take another seed if one is given.

        Raises:
            InputError: a seed below 0.
        """
        if seed is not None:
            if seed < 0:
                raise InputError(f"the seed must be 0 or above, got {seed}")
            self.seed = seed
        self.ended, self.events, self.warning = "", [], ""

    def add_event(self, event: Event) -> None:
        """Add an event, and drop the oldest."""
        self.events = [*self.events, event][-MAX_EVENTS:]


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
