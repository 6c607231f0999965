"""The thesis' laboratory: its unknowns, what it makes of an experiment, and the search for it."""

import math
import re
import sqlite3
from contextlib import closing
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from matplotlib.figure import Figure

from cli.json_keys import documented
from palpate.bench import Experiment, build, load, with_values
from palpate.bench.summary import CONTACT
from palpate.cli import main
from palpate.errors import InputError
from palpate_laboratory import (
    archive,
    contradictions,
    findings,
    infer,
    judge,
    laboratory,
    result,
    sampler,
    search,
)
from palpate_laboratory.archive import Tried
from palpate_laboratory.contradictions import Bred, breed
from palpate_laboratory.judge import drawn_shares, judged_shares
from palpate_laboratory.laboratory import (
    CHOSEN,
    Laboratory,
    laboratory_at,
    laboratory_from,
    stiffening,
)
from palpate_laboratory.result import (
    EXCLUDED,
    IMPOSSIBLE,
    NOT_FOUND,
    Contradiction,
    marginals,
    reasons,
    worth,
)
from palpate_laboratory.sampler import Settings, sample
from palpate_laboratory.search import MISS, Job, PosteriorSearch, Threads, Workers
from palpate_laboratory.sentences import HOLDS, TELLING_FIRST, sentences, sentences_of_search
from palpate_laboratory.trial import Trial
from palpate_laboratory.unknowns import (
    BY_NAME,
    LINEAR,
    LISTING,
    RELAXING,
    STIFFENING,
    UNKNOWNS,
    Unknown,
)
from palpate_studies.cluster import Cluster
from palpate_thesis.claims import ThesisClaim, count_in_words, count_verdicts, with_wholes
from palpate_thesis.conditions import rougher
from palpate_thesis.figure import studies, study
from palpate_thesis.force_control.tracking import FOAM, RUBBER, SINE
from palpate_thesis.least_squares import panels, press_runs
from palpate_thesis.measure import MeasurementFormat, measure
from palpate_thesis.neural_identifier.network import NetworkPress
from palpate_thesis.runs import Runs
from studies.cluster import local_cluster


def test_every_unknown_is_a_field_with_a_range_that_holds_its_own_ends():
    assert [u.name for u in UNKNOWNS] == list(Laboratory.__dataclass_fields__)
    for u in UNKNOWNS:
        assert u.reason
        assert u.low < u.high
        assert u.at(0.0) == pytest.approx(u.choices[0] if u.choices else u.low)
        assert u.at(1.0) == pytest.approx(u.choices[-1] if u.choices else u.high)


def test_the_hand_chosen_bench_lies_in_the_ranges():
    for name, value in CHOSEN.numbers().items():
        assert BY_NAME[name].holds(value), name


@pytest.mark.parametrize("experiment", [FOAM, RUBBER, press_runs.PLAIN, press_runs.RELAXING])
def test_the_hand_chosen_bench_changes_nothing(experiment: Experiment):
    assert CHOSEN.of(experiment) == experiment


def test_what_a_figure_varies_is_varied_about_the_laboratorys_own_value():
    lab = Laboratory(friction=0.5, foam_damping=100.0)
    twice = lab.of(with_values(FOAM, {**rougher(FOAM, 2.0), "surface.damping": 400.0}))
    assert twice.friction.coulomb == pytest.approx(FOAM.friction.coulomb)
    assert twice.surface.damping == pytest.approx(200.0)


def test_a_laboratory_changes_what_it_names():
    lab = Laboratory(
        wall=0.45,
        motor2=5.0,
        noise=0.3,
        controller_weights=3.0,
        restart=0.0,
        arm_stiffness=1e5,
        asymmetry=0.2,
    )
    e = lab.of(with_values(FOAM, SINE))
    assert e.wall.x - e.robot.start[0] == pytest.approx(FOAM.wall.x - FOAM.robot.start[0])
    assert e.robot.torque_limits == (16.0, 5.0, 0.6)
    assert e.force_sensor.noise == pytest.approx(0.3)
    assert (e.controller.weights, e.controller.weights_seed) == ("random", 3)
    assert e.force.restart == 0.0
    assert e.elastic is not None
    assert e.elastic.stiffness == 1e5
    assert e.friction.asymmetry == 0.2


TRIED = {
    "foam press": press_runs.PLAIN,
    "rubber press": press_runs.RUBBER,
    "steps on foam": FOAM,
    "steps on rubber": RUBBER,
    "sine on foam": with_values(FOAM, SINE),
}
IN_THE_NETWORK = {"amplitude", "weights", "start"}  # of the identifier, which thinks after the run


@pytest.mark.parametrize(
    "unknown", [u for u in UNKNOWNS if u.name not in IN_THE_NETWORK], ids=lambda u: u.name
)
def test_every_unknown_enters_some_experiment(unknown: Unknown):
    law = {"foam_branch": RELAXING, "foam_branch_time": RELAXING, "foam_exponent": STIFFENING}
    base = replace(laboratory_at([0.4] * len(UNKNOWNS)), foam_law=law.get(unknown.name, LINEAR))
    other = replace(base, **{unknown.name: unknown.at(0.9)})
    assert any(base.of(e) != other.of(e) for e in TRIED.values())


@pytest.mark.parametrize(
    ("case", "of"),
    [
        ("foam press", {"foam_law": STIFFENING}),
        ("foam press", {"foam_law": RELAXING}),
        ("foam press", {"roughness": 50.0}),
        ("foam press", {"arm_stiffness": 1e5, "arm_frequency": 30.0}),
        ("foam press", {"asymmetry": 0.3}),
        ("foam press", {"beyond": 0.2}),
        ("sine on foam", {"restart": 0.0}),
        ("steps on foam", {"controller_weights": 2.0}),
    ],
    ids=str,
)
def test_what_no_figure_had_tried_changes_the_runs(case: str, of: dict[str, float]):
    press = 5.5 if "restart" in of else 0.5  # the clock starts anew after 5 s
    short = with_values(TRIED[case], {"run.press": press, "run.steps": 5})
    bench, other = (build(lab.of(short)).run(60.0, 0, press=press) for lab in (CHOSEN, Laboratory(**of)))
    force = [record["force_measured"][record["phase"] == CONTACT] for record in (bench, other)]
    rows = min(map(len, force))
    assert rows > 100
    assert not np.allclose(force[0][:rows], force[1][:rows])


def test_the_identifiers_unknowns_enter_its_answer():
    t = np.arange(4000) * 1e-3
    inputs = np.column_stack([4e-3 * t / 4.0, np.full(4000, 1e-3), np.zeros(4000)])
    press = NetworkPress("foam", inputs, 20.0 * t / 4.0, 5000.0, np.zeros((4000, 3)))
    base = Trial(Laboratory(start=1.0)).identifiers_answer(press)
    for of in ({"amplitude": 80.0}, {"weights": 1.5}, {"start": 2.0}):
        assert Trial(Laboratory(**{"start": 1.0, **of})).identifiers_answer(press) != base


def test_foams_of_all_laws_sink_in_alike_from_5_to_20_N():
    for n in (1.0, 1.5, 2.5):
        s = stiffening(5200.0, 200.0, 0.1, n)
        depth = [(f / s["stiffness"]) ** (1.0 / n) for f in (5.0, 20.0)]
        assert 15.0 / (depth[1] - depth[0]) == pytest.approx(5200.0)
        assert s["damping"] * depth[1] ** n == pytest.approx(200.0)
        assert press_runs.own_damping(s) == pytest.approx(200.0)
    assert Laboratory(foam_law=STIFFENING).of(FOAM).surface.exponent == 1.5
    assert Laboratory(foam_law=RELAXING, foam_branch=2.0).of(FOAM).surface.branch_stiffness == pytest.approx(
        10400.0
    )
    assert Laboratory(foam_law=RELAXING).of(RUBBER).surface.stiffness == RUBBER.surface.stiffness


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
        laboratory.load_laboratory(str(path))
    assert "\n" not in str(refused.value)


def test_a_laboratory_comes_back_from_its_file(tmp_path):
    lab = laboratory_at([0.3] * len(UNKNOWNS))
    path = tmp_path / "lab.toml"
    path.write_text(laboratory.text(lab, 'about "it"', "palpate laboratory --seed 1", 1))
    assert laboratory.load_laboratory(str(path)) == lab
    assert laboratory_from({}, "nothing") == CHOSEN


def test_each_surface_and_each_controller_stands_in_both_halves():
    for half in (True, False):
        ids = " ".join(s.id for s in sentences() if s.calibrates is half)
        for word in ("foam", "rubber", "least-squares", "network", "neural-foam", "neural-rubber"):
            assert word in ids, (half, word)


def test_sentences_are_claims_of_their_figures_and_each_has_a_law():
    assert {s.id for s in sentences()} == set(HOLDS)
    assert len(sentences()) == len(HOLDS)
    assert {s.figure for s in sentences()} <= {s.NUMBER for s in studies()}
    assert {s.figure for s in sentences_of_search(calibrating=False)} == set(TELLING_FIRST)


def gaussian(points, _):
    return -0.5 * (((points - MIDDLE) / WIDTH) ** 2).sum(axis=1)


MIDDLE, WIDTH = np.array([0.3, 0.6, 0.5]), np.array([0.05, 0.1, 0.02])


def test_the_sampler_finds_a_known_posterior():
    found = sample(gaussian, np.zeros(3, dtype=bool), Settings(400, 4, 4, 1))
    # 400 points know a mean to a twentieth of the width, and the width to a twenty-eighth of it; three times that.
    assert np.all(np.abs(found.points.mean(axis=0) - MIDDLE) < 0.15 * WIDTH)
    assert found.points.std(axis=0) == pytest.approx(WIDTH, rel=0.15)
    assert found.stages[-1].beta == 1.0


def test_the_sampler_weighs_choices_and_steps():
    def steps(points, _):
        return np.where(points[:, 0] < 0.25, 0.0, -math.log(3.0))

    found = sample(steps, np.array([True]), Settings(2000, 2, 4, 2))
    # A quarter of the prior weighs three times as much as the rest: half of the posterior; three standard errors.
    assert np.mean(found.points[:, 0] < 0.25) == pytest.approx(0.5, abs=3 * 0.5 / math.sqrt(2000))


def test_a_floor_never_changes_what_is_sampled():
    def lazy(points, floor):
        full = gaussian(points, floor)
        return np.where(full < floor, -np.inf, full)

    settings = Settings(40, 4, 2, 3)
    redrawn = np.zeros(3, dtype=bool)
    assert np.array_equal(sample(gaussian, redrawn, settings).points, sample(lazy, redrawn, settings).points)


class Stub:
    """Tries laboratories by a rule that costs nothing, and can be interrupted."""

    def __init__(self, after: int | None = None):
        self.after, self.asked = after, 0

    def try_all(self, jobs, ids):
        for job in jobs:
            if self.asked == self.after:
                raise KeyboardInterrupt
            self.asked += 1
            holds = [job.shares[i % len(job.shares)] < 0.7 for i in range(len(ids))]
            cut = next(
                (i + 1 for i in range(len(ids)) if holds[: i + 1].count(False) > job.allowed), len(ids)
            )
            yield Tried(job.number, job.shares, tuple(holds[:cut]))


def test_an_interrupted_search_ends_as_one_that_was_not(tmp_path):
    of, settings = sentences_of_search(calibrating=True), Settings(16, 2, 1, 5)
    whole = PosteriorSearch(of, settings, Stub()).run(tmp_path / "whole.sqlite")
    with pytest.raises(KeyboardInterrupt):
        PosteriorSearch(of, settings, Stub(after=50)).run(tmp_path / "cut.sqlite")
    path = tmp_path / "cut.sqlite"
    again = Stub()
    resumed = PosteriorSearch(of, settings, again).run(path)
    assert np.array_equal(whole.points, resumed.points)
    assert again.asked == len(archive.read(tmp_path / "whole.sqlite")[1]) - 50
    assert resumed.likelihood.max() >= -MISS * len(of)


def test_an_archive_of_another_search_is_refused(tmp_path):
    of, path = sentences_of_search(calibrating=True), tmp_path / "some.sqlite"
    PosteriorSearch(of, Settings(8, 2, 1, 5), Stub()).run(path)
    with pytest.raises(InputError, match="another search"):
        PosteriorSearch(of, Settings(8, 2, 1, 6), Stub()).run(path)
    path.write_bytes(b"not ours\n")
    with pytest.raises(InputError, match="did not write it"):
        PosteriorSearch(of, Settings(8, 2, 1, 5), Stub()).run(path)


def test_a_damaged_archive_is_one_line_and_a_strangers_is_not_touched(tmp_path):
    of, path = sentences_of_search(calibrating=True), tmp_path / "some.sqlite"
    PosteriorSearch(of, Settings(8, 2, 1, 5), Stub()).run(path)
    whole = path.read_bytes()
    path.write_bytes(whole[:100] + bytes(len(whole) - 100))
    with pytest.raises(InputError, match="damaged"):
        PosteriorSearch(of, Settings(8, 2, 1, 5), Stub()).run(path)
    other = tmp_path / "other.sqlite"
    with closing(sqlite3.connect(other)) as connection:
        connection.execute("CREATE TABLE years (work)")
    before = other.read_bytes()
    with pytest.raises(InputError, match="did not write it"):
        PosteriorSearch(of, Settings(8, 2, 1, 5), Stub()).run(other)
    assert other.read_bytes() == before


def test_a_search_knows_the_sources_of_the_figures_that_it_asks():
    """Else one would be resumed after a figure had changed."""
    files = search.sources()
    assert all(path.is_file() for path in files)
    names = {path.name for path in files}
    assert {
        "fig_6_11_17.py",
        "tracking.py",
        "press_runs.py",
        "network.py",
        "laboratory.py",
        "trial.py",
    } <= names


def test_a_value_is_computed_once(tmp_path):
    values = iter([{"a": 1}, {"a": 2}])
    path = tmp_path / "judged.sqlite"
    assert archive.remember(path, "one", dict[str, int], lambda: next(values)) == {"a": 1}
    assert archive.remember(path, "one", dict[str, int], lambda: next(values)) == {"a": 1}
    assert archive.remember(path, "other", dict[str, int], lambda: next(values)) == {"a": 2}


def test_what_one_search_tried_in_full_is_lent_to_the_other(tmp_path):
    all_, half = sentences_of_search(calibrating=False), sentences_of_search(calibrating=True)
    settings, path = Settings(8, 2, 1, 5), tmp_path / "all.sqlite"
    one = PosteriorSearch(all_, settings, Stub())
    one.run(path)
    lent = search.borrow(path, one.head(), all_, half)
    full = {n: t for n, t in archive.read(path)[1].items() if len(t.verdicts) == len(all_)}
    assert set(lent) == set(full)
    assert lent[0].verdicts == tuple(full[0].verdicts[all_.index(s)] for s in half)


def test_a_laboratory_is_given_up_once_it_misses_more_than_is_allowed():
    ids = [s.id for s in sentences_of_search(calibrating=True) if s.figure == "6.1"]
    job = Job(0, (0.0,) * len(UNKNOWNS), -1.0)  # no miss at all is allowed: given up at the first sentence
    assert len(search.attempt(job, ids).verdicts) == 1


def test_threads_try_what_they_are_given():
    ids = tuple(s.id for s in sentences_of_search(calibrating=True) if s.figure == "6.1")
    jobs = [Job(n, (0.5,) * len(UNKNOWNS), math.inf) for n in range(2)]
    found = sorted(Threads(2).try_all(jobs, ids), key=lambda t: t.number)
    assert found[0].verdicts == found[1].verdicts
    assert [t.number for t in found] == [0, 1]


@pytest.mark.long
def test_a_worker_of_a_cluster_finds_what_a_thread_does(tmp_path):
    ids, jobs = ("force-noise",), [Job(n, (0.5,) * len(UNKNOWNS), math.inf) for n in range(2)]
    with local_cluster(tmp_path, workers=1) as running:
        cluster = Cluster(running.address)
        try:
            found = list(Workers(cluster).try_all(jobs, ids))
        finally:
            cluster.close()
    assert sorted(found, key=lambda t: t.number) == sorted(
        Threads(1).try_all(jobs, ids), key=lambda t: t.number
    )


def test_a_trial_of_the_bench_says_what_its_figures_do():
    trial = Trial(CHOSEN, steps=20)
    record = build(press_runs.PLAIN).run(60.0, 0, press=press_runs.PLAIN.run.press)
    assert trial.foam is not None
    assert trial.foam.found == press_runs.numbers_of(record)


def test_contradictions_are_pairs_that_were_expected_and_never_seen():
    rng = np.random.default_rng(4)
    first = rng.random(200) < 0.5
    rows = {
        i: Tried(i, (0.5,), (bool(a), not a, bool(rng.random() < 0.5), False)) for i, a in enumerate(first)
    }
    table = contradictions.table(("a", "not a", "by chance", "never"), rows)
    (found,) = table.never_together()
    assert found.ids == ("a", "not a")
    assert found.parts == (first.sum(), (~first).sum())
    assert found.expected == pytest.approx(first.sum() * (~first).sum() / 200)
    assert found.excluded
    assert [x.id for x in table.alone() if x.true == 0] == ["never"]


def test_three_sentences_may_exclude_each_other_though_each_two_do_not():
    rng = np.random.default_rng(5)
    cases = ((True, True, False), (True, False, True), (False, True, True), (False, False, False))
    rows = {i: Tried(i, (0.5,), cases[rng.integers(4)]) for i in range(400)}
    (found,) = contradictions.table(("a", "b", "c"), rows).never_together()
    assert found.ids == ("a", "b", "c")
    # each two hold in a quarter of all, each one in half: n (1/4)^3 / (1/2)^3
    assert found.expected == pytest.approx(400 / 8, rel=0.2)
    assert found.excluded
    few = contradictions.table(("a", "b", "c"), {i: rows[i] for i in range(20)}).never_together()
    assert not any(one.excluded for one in few)


class Rule:
    """Makes each sentence true where its share of the prior lies above a level."""

    def __init__(self, level: float):
        self.level, self.asked = level, 0

    def try_all(self, jobs, ids):
        for job in jobs:
            self.asked += 1
            yield Tried(job.number, job.shares, tuple(job.shares[int(id_)] > self.level for id_ in ids))


def halves_apart(level: float) -> contradictions.VerdictTable:
    points = np.random.default_rng(6).random((60, 8))
    points[:, 1] = np.where(points[:, 0] > level, level * points[:, 1], points[:, 1])
    rows = {i: Tried(i, tuple(p), (p[0] > level, p[1] > level)) for i, p in enumerate(points)}
    return contradictions.table(("0", "1"), rows)


def test_what_only_looked_like_a_contradiction_is_bred_away():
    among = halves_apart(0.7)
    assert [one.ids for one in among.never_together()] == [("0", "1")]
    found = breed(("0", "1"), among, Rule(0.7), 96, 1)
    assert found.most == 2
    assert min(found.shares[:2]) > 0.7
    assert found.tries < 96


def test_what_cannot_be_is_not_bred():
    class Never(Rule):
        def try_all(self, jobs, ids):
            for one in super().try_all(jobs, ids):
                first = one.verdicts[0]
                yield Tried(one.number, one.shares, (first, not first))

    runner = Never(0.5)
    found = breed(("0", "1"), halves_apart(0.5), runner, 40, 1)
    assert (found.most, found.tries, runner.asked) == (1, 40, 40)


def test_a_contradiction_is_called_what_is_known_of_it():
    ids = tuple(s.id for s in sentences_of_search(calibrating=False))
    law, plain = next(iter(reasons())), f"{ids[0]} + {ids[1]}"
    for names in reasons():
        parts = names.split(" + ")
        assert [i for i in ids if i in parts] == parts, "unknown names, or not in the order of the search"

    def one(names: str, expected: float, most: int) -> Contradiction:
        together = contradictions.Together(tuple(names.split(" + ")), (9, 9), 20, expected, 10.0)
        return Contradiction(together, Bred(96, most, ()))

    assert one(law, 4.0, 1).verdict == IMPOSSIBLE
    assert one(plain, 12.0, 1).verdict == EXCLUDED
    assert one(plain, 4.0, 1).verdict == NOT_FOUND
    assert not one(law, 12.0, 2).stands


def test_a_laboratory_is_better_only_beyond_chance():
    validation = [s.id for s in judge.validation()]

    def against(only_there: int, only_here: int) -> result.InferenceResult:
        there = dict.fromkeys((s.id for s in sentences()), 0)
        here = dict(there)
        there.update(dict.fromkeys(validation[:only_there], 10))
        here.update(dict.fromkeys(validation[only_there : only_there + only_here], 10))
        none = sampler.Sample(*([()] * 5))
        lab, bench = judge.Judged(CHOSEN, 10, there), judge.Judged(CHOSEN, 10, here)
        return result.InferenceResult(none, None, bench, lab, lab, (), (), (), None)

    assert against(5, 4).cross_validation == (5, 4)
    assert against(5, 4).by_chance == pytest.approx(0.5)  # of nine heads or tails five or more
    assert not against(5, 4).better
    assert against(5, 0).by_chance == pytest.approx(1.0 / 32.0)
    assert against(5, 0).better


def test_relatives_are_worth_less_than_strangers():
    rng = np.random.default_rng(7)
    of = rng.standard_normal((400, 5))
    strangers = sampler.Sample(of, np.zeros(400), (), of, np.arange(400))
    assert worth(strangers) == pytest.approx(400.0, rel=0.01)
    families = np.repeat(np.arange(40), 10)
    copies = sampler.Sample(of, np.zeros(400), (), of[families], families)
    assert worth(copies) == pytest.approx(40.0, rel=0.05)
    assert worth(sampler.Sample(of, np.zeros(400), (), of, np.zeros(400, dtype=int))) == pytest.approx(1.0)
    # families that forgot their ancestor are strangers again: 40 of them know it to a fifth
    forgot = sampler.Sample(of, np.zeros(400), (), of, families)
    assert np.median(worth(forgot)) == pytest.approx(400.0, rel=0.4)


def test_the_sampler_tells_what_lies_before_it():
    told = []
    sample(gaussian, np.zeros(3, dtype=bool), Settings(40, 4, 2, 3), lambda *one: told.append(one))
    assert told[0] == (0.0, 160)
    assert [count for _, count in told[1:-1]] == [80] * (len(told) - 2)
    assert told[-1] == (1.0, 240)


def test_a_share_is_told_with_its_spread():
    of = [s for s in sentences() if s.figure in {"6.1", "6.2"}]
    rows = {i: Tried(i, (0.5,), (i < 2,) * len(of)) for i in range(4)}
    rows[4] = Tried(4, (0.5,), (True,))  # given up
    found = drawn_shares("some", contradictions.table([s.id for s in of], rows), of)
    assert found.laboratories == 4
    assert (found.calibration.mean, found.calibration.of) == (0.5, 3)
    assert found.validation.spread == pytest.approx(math.sqrt(1.0 / 3.0))
    one = judge.Judged(CHOSEN, 10, {s.id: 3 for s in of})
    assert judged_shares("one", one, of).validation.mean == pytest.approx(0.3)


def test_verdicts_that_were_given_up_are_not_taken_for_no():
    rows = {0: Tried(0, (0.5,), (True, False)), 1: Tried(1, (0.5,), (True,))}
    assert [x.tried for x in contradictions.table(("a", "b"), rows).alone()] == [2, 1]


def test_what_a_part_was_not_asked_is_not_known_of_it():
    whole = contradictions.table(("a", "b"), {0: Tried(0, (0.5,), (True, False))})
    both = contradictions.join(whole, contradictions.table(("b",), {0: Tried(0, (0.5,), (True,))}))
    assert [(x.id, x.true, x.tried) for x in both.alone()] == [("a", 1, 1), ("b", 1, 2)]


def test_marginals_say_what_is_told():
    points = np.random.default_rng(1).random((400, len(UNKNOWNS)))
    points[:, 0] = 0.5 + 0.05 * (points[:, 0] - 0.5)
    found = marginals(points)
    assert found[0].verdict == "told"
    assert found[2].verdict == "not told"
    assert re.fullmatch(r"[\d.]+ \([\d.]+ to [\d.]+\) times the bench's", found[0].in_words())


def test_the_best_of_a_posterior_miss_fewest_and_differ():
    points = np.linspace(0.1, 0.9, 4)[[0, 1, 1, 2, 3], None] * np.ones(len(UNKNOWNS))
    found = sampler.Sample(points, np.array([-2.0, -1.0, -1.0, -1.0, -3.0]), (), points, np.arange(5))
    assert infer.best(found) == [laboratory_at(points[i]) for i in (1, 3, 0, 4)[: infer.CANDIDATES]]


def test_a_figure_is_measured_in_another_laboratory(tmp_path):
    runs = Runs(range(2), laboratory=Laboratory(noise=0.15))
    (done,) = measure(
        [study("4.4")], runs, tmp_path / "thesis", written=MeasurementFormat("palpate thesis 4.4")
    )
    (claim,) = done.claims
    assert claim.verdict == "differs"
    assert "noise 0.15" in claim.note
    assert "1 claim measured" in (tmp_path / "thesis" / "index.html").read_text()
    rows = msgspec.json.decode((tmp_path / "thesis" / "claims.json").read_bytes())
    assert [r["group"] for r in rows] == [False]


def row(name: str, verdict) -> ThesisClaim:
    return ThesisClaim(name, "", "", "", "", "", verdict, "")


def test_claims_are_counted_without_the_rows_that_sum_them_up():
    rows = with_wholes([row("a.K", "reproduced"), row("a.B", "differs"), row("b", "not checkable")])
    assert [r.group for r in rows] == [True, False, False, False]
    assert count_verdicts(rows).total() == 3
    assert count_in_words(rows) == "3 claims measured: 1 reproduced, 1 differ, 1 not checkable"


def test_the_listings_weights_stay_where_a_figure_has_others():
    e = with_values(load("foam-neural"), {"controller.weights": "random", "controller.weights_seed": 7})
    assert Laboratory(controller_weights=2.0).of(e).controller.weights_seed == 7
    assert Laboratory(controller_weights=LISTING, noise=0.3).of(FOAM).controller.weights == "thesis"


@pytest.mark.parametrize(
    ("command", "told"),
    [
        (["thesis", "--laboratory", "nowhere"], "unknown laboratory 'nowhere'"),
        (["thesis", "2.2", "--laboratory", "lab.toml"], "tells nothing of the thesis' own laboratory"),
        (["laboratory", "--particles", "3"], "particles"),
        (["laboratory", "--scheduler", "nowhere"], "no address of a scheduler"),
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


def test_an_inference_ends_with_a_laboratory_that_is_read_again(tmp_path, monkeypatch, root):
    some = tuple(s for s in sentences() if s.figure in {"6.1", "6.8", "4.4"})
    monkeypatch.setattr(judge, "SEEDS", (0,))
    for module in (judge, findings, infer, result):
        monkeypatch.setattr(module, "sentences", lambda: some)
    monkeypatch.setattr(
        infer,
        "sentences_of_search",
        lambda *, calibrating: tuple(s for s in some if s.calibrates or not calibrating),
    )
    parts = []
    run = infer.Inference(
        tmp_path / "lab",
        Settings(8, 2, 1, 5),
        Stub(),
        "palpate laboratory --seed 5",
        told=lambda *one: parts.append(one),
    )
    told = run.run()
    found = msgspec.json.decode((tmp_path / "lab" / "found.json").read_bytes())
    assert set(found) | {"seed"} == documented(root)["laboratory"] | {"command", "written_by"}
    assert found["true"]["inferred from all"]["all"] == {"true": told.by_all.count(some), "of": len(some)}
    assert laboratory.load_laboratory(str(tmp_path / "lab" / "inferred.toml")) == told.by_all.laboratory
    assert "posterior" in (tmp_path / "lab" / "index.html").read_text()
    assert "| hand-chosen bench |" in (tmp_path / "lab" / "found.md").read_text()
    assert parts[0] == ("all sentences, prior", 0, 16)
    assert [one for one in parts if one[1] > one[2]] == []
    assert {row["name"] for row in found["predictive"]} >= {"drawn from the posterior of the half"}
    monkeypatch.setattr(infer, "present", lambda *_: None)  # the page once is enough
    again = infer.Inference(
        tmp_path / "lab", Settings(8, 2, 1, 5), Stub(after=0), "palpate laboratory --seed 5"
    )
    assert again.run().by_all == told.by_all


def test_the_page_is_made_anew_only_by_the_same_search(tmp_path):
    (tmp_path / "mine.txt").write_text("years of work")
    with pytest.raises(InputError, match="holds other files"):
        infer.Inference(tmp_path, Settings(8, 2, 1, 5), Stub(), "palpate laboratory").run(replace=False)
