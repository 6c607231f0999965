"""All evidence of an identification on the terminal."""

from dataclasses import replace

from rich.console import Console

from palpate.identification.causes import Code, Warn
from palpate.report.identification.answer import build_answer
from palpate.report.identification.words import Source, full_number, sentence
from palpate.report.terminal import show_answer
from palpate.text import printable
from report.outcomes import OUTCOMES


def printed(found, name="press [1].csv"):
    console = Console(width=200, markup=False, highlight=False)
    with console.capture() as capture:
        show_answer(build_answer(found, Source(name), verbose=True), console)
    return printable(capture.get())


def test_the_sentence_is_the_first_line_and_the_working_point_follows():
    found = OUTCOMES["identified"]()
    text = " ".join(printed(found).split())
    assert text.startswith(sentence(found))
    assert text.index("press [1].csv: 1 contact: ") < text.index("limited by")
    assert full_number(found.working_point.stiffness) in text


def test_each_parameter_has_its_number_its_verdict_and_its_largest_cause():
    found = OUTCOMES["identified"]()
    lines = printed(found).splitlines()
    for name, p in found.parameters.items():
        (line,) = (own for own in lines if own.strip().startswith(f"{name} "))
        parts = [full_number(p), str(p.verdict), next(iter(p.budget))]
        assert all(part in line for part in parts), line


def test_nothing_of_a_log_is_obeyed_by_the_terminal():
    """Names and warnings may hold escape sequences and what rich takes for markup."""
    nasty = "\x1b]0;gone\x07[bold]x[red]"
    found = replace(OUTCOMES["no_contact"](), warnings=(Warn(Code.MISSING_SAMPLES, f"column {nasty}"),))
    text = printed(found, nasty)
    assert "\x1b" not in text
    assert "\x07" not in text
    assert text.count("[bold]x[red]") == 2
