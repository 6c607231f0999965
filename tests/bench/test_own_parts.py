"""Parts of the user's in an experiment: what is taken, what is refused before the first tick, and in which words."""

import pickle
import sys

import numpy as np
import pytest

from bench.quick import quick
from own_parts import HEAD, Normal, Push, controller
from palpate.bench import build, with_values
from palpate.bench.from_experiment import check_parts
from palpate.bench.tables import parse
from palpate.cli import main
from palpate.errors import InputError, PartError
from palpate.logs import read_log, write_record

pytestmark = pytest.mark.usefixtures("permitted")

EXPERIMENT = """
title = "Mine"
[surface]
kind = "own_parts:Spring"
stiffness = 5000
[controller]
kind = "own_parts:Push"
ki = 2
hold = [0.0, 1500.0, 2.0]
[identifier]
kind = "own_parts:Normal"
[run]
press = 0.2
duration = 1.5
[robot]
start = [0.4635, 0.0, 0.0]
[approach]
hold = 0.05
first = 0.470
step = 0.002
period = 0.1
"""


@pytest.fixture
def module(tmp_path, monkeypatch, request):
    """Writes a module beside an experiment's file; the name under which it is found, unlike any other's."""
    monkeypatch.chdir(tmp_path)
    name = f"plug_{abs(hash(request.node.name))}"

    def write(source, name=name):
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
        return name

    yield write
    sys.modules.pop(name, None)


def with_controller(kind):
    return with_values(quick("foam-hybrid"), {"controller": {"kind": kind}})


def test_an_experiment_is_made_of_them():
    experiment = parse(EXPERIMENT, "mine")
    bench = build(experiment)
    assert bench.loop.controller == Push(2.0, (0.0, 1500.0, 2.0), 1e-3)
    assert bench.loop.plant.surface.damping == 100.0
    record = bench.run(0.8, seed=1, press=0.2, compiled=False)
    assert (record["phase"] == 1.0).any()
    assert record.meta["experiment"]["controller"]["kind"] == "own_parts:Push"
    # The identifier is fed what the matched least squares are: with a start as vague it says the same.
    assert record["K_identifier"][-1] == pytest.approx(record["K_matched"][-1], rel=1e-3)
    assert np.isnan(record["K_identifier"][0])


def test_its_numbers_change_as_any_other_and_it_goes_to_another_process():
    experiment = with_values(parse(EXPERIMENT, "mine"), {"controller.ki": 5.0})
    assert experiment.controller.ki == 5.0
    assert pickle.loads(pickle.dumps(experiment)) == experiment


def test_identifiers_of_palpate_are_named_by_their_kind():
    for kind in ("least-squares", "restarting-least-squares"):
        experiment = with_values(quick("foam-hybrid"), {"identifier": {"kind": kind}})
        record = build(experiment).run(0.5, seed=1, press=0.2)
        assert np.isfinite(record["K_identifier"][-1])
        assert record["K_identifier"][-1] == pytest.approx(record["K_matched"][-1], rel=0.05)


def test_with_identifier_has_one_for_each_run():
    bench = build(quick("foam-hybrid")).with_identifier(Normal)
    first, again = (bench.run(0.4, seed=1) for _ in range(2))
    np.testing.assert_array_equal(first["K_identifier"], again["K_identifier"])


REFUSED = {
    "no module": ("nowhere_at_all:Bad", "there is no module 'nowhere_at_all'"),
    "a path": ("folder/student.py:Bad", "write 'student:Bad'"),
    "no name": ("student:", "write module:Name"),
    "nothing of that name": ("own_parts:Psuh", "did you mean 'Push'"),
    "no class": ("own_parts:mean_force", "a controller is a class"),
    "no tuple": ("own_parts:Normal", "is no NamedTuple"),
    "another part": ("own_parts:Spring", "has no method step"),
}


@pytest.mark.parametrize(("kind", "why"), REFUSED.values(), ids=REFUSED)
def test_what_is_no_controller_is_refused(kind, why):
    with pytest.raises(InputError, match=why) as refused:
        with_controller(kind)
    assert "\n" not in str(refused.value)


WRONG = {
    "syntax": ("def (", "SyntaxError"),
    "raises when imported": (f"{HEAD}1 / 0", "line 3: ZeroDivisionError"),
    "leaves": ("raise SystemExit(3)", "SystemExit"),
    "missing library": ("import no_such_library", "line 1: ModuleNotFoundError"),
    "wrong arguments": (controller("pass").replace("sense, task, model", "sense"), "it must be step"),
    "text in a field": (controller("pass").replace("ki: float = 1.0", "ki: str = 'a'"), "may be float, int"),
}


@pytest.mark.parametrize(("source", "why"), WRONG.values(), ids=WRONG)
def test_a_module_that_cannot_be_used_says_why(module, source, why):
    with pytest.raises(InputError, match=why) as refused:
        with_controller(f"{module(source)}:Bad")
    assert "\n" not in str(refused.value)


FAILS = {
    "raises": (controller("return sense.force, state"), "line 8: AttributeError"),
    "not a number": (controller("return float('nan') * model.h, state"), "every number must be finite"),
    "torque alone": (controller("return model.h"), r"must return \(torque, state\)"),
    "no vector": (controller("return 1.0, state"), "must be a Vec3"),
    "another state": (controller("return model.h, (state, 1.0)"), "state of another type"),
}


@pytest.mark.parametrize(("source", "why"), FAILS.values(), ids=FAILS)
def test_what_fails_at_its_first_tick_is_told_before_the_run(module, source, why):
    with pytest.raises(InputError, match=why) as refused:
        check_parts(build(with_controller(f"{module(source)}:Bad")))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("source", "why"),
    [
        (controller("return helper(model.h), state", "def helper(x):\n    return x\n"), "mark it with @law"),
        (
            controller("return Vec3(np.linalg.norm(sense.x), 0.0, 0.0), state", "import numpy as np\n"),
            "knows no norm",
        ),
    ],
    ids=["plain function", "library"],
)
def test_what_the_compiler_cannot_is_told_with_its_line(module, source, why):
    name = module(source)
    with pytest.raises(InputError, match=why) as refused:
        check_parts(build(with_controller(f"{name}:Bad")))
    assert f"{name}.py, line" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_script_is_told_the_same_in_one_line_and_keeps_the_compilers_words(module, monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(tmp_path)
    name = module(controller("return helper(model.h), state", "def helper(x):\n    return x\n"))
    part = __import__(name).Bad()
    with pytest.raises(PartError, match="mark it with @law") as failed:
        build(quick("foam-hybrid")).with_controller(part).run(0.01)
    assert failed.value.__cause__ is None
    assert "Failed in nopython mode" in failed.value.compiler


def test_a_bad_identifier_is_told(module):
    name = module(
        "class Bad:\n    def update(self, regressor, force): pass\n    def estimate(self): return 3.0\n"
    )
    with pytest.raises(InputError, match="AttributeError"):
        check_parts(build(with_values(quick("foam-hybrid"), {"identifier": {"kind": f"{name}:Bad"}})))


def test_keys_are_the_parts_own_fields():
    for text, why in (
        ("gain = 2", "unknown key 'gain'.*in \\[controller\\]"),
        ("ki = 'a'", "ki in \\[controller\\] must be a number"),
        ("tick = 0.1", "unknown key 'tick'"),
    ):
        with pytest.raises(InputError, match=why):
            parse(EXPERIMENT.replace("ki = 2", text), "mine")


@pytest.mark.long
def test_a_record_that_names_a_part_imports_nothing(module, tmp_path):
    """A log is a stranger's: the names in it are texts."""
    name = module("raise RuntimeError('imported')")
    record = build(quick("foam-hybrid")).run(0.6, seed=1)
    experiment = {**record.meta["experiment"], "controller": {"kind": f"{name}:Bad"}}
    poisoned = type(record)(record.columns, record.units, {**record.meta, "experiment": experiment})
    write_record(poisoned, tmp_path / "record.parquet")
    assert len(read_log(tmp_path / "record.parquet")) == len(record)
    assert main(["identify", "record.parquet", "--json"]) in {0, 1, 2}
    assert name not in sys.modules
