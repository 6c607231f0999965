"""The causes of an interval: each with its description, and with a measurement that makes it narrower."""

from __future__ import annotations

from typing import NamedTuple


class Cause(NamedTuple):
    """A part of a budget.

    Args:
        described: a noun phrase, as in `its uncertainty is mostly due to ...`.
        remedy: an imperative.
    """

    described: str
    remedy: str


NOISE = Cause("noise", "press deeper, longer or more often; try palpate excite")

_CAUSES = {
    "noise": NOISE,
    "lag": Cause("the uncalibrated lag of the force", "calibrate the lag and give it with --lag"),
    "other forces": Cause(
        "drift, friction or relaxation beside the model",
        "let the log begin and end in the air, and press more often",
    ),
    "touch": Cause("the difference between touch and contact", "approach more slowly, and more often"),
    "octaves": Cause("the difference between frequencies", "excite a wider band (palpate excite)"),
    "blocks": Cause("differences between parts of the log", "press longer, or more often, about one depth"),
    "repetition": Cause("differences between parts of the log", "press more often"),
    "strokes": Cause("the difference between loading and unloading", "press more slowly, or more often"),
    "unexplained": Cause("a force that the model does not explain", "keep the motion near one depth"),
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
        "the tool's own inertia", "move faster in the air, or compensate the inertia beforehand"
    ),
    "position noise": Cause("noise of the position", "measure the position finer, or move further"),
    "calibration": Cause("the scales of force and position", "calibrate force and position"),
    "series stiffness": Cause(
        "the compliance in series with the surface", "measure the position nearer to the surface"
    ),
    "tip's mass": Cause("the arm's mass at its tip", "measure the position nearer to the surface"),
    "tangent": Cause("the slope of the press", "press more often"),
    "the indenter's law": Cause("the deviation from the indenter's law", "press less deep"),
    "surface position": Cause(
        "the position of the surface", "let the log begin in the air, and approach slowly"
    ),
    "small strain": Cause("a strain that is not small", "press less deep"),
    "Poisson's ratio": Cause("Poisson's ratio", "give --poisson"),
    "between logs": Cause("differences between the logs", "press more often, at more places"),
    "common to all logs": Cause(
        "errors common to all logs (lag, calibration, compliance in series)",
        "calibrate these; more logs do not help",
    ),
    "each log": Cause("each log's own interval", "make each log longer"),
}
_UNKNOWN = {"octave": "blocks", "press": "curvature"}
"""The cause of a working point's interval that has no budget, by its source."""


def cause_of(name: str | None, source: str = "") -> Cause:
    """The cause of that name.

    Args:
        name: in a budget; None if there is no budget.
        source: of the working point, `octave` or `press`.
    """
    if name is None:
        return _CAUSES[_UNKNOWN[source]] if source in _UNKNOWN else NOISE
    return _CAUSES.get(name, Cause(name, NOISE.remedy))
