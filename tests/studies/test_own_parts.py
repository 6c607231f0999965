"""The user's own parts and metrics in a study: tried before the first run, told in one line, known by their sources."""

import sys
import zlib

import pytest

from own_parts import controller
from palpate.cli import main
from palpate.errors import InputError
from palpate.studies import run
from palpate.studies.journal import head_of, sources
from palpate.studies.plan import plan_runs
from palpate.studies.run_one import RunJob, pack, run_on_worker, run_one
from palpate.studies.study import parse
from studies.small import NEAR, text

pytestmark = pytest.mark.usefixtures("permitted")

METRIC = '["force_rms", "own_parts:mean_force"]'
OWN = text(
    '[parameters.law.cases]\nmine = { controller = { kind = "own_parts:Push" } }\nPI = {}', metrics=METRIC
)
IDENTIFIED = text(
    '"identifier.memory" = [480, 960]',
    metrics='["K_identifier", "own_parts:mean_force"]',
    fixed=NEAR + 'identifier = { kind = "restarting-least-squares" }\n',
)


@pytest.fixture
def module(tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)
    name = f"study_plug_{abs(hash(request.node.name))}"

    def write(source):
        (tmp_path / f"{name}.py").write_text(source, encoding="utf-8")
        return name

    yield write
    sys.modules.pop(name, None)


def refused(capsys, tmp_path, source):
    """The one line with which a study is refused, before anything is written."""
    (tmp_path / "mine.toml").write_text(source, encoding="utf-8")
    assert main(["study", "mine.toml", "--plugins", "--out", "out"]) == 2
    told = capsys.readouterr().err
    assert told.count("palpate: ") == 1
    assert told.rstrip("\n").rpartition("\n")[2].startswith("palpate: ")
    assert not (tmp_path / "out").exists()
    return told


def test_an_identifier_and_a_metric_of_ones_own_are_columns(tmp_path):
    frame = run(IDENTIFIED, tmp_path / "out")
    assert frame["result"].to_list() == ["done"] * 2
    assert (frame["own_parts:mean_force"] > 1.0).all()
    assert frame["K_identifier"].is_not_null().all()


def test_a_study_knows_its_plugins_by_their_sources():
    planned = plan_runs(parse(OWN, "T"), "T")
    assert [one.name for one in planned.plugins] == ["own_parts:Push", "own_parts:mean_force"]
    assert head_of(planned).stamp["own_parts:Push"] == planned.plugins[0].stamp


def test_a_worker_imports_them_and_refuses_other_sources():
    from dataclasses import replace

    planned = plan_runs(parse(IDENTIFIED, "T"), "T")
    job = RunJob(planned.setting(0), tuple(planned.study.metrics), None, planned.plugins)
    row = run_on_worker(pack(job), sources())
    assert row.metrics == run_one(job).metrics
    other = replace(planned.plugins[0], stamp="0123456789abcdef")
    with pytest.raises(InputError, match=r"a worker of the cluster cannot use a plug-in: .*other sources"):
        run_on_worker(pack(job)._replace(plugins=(other,)), sources())


def test_a_plugin_that_is_not_there(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "did you mean 'Push'" in refused(capsys, tmp_path, OWN.replace("own_parts:Push", "own_parts:Psuh"))


def test_a_plugin_that_fails(capsys, module, tmp_path):
    name = module(controller("return float('nan') * model.h, state"))
    assert "every number must be finite" in refused(
        capsys, tmp_path, OWN.replace("own_parts:Push", f"{name}:Bad")
    )


@pytest.mark.parametrize(
    "parameter",
    [
        '"controller.kind" = ["hybrid", "own_parts:Spring"]',
        'law = { values = ["hybrid", "own_parts:Spring"], sets = ["controller.kind"] }',
        'law.cases = { one = {}, other = { "controller.kind" = "own_parts:Spring" } }',
    ],
    ids=["path", "sets", "cases"],
)
def test_another_part_by_whatever_way_it_is_set(capsys, module, tmp_path, parameter):
    """Though the other values are well: it is a mistake, not a row."""
    assert "has no method step" in refused(
        capsys, tmp_path, text(parameter, fixed=f"{NEAR}controller = {{}}\n")
    )


METRICS = {
    "raises": ("def bad(look):\n    return look['nothing']\n", "fails"),
    "no number": ("def bad(look):\n    return 'much'\n", "fails"),
    "no argument": ("def bad():\n    return 1.0\n", "takes one argument"),
    "no function": ("bad = 3\n", "is a int; a metric is"),
}


@pytest.mark.parametrize(("source", "why"), METRICS.values(), ids=METRICS)
def test_a_metric_that_fails(capsys, module, tmp_path, source, why):
    name = module(source)
    assert why in refused(capsys, tmp_path, IDENTIFIED.replace("own_parts:mean_force", f"{name}:bad"))


def test_results_that_name_a_plugin_import_nothing(module, tmp_path):
    """Another study is begun in a folder whose own files name code: it is refused, and nothing of it is imported."""
    name = module("raise RuntimeError('imported')")
    folder = tmp_path / "out"
    run(IDENTIFIED, folder)
    for file in ("study.toml", "runs.jsonl"):
        path = folder / file
        first, *rest = path.read_text().replace("own_parts:mean_force", f"{name}:bad").splitlines()
        if file == "runs.jsonl":  # whose lines begin with their checksum
            head_text = first.partition(" ")[2]
            first = f"{zlib.crc32(head_text.encode()):08x} {head_text}"
        path.write_text("\n".join([first, *rest, ""]))
    with pytest.raises(InputError, match="another study"):
        run(IDENTIFIED.replace("960", "1000"), folder)
    assert name not in sys.modules
