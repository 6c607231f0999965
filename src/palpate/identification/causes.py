"""The causes of an interval: each with its description, and with a measurement that makes it narrower."""

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple


class Cause(NamedTuple):
    """A part of a budget.

    Args:
        described: a noun phrase, as in `its uncertainty is mostly due to ...`.
        remedy: an imperative.
        kind: how it is evaluated: A by statistics of the log, B by other means (JCGM 100, 3.3.4).
    """

    described: str
    remedy: str
    kind: str = "B"


NOISE = Cause("noise", "press deeper, longer or more often; try palpate excite", "A")

_CAUSES = {
    "noise": NOISE,
    "lag": Cause("the uncalibrated lag of the force", "calibrate the lag and give it with --lag"),
    "low-pass": Cause("a low-pass of the force that may be its lag", "give it with --force-filter, or none"),
    "other forces": Cause(
        "drift, friction or relaxation beside the model",
        "let the log begin and end in free motion, and press more often",
    ),
    "time": Cause(
        "a force that changes with time, which one press cannot tell from the surface", "press more often"
    ),
    "loadings": Cause("differences between loadings", "press more often, at one speed", "A"),
    "friction": Cause("friction, or play before the position's sensor", "press and measure without play"),
    "ripple": Cause("the ripple of the force", "remove its cause: mains, vibration, interference"),
    "touch": Cause("the difference between touch and contact", "approach more slowly, and more often"),
    "octaves": Cause("the difference between frequencies", "excite a wider band (palpate excite)", "A"),
    "blocks": Cause("differences between parts of the log", "press longer, or more often, at one depth", "A"),
    "repetition": Cause("differences between parts of the log", "press more often", "A"),
    "dynamic stiffness": Cause(
        "the difference between the model and the dynamic stiffness",
        "keep the motion near one frequency and depth",
    ),
    "unexplained": Cause("a force that the model does not explain", "keep the motion near one depth"),
    "missing force": Cause(
        "a mass below zero", "compensate the tool's inertia, or measure nearer to the surface"
    ),
    "curvature": Cause("the change of the slope over the press", "press about the force that you need"),
    "within the octave": Cause(
        "the change of the stiffness with the frequency", "move at one frequency, the one that you need"
    ),
    "speed": Cause("the dependence of the force on the speed", "press more slowly"),
    "filter": Cause("a press as short as the filter's memory", "press more slowly, or log faster"),
    "unseen way": Cause(
        "a jump of the position between readings, in which the touch may lie",
        "move more slowly, log faster, or give --bonded",
    ),
    "tool's inertia": Cause(
        "the tool's own inertia", "move faster in free motion, or compensate it beforehand"
    ),
    "position noise": Cause("noise of the position", "measure the position finer, or move further"),
    "calibration": Cause("the scales of force and position", "calibrate force and position"),
    "series stiffness": Cause(
        "the compliance in series with the surface", "measure the position nearer to the surface"
    ),
    "tip's mass": Cause("the arm's mass at its tip", "measure the position nearer to the surface"),
    "tangent": Cause("the slope of the press", "press more often", "A"),
    "the indenter's law": Cause("the deviation from the indenter's law", "press less deep"),
    "surface position": Cause(
        "the position of the surface", "let the log begin in free motion, and approach slowly"
    ),
    "small strain": Cause("a strain that is not small", "press less deep"),
    "Poisson's ratio": Cause("Poisson's ratio", "give --poisson"),
    "between logs": Cause("differences between the logs", "press more often, at more places", "A"),
    "common to all logs": Cause(
        "errors common to all logs (lag, calibration, compliance in series)",
        "calibrate these; more logs do not help",
    ),
    "each log": Cause("each log's own interval", "make each log longer", "A"),
}
_CAUSE_BY_SOURCE = {"octave": "blocks", "press": "curvature"}
"""The cause of a working point's interval that has no budget, by its source."""


def cause_of(name: str | None, source: str = "") -> Cause:
    """The cause of that name in a budget; without a budget, that of a working point's source, `octave` or `press`."""
    if name is None:
        return _CAUSES[_CAUSE_BY_SOURCE[source]] if source in _CAUSE_BY_SOURCE else NOISE
    return _CAUSES.get(name, Cause(name, NOISE.remedy))


BRIEF_CONTACT = "the longest contact has"
"""How the reason begins where the probe touches, and each contact is too short."""


class Code(Enum):
    """The warnings. The value is what a user should know about it; the word is `code.word`."""

    FORCE_LAGS_POSITION = (
        "The fit gives a negative damping, which no passive surface has: the force reading lags the position reading."
        " Damping is refused. Calibrate the lag and give it with --lag."
    )
    LAG_DAMPING_CONFOUNDED = (
        "A lag of the force lowers the damping by K times the lag, and this log does not separate the two."
        " Calibrate the lag and give it with --lag, or excite the contact over a wider band. Of two channels that one"
        " converter samples without a low-pass, give --lag 0:STD with one row of the log as STD."
    )
    SERIES_COMPLIANCE = (
        "The contact is not much softer than what lies between the position sensor and the surface,"
        " so K is mostly about the arm. Measure the position nearer to the surface."
    )
    LOW_EXCITATION = "The motion is too slow, too small or too short to show the parameter above the noise."
    NONLINEAR_STIFFNESS = "The stiffness changes with the position; K is that of the middle of the motion."
    HELD_SAMPLES = "A channel is refreshed more slowly than the rows; only its fresh readings are used."
    MISSING_SAMPLES = (
        "Rows without a reading, or with a spike; short stretches are bridged, long ones left out."
    )
    IRREGULAR_TIME = "The rows are not evenly spaced in time; both channels are resampled evenly."
    SATURATED = "A channel rests at its extreme while the other moves on: it is at the end of its range."
    UNIT_GUESS = "A unit was guessed: neither you nor the file states it."
    SIGNALS_GUESSED = "Columns, units or axes were guessed: neither you nor the file states them."
    UNIT_STATED = "A unit was taken from the file's own statement, or from a column's name."
    UNIT_DOUBTFUL = "A unit is probably wrong: the press is unusual by it, or the column's name has another."
    TIME_DOUBTFUL = "The time is doubtful in this unit: it counts rows, or its rate is beyond any log's."
    COLUMNS_SWAPPED = "A column was given a role that its own name contradicts."
    LINES_SKIPPED = "Lines of the file that are not rows of its table were left out."
    FORCE_DRIFTS = "The force in free motion changes during the log; the change is removed."
    FORCE_DROPS = (
        "The force drops at once while the probe moves on: a break, or a slip; the log is read up to it."
    )
    FORCE_FLOWS = (
        "The force follows the speed and is gone at rest: what is touched flows, and has no stiffness."
    )
    FORCE_RIPPLES = "The force in free motion ripples; the ripple is removed, and what may be left counts."
    FORCE_SIGN_REVERSED = "The force falls as the probe goes in; its sign was reversed."
    POSITION_SIGN_REVERSED = "The position falls as the probe goes in; its sign was reversed."
    LOW_RATE = "Rows are so rare that fast motion may be missed, and with it damping and mass."
    NO_CONTACT = "The force never leaves its resting level for long enough: there is nothing to identify."
    CONTACT_AT_START = (
        "The log begins in contact: the force without contact is not known, and is estimated as an offset."
    )
    LOG_CUT_SHORT = "The bag is damaged or was never closed; its intact part was read."
    CLOCKS_DISAGREE = (
        "The clocks that stamped two topics differ. Aligning them leaves a lag that is not calibrated."
    )
    FRAME_GUESS = "The frame of the wrench was taken from the messages; --wrench-frame sets it."
    NORMAL_UNCERTAIN = (
        "The contact's normal was estimated from the force, and its uncertainty matters for the parameters."
    )
    TOOL_INERTIA = (
        "In free motion the force follows the acceleration, as a mass beyond the sensor makes it. A negative mass is an"
        " inertia compensated with the wrong sign, or twice. In contact a damping and a lag hide that."
    )
    PAYLOAD_DOUBTFUL = "The sensor's readings in free motion differ from the payload file's prediction."
    NEGATIVE_STIFFNESS = "The force falls as the penetration grows: no passive surface does that."

    @property
    def word(self) -> str:
        """The stable word that scripts may rely on, such as `force-lags-position`."""
        return self.name.lower().replace("_", "-")

    def __str__(self) -> str:
        return self.word


@dataclass(frozen=True)
class Warn:
    """One warning about one log: its code, and what was seen here."""

    code: Code
    text: str


def from_word(word: str) -> Code:
    """The code of a stable word."""
    return Code[word.upper().replace("-", "_")]
