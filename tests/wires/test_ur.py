"""A press with a UR by ur-rtde itself, against a simulated controller in another process."""

from __future__ import annotations

import json
import socket
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest

from palpate.cli import main
from palpate.logs import read_record
from palpate.signals.rotations import quaternion_from_vector, rotate
from palpate.wires import Command, open_wire
from wires.slow_cell import REHEARSAL, WORDS, child

pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this system")


@contextmanager
def controller(folder, address, *words):
    where = ("--address", address, "--arm", folder / "arm.toml", "--seconds", "60")
    with child(REHEARSAL / "rtde_arm.py", *where, *words) as (process, line):
        assert line == f"rtde:{address}"
        yield process


def words_of(folder, address, *more):
    return [
        "press",
        "--wire",
        f"rtde:{address}",
        "--gains",
        str(folder / "gains.toml"),
        *WORDS,
        "--json",
        *more,
    ]


@pytest.mark.real_time
@pytest.mark.parametrize("way", ["", "?as=servo"])
def test_it_presses_with_the_force_asked_for(folder, here, capsys, address, way):
    with controller(folder, address, "--stiffness", "4000"):
        code = main(words_of(folder, address + way, "--yes", "--record", "rec", "--seconds", "2.5"))
        told = json.loads(capsys.readouterr().out)
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    assert abs(told["bias_N"][2]) < 1.0  # the controller zeroed 3 N by one reading and its noise
    record = read_record(here / "rec" / "record.parquet")
    assert len(record) == told["lateness"]["ticks"]
    assert main(["identify", "rec/record.parquet", "--json"]) in {0, 1}
    assert json.loads(capsys.readouterr().out)["working_point"]["stiffness"]["value"] is not None
    # The arm's own 50 kN/m are in series. The certificate counts readings that are late by two ticks.
    (K, std), felt = told["stiffness_N_per_m"], 4000 / (1 + 4000 / 5e4)
    assert told["lateness"]["p99.9_s"] > 2 * 0.002 or abs(K - felt) < max(3 * std, 0.1 * felt)


@pytest.mark.real_time
def test_the_watchdog_stops_the_arm_where_the_library_dies_too(folder, here, address):
    """Its connection is closed then, and the script of a UR runs on: nothing but RTDE's watchdog ends the motion."""
    with controller(folder, address, "--gap", "0.05"):
        wire = open_wire(f"rtde:{address}")
        wire.begin(0.1)
        for _ in range(20):
            wire.read(1.0)
            wire.write(Command((0.0, 0.0, -0.01), (0.0, 0.0, 0.0)))
        last = wire.read(1.0)
        wire._driver.kill()
        wire.close()
        again = open_wire(f"rtde:{address}")
        time.sleep(1.0)  # the slow arm's own lag
        senses = [again.read(1.0) for _ in range(40)]
        again.close()
    depth = [sense.position[2] for sense in senses]
    assert np.ptp(depth) < 1e-5
    way = last.position[2] - depth[0]
    assert 0.01 * 0.1 < way < 0.01 * 0.5  # the silence, and what the arm lags behind


@pytest.mark.real_time
def test_a_second_master_is_refused(folder, here, capsys, address):
    with controller(folder, address):
        first = open_wire(f"rtde:{address}")
        first.begin(30.0)  # else it rests the arm by itself and lets go
        assert main(words_of(folder, address, "--yes")) == 2
        assert "with no other master" in capsys.readouterr().err
        first.close()
        second = open_wire(f"rtde:{address}")  # when the first has gone, it is taken over
        second.begin()
        for _ in range(10):
            second.read(1.0)
            second.write(Command((0.0, 0.0, -0.001), (0.0, 0.0, 0.0)))
        second.close()


@pytest.mark.real_time
def test_nothing_at_the_address_and_another_protocol_are_named(folder, here, capsys, address):
    assert main(words_of(folder, address, "--dry-run")) == 2
    assert "no UR answers" in capsys.readouterr().err
    with socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind((address, 30004))
        other.listen()

        def answer():
            one, _ = other.accept()
            one.recv(100)
            one.send(b"HTTP/1.1 400 Bad Request\r\n\r\n")
            one.close()

        threading.Thread(target=answer, daemon=True).start()
        assert main(words_of(folder, address, "--dry-run")) == 2
        err = capsys.readouterr().err
    assert "no UR answers" in err
    assert "Traceback" not in err


def test_another_way_to_move_is_refused(folder, here, capsys):
    assert main(words_of(folder, "127.0.0.1?as=force", "--dry-run")) == 2
    assert "rtde:ADDRESS?as=servo" in capsys.readouterr().err


@pytest.mark.parametrize("address", ["rtde:192.168.0.10:30004?as=servo", "franka:192.168.0.10:1337"])
def test_a_port_is_no_part_of_an_address(address):
    from palpate.errors import InputError
    from palpate.wires import open_wire

    with pytest.raises(InputError, match=r"has a port; .* on every controller: (rtde|franka):192.168.0.10$"):
        open_wire(address)


def test_turns_are_those_of_a_library():
    from scipy.spatial.transform import Rotation

    rng = np.random.default_rng(0)
    turns = Rotation.random(50, rng=rng)
    for turn in [
        *turns,
        Rotation.identity(),
        Rotation.from_rotvec([np.pi, 0, 0]),
        Rotation.from_rotvec([0, 0, np.pi]),
    ]:
        v = rng.normal(size=3)
        q = quaternion_from_vector(turn.as_rotvec())
        assert (Rotation.from_quat(q) * turn.inv()).magnitude() < 1e-7
        np.testing.assert_allclose(rotate(q, v), turn.apply(v), atol=1e-12)
