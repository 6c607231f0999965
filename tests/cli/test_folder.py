"""A folder of results is there whole or not at all, and nothing else is ever lost."""

import pytest

from palpate.cli._folder import MARK, fresh_folder
from palpate.errors import InputError


def write(path, text="{}", *, force=False):
    with fresh_folder(path, force=force) as folder:
        (folder / MARK).write_text(text)


def contents(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_results_appear_with_their_parents(tmp_path):
    write(tmp_path / "runs" / "foam", "new")
    assert contents(tmp_path) == ["runs", "runs/foam", f"runs/foam/{MARK}"]


def test_nothing_is_there_before_the_end(tmp_path):
    with fresh_folder(tmp_path / "foam", force=False) as folder:
        (folder / MARK).write_text("{}")
        assert not (tmp_path / "foam").exists()


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_failure_leaves_nothing_half_written(tmp_path, error):
    with pytest.raises(error), fresh_folder(tmp_path / "foam", force=False) as folder:
        (folder / MARK).write_text("{}")
        raise error
    assert contents(tmp_path) == []


def test_an_existing_folder_is_refused_before_the_work_starts(tmp_path):
    write(tmp_path / "foam", "old")
    with pytest.raises(InputError, match="--force"), fresh_folder(tmp_path / "foam", force=False):
        pytest.fail("the block must not run")
    assert (tmp_path / "foam" / MARK).read_text() == "old"


def test_force_replaces_results(tmp_path):
    write(tmp_path / "foam", "old")
    (tmp_path / "foam" / "left_over.png").touch()
    write(tmp_path / "foam", "new", force=True)
    assert contents(tmp_path) == ["foam", f"foam/{MARK}"]
    assert (tmp_path / "foam" / MARK).read_text() == "new"


def test_a_failed_replacement_keeps_the_old_results(tmp_path):
    write(tmp_path / "foam", "old")
    with pytest.raises(OSError, match="disk"), fresh_folder(tmp_path / "foam", force=True):
        raise OSError("disk full")
    assert contents(tmp_path) == ["foam", f"foam/{MARK}"]
    assert (tmp_path / "foam" / MARK).read_text() == "old"


def test_force_never_removes_what_palpate_did_not_write(tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    (home / "letters.txt").write_text("dear")
    with pytest.raises(InputError, match="no results of palpate"):
        write(home, force=True)
    assert contents(tmp_path) == ["home", "home/letters.txt"]


def test_a_file_in_the_place_is_refused(tmp_path):
    (tmp_path / "foam").write_text("a file")
    with pytest.raises(InputError, match="not a folder"):
        write(tmp_path / "foam", force=True)


def test_a_place_under_a_file_is_the_systems_error_and_leaves_nothing(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"):
        write(tmp_path / "file" / "foam")
    assert contents(tmp_path) == ["file"]
