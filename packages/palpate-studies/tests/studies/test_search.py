"""A search: finds what there is to find, and goes on where it stopped as if it had not."""

import math

import optuna
import polars
import pytest

from palpate_studies.run_study import Work
from palpate_studies.search import NAME, Searching, objective
from studies.small import Formula, planned, text

SEARCH = text(
    """
    "controller.ki" = { log = [0.1, 100.0] }
    "controller.kf" = { range = [0.0, 2.0] }
    "force_sensor.bits" = { range = [6, 16] }
    "surface.damping" = [60.0, 200.0]
    """,
    head='seeds = 2\nbest = { least = "force_rms" }',
    tail="[search]\ntrials = 40\nbatch = 4",
)


def bowl(at):
    """Least, 0, at ki = 3, kf = 0.5, 12 bits and a damping of 200."""
    ki, kf = math.log10(at["controller.ki"] / 3.0), at["controller.kf"] - 0.5
    bits = (at["force_sensor.bits"] - 12) / 10
    return ki**2 + kf**2 + bits**2 + (at["surface.damping"] == 60.0) + 0.01 * at["seed"]


def searched(folder, runner, source=SEARCH):
    return Work(planned(source), source, folder, runner).run()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A search that was not interrupted: its folder and its table."""
    folder = tmp_path_factory.mktemp("whole") / "out"
    return folder, searched(folder, Formula(bowl))


def test_it_comes_nearer_than_its_first_trials(whole):
    frame = whole[1]
    assert len(frame) == 80
    assert frame["force_rms"][60:].mean() < 0.5 * frame["force_rms"][:20].mean()
    best = frame.sort("force_rms").row(0, named=True)
    assert best["force_rms"] < 0.1
    assert best["surface.damping"] == 200.0
    assert frame["force_sensor.bits"].dtype == polars.Int64


def test_the_trials_stand_in_a_journal_of_optunas_own(whole):
    folder, frame = whole
    storage = optuna.storages.JournalStorage(optuna.storages.journal.JournalFileBackend(str(folder / NAME)))
    (summary,) = optuna.get_all_study_summaries(storage)
    study = optuna.load_study(study_name=summary.study_name, storage=storage)
    assert len(study.trials) == 40
    means = frame.group_by("controller.ki", maintain_order=True).agg(polars.col("force_rms").mean())
    assert [t.value for t in study.trials] == pytest.approx(means["force_rms"].to_list(), rel=1e-12)
    assert [t.params["controller.ki"] for t in study.trials] == means["controller.ki"].to_list()


@pytest.mark.parametrize("after", [3, 8, 41])
def test_an_interrupted_search_makes_the_same_table(tmp_path, whole, after):
    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        searched(folder, Formula(bowl, stops_after=after))
    searched(folder, Formula(bowl, backwards=True))
    assert (folder / "results.parquet").read_bytes() == (whole[0] / "results.parquet").read_bytes()


def test_killed_between_two_trials_of_a_batch(tmp_path, whole, monkeypatch):
    """Optuna's journal is then in the middle of a batch; the batch is proposed from those before it all the same."""
    folder, tell, told = tmp_path / "out", Searching.tell, []

    def killed(self, number, values, objective):
        if number == 17:  # of the batch 16 to 19
            raise KeyboardInterrupt
        told.append(number)
        tell(self, number, values, objective)

    with monkeypatch.context() as patch:
        patch.setattr(Searching, "tell", killed)
        with pytest.raises(KeyboardInterrupt):
            searched(folder, Formula(bowl))
    assert told == list(range(17))
    searched(folder, Formula(bowl))
    assert (folder / "results.parquet").read_bytes() == (whole[0] / "results.parquet").read_bytes()


def tear(path):
    path.write_bytes(path.read_bytes()[:-25])


def spoil(path):
    path.write_bytes(path.read_bytes().replace(b"study_name", b"study_nome", 1))


@pytest.mark.parametrize("harm", [tear, spoil, lambda path: path.unlink()], ids=["torn", "spoiled", "gone"])
def test_optunas_journal_is_made_again_from_the_studys(tmp_path, whole, harm):
    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        searched(folder, Formula(bowl, stops_after=50))
    harm(folder / NAME)
    rest = Formula(bowl)
    searched(folder, rest)
    assert len(rest.ran) == 30
    assert (folder / "results.parquet").read_bytes() == (whole[0] / "results.parquet").read_bytes()


def test_the_most_of_something(tmp_path):
    source = SEARCH.replace("least", "most")
    frame = searched(tmp_path / "out", Formula(lambda at: -bowl(at)), source)
    assert frame["force_rms"].max() > -0.1


def test_a_trial_counts_only_if_all_its_runs_were_done():
    assert objective([("done", 1.0), ("done", 3.0)]) == 2.0
    assert objective([("done", 1.0), ("diverged", 3.0)]) is None
    assert objective([("done", 1.0), ("done", None)]) is None
    assert objective([]) is None
