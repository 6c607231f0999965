"""A run's tables: figures with as many digits as they carry, and notes on what must not be missed."""

import pytest

from bench.quick import quick
from palpate.bench import build, summarise
from palpate.identification import identify
from palpate.records import Record
from palpate.report.run.table import notes, tables


@pytest.fixture(scope="module")
def record():
    return build(quick("foam-hybrid")).run(3.0, press=1.5)


@pytest.fixture(scope="module")
def summary(record):
    return summarise(record)


@pytest.fixture(scope="module")
def found(record):
    columns = {"time": record["t"], "position": record["x_measured"], "force": record["force_sampled"]}
    return identify(Record(columns, {"time": "s", "position": "m", "force": "N"}))


def cells(table):
    return {row[0]: row[1:] for row in table.rows}


def test_the_tables_say_what_the_summary_and_the_identification_say(summary, found):
    force, surface, identified = tables(summary, found)
    assert cells(force)["desired at the end"] == ("20.00 N",)
    assert cells(force)["contact at"] == (f"{summary['contact_at_s']:.3f} s",)
    stiffness = dict(zip(identified.head[1:], cells(identified)["K [N/m]"], strict=True))
    assert stiffness["truth"] == "5200"
    own = found.parameters["K"]
    row = dict(zip(surface.head[1:], cells(surface)["K, stiffness"], strict=True))
    assert row["verdict"] == str(own.verdict)
    assert row["truth"] == "5200 N/m"
    assert "verdict" not in identified.head, "an estimator that assumes the model judges nothing"
    assert float(stiffness["thesis"]) == pytest.approx(summary["identified"]["thesis"]["K"], rel=1e-3)


NOTED = {
    "no contact": ({"end": "no contact", "why": "no surface was felt"}, "Move the wall"),
    "diverged": ({"end": "diverged", "why": "torque2 is not a finite number"}, "torque2"),
    "interrupted": ({"end": "interrupted", "why": "interrupted at 3.0 s"}, "3.0 s"),
    "losses": ({"contacts_lost": 2}, "lost 2 times"),
    "saturation": ({"saturated": {"joint1": 0.0, "joint2": 0.5, "joint3": 0.0}}, "joint2 .* 50.0 %"),
}


@pytest.mark.parametrize(("changes", "told"), NOTED.values(), ids=NOTED)
def test_what_must_not_be_missed_is_noted(summary, changes, told):
    import re

    quiet = {**summary, "saturated": dict.fromkeys(summary["saturated"], 0.0)}
    assert notes(quiet) == []
    (note,) = notes({**quiet, **changes})
    assert re.search(told, note)
