"""All evidence of an identification on the terminal."""

from rich.console import Console

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
