"""The journal: whatever happens to its end, the whole lines count, and another study's are refused."""

import errno
import os

import pytest

from palpate.errors import InputError
from palpate_studies.run_one import Row
from palpate_studies.run_study import Finished, JournalHead, open_journal, rows

YESTERDAY = (
    b'60054b54 {"title":"T","study":"study","palpate":"0.1.0","sources":"sources","runs":10,"format":1}\n'
    b'42b338d8 [4,{"a":0.4,"seed":0},"done","as asked for",[0.2,null],0.01]\n'
)
HEAD = JournalHead("T", "study", "0.1.0", "sources", 10)


def row(run):
    return Row(run, {"a": 0.1 * run, "seed": 0}, "done", "as asked for", (1.0 / (run + 1), None), 0.01)


@pytest.fixture
def path(tmp_path):
    """A journal with runs 0 to 4."""
    path = tmp_path / "runs.jsonl"
    with open_journal(path, HEAD) as book:
        for run in range(5):
            book.append(row(run))
    return path


def finished(path, head=HEAD):
    with open_journal(path, head) as book:
        return [run for run in range(head.runs) if run in book.finished]


def test_rows_come_back_bit_for_bit(path):
    assert list(rows(path)) == [row(run) for run in range(5)]
    assert finished(path) == [0, 1, 2, 3, 4]


def test_a_run_is_written_once(path):
    with open_journal(path, HEAD) as book:
        book.append(row(3))
        book.append(row(7))
        book.append(row(7))
    assert [one.run for one in rows(path)] == [0, 1, 2, 3, 4, 7]


@pytest.mark.parametrize("cut", [1, 2, 10, 60])
def test_a_torn_last_line_is_run_again(path, cut):
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    assert finished(path) == [0, 1, 2, 3]
    with open_journal(path, HEAD) as book:
        book.append(row(4))
    assert path.read_bytes() == whole


def test_a_spoiled_line_is_run_again_and_the_others_count(path):
    lines = path.read_bytes().splitlines(keepends=True)
    lines[2] = lines[2].replace(b"done", b"dome")
    path.write_bytes(b"".join(lines))
    assert finished(path) == [0, 2, 3, 4]


def test_whatever_one_byte_is_changed_to_at_most_one_run_is_lost(path):
    whole = path.read_bytes()
    start = whole.index(b"\n") + 1
    for at in range(start, len(whole), 7):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x11]) + whole[at + 1 :])
        kept = list(rows(path))
        assert len(kept) >= 3  # a line end that is gone takes both lines with it
        assert all(one == row(one.run) for one in kept)


def test_another_study_and_another_version_are_refused(path):
    for other, told in (
        (JournalHead("T", "another", "0.1.0", "sources", 10), "another study"),
        (JournalHead("T", "study", "0.2.0", "sources", 10), "another version"),
        (JournalHead("T", "study", "0.1.0", "other", 10), "another version"),
    ):
        before = path.read_bytes()
        with pytest.raises(InputError, match=told), open_journal(path, other):
            pass
        assert path.read_bytes() == before


def test_another_file_is_refused(path):
    for content in ("run,force\n0,1.0\n", "", "no line end", '{"title": "T", "palpate": "0.1.0"}\n'):
        path.write_text(content)
        with pytest.raises(InputError, match="palpate did not write it"), open_journal(path, HEAD):
            pass
        assert path.read_text() == content


def test_a_spoiled_head_is_refused_and_kept(path):
    spoiled = path.read_bytes().replace(b'"T"', b'"U"', 1)
    path.write_bytes(spoiled)
    with pytest.raises(InputError, match="no journal of a study"), open_journal(path, HEAD):
        pass
    assert path.read_bytes() == spoiled


def test_a_full_disk_leaves_whole_lines(path, monkeypatch):
    class Full:
        """A file on a disk that takes ten bytes more."""

        def __init__(self, file):
            self.file = file

        def write(self, line):
            return self.file.write(line[:10])

        def fileno(self):
            return self.file.fileno()

    before = path.read_bytes()
    with open_journal(path, HEAD) as book:
        monkeypatch.setattr(book, "_file", Full(book._file))
        with pytest.raises(InputError, match=os.strerror(errno.ENOSPC)) as refused:
            book.append(row(8))
        assert "5 runs are saved" in str(refused.value)
    assert path.read_bytes() == before


def test_what_is_finished_takes_little_memory():
    done = Finished()
    for run in (1, 0, 2, 5):
        done.add(run)
    assert [run in done for run in range(7)] == [True, True, True, False, False, True, False]
    assert len(done) == 4
    for run in (4, 3):
        done.add(run)
    assert (done.below, done.above) == (6, set())


def test_a_journal_of_yesterday_is_read(tmp_path):
    path = tmp_path / "runs.jsonl"
    path.write_bytes(YESTERDAY)
    assert finished(path) == [4]
    assert list(rows(path)) == [row(4)]
