"""No laboratory contradicts a number that the thesis prints, and one that did would be seen."""

from operator import attrgetter

import msgspec
import pytest

from palpate_thesis.laboratory import BENCH, FILES, Laboratory, load_laboratory
from palpate_thesis.printed_facts import PrintedFact, contradictions, printed_facts, subjects


@pytest.mark.parametrize("name", ["bench", *FILES.names()])
def test_no_shipped_laboratory_contradicts_a_printed_number(name: str):
    assert contradictions(load_laboratory(name)) == []


@pytest.mark.parametrize(
    ("of", "told"),
    [
        ({"friction": 1.3, "stiction": 1.5}, "friction.static"),
        ({"wall": 0.45}, "wall.x"),
        ({"amplitude": 20.0}, "amplitude"),
        ({"beyond": 0.5}, "beyond"),
    ],
)
def test_a_laboratory_that_contradicts_a_printed_number_is_named(of: dict[str, float], told: str):
    assert all(told in line for line in contradictions(Laboratory(**of)))
    assert contradictions(Laboratory(**of))


def test_every_printed_number_is_compared_with_something_that_has_it():
    by_name = subjects(BENCH)
    for of, facts in printed_facts().items():
        for fact in facts:
            assert fact.where
            wrong = replace_printed(fact)
            values = [attrgetter(fact.path)(by_name[name]) for name in of.split(", ")]
            assert not any(map(wrong.allows, values)), fact.path


def replace_printed(fact: PrintedFact) -> PrintedFact:
    """The fact with another number: larger if equal or above, negative if a limit."""

    def other(value):
        if isinstance(value, list):
            return [other(v) for v in value]
        if isinstance(value, (bool, str)):
            return "another"
        return -1.0 if fact.rule == "at most" else value + 1000.0

    return msgspec.structs.replace(fact, printed=other(fact.printed))
