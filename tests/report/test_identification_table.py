"""An identification on the terminal."""

from rich.console import Console

from palpate.report.identification_table import show
from palpate.report.identification_words import number
from palpate.report.numbers import between
from report.outcomes import OUTCOMES


def printed(found):
    console = Console(width=200, record=True, file=None, quiet=False, force_terminal=False)
    with console.capture() as capture:
        show(found, "press [1].csv", console)
    return capture.get()


def test_each_parameter_has_its_number_interval_and_verdict():
    found = OUTCOMES["identified"]()
    lines = printed(found).splitlines()
    for name, p in found.parameters.items():
        (line,) = (own for own in lines if own.startswith(f"{name} "))
        for part in (number(p), between(*p.ci95), p.unit, str(p.verdict)):
            assert part in line


def test_what_is_not_identified_has_its_reason_and_a_dash():
    found = OUTCOMES["not_identifiable"]()
    text = printed(found)
    assert found.parameters["M"].reason in text
    (line,) = (own for own in text.splitlines() if own.startswith("M "))
    assert line.split()[1:3] == ["-", "-"]


def test_a_log_without_contact_says_so():
    text = printed(OUTCOMES["no_contact"]())
    assert "press [1].csv: 0 contacts" in text
    assert "no-contact:" in text
