"""From text to SI."""

from __future__ import annotations

import pytest

from palpate.cli.options.values import quantity, shares, spread
from palpate.errors import InputError


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("15", "force", 15.0),
        ("15:N", "force", 15.0),
        ("15N", "force", 15.0),
        ("1.5e1 N", "force", 15.0),
        ("50 N s/m", "damping", 50.0),
        ("2:kN", "force", 2000.0),
        ("1.6:um", "length", 1.6e-6),
        ("100:us", "time", 1e-4),
        ("0.2:kHz", "frequency", 200.0),
        ("50:g", "mass", 0.05),
        ("-3", "force", -3.0),
        ("1e3:N/s", "force rate", 1000.0),
    ],
)
def test_a_number_with_or_without_its_unit(text, kind, value):
    assert quantity("--x", text, kind) == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "kind", "ends"),
    [
        ("3000:8000", "stiffness", (3000, 8000)),
        ("3:8:N/mm", "stiffness", (3000, 8000)),
        ("3:8N/mm", "stiffness", (3000, 8000)),
        ("1e2:1e6", "stiffness", (1e2, 1e6)),
        ("3:8:kN/m", "stiffness", (3000, 8000)),
        ("5200", "stiffness", (5200, 5200)),
        ("5.2:N/mm", "stiffness", (5200, 5200)),
        ("50:300:N s/m", "damping", (50, 300)),
        ("50:200:g", "mass", (0.05, 0.2)),
    ],
)
def test_a_range(text, kind, ends):
    assert spread("--x", text, kind) == pytest.approx(ends)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("10%", {"K": 0.1, "B": 0.1, "M": 0.1}),
        ("0.1", {"K": 0.1, "B": 0.1, "M": 0.1}),
        ("K=2%,M=25%", {"K": 0.02, "M": 0.25}),
        (" B = 5% ", {"B": 0.05}),
    ],
)
def test_shares(text, found):
    assert shares("--precision", text, ("K", "B", "M")) == pytest.approx(found)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: quantity("--force", "much", "force"), "--force needs a number"),
        (lambda: quantity("--force", "", "force"), "--force needs a number"),
        (lambda: quantity("--force", "nan", "force"), "--force needs a number"),
        (lambda: quantity("--force", "inf:N", "force"), "--force needs a number"),
        (lambda: quantity("--force", "15:mm", "force"), "unknown unit of force in --force 'mm'"),
        (lambda: quantity("--force", "15:", "force"), "unknown unit"),
        (lambda: quantity("--force", "15Nm", "force"), "unknown unit of force in --force 'Nm'"),
        (lambda: spread("--mass", "50:200:N", "mass"), "unknown unit of mass in --mass 'N'"),
        (lambda: spread("--mass", "1:2:3", "mass"), "LOW:HIGH"),
        (lambda: spread("--mass", "a:b", "mass"), "unknown unit"),
        (lambda: spread("--mass", ":", "mass"), "unknown unit"),
        (lambda: shares("--precision", "Q=5%", ("K",)), "unknown parameter in --precision 'Q'"),
        (lambda: shares("--precision", "K=", ("K",)), "--precision needs a number"),
        (lambda: shares("--precision", "%", ("K",)), "--precision needs a number"),
    ],
)
def test_what_is_wrong_is_said(ask, words):
    with pytest.raises(InputError, match=words):
        ask()
