"""A study from plan to table: gone on with wherever it stopped, the same rows whatever the order, nothing lost."""

import threading
import time
import weakref

import polars
import pytest

from palpate.bench import Bench
from palpate.errors import InputError
from palpate.studies import run_one as one_run
from palpate.studies.run_one import Local, RunJob, map_unordered
from palpate.studies.run_study import Work
from studies.small import NEAR, SMALL, Formula, planned, text

GRID = text(
    '"controller.ki" = { range = [1.0, 20.0], points = 20 }',
    head="seeds = 3",
    metrics='["force_rms", "settling"]',
)


def formula(at):
    return at["controller.ki"] ** 0.5 + at["seed"] / 7.0


def work(source, folder, runner, **options):
    return Work(planned(source), source, folder, runner, **options)


def table(folder):
    return (folder / "results.parquet").read_bytes()


@pytest.fixture
def uninterrupted(tmp_path):
    """The table of `GRID`."""
    work(GRID, tmp_path / "whole", Formula(formula)).run()
    return table(tmp_path / "whole")


def test_the_table_has_a_row_for_each_run_in_order(tmp_path):
    frame = work(GRID, tmp_path / "out", Formula(formula, backwards=True)).run()
    assert frame["run"].to_list() == list(range(60))
    assert frame.columns == ["run", "controller.ki", "seed", "result", "why", "force_rms", "settling"]
    for row in frame.rows(named=True):
        assert row["force_rms"] == formula(row)
    assert polars.read_parquet(tmp_path / "out" / "results.parquet").equals(frame)


@pytest.mark.parametrize("after", [0, 1, 31, 59])
def test_an_interrupted_study_goes_on_and_its_table_is_the_same_to_the_byte(tmp_path, uninterrupted, after):
    folder, first = tmp_path / "out", Formula(formula, stops_after=after)
    with pytest.raises(KeyboardInterrupt):
        work(GRID, folder, first).run()
    assert not (folder / "results.parquet").exists()
    second, seen = Formula(formula), []
    work(GRID, folder, second, progress=seen.append).run()
    assert table(folder) == uninterrupted
    assert sorted(first.ran + second.ran) == list(range(60))  # each run once
    assert seen[0] == after
    assert seen[-1] == 60


def test_a_finished_study_runs_nothing_again(tmp_path, uninterrupted):
    again = Formula(formula)
    work(GRID, tmp_path / "whole", again).run()
    assert again.ran == []
    assert table(tmp_path / "whole") == uninterrupted


def test_another_study_in_the_folder_is_refused_unless_it_is_to_go(tmp_path, uninterrupted):
    other = GRID.replace("seeds = 3", "seeds = 2")
    with pytest.raises(InputError, match="another study"):
        work(other, tmp_path / "whole", Formula(formula)).run()
    assert table(tmp_path / "whole") == uninterrupted
    assert len(work(other, tmp_path / "whole", Formula(formula)).run(replace=True)) == 40


def test_a_folder_of_other_files_is_never_touched(tmp_path):
    (tmp_path / "thesis.docx").write_text("years of work")
    for replace, said in ((False, "holds other files"), (True, "thesis.docx, which palpate did not write")):
        with pytest.raises(InputError, match=said):
            work(GRID, tmp_path, Formula(formula)).run(replace=replace)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.docx"]


def test_a_journal_of_other_making_is_not_removed_by_replace(tmp_path):
    (tmp_path / "runs.jsonl").write_text("mine\n")
    for replace in (False, True):
        with pytest.raises(InputError, match="palpate did not write"):
            work(GRID, tmp_path, Formula(formula)).run(replace=replace)
    assert (tmp_path / "runs.jsonl").read_text() == "mine\n"


def test_real_runs_on_threads_are_what_the_bench_gives(tmp_path):
    frame = work(SMALL, tmp_path / "out", Local(2)).run()
    assert set(frame["result"]) == {"done"}
    assert frame["K_error_matched"].is_not_null().all()
    alone = work(SMALL, tmp_path / "alone", Local(1)).run()
    assert frame.equals(alone)
    assert table(tmp_path / "out") == table(tmp_path / "alone")


def test_a_failing_run_is_a_row_and_the_others_go_on(tmp_path):
    source = text(
        """
        "controller.ki" = [5.0, -1.0]
        "wall.x" = [0.465, 0.9]
        "force.second" = [20.0, -40.0]
        """,
        fixed=NEAR.replace("duration = 1.5", "duration = 1.5, losses = 1")
        + '"force.period" = 0.05\n"approach.release" = 4.0\n',
    )
    frame = work(source, tmp_path / "out", Local(2)).run()
    by = {(r["controller.ki"], r["wall.x"], r["force.second"]): r for r in frame.rows(named=True)}
    assert by[5.0, 0.465, 20.0]["result"] == "done"
    assert by[-1.0, 0.465, 20.0]["result"] == "refused"
    assert "ki in [controller] must be a number at least 0" in by[-1.0, 0.465, 20.0]["why"]
    assert by[5.0, 0.9, 20.0]["result"] == "no contact"
    assert by[5.0, 0.465, -40.0]["result"] == "lost contact"
    assert all(r["why"] for r in by.values())
    assert all(r["force_rms"] is None for r in by.values() if r["result"] in {"refused", "no contact"})


def test_an_error_within_a_run_is_its_result(tmp_path, monkeypatch):
    def broken(record, window):
        raise ZeroDivisionError("a metric that\nfails")

    monkeypatch.setattr(one_run, "Window", broken)
    frame = work(SMALL, tmp_path / "out", Local(2)).run()
    assert set(frame["result"]) == {"failed"}
    assert set(frame["why"]) == {"ZeroDivisionError: a metric that fails"}


def test_records_are_not_kept_in_memory(tmp_path, monkeypatch):
    """Of many runs, no more than the few in hand are alive; the journal has the rest."""
    made, alive, run = [], [], Bench.run

    def counted(*words, **more):
        found = run(*words, **more)
        made.append(weakref.ref(found))
        alive.append(sum(one() is not None for one in made))
        return found

    monkeypatch.setattr(Bench, "run", counted)
    work(SMALL.replace("seeds = 2", "seeds = 4"), tmp_path / "out", Local(2)).run()
    assert len(made) == 24
    assert max(alive) <= 4


def test_items_are_taken_as_they_are_needed():
    taken = []

    def items():
        for i in range(100):
            taken.append(i)
            yield i

    results = map_unordered(lambda i: i, items(), threads=2)
    next(results)
    assert len(taken) <= 4
    results.close()
    assert len(taken) <= 4


def test_stopping_stops_the_runs_under_way():
    """Two runs of an hour each are under way when Ctrl-C comes; their threads end within one look at the progress."""
    source = SMALL.replace("press = 0.2", "press = 3000.0").replace("duration = 1.5", "duration = 3000.0")
    plan = planned(source)

    def jobs():
        for run in range(2):
            yield RunJob(plan.setting(run), ("force_rms",), None, False)
        raise KeyboardInterrupt

    before = set(threading.enumerate())
    with pytest.raises(KeyboardInterrupt):
        list(Local(2).run(jobs()))
    deadline = time.monotonic() + 60.0  # of hours that two runs would take
    while set(threading.enumerate()) - before:
        assert time.monotonic() < deadline
        time.sleep(0.01)
