"""Sums over lines of the cosine transform: they equal sums over rows, whatever the gaps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.identification.estimators.octaves import (
    MOST_GROUPS,
    SHORTEST,
    Segment,
    line_frequencies,
    lowest_line,
    octave_of,
    octaves_of,
    segments_of,
)

DT = 1e-3


def columns(rows, seed=0, p=3):
    return np.random.default_rng(seed).normal(size=(rows, p))


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(SHORTEST, 300), min_size=1, max_size=5), st.integers(0, 2**31))
def test_summed_over_octaves_they_are_the_products_without_each_segments_mean(lengths, seed):
    """Parseval: the transform is orthonormal, and its first line is the mean."""
    edges = np.r_[0, np.cumsum(lengths)]
    segments = [Segment(int(a), int(b), i % 2) for i, (a, b) in enumerate(zip(edges, edges[1:], strict=False))]
    own = columns(edges[-1], seed)
    found = octaves_of(own, segments, DT, lowest_line(segments, DT))
    direct = np.zeros((3, 3))
    for s in segments:
        part = own[s.first : s.last] - own[s.first : s.last].mean(axis=0)
        direct += part.T @ part
    np.testing.assert_allclose(found.total.sum(axis=0), direct, atol=1e-10 * edges[-1])
    assert found.lines.sum() == edges[-1] - len(segments)


def test_an_offset_in_each_segment_drops_out():
    segments = [Segment(0, 100, 0), Segment(100, 250, 1)]
    own = columns(250)
    moved = own + np.where(np.arange(250) < 100, 7.0, -40.0)[:, None]
    lowest = lowest_line(segments, DT)
    for one, other in zip(
        octaves_of(own, segments, DT, lowest).products, octaves_of(moved, segments, DT, lowest).products,
        strict=True,
    ):  # fmt: skip
        np.testing.assert_allclose(other, one, atol=1e-9)


def test_the_lowest_octave_has_three_lines_and_each_further_one_twice_as_many_as_before():
    count = 2**10
    frequency = line_frequencies(count, DT)
    numbers, sizes = np.unique(octave_of(frequency, frequency[0]), return_counts=True)
    np.testing.assert_array_equal(numbers, np.arange(len(sizes)))
    np.testing.assert_array_equal(sizes, [3, *(4 * 2 ** np.arange(len(sizes) - 1))])


def test_edges_of_octaves_are_frequencies_not_line_numbers():
    """A segment of half the length has half the lines in each octave, of the same frequencies."""
    long_one, short = Segment(0, 2048, 0), Segment(2048, 3072, 1)
    own = columns(3072)
    found = octaves_of(own, [long_one, short], DT, lowest_line([long_one, short], DT))
    assert found.lines[0, 1:9].tolist() == [4.0 * 2**k for k in range(8)]
    assert found.lines[1, 1:9].tolist() == [2.0 * 2**k for k in range(8)]
    assert found.lines[:, 10:].sum() == 0  # of half the sampling rate and more, there is no line


@pytest.mark.parametrize("frequency", [3.0, 11.0, 47.0, 210.0])
def test_a_cosine_is_in_the_octave_of_its_frequency(frequency):
    """Of a long segment; what leaks past its octave's neighbours is less than a hundredth of its power."""
    t = np.arange(4000) * DT
    segments = [Segment(0, 4000, 0)]
    own = octaves_of(np.cos(2 * np.pi * frequency * t)[:, None], segments, DT, lowest_line(segments, DT))
    power = own.total[:, 0, 0]
    at = int(np.argmax(power))
    assert own.frequency[at] / 2**0.5 * 0.999 <= frequency <= own.frequency[at] * 2**0.5 * 1.001
    assert power[max(at - 1, 0) : at + 2].sum() > 0.99 * power.sum()


def test_white_noise_has_its_variance_in_every_line():
    segments = [Segment(0, 20_000, 0)]
    own = octaves_of(columns(20_000, 3, 1), segments, DT, lowest_line(segments, DT))
    level = own.total[:, 0, 0] / own.lines[0]
    # A mean of n squares deviates by sqrt(2/n); four of them.
    assert (np.abs(level - 1) < 4 * np.sqrt(2 / own.lines[0])).all()


def test_rows_are_cut_at_gaps_and_at_the_ends_of_contacts():
    rows = np.r_[np.arange(10, 60), np.arange(80, 120), np.arange(120, 150)]
    spans = np.r_[np.zeros(90, int), np.ones(30, int)]
    found = segments_of(rows, spans)
    assert [(s.first, s.last, s.group) for s in found] == [(0, 50, 0), (50, 90, 0), (90, 120, 1)]


def test_rows_that_are_two_samples_apart_have_no_gap():
    assert segments_of(np.arange(0, 100, 2), np.zeros(50, int)) == [Segment(0, 50, 0)]


def test_a_piece_too_short_for_two_octaves_is_left_out():
    rows = np.r_[np.arange(0, SHORTEST - 1), np.arange(100, 100 + SHORTEST)]
    assert segments_of(rows, np.zeros(len(rows), int)) == [Segment(SHORTEST - 1, 2 * SHORTEST - 1, 0)]
    assert segments_of(np.empty(0, int), np.empty(0, int)) == []


@given(st.integers(1, 200))
@settings(max_examples=30, deadline=None)
def test_contacts_are_grouped_in_order_and_never_into_more_than_a_few(count):
    spans = np.repeat(np.arange(count) * 3, SHORTEST)
    rows = np.arange(len(spans))
    groups = [s.group for s in segments_of(rows, spans)]
    assert groups == sorted(groups)
    assert set(groups) == set(range(max(groups) + 1))
    assert max(groups) + 1 <= MOST_GROUPS


def test_some_groups_alone_are_the_sum_of_theirs():
    segments = [Segment(0, 100, 0), Segment(100, 200, 1), Segment(200, 300, 2)]
    found = octaves_of(columns(300), segments, DT, lowest_line(segments, DT))
    part = found.of_groups([0, 2])
    np.testing.assert_allclose(part.total, found.products[0] + found.products[2])
    np.testing.assert_array_equal(part.lines, found.lines[[0]] + found.lines[[2]])
