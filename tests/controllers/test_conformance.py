"""What is true of every controller that an experiment can ask for: found, not listed."""

import msgspec
import pytest

from bench.quick import quick
from palpate.bench import build, with_values
from palpate.controllers import ControllerTable
from palpate.signals.types import example, kinds
from palpate.testing import controllers as laws
from palpate.testing.check import TICK, WALL

each = pytest.mark.parametrize(
    "table", [example(kind) for kind in kinds(ControllerTable)], ids=lambda t: t.__struct_config__.tag
)


@each
@pytest.mark.parametrize("law", laws.IN_PLAIN, ids=lambda law: law.__name__)
def test_it_obeys_the_laws_that_users_run_on_theirs(table, law):
    law(table.build(TICK, WALL))


@pytest.mark.long
@each
@pytest.mark.parametrize("law", laws.LAWS[len(laws.IN_PLAIN) :], ids=lambda law: law.__name__)
def test_it_obeys_those_that_compile_it(table, law):
    law(table.build(TICK, WALL))


@each
def test_an_experiment_may_ask_for_it(table):
    asked = {"controller": {"kind": table.__struct_config__.tag, **msgspec.to_builtins(table)}}
    record = build(with_values(quick("foam-hybrid"), asked)).run(0.002, compiled=False)
    assert len(record) == 2
