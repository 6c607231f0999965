"""`palpate certify FILE.yaml --controller ...`: what the command does with a controller of others."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from palpate.cli.toolkit import command, print_answer, print_lines
from palpate.files import MADE, write_text
from palpate_certify.controller_file import STIFFEST, certify_controller
from palpate_certify.report import lines, page

if TYPE_CHECKING:
    from palpate.cli.certify import OthersOptions, ProofOptions
    from palpate.cli.options.force import TuningOutputOptions


def certify_file(path: Path, others: OthersOptions, asked: ProofOptions, output: TuningOutputOptions) -> int:
    """Print where a controller of others is stable; 1 if it is not proved on all surfaces asked for."""
    output.check_new(output.out, ending=".yaml")
    report, delay, mass = others.page(), others.seconds, others.kilograms
    stiffest = STIFFEST if asked.surfaces is None else asked.surfaces[1]
    verdict = certify_controller(path, str(others.controller), delay, mass, stiffest, asked.longest or 0.0)
    answer, text, written = verdict.answer, verdict.text, []
    if output.out is not None and answer["corrected"] is not None:
        write_text(output.out, text if text.startswith(MADE) else f"{MADE} certify.\n{text}")
        written.append(output.out)
    if report is not None:
        write_text(report, page(verdict, path, command()))
        written.append(report)
    if output.json:
        print_answer(answer)
    else:
        print_lines(*lines(answer, written))
    proved = answer["proved"]["stiffness"]
    return 0 if proved is not None and proved[1] >= stiffest else 1
