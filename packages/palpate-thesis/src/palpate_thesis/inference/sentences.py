"""The thesis' sentences about its laboratory, each with the threshold of its claim in one trial."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from operator import itemgetter, methodcaller
from typing import Any

from palpate_thesis.claims import MAJORITY, Sentence, experiment_sentences, rows
from palpate_thesis.figures import fig_4_02_04 as bench
from palpate_thesis.figures import fig_6_01_05 as squares
from palpate_thesis.figures import fig_6_06_09 as networks
from palpate_thesis.figures import fig_6_10_17 as force
from palpate_thesis.inference.trial import Trial

Result = Callable[[Trial], Any]


def _judge(result: Result, *sentences: Sentence) -> dict[str, Sentence]:
    """Sentences about a result as sentences about a trial; they do not hold where it is None, for contact was lost."""

    def on_trial(sentence: Sentence) -> Sentence:
        def holds(trial: Trial) -> bool:
            value = result(trial)
            return value is not None and sentence.holds(value)

        return replace(sentence, holds=holds)

    return {sentence.id: on_trial(sentence) for sentence in sentences}


def _press(surface: str, part: str) -> Result:
    return lambda trial: getattr(trial[surface], part, None)


def _item(name: str, index: int) -> Result:
    return lambda trial: None if trial[name] is None else trial[name][index]


def _both_clean(trial: Trial) -> bool:
    return all(trial[name] is not None and trial[name].switch.clean for name in ("foam", "rubber"))


def _slower(trial: Trial) -> bool:
    answers = {rate: trial.answer("foam", rate) for rate in networks.SMALLER}
    by_rate = {rate: [answer] for rate, answer in answers.items() if answer is not None}
    return len(by_rate) == len(answers) and networks.slower_throughout(by_rate)[0]


def _too_large(trial: Trial) -> bool:
    answer = trial.answer("foam", networks.RATES[-1])
    return answer is not None and networks.stuck(answer)


def _sticks(trial: Trial) -> bool:
    stuck, free = _item("6.11", 1)(trial), trial["unstuck"]
    return stuck is not None and free is not None and 1.0 - free.y / stuck.y >= force.PART


ON_TRIALS: Mapping[str, Sentence] = {
    **_judge(
        lambda trial: trial,
        Sentence("switch-at-5N", _both_clean, fraction=MAJORITY),
        Sentence("network-learning-rate.slower", _slower),
        Sentence("network-learning-rate.too-large", _too_large),
        Sentence("neural-free-directions.sticks", _sticks, fraction=MAJORITY),
    ),
    **_judge(
        _press("foam", "switch"), Sentence("switch-at-5N.threshold", lambda s: not s.early, fraction=1.0)
    ),
    **_judge(_press("foam", "noise"), bench.NOISE),
    **{
        id_: sentence
        for study in squares.STUDIES
        for id_, sentence in _judge(_press(study.surface, "estimates"), *study.sentences).items()
    },
    **_judge(_press("foam", "estimates"), squares.ALL_AT_ONCE),
    **_judge(methodcaller("answer", "foam"), *networks.FOAM, networks.ERROR),
    **_judge(methodcaller("answer", "rubber"), *networks.RUBBER),
    **{
        id_: sentence
        for study in force.FORCE
        for id_, sentence in _judge(itemgetter(study.NUMBER), *study.sentences).items()
    },
    **_judge(_item("6.11", 0), *force.FOAM.sentences),
    **_judge(_item("6.11", 1), *force.FREE_DIRECTIONS),
}
"""Each claim's own threshold, unchanged, on one run."""


def sentences() -> tuple[Sentence, ...]:
    """All sentences in the order of claims.toml."""
    return tuple(ON_TRIALS[id_] for id_ in rows() if id_ in experiment_sentences())


def searched(half: bool) -> tuple[Sentence, ...]:
    """Sentences that decide a search, those of the calibration half alone or all: see claims.toml."""
    among = halves()["calibration" if half else "all"]
    return tuple(s for s in among if rows()[s.id].get("searched", True))


def halves() -> dict[str, tuple[Sentence, ...]]:
    """The sentences of the calibration half, of the validation half, and all."""
    calibrating = {id_ for id_, row in rows().items() if row.get("half") == "calibration" or "states" in row}
    calibration = tuple(s for s in sentences() if s.id in calibrating)
    validation = tuple(s for s in sentences() if s.id not in calibrating)
    return {"calibration": calibration, "validation": validation, "all": sentences()}


def true_ids(trial: Trial, among: Iterable[Sentence]) -> tuple[str, ...]:
    """Names of the sentences that hold in a trial."""
    return tuple(s.id for s in among if s.holds(trial))
