"""The thesis' laboratory: its unknowns, its effect on an experiment, and the search for it."""

import json
import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from matplotlib.figure import Figure

from cli.json_keys import documented
from palpate.bench import Experiment, build, with_values
from palpate.cli import main
from palpate.errors import InputError
from palpate_thesis.claims import (
    ThesisClaim,
    count_in_words,
    count_verdicts,
    experiment_sentences,
    plausible_laboratories,
    rows,
)
from palpate_thesis.figure import studies, study
from palpate_thesis.force_control.tracking import FOAM, RUBBER, SINE
from palpate_thesis.inference import search
from palpate_thesis.inference.search import GENERATION, STATE, LaboratorySearch
from palpate_thesis.inference.sentences import ON_TRIALS, halves, sentences
from palpate_thesis.inference.trial import Trial
from palpate_thesis.laboratory import (
    BENCH,
    LINEAR,
    RELAXING,
    STIFFENING,
    UNKNOWNS,
    Laboratory,
    Unknown,
    laboratory_at,
    laboratory_from,
    laboratory_text,
    load_laboratory,
    stiffening,
)
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.measure import MeasurementFormat, measure
from palpate_thesis.neural_identifier.network import NetworkPress
from palpate_thesis.runs import Runs


def test_every_unknown_is_a_field_with_a_range_that_holds_its_own_ends():
    assert [u.name for u in UNKNOWNS] == list(Laboratory.__dataclass_fields__)
    for u in UNKNOWNS:
        assert u.reason
        assert u.low < u.high
        assert u.quantile(0.0) == pytest.approx(u.choices[0] if u.choices else u.low)
        assert u.quantile(1.0) == pytest.approx(u.choices[-1] if u.choices else u.high)


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(set(plausible_laboratories().values()) - {"inferred"}))
def test_a_laboratory_shows_the_sentences_that_it_is_named_for(name: str):
    named = {s for s, laboratory in plausible_laboratories().items() if laboratory == name}
    trials = [Trial(load_laboratory(name), seed, search.FULL_STEPS) for seed in search.SEEDS]
    wrong = [
        s.id for s in sentences() if s.id in named and not s.is_true(sum(map(s.holds, trials)), len(trials))
    ]
    assert wrong == []


@pytest.mark.parametrize("experiment", [FOAM, RUBBER, press_runs.PLAIN, press_runs.RELAXING])
def test_the_hand_chosen_bench_changes_nothing(experiment: Experiment):
    assert BENCH.adapt(experiment) == experiment


TRIED = {
    "foam press": press_runs.PLAIN,
    "rubber press": press_runs.RUBBER,
    "steps on foam": FOAM,
    "steps on rubber": RUBBER,
    "sine on foam": with_values(FOAM, SINE),
}
IN_THE_NETWORK = {
    "amplitude",
    "weights",
    "output_sum",
    "start",
}  # of the identifier, which thinks after the run


@pytest.mark.parametrize(
    "unknown", [u for u in UNKNOWNS if u.name not in IN_THE_NETWORK], ids=lambda u: u.name
)
def test_every_unknown_enters_some_experiment(unknown: Unknown):
    law = {"foam_branch": RELAXING, "foam_branch_time": RELAXING, "foam_exponent": STIFFENING}
    base = replace(laboratory_at([0.4] * len(UNKNOWNS)), foam_law=law.get(unknown.name, LINEAR))
    other = replace(base, **{unknown.name: unknown.quantile(0.9)})
    assert any(base.adapt(e) != other.adapt(e) for e in TRIED.values())


@pytest.mark.long
def test_the_identifiers_unknowns_enter_its_answer():
    t = np.arange(4000) * 1e-3
    inputs = np.column_stack([4e-3 * t / 4.0, np.full(4000, 1e-3), np.zeros(4000)])
    none = np.zeros((4000, 3))
    press = NetworkPress("foam", inputs, 20.0 * t / 4.0, 5000.0, none, none, none[0])
    base = Trial(Laboratory(start=1.0)).answer_for(press)
    for of in ({"amplitude": 80.0}, {"weights": 1.5}, {"output_sum": 1.0}, {"start": 2.0}):
        assert Trial(Laboratory(**{"start": 1.0, **of})).answer_for(press) != base


def test_foams_of_all_laws_sink_in_alike_from_5_to_20_N():
    for n in (1.0, 1.5, 2.5):
        s = stiffening(5200.0, 200.0, 0.1, n)
        depth = [(f / s["stiffness"]) ** (1.0 / n) for f in (5.0, 20.0)]
        assert 15.0 / (depth[1] - depth[0]) == pytest.approx(5200.0)
        assert s["damping"] * depth[1] ** n == pytest.approx(200.0)
        assert press_runs.own_values(s)["B"] == pytest.approx(200.0)
    assert Laboratory(foam_law=STIFFENING).adapt(FOAM).surface.exponent == 1.5
    assert Laboratory(foam_law=RELAXING, foam_branch=2.0).adapt(
        FOAM
    ).surface.branch_stiffness == pytest.approx(10400.0)
    assert Laboratory(foam_law=RELAXING).adapt(RUBBER).surface.stiffness == RUBBER.surface.stiffness


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[unknowns]\nfrictoin = 1.0", "friction"),
        ("[unknowns]\nfriction = 9.0", "between 0.05 and 1.47"),
        ("[unknowns]\nrestart = 2.0", "one of"),
        ('[unknowns]\nnoise = "much"', "must be a number"),
        ("[unknowns]\nnoise = nan", "between"),
        ("unknowns = 3", "no table"),
        ("colour = 3\n[unknowns]", "unknown key"),
        ("[unknowns", "not TOML"),
    ],
)
def test_a_bad_file_is_refused_in_a_line(tmp_path, text: str, told: str):
    path = tmp_path / "lab.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=told) as refused:
        load_laboratory(str(path))
    assert "\n" not in str(refused.value)


def test_a_laboratory_comes_back_from_its_file(tmp_path):
    lab = laboratory_at([0.3] * len(UNKNOWNS))
    path = tmp_path / "lab.toml"
    path.write_text(laboratory_text(lab, BENCH, about='about "it"', command="palpate laboratory --seed 1"))
    assert load_laboratory(str(path)) == lab
    assert laboratory_from({}, "nothing", BENCH) == BENCH


def test_a_laboratory_has_the_other_values_of_its_base(tmp_path):
    lab = replace(load_laboratory("inferred"), noise=0.3)
    path = tmp_path / "lab.toml"
    path.write_text(laboratory_text(lab, load_laboratory("inferred"), base="inferred"))
    assert path.read_text() == 'base = "inferred"\n\n[unknowns]\nnoise = 0.3\n'
    assert load_laboratory(str(path)) == lab


def test_sentences_are_claims_of_their_figures_and_each_has_a_law():
    assert {s.id for s in sentences()} == set(ON_TRIALS)
    assert len(sentences()) == len(ON_TRIALS)
    assert {rows()[s.id]["figure"] for s in sentences()} <= {s.NUMBER for s in studies()}


def test_a_trial_of_the_bench_agrees_with_the_figures():
    trial = Trial(BENCH, steps=20)
    record = build(press_runs.PLAIN).run(60.0, 0, press=press_runs.PLAIN.run.press)
    assert trial["foam"].estimates == press_runs.press_estimates(record)


@pytest.fixture
def rule(monkeypatch):
    """Decides sentences by the unknowns' values instead of runs, and can interrupt a search."""

    class Rule:
        asked, limit = 0, math.inf

        def __call__(self, trial, among):
            self.asked += 1
            if self.asked > self.limit:
                raise KeyboardInterrupt
            lab, chosen = trial.laboratory, tuple(among)
            good = (lab.wall < 0.467, lab.noise < 0.2, lab.friction > 0.9, lab.sticking < 0.3)
            return tuple(s.id for i, s in enumerate(chosen) if good[i % len(good)])

    rule = Rule()
    monkeypatch.setattr(search, "true_ids", rule)
    return rule


def tried(folder):
    return msgspec.json.decode((folder / STATE).read_bytes(), type=search.SearchState).tried


def test_the_search_improves_on_the_prior(tmp_path, rule):
    result = LaboratorySearch(tmp_path / "lab", "palpate laboratory", tries=256).run()
    counts = [len(one.true) for one in tried(tmp_path / "lab")]
    assert result.tried == len(counts) == 256
    assert max(counts[64:]) > max(counts[:64])
    assert result.inferred.count_true(sentences()) == len(sentences())
    assert 0 < result.laboratories["hand-chosen bench"].count_true(sentences()) < len(sentences())


def test_an_interrupted_search_ends_as_one_that_was_not(tmp_path, rule):
    whole = LaboratorySearch(tmp_path / "whole", "palpate laboratory", tries=64).run()
    rule.asked, rule.limit = 0, 40
    with pytest.raises(KeyboardInterrupt):
        LaboratorySearch(tmp_path / "cut", "palpate laboratory", tries=64).run()
    assert len(tried(tmp_path / "cut")) == 2 * GENERATION
    rule.limit = math.inf
    assert LaboratorySearch(tmp_path / "cut", "palpate laboratory", tries=64).run() == whole
    assert tried(tmp_path / "cut") == tried(tmp_path / "whole")


def test_the_number_of_threads_changes_nothing(tmp_path, rule):
    one, four = (
        LaboratorySearch(tmp_path / str(n), "palpate laboratory", tries=64, threads=n).run() for n in (1, 4)
    )
    assert one == four


def test_half_searches_by_the_calibration_half_alone(tmp_path, rule):
    LaboratorySearch(tmp_path / "half", "palpate laboratory", tries=16, half=True).run()
    calibration = {s.id for s in halves()["calibration"]}
    assert {name for one in tried(tmp_path / "half") for name in one.true} <= calibration


def test_a_state_of_another_search_is_refused(tmp_path, rule):
    folder = tmp_path / "lab"
    LaboratorySearch(folder, "palpate laboratory", tries=16, seed=5).run()
    with pytest.raises(InputError, match="another search"):
        LaboratorySearch(folder, "palpate laboratory", tries=16, seed=6).run()
    state = json.loads((folder / STATE).read_text())
    (folder / STATE).write_text(json.dumps(state | {"tried": 3}))
    with pytest.raises(InputError, match="damaged"):
        LaboratorySearch(folder, "palpate laboratory", tries=16, seed=5).run()


def test_a_folder_of_something_else_is_refused(tmp_path, rule):
    (tmp_path / "mine.txt").write_text("years of work")
    with pytest.raises(InputError, match="holds other files"):
        LaboratorySearch(tmp_path, "palpate laboratory", tries=16).run()


def test_the_command_writes_a_laboratory_that_can_be_read(tmp_path, rule, capsys, root):
    out = tmp_path / "lab"
    assert main(["laboratory", "--tries", "32", "--out", str(out), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed.keys() - {"command", "files", "options", "version"} == documented(root)["laboratory"]
    inferred = load_laboratory(str(out / "inferred.toml"))
    assert printed["laboratories"]["inferred"] == inferred.numbers()
    assert printed["true"]["inferred"]["all"]["of"] == len(sentences())
    rule.limit = 0
    assert main(["laboratory", "--tries", "32", "--out", str(tmp_path / "other")]) == 130
    assert "the same command resumes" in capsys.readouterr().err


@pytest.mark.long
def test_a_figure_is_measured_in_another_laboratory(tmp_path):
    runs = Runs(range(2), laboratory=Laboratory(noise=0.15))
    (done,) = measure(
        [study("4.4")], runs, tmp_path / "thesis", written=MeasurementFormat("palpate thesis 4.4")
    )
    (claim,) = done.claims
    assert claim.verdict == "reproduced in a plausible laboratory"
    assert "It holds with --laboratory inferred" in claim.note
    page = (tmp_path / "thesis" / "index.html").read_text()
    assert "1 sentence about the experiments: 0 reproduced, 1 reproduced in a plausible" in page


def row(name: str, verdict, of="ours") -> ThesisClaim:
    return ThesisClaim(name, "", "", "", "", "", verdict, "", of)


def test_claims_are_counted_by_kind():
    rows = [row("a.K", "reproduced"), row("a.B", "contradicted"), row("b", "not checkable", "experiment")]
    assert {of: counts.total() for of, counts in count_verdicts(rows).items()} == {"experiment": 1, "ours": 2}
    first, second = count_in_words(rows)
    assert first == "1 sentence about the experiments: 0 reproduced, 1 not checkable"
    assert second.endswith(": 1 reproduced, 1 contradicted")


def test_there_are_49_sentences_about_the_experiments_and_each_has_its_text():
    assert experiment_sentences() == {s.id for s in sentences()}
    assert len(experiment_sentences()) == 49
    assert {name: len(half) for name, half in halves().items()} == {
        "calibration": 22,
        "validation": 27,
        "all": 49,
    }


@pytest.mark.parametrize(
    ("command", "told"),
    [
        (["thesis", "--laboratory", "nowhere"], "unknown laboratory 'nowhere'"),
        (["laboratory", "--tries", "3"], "tries"),
    ],
)
def test_the_command_line_refuses_what_it_cannot_do(tmp_path, capsys, monkeypatch, command, told: str):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lab.toml").write_text("[unknowns]\nfriction = 0.5\n")
    assert main(command) == 2
    err = capsys.readouterr().err
    assert told in err
    assert "Traceback" not in err
    assert [p.name for p in tmp_path.iterdir()] == ["lab.toml"]


@pytest.mark.long
def test_a_press_that_ended_before_the_slot_leaves_its_panel_alone():
    axis = Figure().subplots()
    panels.calm_limits(axis, np.array([1.0, 3.0]), np.empty(0), np.full(3, np.nan))
    assert axis.get_ylim() == pytest.approx((0.5, 3.5))
    before = axis.get_ylim()
    panels.calm_limits(axis, np.empty(0))
    assert axis.get_ylim() == before
