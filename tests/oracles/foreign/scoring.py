"""One log, identified: each answer against the truth."""

from __future__ import annotations

import resource
import time
import traceback
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from foreign.bound import half_widths
from foreign.logs import Cell, Log, make_log
from foreign.truth import Range, dynamic_stiffness, octave_stiffness, of_model, press_stiffness
from palpate.errors import InputError
from palpate.identification import identify
from palpate.records import Record

FAR = 0.25
"""An identified value further off than this share is confidently wrong."""
HALVES, SMALL = 3.0, 0.02
"""So is one that is off by more half-widths than this and by more than this share."""
WORKING_POINT = "working point"


@dataclass(frozen=True)
class Answer:
    """One identified parameter against its truth.

    Args:
        name: K, B, M, or another of the model's own; WORKING_POINT.
        value, low, high: of the answer, its 95 % interval.
        truth: lowest and highest true value.
        defined: whether the surface has it as one number; else the range of what a linear model may call so.
        holds: whether the interval holds the truth.
        wrong: whether it is confidently wrong.
        bound: least half-width that the log carries, where it is known.
    """

    name: str
    value: float
    low: float
    high: float
    truth: Range
    defined: bool
    holds: bool
    wrong: bool
    bound: float | None

    @property
    def half(self) -> float:
        """Half of the interval's width."""
        return (self.high - self.low) / 2


@dataclass(frozen=True)
class Score:
    """What was made of one log. The working point is an answer also where it is not called identified.

    Args:
        cell, motion, seed: what makes the log again.
        outcome: answered, refused (an input error) or crashed; text: of the error.
        answers: the identified parameters.
        known: parameters that a knowing estimator has to 5 %, which the answer should have too.
        lag_told: the lag was told.
        working: the working point was given.
        lag_given, lag_false: a lag nobody told was reported; the truth is beyond its own bound.
        lag_invented: the same where there is no lag at all.
        seconds, megabytes: what it took; the memory is the most that the worker had until then.
    """

    cell: str
    motion: str
    seed: int
    outcome: str
    text: str = ""
    model: str = ""
    contacts: int = 0
    answers: tuple[Answer, ...] = ()
    known: tuple[str, ...] = ()
    lag_told: bool = False
    working: bool = False
    lag_given: bool = False
    lag_false: bool = False
    lag_invented: bool = False
    seconds: float = 0.0
    megabytes: float = 0.0
    codes: tuple[str, ...] = field(default=())

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def record_of(log: Log) -> Record:
    """The log as `identify` takes it."""
    columns = {"time": log.time, "position": log.position, "force": log.force}
    return Record(columns, {"time": "s", "position": "m", "force": "N"})


def score(cell: Cell, seed: int) -> Score:
    """Make a log, identify it and score the answer. A crash is a score too."""
    return score_log(make_log(cell, seed))


def score_log(log: Log) -> Score:
    """Identify a log and score the answer."""
    begin = time.perf_counter()
    about = {
        "cell": str(log.cell),
        "motion": log.plan.motion,
        "seed": log.seed,
        "lag_told": "lag" in log.options,
    }
    bound = half_widths(log)
    known = tuple(n for n in bound if bound[n] <= 0.05 * log.truth[n][0])  # none below zero is a surface's
    begin = time.perf_counter()
    try:
        found = identify(record_of(log), **log.options)
    except InputError as error:
        return Score(**about, outcome="refused", text=str(error), known=known)
    except Exception:  # noqa: BLE001 - a judge has to survive what it judges
        text = traceback.format_exc(limit=-3)
        return Score(**about, outcome="crashed", text=text, known=known)
    seconds = time.perf_counter() - begin
    point = _working_point(log, found)
    given, false, invented = _lag(log, found)
    return Score(
        **about,
        outcome="answered",
        model=found.model,
        contacts=len(found.contacts),
        answers=(*_parameters(log, found, bound), *point),
        known=known,
        working=bool(point),
        lag_given=given,
        lag_false=false,
        lag_invented=invented,
        seconds=seconds,
        megabytes=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        codes=found.codes,
    )


def judge_found(log: Log, found: Any) -> list[str]:
    """What is wrong with an answer to a log: intervals that miss the truth, a false lag; one sentence each."""
    answers = (*_parameters(log, found, {}), *_working_point(log, found))
    missed = [
        f"{a.name} {a.low:.4g} .. {a.high:.4g} misses {_named(a.truth)}" for a in answers if not a.holds
    ]
    _, false, _ = _lag(log, found)
    low, high = log.lag
    return missed + ([f"lag is {_named((1e3 * low, 1e3 * high))} ms"] if false else [])


def _named(truth: Range) -> str:
    low, high = truth
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


def _parameters(log: Log, found: Any, bound: dict[str, float]) -> tuple[Answer, ...]:
    touched = log.dense.depth[log.dense.contact]
    depth = getattr(found, "depth", None) or (float(np.percentile(touched, 99)) if len(touched) else None)
    own = of_model(log.plan.surface, found.model, _untold_arm(log), depth)
    if "Fc" in own:  # the guide's friction is in it where the load is largest
        low, high = own["Fc"]
        own["Fc"] = low, high + log.plan.recording.world.friction * float(log.dense.force.max())
    answers = []
    for name, p in found.parameters.items():
        if str(p.verdict) != "identified" or p.value is None or p.ci95 is None:
            continue
        tangent = _tangent(log, found) if name == "K" else None
        if tangent is not None:
            truth, defined = tangent, log.plan.surface.linear
        elif name in own:
            truth, defined = own[name], True
        elif name in log.truth and (name == "M" or found.model != "hunt-crossley"):
            truth, defined = log.truth[name], name in log.defined
        else:
            continue
        answers.append(judged(name, p.value, p.ci95, truth, defined, bound.get(name)))
    return tuple(answers)


def _tangent(log: Log, found: Any) -> Range | None:
    """The true slope where K is said to be the press' tangent at a force; None where it is not."""
    point = getattr(found, "working_point", None)
    if point is None or str(point.source) != "press" or found.K.value != point.stiffness.value:
        return None
    return working_truth(log, "press", None, point.force_N)


def judged(
    name: str,
    value: float,
    ci95: tuple[float, float],
    truth: Range,
    defined: bool = True,
    bound: float | None = None,
) -> Answer:
    """An answer against its truth.

    Args:
        name: of the parameter.
        value: what was said.
        ci95: its 95 % interval.
        truth: lowest and highest true value.
        defined: whether it is one number.
        bound: least half-width possible.
    """
    low, high = (float(end) for end in ci95)
    miss = max(truth[0] - value, value - truth[1], 0.0)
    size = abs(truth[0] if value < truth[0] else truth[1])
    off = miss / size if size > 0 else (np.inf if miss > 0 else 0.0)
    half = (high - low) / 2
    wrong = off > FAR or (miss > HALVES * half and off > SMALL)
    return Answer(
        name, float(value), low, high, (float(truth[0]), float(truth[1])), defined, _holds((low, high), truth),
        bool(wrong), bound,
    )  # fmt: skip


def _holds(interval: tuple[float, float], truth: Range) -> bool:
    return bool(interval[0] <= truth[1] and interval[1] >= truth[0])


def _untold_arm(log: Log) -> float:
    """Stiffness in series that the options do not tell [N/m]; infinite if there is none."""
    return np.inf if "series_stiffness" in log.options else float(log.plan.recording.series)


def working_truth(log: Log, source: str, frequency: float | None, force: float) -> Range | None:
    """The true stiffness at a working point [N/m], from the press without sensors; None where it has none.

    An arm in series that is not told may be in it or not, and so may the inertia of a payload, a cable beside the
    surface and the friction of a guide.
    """
    dense, surface, arm = log.dense, log.plan.surface, _untold_arm(log)
    world = log.plan.recording.world
    inertia = 0.0
    if source == "octave" and frequency:
        own = octave_stiffness(dense, frequency)
        if surface.linear:
            own = (dynamic_stiffness(surface, frequency, 0.0, 0.0).real,) * 2
        inertia = (2 * np.pi * frequency) ** 2 * log.plan.recording.payload
    else:
        own = press_stiffness(surface, dense, force)
    if own is None:
        return None
    ends = [z - more for k in own for z in (k, k / (1 + k / arm)) for more in (0.0, inertia)]
    return min(ends) * (1 - world.friction), max(ends) * (1 + world.friction) + world.spring


def _working_point(log: Log, found: Any) -> tuple[Answer, ...]:
    point = getattr(found, "working_point", None)
    p = getattr(point, "stiffness", None)
    if p is None or p.value is None or p.ci95 is None:
        return ()
    truth = working_truth(log, str(point.source), point.frequency_Hz, point.force_N)
    if truth is None:
        return ()
    answer = judged(WORKING_POINT, p.value, p.ci95, truth)
    return (replace(answer, wrong=answer.wrong and str(p.verdict) == "identified"),)


def _lag(log: Log, found: Any) -> tuple[bool, bool, bool]:
    """Whether a lag is reported that nobody told, whether it is false by its own bound, whether there is none."""
    lag = found.lag
    if lag is None or "lag" in log.options:
        return False, False, False
    if isinstance(lag, tuple):
        value, reach, kind = lag[0], 1.96 * lag[1], "measured"
    else:
        value, reach, kind = lag.value, lag.bound, str(lag.kind)
    low, high = log.lag
    false = max(low - value, value - high, 0.0) > reach
    return kind != "prior", bool(false), bool(false and low >= 0.0 >= high)
