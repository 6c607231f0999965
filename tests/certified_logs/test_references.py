"""The certified logs: closed forms, a second derivation, and the solvers' digits."""

import numpy as np
import pytest
from certify_references import certify

from palpate.certified_logs.check import REQUIRED_DIGITS, scores
from palpate.certified_logs.models import FLOATS, MODELS, log_text, motion_and_force, problems
from palpate.cli import main

KNOWN = problems()


def test_there_are_forty_logs_and_more_of_every_model():
    assert len(KNOWN) >= 40
    assert {p.model for p in KNOWN} == set(MODELS)
    assert {p.level for p in KNOWN} == {"easy", "average", "hard"}


@pytest.mark.parametrize(
    "problem",
    [pytest.param(p, id=p.name, marks=pytest.mark.long if p.law.nonlinear else ()) for p in KNOWN[::9]],
)
def test_a_certificate_is_made_again_to_its_last_digit(problem):
    assert certify(problem) == problem


@pytest.mark.parametrize("problem", KNOWN, ids=lambda p: p.name)
def test_the_certified_parameters_leave_no_gradient(problem):
    path, force = motion_and_force(problem)
    at = {name: float(c.value) for name, c in problem.certified.items()}
    columns = np.column_stack(problem.law.columns(path, at, FLOATS))
    residual = force - columns @ [at[k] for k in problem.law.linear]
    assert (
        np.abs(columns.T @ residual / (np.linalg.norm(columns, axis=0) * np.linalg.norm(residual))).max()
        < 1e-6
    )
    assert float(problem.residual_std) == pytest.approx(
        np.sqrt(residual @ residual / (len(force) - len(at))), rel=1e-9
    )


def test_a_motion_is_the_column_of_its_log():
    for problem in KNOWN:
        path, _ = motion_and_force(problem)
        column = [float(line.split(",")[1]) for line in log_text(problem.name).splitlines()[1:]]
        assert path.derivative(0, FLOATS) == pytest.approx(column, abs=6e-11)


def test_derivatives_and_the_low_pass_are_those_of_their_equations():
    path, _ = motion_and_force(KNOWN[0])
    h = 1e-6
    for order in (1, 2):
        later, earlier = (
            path._replace(time=path.time + s * h).derivative(order - 1, FLOATS) for s in (1, -1)
        )
        assert (later - earlier) / (2 * h) == pytest.approx(
            path.derivative(order, FLOATS), rel=1e-5, abs=1e-6
        )
    T, turn = 0.0031, 2 * np.pi * path.frequency
    answer = 1 / (1 + 1j * turn * T)
    y, rate = (path.derivative(k, FLOATS, 0, answer.real, answer.imag) for k in (0, 1))
    assert T * rate + y == pytest.approx(path.derivative(0, FLOATS), abs=1e-12)


@pytest.mark.parametrize("problem", KNOWN, ids=lambda p: p.name)
def test_the_search_of_identify_has_eight_digits_from_both_starts(problem):
    found = list(scores(problem, "palpate"))
    assert min(score.digits for score in found) > REQUIRED_DIGITS
    assert (
        min(score.digits_std for score in found) > REQUIRED_DIGITS - 0.5
    )  # of differences, in a sum of squares


@pytest.mark.parametrize("problem", [p for p in KNOWN if not p.starts], ids=lambda p: p.name)
def test_recursive_least_squares_has_eight_digits(problem):
    assert min(score.digits for score in scores(problem, "palpate recursive")) > REQUIRED_DIGITS


def test_the_command_exports_and_refuses(tmp_path):
    assert main(["references", "export", str(tmp_path / "logs")]) == 0
    assert len(list((tmp_path / "logs").glob("*.csv"))) == len(KNOWN)
    assert main(["references", "export", str(tmp_path / "logs")]) == 2
    assert main(["references", "export"]) == 2


@pytest.mark.parametrize("words", [["export"], ["check", "nope"]])
def test_a_folder_is_for_export_alone(words, capsys):
    assert main(["references", *words]) == 2
    assert "palpate references export FOLDER" in capsys.readouterr().err
