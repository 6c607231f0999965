"""The journal: whatever happens to its end, the whole lines count, and another study's are refused."""

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import palpate
from palpate.errors import InputError
from palpate.studies.journal import JournalHead, Row, open_journal
from palpate.studies.run_study import Work
from studies.small import SMALL, Formula, planned

STAMP = {"numpy": "2.2.0", "palpate/bench": "0123456789abcdef", "mine:metric": "fedcba9876543210"}
HEAD = JournalHead("T", "study", "0.1.0", STAMP, 10)


def rows(path):
    with open_journal(path, HEAD) as book:
        return list(book.rows())


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
    assert rows(path) == [row(run) for run in range(5)]
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


def test_whatever_one_byte_is_changed_to_at_most_one_run_is_lost(path):
    whole = path.read_bytes()
    start = whole.index(b"\n") + 1
    for at in range(start, len(whole), 7):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x11]) + whole[at + 1 :])
        kept = rows(path)
        assert len(kept) >= 3  # a line end that is gone takes both lines with it
        assert all(one == row(one.run) for one in kept)


CHANGED = {
    "another study": (JournalHead("T", "another", "0.1.0", STAMP, 10), "another study ('T', 10 runs)"),
    "a metric": (
        JournalHead("T", "study", "0.1.0", STAMP | {"mine:metric": "0"}, 10),
        "other sources than those here: mine:metric fedcba9876543210 (here 0);",
    ),
    "a library and a room": (
        JournalHead("T", "study", "0.1.0", STAMP | {"numpy": "2.3.1", "palpate/bench": "0"}, 10),
        "other sources than those here: numpy 2.2.0 (here 2.3.1), palpate/bench 0123456789abcdef (here 0);",
    ),
    "a room more": (
        JournalHead("T", "study", "0.1.0", STAMP | {"palpate/new": "0"}, 10),
        ": palpate/new none (here 0);",
    ),
    "version": (JournalHead("T", "study", "0.2.0", STAMP, 10), ": palpate 0.1.0 (here 0.2.0);"),
}


@pytest.mark.parametrize(("other", "told"), CHANGED.values(), ids=CHANGED)
def test_another_study_and_other_sources_are_refused(path, other, told):
    before = path.read_bytes()
    with pytest.raises(InputError) as refused, open_journal(path, other):
        pass
    assert told in str(refused.value)
    assert "choose another --out, or add --replace" in str(refused.value)
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


@pytest.mark.long
def test_a_study_is_resumed_by_the_same_sources_wherever_they_are_and_by_no_others(tmp_path):
    folder, copy = tmp_path / "out", tmp_path / "copy" / "palpate"
    package = Path(palpate.__file__).parent
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
    Work(planned(SMALL), SMALL, folder, Formula(lambda _: 1.0)).run()  # all runs: a copy has no compiled loop

    def resume(*words):
        command = [sys.executable, "-m", "palpate", "study", "small.toml", "--out", "out", *words]
        where = {**os.environ, "PYTHONPATH": str(copy.parent)}
        return subprocess.run(command, check=False, cwd=tmp_path, env=where, capture_output=True, text=True)

    file = copy / "studies" / "metrics" / "following.py"
    source, before = file.read_text(encoding="utf-8"), (folder / "runs.jsonl").read_bytes()
    file.write_text(source + "\n# changed\n", encoding="utf-8")
    refused = resume()
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert "other sources than those here: palpate's sources" in refused.stderr
    assert (folder / "runs.jsonl").read_bytes() == before
    file.write_text(source, encoding="utf-8")
    assert resume().returncode == 0
    assert (folder / "runs.jsonl").read_bytes() == before
