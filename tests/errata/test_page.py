"""The page and its tests stay in step."""

import pytest

from errata.page import COLUMNS, PAGE, VERDICTS, calls, fails, holds, rows


def test_each_row_has_a_test_and_each_test_a_row():
    assert {row.id for row in rows()} == set(calls())


def test_ids_count_without_gaps_in_the_page_s_order():
    assert [row.id for row in rows()] == [f"E{i}" for i in range(1, len(rows()) + 1)]


def test_rows_are_whole_and_verdicts_are_known_words():
    for row in rows():
        assert all(row), row
        assert row.verdict in VERDICTS, row


def test_every_table_has_the_same_columns():
    headers = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| id")]
    assert set(headers) == {"| " + " | ".join(COLUMNS) + " |"}


def test_what_is_wrong_is_seen_to_fail_and_what_is_right_to_hold():
    called = calls()
    for row in rows():
        needed = {"right": {"holds"}, "undecided": {"holds"}}.get(row.verdict, {"holds", "fails"})
        assert needed <= called[row.id], f"{row.id} must call {sorted(needed)}"


def test_the_two_words_can_say_no():
    with pytest.raises(AssertionError, match="exceeds the tolerance"):
        holds([0.0, -2.0], 1.0)
    with pytest.raises(AssertionError, match="does not reach the margin"):
        fails([0.0, -0.5], 1.0)
