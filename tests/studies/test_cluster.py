"""A study on a Dask cluster of real processes: the same table as here, whatever dies on the way."""

import json
import shutil
import signal
import subprocess
import threading
import time

import dask
import pytest

from palpate.cli import main
from palpate.errors import InputError
from palpate.studies import cluster as clusters
from palpate.studies.cluster import Cluster, pack, run_on_worker
from palpate.studies.journal import sources
from palpate.studies.run_one import Local, RunJob
from palpate.studies.run_study import Work
from studies.cluster import local_cluster
from studies.small import SMALL, planned, text

MORE = SMALL.replace("points = 3", "points = 20")


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """The table of `MORE` from the threads of this process."""
    folder = tmp_path_factory.mktemp("here") / "out"
    Work(planned(MORE), MORE, folder, Local()).run()
    return (folder / "results.parquet").read_bytes()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Workers take seconds to start: one cluster for all, which loses a worker first and its scheduler at last."""
    with local_cluster(tmp_path_factory.mktemp("cluster"), workers=2) as running:
        yield running


def on(address, folder, **options):
    """The table of `MORE` from a cluster."""
    runner = Cluster(address, **options)
    try:
        Work(planned(MORE), MORE, folder, runner).run()
    finally:
        runner.close()
    return (folder / "results.parquet").read_bytes()


@pytest.mark.long
def test_two_workers_make_the_table_that_threads_make_and_one_may_die(cluster, tmp_path, here):
    def die(finished):
        if finished >= 20:
            cluster.workers[0].kill()

    runner = Cluster(cluster.address)
    Work(planned(MORE), MORE, tmp_path / "out", runner, die).run()
    runner.close()
    assert (tmp_path / "out" / "results.parquet").read_bytes() == here
    assert cluster.workers[0].wait() != 0


@pytest.mark.long
def test_the_runs_of_a_frozen_worker_are_sent_again(tmp_path, here):
    with local_cluster(tmp_path, workers=2) as running:
        frozen = running.workers[0]
        killer = threading.Timer(0.3, lambda: frozen.send_signal(signal.SIGSTOP))
        killer.start()
        begin = time.monotonic()
        try:
            assert on(running.address, tmp_path / "out") == here
            assert time.monotonic() - begin < 60.0
        finally:
            killer.join()
            frozen.send_signal(signal.SIGCONT)


@pytest.mark.long
def test_a_cluster_that_goes_away_loses_nothing(cluster, tmp_path, here):
    folder, source = tmp_path / "out", MORE

    def leave(finished):
        if finished >= 20:
            cluster.scheduler.kill()

    runner = Cluster(cluster.address)
    with pytest.raises(InputError, match="failed") as gone:
        Work(planned(source), source, folder, runner, leave).run()
    runner.close()
    assert "the same command resumes" in str(gone.value)
    Work(planned(source), source, folder, Local()).run()
    assert (folder / "results.parquet").read_bytes() == here


@pytest.mark.long
def test_a_cluster_without_workers_is_refused(tmp_path):
    with local_cluster(tmp_path, workers=0) as empty, pytest.raises(InputError, match="has no worker"):
        on(empty.address, tmp_path / "out", patience=1.0)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense://x", "127.0.0.1:notaport", "tcp://[::1"])
def test_no_scheduler_is_reported_in_a_line(address, monkeypatch):
    monkeypatch.setattr(clusters, "CONNECT", 0.5)
    with pytest.raises(InputError, match="no Dask scheduler answers at") as refused:
        Cluster(address)
    assert "\n" not in str(refused.value)


@pytest.mark.long
@pytest.mark.skipif(shutil.which("openssl") is None, reason="certificates are made by openssl")
def test_a_cluster_is_reached_through_tls(tmp_path):
    """With the certificate that its authority signed, and not without."""
    key, certificate = tmp_path / "key.pem", tmp_path / "cert.pem"
    made = ("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=palpate")
    subprocess.run(["openssl", *made, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    words = ("--tls-ca-file", certificate, "--tls-cert", certificate, "--tls-key", key)
    with local_cluster(tmp_path, workers=1, words=("--protocol", "tls", *map(str, words))) as running:
        assert running.address.startswith("tls://")
        place = "distributed.comm.tls"
        files = {
            f"{place}.ca-file": certificate,
            f"{place}.client.cert": certificate,
            f"{place}.client.key": key,
        }
        with dask.config.set({name: str(file) for name, file in files.items()}):
            runner = Cluster(running.address)
            done = list(runner.run(jobs(1)))
            runner.close()
    assert [row.result for row in done] == ["done"]


def jobs(count):
    plan = planned(SMALL)
    return [RunJob(plan.setting(i), tuple(plan.study.metrics), None) for i in range(count)]


def test_a_worker_with_other_sources_refuses():
    packed = pack(jobs(1)[0])
    other = sources() | {"palpate's sources": "0123456789abcdef", "numpy": "1.0"}
    with pytest.raises(
        InputError, match=r"other sources than the study: numpy .* \(here 1.0\), palpate's sources"
    ):
        run_on_worker(packed, other)
    assert run_on_worker(packed, sources()).result == "done"


@pytest.mark.long
def test_a_run_that_kills_workers_has_a_result_of_its_own_and_costs_no_other(tmp_path, monkeypatch):
    """It dies beside others in a task, and then alone; short runs share one."""
    monkeypatch.setattr(clusters, "MAX_SENT", 4)
    deadly = "__import__('os')._exit(7)"
    items = [str(i) for i in range(250)]
    items[180] = deadly
    with local_cluster(tmp_path, workers=10) as running:
        runner = Cluster(running.address)
        found = list(runner.map(eval, items, lambda item, why: (item, why)))
        runner.close()
    (died,) = (result for result in found if isinstance(result, tuple))
    assert died[0] == deadly
    assert "died" in died[1]
    assert sorted(result for result in found if result != died) == [i for i in range(250) if i != 180]


@pytest.mark.long
def test_workers_run_a_controller_of_ones_own(tmp_path, capsys, monkeypatch, root):
    """As a user types it: the module lies beside the study, the workers were started somewhere else."""
    (tmp_path / "push_of_mine.py").write_text((root / "tests" / "own_parts.py").read_text(encoding="utf-8"))
    cases = 'mine = { controller = { kind = "push_of_mine:Push" } }\nPI = {}'
    metrics = '["force_rms", "push_of_mine:mean_force"]'
    source = text(f"[parameters.law.cases]\n{cases}", metrics=metrics)
    (tmp_path / "mine.toml").write_text(source, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = ["study", "mine.toml", "--plugins", "--json"]
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with local_cluster(elsewhere, workers=2, place=elsewhere) as running:
        assert main([*words, "--out", "there", "--scheduler", running.address]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["results"] == {"done": 2}
