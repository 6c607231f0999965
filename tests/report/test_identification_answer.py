"""The answer of an identification: what it is, what limits it, and no more lines than are read at once."""

from __future__ import annotations

from dataclasses import replace

import pytest
from rich.console import Console

from palpate.contact_frame import ArmDynamics
from palpate.contact_frame.arm import with_arm
from palpate.identification import Code, Parameter, Verdict, Warn
from palpate.identification.indenter import Indenter, with_modulus
from palpate.report.identification.answer import show
from palpate.report.identification.words import full_number
from report.outcomes import OUTCOMES


def printed(found, name="press [1].csv", width=200, notes=(), end="all evidence: --verbose"):
    console = Console(width=width, force_terminal=True, color_system=None, highlight=False)
    with console.capture() as capture:
        show(found, name, console, notes, end)
    return [line.rstrip() for line in capture.get().splitlines()]


@pytest.mark.parametrize("name", OUTCOMES)
def test_an_answer_is_read_at_once(name):
    found = OUTCOMES[name]()
    warnings = (*found.warnings, Warn(Code.UNIT_DOUBTFUL, "mm?"), Warn(Code.SATURATED, "full"))
    for own in (found, replace(found, warnings=warnings)):
        lines = printed(own, notes=("read as --time t", "position from the joints"))
        assert len(lines) <= 14
        assert any("--verbose" in line for line in lines)


def test_each_quantity_has_one_answer():
    found = OUTCOMES["identified"]()
    lines = printed(found)
    assert (
        lines[0]
        == f"{full_number(found.working_point.stiffness)}   stiffness   ✓ identified        press [1].csv"
    )
    for name in ("K", "B", "M"):
        (row,) = (line for line in lines if line.startswith(f"{name} "))
        assert full_number(found.parameters[name]) in row
        assert "✓ identified" in row


def test_a_parameter_without_a_number_has_its_bound_its_cause_and_a_remedy():
    found = OUTCOMES["not_identifiable"]()
    (row,) = (line for line in printed(found) if line.startswith("M "))
    assert "? not identifiable" in row
    assert next(iter(found.parameters["M"].budget)) == "other forces"
    assert "drift or friction" in row


def test_a_rejected_parameter_has_a_reason_and_no_number():
    reason = "the fit gives -1800 N s/m, below zero: no passive surface does that"
    damping = Parameter(None, None, None, "N s/m", Verdict.REJECTED, reason)
    found = OUTCOMES["identified"]()
    lines = printed(replace(found, parameters={**found.parameters, "B": damping}))
    (row,) = (line for line in lines if line.startswith("B "))
    assert row.split()[1:] == ["-", "✕", "rejected"]
    assert "B: the fit gives -1800 N s/m, below zero." in lines


def test_a_stiffness_behind_the_joints_is_a_lower_bound_everywhere():
    found = with_arm(OUTCOMES["identified"](), ArmDynamics(position_from="joints"), 0.25, from_pose=True)
    lines = printed(found)
    assert "stiffness of surface and arm in series   ! lower bound of the surface" in lines[0]
    assert "give --robot-stiffness" in lines[1]
    (row,) = (line for line in lines if line.startswith("K "))
    assert "! lower bound" in row
    assert "not identifiable" not in row


def test_a_modulus_goes_first():
    found = with_modulus(OUTCOMES["not_identifiable"](), Indenter.parse("punch:5:mm"))
    lines = printed(found)
    assert "Young's modulus" in lines[0]
    assert "stiffness" in lines[2]
    assert not any(line.startswith("E ") for line in lines)
    assert next(iter(found.parameters)) == "E"


def test_nothing_of_a_log_is_obeyed_by_the_terminal():
    nasty = "\x1b]0;gone\x07[bold]x[/]"
    found = replace(OUTCOMES["no_contact"](), warnings=(Warn(Code.UNIT_DOUBTFUL, nasty),))
    text = "\n".join(printed(found, nasty, notes=(f"read as {nasty}",)))
    assert "\x1b]" not in text
    assert "\x07" not in text
    assert text.count("[bold]x[/]") == 3
