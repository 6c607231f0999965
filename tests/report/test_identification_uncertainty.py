"""Uncertainty budgets on the terminal and on the page."""

import pytest

from palpate.report.identification.answer import build_answer
from palpate.report.identification.page import budget_notes, budget_tables, page
from palpate.report.identification.words import Source
from palpate.report.terminal import answer_text
from report.outcomes import OUTCOMES


def test_each_number_has_a_table_whose_totals_are_its_interval():
    found = OUTCOMES["identified"]()
    tables = budget_tables(found)
    numbers = [name for name, p in found.parameters.items() if p.value is not None]
    assert len(tables) == 1 + len(numbers)
    text = " ".join(answer_text(build_answer(found, budget=True)).split())
    for table in tables:
        assert table.title in text
        assert all(row[0] in text for row in table.rows)
        assert table.rows == sorted(table.rows, key=lambda row: -float(row[-1].split()[0]))
    assert all(note in text for note in budget_notes(found))
    assert "r(K, B)" in budget_notes(found)[0]


def test_the_page_has_the_same_tables():
    found = OUTCOMES["identified"]()
    text = page(found, Source("press.csv"))
    assert all(f"Uncertainty budget of {table.title}" in text for table in budget_tables(found))


@pytest.mark.parametrize("outcome", ["no_contact", "volts"])
def test_other_outcomes_print(outcome):
    found = OUTCOMES[outcome]()
    text = answer_text(build_answer(found, budget=True))
    assert text.count("ν_eff = ") == len(budget_tables(found))
    assert ("u_c" in text) == (outcome == "volts")
