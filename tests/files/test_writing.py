"""A file is there whole or not at all, and is never written over one that palpate did not write."""

import os
import resource
import signal
import subprocess
import sys
from contextlib import contextmanager

import polars
import pytest

from palpate.errors import InputError
from palpate.files import MADE, check_place, fresh_folder, ours, whole, with_author, write_json, write_text
from palpate.logs import write_record
from palpate.records import Record
from palpate.report import style
from palpate.report.page import Answer, answer_page


def names(folder):
    return [path.name for path in folder.iterdir()]


def a_png(path):
    style.save(style.figure()[0], path)


def a_page(path):
    write_text(
        path, answer_page(Answer(title="T", sentence="S", about="A"), room="record", command="palpate")
    )


def a_record(path):
    write_record(Record({"t": [0.0, 1.0]}, {"t": "s"}), path)


WRITERS = {
    "a.png": a_png,
    "a.html": a_page,
    "a.parquet": a_record,
    "a.json": lambda path: write_json(path, with_author({"end": "done"})),
    "a.toml": lambda path: write_text(path, f"{MADE} excite.\n[run]\n"),
    "a.csv": lambda path: write_text(path, "time_s,force_desired_N\n0,1\n"),
}
FOREIGN = {
    "a.png": b"\x89PNG\r\n\x1a\n" + b"a photograph of palpate",
    "a.html": b"<html><body>about palpate</body></html>",
    "a.json": b'{"end": "done", "written_by": "palpate"}',
    "a.toml": b'title = "# Made by palpate"\n',
    "a.csv": b"time_s,position_mm\n0,1\n",
    "a.txt": b"",
}


@pytest.mark.parametrize("name", WRITERS)
def test_what_palpate_writes_it_knows_again_and_may_replace(tmp_path, name):
    path = tmp_path / name
    for _ in range(2):
        WRITERS[name](path)
        assert ours(path)
    assert names(tmp_path) == [name]


@pytest.mark.parametrize("name", FOREIGN)
def test_what_somebody_else_wrote_stays(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(FOREIGN[name])
    with pytest.raises(InputError, match="palpate did not write it"):
        WRITERS.get(name, WRITERS["a.json"])(path)
    assert path.read_bytes() == FOREIGN[name]
    assert names(tmp_path) == [name]


@pytest.mark.parametrize("letters", [10, 3_000_000])
def test_a_record_is_known_whatever_is_said_about_it(tmp_path, letters):
    path = tmp_path / "a.parquet"
    write_record(Record({"t": [0.0, 1.0]}, {"t": "s"}, {"about": "a" * letters}), path)
    assert ours(path)


@pytest.mark.parametrize("tail", [b"", b"PAR1", b"\xff\xff\xff\xffPAR1"])
def test_the_beginning_of_a_table_is_nobodys(tmp_path, tail):
    path = tmp_path / "a.parquet"
    path.write_bytes(b"PAR1" + tail)
    assert not ours(path)


def test_a_table_of_somebody_else_stays(tmp_path):
    path = tmp_path / "a.parquet"
    polars.DataFrame({"palpate": [1.0]}).write_parquet(path, metadata={"about": "palpate"})
    with pytest.raises(InputError, match="palpate did not write it"):
        a_record(path)


def test_a_link_is_not_written_through(tmp_path):
    """Neither to a file of palpate's own, nor one that leads nowhere yet."""
    a_page(tmp_path / "real.html")
    before = (tmp_path / "real.html").read_bytes()
    (tmp_path / "a.html").symlink_to(tmp_path / "real.html")
    (tmp_path / "b.html").symlink_to(tmp_path / "nowhere.html")
    for name in ("a.html", "b.html"):
        with pytest.raises(InputError, match="is a link"):
            a_page(tmp_path / name)
    assert (tmp_path / "real.html").read_bytes() == before
    assert not (tmp_path / "nowhere.html").exists()


def test_a_link_put_in_the_drafts_place_is_not_followed(tmp_path):
    (tmp_path / "letters.txt").write_text("dear")
    (tmp_path / ".a.html.palpate-part").symlink_to(tmp_path / "letters.txt")
    with pytest.raises(OSError, match="symbolic"):
        a_page(tmp_path / "a.html")
    assert (tmp_path / "letters.txt").read_text() == "dear"


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_failure_leaves_what_was_there(tmp_path, error):
    path = tmp_path / "a.toml"
    write_text(path, f"{MADE} run.\n")
    with pytest.raises(error), whole(path) as draft:
        draft.write_text("half")
        raise error
    assert path.read_text() == f"{MADE} run.\n"
    assert names(tmp_path) == ["a.toml"]


@contextmanager
def no_room():
    """The system lets no file grow beyond some bytes; what a full disk says, it says without a name as well."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def test_what_does_not_fit_is_named_and_leaves_nothing(tmp_path):
    path = tmp_path / "a.toml"
    with no_room(), pytest.raises(OSError, match="too large") as caught:
        write_text(path, f"{MADE} run.\n" + "#" * 1000)
    assert caught.value.filename == str(path)
    with (
        no_room(),
        pytest.raises(OSError, match="too large") as caught,
        fresh_folder(tmp_path / "b", replace=False) as new,
    ):
        write_text(new / "a.toml", f"{MADE} run.\n" + "#" * 1000)
    assert caught.value.filename == str(tmp_path / "b" / "a.toml")
    assert names(tmp_path) == []


def test_a_file_without_a_mark_is_a_defect(tmp_path):
    with pytest.raises(AssertionError, match="without a mark"):
        write_text(tmp_path / "a.txt", "no mark")
    assert names(tmp_path) == []


def test_a_file_is_as_readable_as_any_other(tmp_path):
    mask = os.umask(0o027)
    try:
        a_page(tmp_path / "a.html")
    finally:
        os.umask(mask)
    assert (tmp_path / "a.html").stat().st_mode & 0o777 == 0o640


def test_one_process_writes_a_file_and_a_killed_one_hinders_nobody(tmp_path):
    path = tmp_path / "a.toml"
    with whole(path) as draft:
        draft.write_text(f"{MADE} run.\n")
        with pytest.raises(InputError, match="another palpate is writing"), whole(path):
            pytest.fail("the block must not run")
    code = (
        "import os, sys\nfrom pathlib import Path\nfrom palpate.files import whole\n"
        "with whole(Path(sys.argv[1])) as draft:\n    draft.write_text('half')\n    os.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", code, str(path)], check=False).returncode == -9
    assert path.read_text() == f"{MADE} run.\n"
    write_text(path, f"{MADE} again.\n")
    assert names(tmp_path) == ["a.toml"]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda tmp: tmp / "none" / "a.png", "there is no folder"),
        (lambda tmp: tmp, "is a folder"),
        (lambda tmp: tmp / "a.jpg", "it is a PNG; name it .*a.png"),
    ],
)
def test_a_wrong_place_is_found_before_any_work(tmp_path, make, said):
    with pytest.raises(InputError, match=said):
        check_place(make(tmp_path), "--figure", ending=".png")


def test_a_folder_that_may_not_be_written_is_found_before_any_work(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # the superuser may write anywhere
    with pytest.raises(InputError, match="may not be written in"):
        check_place(tmp_path / "a.png", "--figure")
