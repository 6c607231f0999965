"""`palpate live`: its first line is its address, and what is wrong is a line and exit code 2."""

import json
import re
import socket
from contextlib import contextmanager

import numpy as np
import pytest

from cli import asked
from live.conftest import PATIENCE, Stream, headless, near
from palpate.bench import build
from palpate.logs import write_record
from palpate_live.view import AT

ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/[\w-]{24}/")


def refused(capsys, *words):
    return asked.refused(capsys, "live", *words)


@contextmanager
def running(*words, lines=1):
    """The program, until the block ends; its first lines."""
    with headless.running(*words, lines=lines) as (process, said):
        yield said
    assert process.returncode == 130, process.said
    assert "Traceback" not in process.said[1]


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "record.parquet"
    write_record(build(near()).run(20.0, seed=1, press=1.0), path)
    return path


@pytest.mark.long
def test_a_run_s_record_moves_the_arm_and_knows_the_truth(record):
    with running("--record", record) as (address,):
        assert ADDRESS.fullmatch(address)
        one = Stream(address).until(lambda c: len(c.rows) > 20)
        one.ask("seek", time=3.5)
        one.until(lambda c: len(c.rows) and np.isfinite(c.rows[-1, AT["K"]]) and c.rows[-1, 0] > 3.4)
        assert one.rows[-1, AT["K_true"]] == 5200.0
        assert np.isfinite(one.rows[:, AT["q1"]]).all()
        one.close()


@pytest.mark.long
def test_a_log_without_joints_says_so_and_is_played(root):
    columns = ("--time", "time_s", "--position", "position_mm:mm", "--force", "force_N:N")
    with running("--log", root / "examples" / "data" / "press.csv", *columns) as (address,):
        one = Stream(address).until(lambda c: len(c.rows) > 20)
        assert np.isnan(one.rows[:, AT["q1"]]).all()
        assert 460 < one.rows[-1, AT["depth"]] < 470  # millimetres, as they stand in the log
        one.close()


def channels_of(client):
    """By topic, what the program offers to a viewer: the contact and the arm, within ten messages."""
    offered = {}
    for _ in range(10):
        told = json.loads(client.recv(PATIENCE))
        offered |= {c["topic"]: c for c in told.get("channels", [])}
        if {"/palpate/contact", "/palpate/arm"} <= set(offered):
            break
    return offered


@pytest.mark.long
def test_an_arm_presses_in_space_and_viewers_see_all_of_it():
    from websockets.sync.client import connect

    with running("--arm", "ur5e", "--foxglove", "--foxglove-port", 0, lines=2) as (address, viewers):
        one = Stream(address).until(lambda c: len(c.rows) > 20)
        assert np.isfinite(one.rows[:, AT["q1"] : AT["q6"] + 1]).all()
        assert np.isnan(one.rows[:, AT["q7"]]).all()
        one.close()
        url = viewers.removeprefix("viewers: ")
        with connect(url, subprotocols=["foxglove.sdk.v1"], open_timeout=PATIENCE) as client:
            offered = channels_of(client)
        assert {"/palpate/contact", "/palpate/arm"} <= set(offered)


@pytest.mark.long
def test_viewers_are_served_beside_the_page(record):
    """Foxglove's protocol, by a client of its own: what is offered, and that messages come."""
    from websockets.sync.client import connect

    with running("--record", record, "--foxglove", "--foxglove-port", 0, lines=2) as (_, viewers):
        assert re.fullmatch(r"viewers: ws://127\.0\.0\.1:\d+/[\w-]{24}/", viewers)
        url = viewers.removeprefix("viewers: ")
        with connect(url, subprotocols=["foxglove.sdk.v1"], open_timeout=PATIENCE) as client:
            offered = channels_of(client)
            number = offered["/palpate/contact"]["id"]
            client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": number}]}))
            # op code 1, the subscription's number, nanoseconds, then the message
            messages = (client.recv(PATIENCE) for _ in range(1000))
            data = next(one for one in messages if isinstance(one, bytes) and one[0] == 1)
            subscription, message = int.from_bytes(data[1:5], "little"), json.loads(data[13:])
    assert offered["/palpate/contact"]["encoding"] == "json"
    assert subscription == 7
    assert message["t"] >= 0.0
    assert message["K_true"] == 5200.0


@pytest.mark.long
def test_a_port_in_use(capsys, record):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert f"port {port} is in use by another program" in refused(
            capsys, "--record", record, "--port", port
        )
        told = refused(capsys, "--record", record, "--foxglove", "--foxglove-port", port)
        assert "name another with --foxglove-port" in told


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--run", "foam-hybird"], "did you mean 'foam-hybrid'"),
        (["--run", "foam-hybrid", "--log", "x.csv"], "--run and --log exclude each other"),
        (["--arm", "fr3", "--run", "foam-hybrid"], "--run and --arm exclude each other"),
        (["--arm", "fr33"], "did you mean 'fr3'"),
        (["--arm", "absent.toml"], "absent.toml"),
        (["--log", "absent.csv"], "absent.csv"),
        (["--record", "absent.parquet"], "absent.parquet"),
        (["--record", "r.parquet", "--time", "t"], "a record states its own columns"),
        (["--port", "-1"], "--port must be from 0 to 65535"),
        (["--port", "many"], "port"),
        (["--seed", "-1"], "seed"),
    ],
)
def test_what_is_wrong_is_a_line(capsys, tmp_path, monkeypatch, words, told):
    monkeypatch.chdir(tmp_path)
    assert told in refused(capsys, *words)


def test_a_log_without_a_force_names_what_there_is(capsys, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,x\n" + "".join(f"{i},{i}\n" for i in range(100)))
    assert "--force" in refused(capsys, "--log", path)


def test_a_record_that_was_cut_short(capsys, record, tmp_path):
    path = tmp_path / "record.parquet"
    path.write_bytes(record.read_bytes()[:5000])
    assert "is it whole?" in refused(capsys, "--record", path)
