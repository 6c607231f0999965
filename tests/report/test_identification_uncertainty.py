"""Uncertainty budgets on the terminal and on the page."""

import pytest
from rich.console import Console

from palpate.report.identification.details import budgets, correlation, show_budgets
from palpate.report.identification.page import page
from palpate.report.identification.words import Source
from report.outcomes import OUTCOMES


def printed(found, width=100):
    console = Console(width=width, force_terminal=False)
    with console.capture() as capture:
        show_budgets(found, console)
    return capture.get()


def test_each_number_has_a_table_whose_totals_are_its_interval():
    found = OUTCOMES["identified"]()
    own = list(budgets(found))
    numbers = [name for name, p in found.parameters.items() if p.value is not None]
    assert len(own) == 1 + len(numbers)
    text = printed(found)
    for table in own:
        assert table.title in text
        assert table.total in text
        assert all(row[0] in text for row in table.rows)
        assert table.rows == sorted(table.rows, key=lambda row: -float(row[-1].split()[0]))
    assert correlation(found) in text
    assert "r(K, B)" in correlation(found)


def test_the_page_has_the_same_tables():
    found = OUTCOMES["identified"]()
    text = page(found, Source("press.csv"))
    assert "<h2>Uncertainty budget</h2>" in text
    assert all(own.total in text for own in budgets(found))


@pytest.mark.parametrize("outcome", ["no_contact", "volts"])
def test_other_outcomes_print(outcome):
    text = printed(OUTCOMES[outcome]())
    assert text.count("ν_eff = ") == len(list(budgets(OUTCOMES[outcome]())))
    assert ("u_c" in text) == (outcome == "volts")
