"""A folder of results is there whole or not at all, is one process's alone, and nothing else is ever lost."""

import subprocess
import sys

import pytest

from palpate.errors import InputError
from palpate.files import fresh_folder, kept_folder, with_author, write_json

FILE, BEGUN = "summary.json", "runs.jsonl"
OURS = '{"written_by": "palpate 0.1.0", "n": %d}'


def write(path, number=1, *, replace=False):
    with fresh_folder(path, replace=replace) as folder:
        (folder / FILE).write_text(OURS % number)


def contents(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_nothing_is_there_before_the_end(tmp_path):
    with fresh_folder(tmp_path / "foam", replace=False) as folder:
        (folder / FILE).write_text(OURS % 1)
        assert not (tmp_path / "foam").exists()


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_failure_leaves_nothing_half_written(tmp_path, error):
    with pytest.raises(error), fresh_folder(tmp_path / "foam", replace=False) as folder:
        (folder / FILE).write_text(OURS % 1)
        raise error
    assert contents(tmp_path) == []


def test_an_existing_folder_is_refused_before_the_work_starts(tmp_path):
    write(tmp_path / "foam", 1)
    with pytest.raises(InputError, match="--replace"), fresh_folder(tmp_path / "foam", replace=False):
        pytest.fail("the block must not run")
    assert (tmp_path / "foam" / FILE).read_text() == OURS % 1


def test_replace_replaces_results(tmp_path):
    write(tmp_path / "foam", 1)
    write(tmp_path / "foam", 2, replace=True)
    assert contents(tmp_path) == ["foam", f"foam/{FILE}"]
    assert (tmp_path / "foam" / FILE).read_text() == OURS % 2


def test_a_failed_replacement_keeps_the_old_results(tmp_path):
    write(tmp_path / "foam", 1)
    with pytest.raises(OSError, match="disk"), fresh_folder(tmp_path / "foam", replace=True):
        raise OSError("disk full")
    assert contents(tmp_path) == ["foam", f"foam/{FILE}"]
    assert (tmp_path / "foam" / FILE).read_text() == OURS % 1


@pytest.mark.parametrize("name", ["letters.txt", "summary.json", "photo.png", "inner/deep.parquet"])
@pytest.mark.parametrize("beside", [False, True])
def test_replace_never_removes_what_palpate_did_not_write(tmp_path, name, beside):
    """Whatever its name, and whatever of palpate's lies beside it."""
    home = tmp_path / "home"
    if beside:
        write(home, 1)
    (home / name).parent.mkdir(parents=True, exist_ok=True)
    (home / name).write_bytes(b"dear")
    before = contents(tmp_path)
    with pytest.raises(InputError, match="palpate did not write"):
        write(home, 2, replace=True)
    with pytest.raises(InputError, match="palpate did not write"), kept_folder(home, BEGUN, replace=True):
        pytest.fail("the block must not run")
    assert contents(tmp_path) == before
    assert (home / name).read_bytes() == b"dear"


def test_a_link_among_the_results_is_not_followed(tmp_path):
    """Not even one to results of palpate: what it leads to was not asked to go."""
    write(tmp_path / "elsewhere", 1)
    write(tmp_path / "foam", 1)
    (tmp_path / "foam" / "records").symlink_to(tmp_path / "elsewhere", target_is_directory=True)
    for within in (fresh_folder, lambda path, replace: kept_folder(path, BEGUN, replace=replace)):
        with pytest.raises(InputError, match="records"), within(tmp_path / "foam", replace=True):
            pytest.fail("the block must not run")
    assert (tmp_path / "elsewhere" / FILE).read_text() == OURS % 1


def test_a_link_in_the_place_is_refused(tmp_path):
    write(tmp_path / "real", 1)
    (tmp_path / "foam").symlink_to(tmp_path / "real", target_is_directory=True)
    for within in (fresh_folder, lambda path, replace: kept_folder(path, BEGUN, replace=replace)):
        with pytest.raises(InputError, match="is a link"), within(tmp_path / "foam", replace=True):
            pytest.fail("the block must not run")
    assert (tmp_path / "real" / FILE).read_text() == OURS % 1


def test_a_file_in_the_place_is_refused(tmp_path):
    (tmp_path / "foam").write_text("a file")
    with pytest.raises(InputError, match="not a folder"):
        write(tmp_path / "foam", replace=True)


def test_a_place_under_a_file_is_the_systems_error_and_leaves_nothing(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        write(tmp_path / "file" / "foam")
    assert contents(tmp_path) == ["file"]


KILLED = """
import os, signal, sys
from pathlib import Path
from palpate import files as folders
path, at = Path(sys.argv[1]), int(sys.argv[2])
count, rename = 0, Path.rename

def renamed(self, target):
    global count
    if count == at:
        os.kill(os.getpid(), signal.SIGKILL)
    count += 1
    return rename(self, target)

Path.rename = renamed
with folders.fresh_folder(path, replace=True) as folder:
    (folder / "summary.json").write_text('{"written_by": "palpate 0.1.0", "n": 2}')
    if at < 0:
        os.kill(os.getpid(), signal.SIGKILL)
folders.shutil.rmtree = lambda _: os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("at", [-1, 0, 1])
def test_what_a_killed_process_left_is_put_right_by_the_next(tmp_path, at):
    """Killed while it writes, before the first and between the two renames: the old results come back."""
    write(tmp_path / "foam", 1)
    ran = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path / "foam"), str(at)], check=False)
    assert ran.returncode == -9
    assert (tmp_path / "foam").exists() == (at < 1)
    with pytest.raises(InputError, match="--replace"):
        write(tmp_path / "foam", 3)
    assert contents(tmp_path) == ["foam", f"foam/{FILE}"]
    assert (tmp_path / "foam" / FILE).read_text() == OURS % 1


def test_a_folder_is_written_by_one_process_at_a_time(tmp_path):
    with (
        fresh_folder(tmp_path / "foam", replace=False) as folder,
        pytest.raises(InputError, match="another palpate is at work"),
    ):
        (folder / FILE).write_text(OURS % 1)
        write(tmp_path / "foam", 2)
    assert (tmp_path / "foam" / FILE).read_text() == OURS % 1


def test_a_folder_is_kept_by_one_process_at_a_time(tmp_path):
    with (
        kept_folder(tmp_path / "study", BEGUN, replace=False),
        pytest.raises(InputError, match="another palpate is at work"),
        kept_folder(tmp_path / "study", BEGUN, replace=False),
    ):
        pytest.fail("the block must not run")


def test_a_kept_folder_is_gone_on_in_once_begun(tmp_path):
    """Notes that a person put beside the results stay, and hinder nobody but --replace."""
    with kept_folder(tmp_path / "study", BEGUN, replace=False):
        write_json(tmp_path / "study" / BEGUN, with_author({}))
    (tmp_path / "study" / "notes.txt").write_text("mine")
    with kept_folder(tmp_path / "study", BEGUN, replace=False):
        assert contents(tmp_path / "study") == ["notes.txt", BEGUN]


def test_results_of_something_else_are_not_begun_in(tmp_path):
    write(tmp_path / "foam", 1)
    with (
        pytest.raises(InputError, match="holds other files"),
        kept_folder(tmp_path / "foam", BEGUN, replace=False),
    ):
        pytest.fail("the block must not run")
    with kept_folder(tmp_path / "foam", BEGUN, replace=True):
        assert contents(tmp_path / "foam") == []


def test_drafts_of_a_killed_process_are_swept(tmp_path):
    with kept_folder(tmp_path / "study", BEGUN, replace=False):
        write_json(tmp_path / "study" / BEGUN, with_author({}))
    (tmp_path / "study" / "records").mkdir()
    (tmp_path / "study" / "records" / ".3.parquet.palpate-part").write_bytes(b"PAR1 half")
    with kept_folder(tmp_path / "study", BEGUN, replace=False):
        assert contents(tmp_path / "study") == ["records", BEGUN]
