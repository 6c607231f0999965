"""A study on a Dask cluster of real processes: the same table as here, whatever dies on the way."""

import contextlib
import json
import pickle
import shutil
import signal
import socket
import subprocess
import threading
import time
from types import SimpleNamespace

import pytest
from distributed import KilledWorker

from palpate.cli import main
from palpate.errors import InputError
from palpate_studies import cluster as clusters
from palpate_studies.cluster import Certificates, Cluster, run_batch
from palpate_studies.run_one import Local, RunJob, sources
from palpate_studies.run_study import Work
from studies.cluster import local_cluster
from studies.small import SMALL, Formula, planned, text

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
def test_two_workers_make_the_table_that_threads_make_and_one_may_die(cluster, tmp_path, here, monkeypatch):
    monkeypatch.setattr(clusters, "UNIT", 0.02)  # more batches than two, so that the death falls among them
    assert on(cluster.address, tmp_path / "both") == here

    def kill():
        time.sleep(0.3)
        cluster.workers[0].kill()

    killer = threading.Thread(target=kill)
    killer.start()
    assert on(cluster.address, tmp_path / "one") == here
    killer.join()
    assert cluster.workers[0].wait() != 0


@pytest.mark.long
def test_a_cluster_that_goes_away_loses_nothing(cluster, tmp_path, here, monkeypatch):
    monkeypatch.setattr(clusters, "UNIT", 0.02)
    folder, source = tmp_path / "out", MORE

    def leave(finished):
        if finished >= 20:
            cluster.scheduler.kill()

    runner = Cluster(cluster.address)
    with pytest.raises(InputError, match="disappeared") as gone:
        Work(planned(source), source, folder, runner, leave).run()
    runner.close()
    assert "the same command resumes" in str(gone.value)
    Work(planned(source), source, folder, Local()).run()
    assert (folder / "results.parquet").read_bytes() == here


def test_a_cluster_without_workers_is_told_of(tmp_path):
    with local_cluster(tmp_path, workers=0) as empty, pytest.raises(InputError, match="has had no worker"):
        on(empty.address, tmp_path / "out", patience=1.0)


def test_no_scheduler_is_told_of(monkeypatch):
    monkeypatch.setattr(clusters, "CONNECT", 0.5)
    with pytest.raises(InputError, match="no Dask scheduler answers at"):
        Cluster("tcp://127.0.0.1:9")


@pytest.mark.parametrize(
    "says",
    [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"SSH-2.0-OpenSSH_9.6\r\n", bytes(8192), b"\xff" * 64],
    ids=["silent", "http", "ssh", "zeros", "huge"],
)
def test_another_program_at_the_port_is_told_of_within_the_time(says, monkeypatch):
    """Dask itself waits for a silent one for ever, and takes the first bytes of any for a size to allocate."""
    monkeypatch.setattr(clusters, "CONNECT", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as port:
        held = []

        def answer():
            with contextlib.suppress(OSError):
                while True:
                    held.append(port.accept()[0])
                    held[-1].sendall(says)

        threading.Thread(target=answer, daemon=True).start()
        began = time.monotonic()
        with pytest.raises(InputError, match="no Dask scheduler answers at") as refused:
            Cluster(f"tcp://127.0.0.1:{port.getsockname()[1]}")
        assert time.monotonic() - began < 5.0
        assert "\n" not in str(refused.value)
        for one in held:
            one.close()


@pytest.mark.long
def test_a_scheduler_that_stands_still_is_told_of(tmp_path, monkeypatch):
    monkeypatch.setattr(clusters, "CONNECT", 2.0)
    with local_cluster(tmp_path, workers=0) as empty:
        runner = Cluster(empty.address)
        empty.scheduler.send_signal(signal.SIGSTOP)
        began = time.monotonic()
        with pytest.raises(InputError, match="disappeared"):
            list(runner.run(jobs(1)))
        runner.close()
        assert time.monotonic() - began < 10.0


@pytest.mark.parametrize(
    "address",
    ["nonsense://x", "127.0.0.1:notaport", "tcp://127.0.0.1", "tcp://[::1", "tcp://a:8786/x", "", "tcp://:1"],
)
def test_an_address_that_is_none_is_refused_at_once(address):
    with pytest.raises(InputError, match="is no address of a scheduler"):
        Cluster(address)


def test_certificates_and_tls_go_together(tmp_path):
    with pytest.raises(InputError, match="tls:// needs --tls-ca"):
        Cluster("tls://127.0.0.1:8786")
    files = [tmp_path / name for name in ("ca.pem", "cert.pem", "key.pem")]
    with pytest.raises(InputError, match=r"there is no file .*ca\.pem"):
        Certificates(*files)
    for path in files:
        path.write_text("")
    with pytest.raises(InputError, match="certificates are for tls"):
        Cluster("tcp://127.0.0.1:8786", certificates=Certificates(*files))


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
        with pytest.raises(InputError, match="tls:// needs"):
            Cluster(running.address)
        runner = Cluster(running.address, certificates=Certificates(certificate, certificate, key))
        done = list(runner.run(jobs(1)))
        runner.close()
    assert [row.result for row, _ in done] == ["done"]


def jobs(count):
    plan = planned(SMALL)
    return [RunJob(plan.setting(i), tuple(plan.study.metrics), None, False) for i in range(count)]


def test_a_worker_with_other_sources_refuses():
    with pytest.raises(InputError, match="another version of palpate"):
        run_batch(pickle.dumps(jobs(1)), "0123456789abcdef")
    assert len(run_batch(pickle.dumps(jobs(2)), sources())) == 2


class Deadly:
    """A batch that its workers died of."""

    def result(self):
        raise KilledWorker("task", SimpleNamespace(address="tcp://10.0.0.7:1"), 3)


def test_of_runs_that_kill_workers_each_is_tried_alone_and_becomes_a_row():
    hand = clusters.Dispatcher(None, "tcp://somewhere", 1.0)
    assert hand.take(Deadly(), jobs(2)) is None
    ((row, record),) = hand.take(Deadly(), jobs(1))
    assert (row.run, row.result, row.metrics, record) == (0, "failed", (None, None, None), None)
    assert "tcp://10.0.0.7:1" in row.why


def test_batches_grow_to_the_unit():
    batches = clusters.Batches(iter(jobs(12) * 100))
    first = next(batches)
    assert 0.5 * clusters.UNIT < len(first) * 0.2 * 1000 * clusters.TICK < 1.5 * clusters.UNIT
    batches.took(
        [(row, None) for row, _ in Formula(lambda _: 0.0).run(first[:1])]
    )  # which says that it took 1 s
    batches.seconds = 0.05
    assert len(next(batches)) == 4
    batches.seconds = 5.0
    assert len(next(batches)) == 1
    batches.again(first[:2])
    assert [len(next(batches)) for _ in range(3)] == [1, 1, 1]


@pytest.mark.long
def test_workers_run_a_controller_of_ones_own(tmp_path, capsys, monkeypatch, root):
    """As a user types it: the module lies beside the study, the workers were started somewhere else."""
    (tmp_path / "push_of_mine.py").write_text((root / "tests" / "own_parts.py").read_text(encoding="utf-8"))
    cases = 'mine = { controller = { kind = "push_of_mine:Push" } }\nPI = {}'
    metrics = '["force_rms", "push_of_mine:mean_force"]'
    source = text(f"[parameters.law.cases]\n{cases}", metrics=metrics)
    (tmp_path / "mine.toml").write_text(source, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = ["study", "mine.toml", "--plugins", "--yes", "--json"]
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with local_cluster(elsewhere, workers=2, place=elsewhere) as running:
        assert main([*words, "--out", "there", "--scheduler", running.address]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["results"] == {"done": 2}
    assert main([*words, "--out", "here"]) == 0
    assert (tmp_path / "there" / "results.parquet").read_bytes() == (
        tmp_path / "here" / "results.parquet"
    ).read_bytes()
