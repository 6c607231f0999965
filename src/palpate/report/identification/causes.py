"""What an interval is made of, in words, and what to measure next to make it narrower."""

from __future__ import annotations

_CAUSES = {
    "noise": ("noise", "press deeper, longer or more often"),
    "lag": ("the lag of the force", "calibrate it and give --lag"),
    "other forces": (
        "drift, friction or relaxation beside the model",
        "let the log begin and end in the air, and press more often",
    ),
    "touch": ("that the touch and the contact give two answers", "approach slower, and more often"),
    "octaves": ("that the answer differs by frequency", "excite a wider band (palpate excite)"),
    "blocks": ("that stretches of the log differ", "press longer, or more often, about one depth"),
    "repetition": ("that two parts of the log differ", "press more often"),
    "strokes": ("that the ways in and out differ", "press more slowly, or more often"),
    "unexplained": ("force that the model leaves and that is no noise", "keep the motion near one depth"),
    "curvature": ("that the slope changes over the press", "press about the force that you need"),
    "within the octave": (
        "that it changes with the frequency",
        "move at one frequency, the one that you need",
    ),
    "speed": ("what the force has of the speed", "press more slowly"),
    "filter": ("that the press is as short as the filter's memory", "press more slowly, or log faster"),
    "unseen way": (
        "that the position jumps where no reading was taken, and the touch may lie there",
        "move more slowly, log faster, or give --bonded",
    ),
    "tool's inertia": ("the tool's own inertia", "move faster in the air, or take it out beforehand"),
    "position noise": ("noise of the position", "measure the position finer, or move further"),
    "calibration": ("the scales of force and position", "calibrate them and give --calibration"),
    "series stiffness": ("what gives way beside the surface", "measure the position nearer to the surface"),
    "tangent": ("the slope of the press", "press more often"),
    "the indenter's law": ("that the press does not follow the indenter's law", "press less deep"),
    "surface position": ("where the surface lies", "let the log begin in the air, and approach slowly"),
    "small strain": ("that the strain is not small", "press less deep"),
    "Poisson's ratio": ("Poisson's ratio", "give --poisson"),
    "between logs": ("that the logs differ", "press more often, at more places"),
    "alike in all logs": (
        "what all logs err by alike (lag, calibration, what gives way beside the surface)",
        "calibrate these; more logs do not help",
    ),
    "each log": ("each log's own interval", "make each log longer"),
}
_UNTOLD = {
    "octave": ("that stretches of the log differ", "press longer, or more often, about one depth"),
    "press": ("that the slope changes over the press", "press more often, about the force that you need"),
}
"""By where the working point's stiffness is from, if it tells no cause."""


def cause(name: str | None, source: str = "octave") -> str:
    """A cause of a budget, as the end of `what limits it is ...`."""
    if name is None:
        return _UNTOLD[source][0] if source in _UNTOLD else "noise"
    return _CAUSES[name][0] if name in _CAUSES else name


def next_step(name: str | None, source: str = "octave") -> str:
    """What to do about it."""
    if name is None:
        return _UNTOLD.get(source, _CAUSES["noise"])[1]
    return _CAUSES.get(name, _CAUSES["noise"])[1]
