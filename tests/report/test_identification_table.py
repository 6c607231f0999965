"""An identification on the terminal."""

from dataclasses import replace

from rich.console import Console

from palpate.identification.causes import Code, Warn
from palpate.report.identification.details import show
from palpate.report.identification.words import full_number, number, sentence
from palpate.units import between
from report.outcomes import OUTCOMES


def printed(found, name="press [1].csv"):
    console = Console(width=200, record=True, file=None, quiet=False, force_terminal=False)
    with console.capture() as capture:
        show(found, name, console)
    return capture.get()


def test_the_sentence_is_the_first_line_and_the_working_point_follows():
    found = OUTCOMES["identified"]()
    text = " ".join(printed(found).split())
    assert text.startswith(sentence(found))
    point = found.working_point
    assert text.index(f"working point: {full_number(point.stiffness)}") < text.index("value ± 95 %")


def test_each_parameter_has_its_number_both_intervals_its_verdict_and_its_largest_cause():
    found = OUTCOMES["identified"]()
    lines = printed(found).splitlines()
    for name, p in found.parameters.items():
        (line,) = (own for own in lines if own.startswith(f"{name} "))
        parts = [number(p) if p.value is not None else "-", p.unit, str(p.verdict), next(iter(p.budget))]
        parts += [between(*p.ci95_if_model_holds)] if p.ci95_if_model_holds else []
        assert all(part in line for part in parts), line
    assert any(p.ci95_if_model_holds for p in found.parameters.values())


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
    assert text.startswith("Nothing is touched in this log")


def test_nothing_of_a_log_is_obeyed_by_the_terminal():
    """Names and warnings may hold escape sequences and what rich takes for markup."""
    nasty = "\x1b]0;gone\x07[bold]x[/]"
    found = replace(OUTCOMES["no_contact"](), warnings=(Warn(Code.MISSING_SAMPLES, f"column {nasty}"),))
    text = printed(found, nasty)
    assert "\x1b" not in text
    assert "\x07" not in text
    assert text.count("[bold]x[/]") == 2
