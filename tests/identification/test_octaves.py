"""Sums over the lines of windowed blocks: what holds among rows holds among them, octave by octave."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.identification.octaves import (
    GROUPS,
    MIN_SEGMENT_ROWS,
    Segment,
    longest_length,
    split_segments,
    sum_octaves,
)
from palpate.signals.octaves import OVERLAP, TIED

DT = 1e-3


def columns(rows, seed=0, p=3):
    return np.random.default_rng(seed).normal(size=(rows, p))


def sums(own, *lengths):
    edges = np.cumsum([0, *(lengths or [len(own)])])
    segments = [Segment(int(a), int(b)) for a, b in pairwise(edges)]
    return sum_octaves(own, segments, DT, longest_length(segments))


def line(block, number):
    """Of one block by hand: without its weighted mean and slope, behind Hann's window of unit noise power."""
    n = len(block)
    t = np.arange(n)
    window = np.hanning(n + 2)[1:-1]
    window /= np.sqrt((window**2).sum() / 2)
    plain = np.column_stack([np.ones(n), t])
    root = np.sqrt(window)[:, None]
    level = plain @ np.linalg.lstsq(root * plain, root * block)[0]
    return (window * np.exp(-2j * np.pi * number * t / n)) @ (block - level)


def test_the_first_octave_is_the_whole_contact_and_the_next_its_blocks_by_hand():
    own = columns(512)
    found = sums(own)
    whole = np.stack([line(own, k) for k in (1, 2, 3, 4, 5)])
    np.testing.assert_allclose(found.total[0], np.real(whole.conj().T @ whole) / TIED, rtol=1e-9, atol=1e-9)
    assert found.all_lines[0] == pytest.approx(10 / TIED)  # real and imaginary parts
    blocks = [own[a : a + 256] for a in (0, 128, 256)]
    lines = np.concatenate([[line(block, k) for k in (3, 4, 5)] for block in blocks])
    direct = OVERLAP / TIED * np.real(lines.conj().T @ lines)
    np.testing.assert_allclose(found.total[2], direct, rtol=1e-9, atol=1e-9)
    assert found.all_lines[2] == pytest.approx(OVERLAP / TIED * 3 * 6)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(MIN_SEGMENT_ROWS, 300), min_size=1, max_size=5), st.integers(0, 2**31))
def test_a_regression_that_holds_in_every_row_holds_in_every_octave(lengths, seed):
    """A window multiplies both sides alike: f = 5 x - 2 y leaves nothing, whatever the gaps, offsets and slopes."""
    rng = np.random.default_rng(seed)
    own = rng.normal(size=(sum(lengths), 2)).cumsum(axis=0)
    number = np.repeat(np.arange(len(lengths)), lengths)
    drift = (
        rng.normal(size=len(lengths))[number] + np.arange(len(own)) * rng.normal(size=len(lengths))[number]
    )
    found = sums(np.column_stack([own, own @ [5.0, -2.0] + drift]), *lengths)
    left = np.array([5.0, -2.0, -1.0])
    size = np.einsum("oii->o", found.total)
    assert (np.abs(np.einsum("i,oij,j->o", left, found.total, left)) <= 1e-9 * size).all()


def test_white_noise_has_its_variance_in_every_line():
    found = sums(columns(40_000, 3, 1))
    level = found.total[:, 0, 0] / found.all_lines
    # A mean of n squares deviates by sqrt(2/n); Hann's window ties neighbours by 4/9 and 1/36. Four of them.
    tied = 1 + 2 * (4 / 9) * 2 / 3 + 2 / 36 / 3
    assert (np.abs(level - 1) < 4 * np.sqrt(2 * tied / found.all_lines)).all()


@pytest.mark.parametrize("octave", [1, 3, 6])
def test_a_sine_is_in_the_octave_of_its_frequency_and_leaks_into_no_other(octave):
    """But for its neighbours, at whose edges it is."""
    frequency = sums(columns(4000)).frequency[octave]
    found = sums(np.sin(2 * np.pi * frequency * np.arange(4000) * DT)[:, None])
    power = found.total[:, 0, 0] / found.all_lines
    at = int(np.argmax(power))
    assert at == octave
    far = np.delete(power, [max(at - 1, 0), at, min(at + 1, len(power) - 1)])
    assert far.max() < 1e-3 * power[at]


def test_a_short_contact_has_its_say_in_the_octave_of_its_frequency():
    """One of 108 rows beside one of 1000: an oscillation of it is in no block of 500 rows, but in its own."""
    own = 1e-3 * columns(1108, p=1)
    own[1000:, 0] += np.sin(2 * np.pi * 2 * np.arange(108) / 108)
    found = sums(own, 1000, 108)
    power = found.total[:, 0, 0]
    assert found.frequency[int(np.argmax(power))] == pytest.approx(2 / (108 * DT), rel=0.5)
    alone = sums(columns(1000))
    assert found.all_lines[0] == alone.all_lines[0]
    assert (found.all_lines[[2, 3]] > alone.all_lines[[2, 3]]).all()


def test_groups_are_stretches_of_the_log_that_sum_to_all_of_it():
    own = columns(4000)
    found = sums(own)
    assert len(found.products) == GROUPS
    np.testing.assert_allclose(found.products.sum(axis=0), found.total)
    np.testing.assert_allclose(found.lines.sum(axis=0), found.all_lines)
    assert all(group.any() for group in found.products)


def test_rows_are_cut_at_gaps_and_at_the_ends_of_contacts():
    rows = np.r_[np.arange(10, 60), np.arange(80, 120), np.arange(120, 150)]
    spans = np.r_[np.zeros(90, int), np.ones(30, int)]
    assert [(s.first, s.last) for s in split_segments(rows, spans)] == [(0, 50), (50, 90), (90, 120)]


def test_a_piece_too_short_for_a_block_is_left_out():
    rows = np.r_[np.arange(0, MIN_SEGMENT_ROWS - 1), np.arange(100, 100 + MIN_SEGMENT_ROWS)]
    assert split_segments(rows, np.zeros(len(rows), int)) == [
        Segment(MIN_SEGMENT_ROWS - 1, 2 * MIN_SEGMENT_ROWS - 1)
    ]
    assert split_segments(np.empty(0, int), np.empty(0, int)) == []
