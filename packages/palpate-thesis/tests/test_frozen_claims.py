"""The thesis measured again, claim by claim, against the measurement that is kept: `make claims` takes a new one."""

import re
from dataclasses import replace

import pytest

from frozen import FEW, differences, kept, runs_of, told
from palpate.report import style
from palpate_thesis.claims import (
    CONCLUSION,
    ThesisClaim,
    experiment_sentences,
    plausible_laboratories,
    spread,
)
from palpate_thesis.figure import studies, study

FROZEN, OF_TWO_SEEDS = kept(), kept(FEW)
QUICK = ("3.7",)
ONE = ThesisClaim(
    "a.K",
    "here",
    "it holds",
    "1",
    f"1 foam {spread([4.0, 5.0, 6.0], 'N')}; 3 of 3",
    "any",
    "reproduced",
    "why",
)


def changes(measured=ONE.measured, verdict="reproduced"):
    return list(differences({ONE.id: told(ONE)}, [replace(ONE, measured=measured, verdict=verdict)]))


def test_every_study_is_kept():
    assert list(FROZEN) == [one.NUMBER for one in studies()]
    assert all(claims.keys() == FROZEN[number].keys() for number, claims in OF_TWO_SEEDS.items())


def test_the_inferred_laboratory_is_named_for_sentences_that_hold_there():
    """So that no other laboratory contradicts them: the search's 41, one that it judges otherwise, conclusions."""
    named = {sentence for sentence, name in plausible_laboratories().items() if name == "inferred"}
    verdicts = {id_: text for claims in FROZEN.values() for id_, text in claims.items()}
    reproduced = {id_ for id_, text in verdicts.items() if text.startswith("reproduced:")}
    assert named == {id_ for id_ in reproduced if id_ in experiment_sentences() or id_.startswith(CONCLUSION)}
    assert len(named & experiment_sentences()) == 42


def test_a_median_may_move_within_the_range_and_nothing_else_may():
    moved = spread([4.1, 5.9, 6.5], "N")
    assert changes() == changes(f"1 foam {moved}; 3 of 3") == []
    assert "6.1" in changes(f"1 foam {spread([5.0, 6.1, 6.2], 'N')}; 3 of 3")[0]
    assert changes(f"1 foam {spread([5.1, 5.2, 5.3], 'N')}; 3 of 3"), "the old median is not in the new range"
    assert changes(f"1 foam {moved}; 2 of 3")
    assert changes(f"1 foam {spread([4.0, 5.0, 6.0], 'kN')}; 3 of 3")
    assert changes(f"1 foam {spread([4.0, 5.0, 6.0, 5.0], 'N')}; 3 of 3")
    assert "reproduced" in changes(verdict="contradicted")[0]
    assert list(differences({}, [ONE])) == ["a.K: new"]
    assert list(differences({"b": "contradicted: 1"}, [])) == ["b: gone"]


@pytest.mark.timeout(900)  # of one run of minutes, on a machine that others use
@pytest.mark.parametrize(
    "number", [pytest.param(n, marks=() if n in QUICK else pytest.mark.long) for n in FROZEN]
)
def test_a_study_comes_to_what_it_came_to(number, tmp_path):
    """Its claims, each with all it has to say, and its figure; of two seeds, where all take long."""
    one, few = study(number), number in OF_TWO_SEEDS
    data = one.run(runs_of(number, 2 if few else 10))
    claims = one.check(data)
    assert list(differences((OF_TWO_SEEDS if few else FROZEN)[number], claims)) == []
    for claim in claims:
        assert all(claim.__dict__.values())
        assert not re.search(r"\b(nan|inf)\b", f"{claim.measured} {claim.note}")
    assert style.save(one.plot(data), tmp_path / "figure.png").stat().st_size > 10_000
