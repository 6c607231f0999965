"""On presses of a simulator that shares nothing with ours: what is called identified holds, whatever goes wrong."""

from __future__ import annotations

import numpy as np
import pytest

import palpate
from identifiers.foreign_contacts import FAULTS, press
from palpate.identifiers import ContactIdentifier
from palpate.records import Record

PARAMETERS = ("M", "B", "K")


def identified(made, **changes):
    one = ContactIdentifier(made.low_pass, made.rate, made.lag, sampling=made.sampling, **changes)
    one.update_many(made.position, made.force)
    return one


def misses(made, found):
    """By identified parameter, how many half-widths the truth is off the value."""
    verdicts = found.verdicts()
    out = {}
    for name in PARAMETERS:
        if verdicts[name] == "identified":
            i, (low, high) = found.names.index(name), made.truth[name]
            off = max(low - found.theta[i], found.theta[i] - high, 0.0)
            out[name] = off / (1.96 * found.std[i]), off / max(low, 1e-9)
    return out


@pytest.mark.parametrize("seed", [2000, *(pytest.param(n, marks=pytest.mark.long) for n in (2001, 2002))])
@pytest.mark.parametrize("fault", FAULTS)
def test_nothing_is_confidently_wrong(fault, seed):
    """Confidently wrong: off by more than a quarter, or by three half-widths and 2 %."""
    made = press(seed, fault)
    for name, (widths, share) in misses(made, identified(made).estimate()).items():
        assert share < 0.25, (name, widths)
        assert widths < 3 or share < 0.02, (name, share)


@pytest.mark.parametrize(
    "fault",
    [
        "loss of contact",
        *(
            pytest.param(f, marks=pytest.mark.long)
            for f in ("none", "dropped", "not a number", "begins in air")
        ),
    ],
)
def test_a_stiffness_is_known_all_the_same(fault):
    """Of five presses four at least, each to a tenth."""
    known = 0
    for seed in range(2010, 2015):
        made = press(seed, fault)
        found = identified(made).estimate()
        known += found.verdicts()["K"] == "identified" and 1.96 * found.std[2] < 0.1 * found.theta[2]
    assert known >= 4


@pytest.mark.parametrize(
    ("fault", "reason"), [("saturation", "it is saturated"), ("chatter", "contact is lost|not explained")]
)
def test_the_reason_of_a_refusal_is_given(fault, reason):
    found = [identified(press(seed, fault)).estimate() for seed in range(2020, 2024)]
    assert all(one.verdicts()["K"] != "identified" for one in found)
    refused = [one.rejected for one in found if one.rejected]
    assert refused
    assert all(any(part in text for part in reason.split("|")) for text in refused), refused


@pytest.mark.parametrize("fault", ["surface changes", "relaxing"])
def test_a_surface_that_is_no_spring_and_damper_has_a_width_and_not_a_refusal(fault):
    """The stiffness of the surface at the end, or that of the motion."""
    known = 0
    for seed in range(2020, 2024):
        made = press(seed, fault)
        found = identified(made).estimate()
        assert not found.rejected
        known += found.verdicts()["K"] == "identified" and misses(made, found)["K"][0] <= 1.0
    assert known >= 3


def test_a_loss_of_contact_is_found_and_so_is_the_next_touch():
    made = press(2030, "loss of contact")
    one = identified(made)
    away = made.force < np.quantile(made.force, 0.02) + 6 * made.recipe["noise"]
    begun = np.flatnonzero(np.diff(away.astype(int)) == 1)
    assert 2 <= one.contacts <= len(begun) + 1


@pytest.mark.parametrize("seed", [1, *(pytest.param(n, marks=pytest.mark.long) for n in (3, 5, 8))])
def test_stream_and_log_agree(seed):
    """Each within what both leave open."""
    made = press(seed)
    found = identified(made).estimate()
    record = Record(
        {"time": np.arange(len(made.force)) / made.rate, "position": made.position, "force": made.force},
        {"time": "s", "position": "m", "force": "N"},
    )
    log = palpate.identify(record, lag=made.lag, force_filter=made.low_pass, bonded=True).parameters
    verdicts, compared = found.verdicts(), 0
    for name in PARAMETERS:
        other = log.get(name)
        if verdicts[name] == "identified" and other is not None and other.verdict == "identified":
            i = found.names.index(name)
            both = 1.96 * np.hypot(found.std[i], other.std)
            assert abs(found.theta[i] - other.value) < 1.5 * both, name
            compared += 1
    assert compared or verdicts["K"] != "identified"
