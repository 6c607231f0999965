"""A press over a wire to a simulated arm, and everything that a wire can do to it.

In simulated time, but for what needs a socket, a process or a signal.
"""

from __future__ import annotations

import io
import json
import subprocess
import sys
import time

import numpy as np
import pytest

from cli.asked import refused
from cli.json_keys import documented
from palpate.cli import main
from palpate.errors import InputError
from palpate.force import ForceLoop
from palpate.logs import read_record
from palpate.wires import Command, NoReadingError, open_wire, sim
from wires.simulated import SimulatedClock, simulated_arm
from wires.slow_cell import WORDS, arm, servo_cell, wait_for_rows


def press(capsys, folder, address, *words):
    """Exit code and what was printed, as JSON."""
    code = main(["press", "--wire", address, "--gains", str(folder / "gains.toml"), *WORDS, "--json", *words])
    printed = capsys.readouterr()
    assert printed.err == ""
    return code, json.loads(printed.out)


def test_it_presses_with_the_force_asked_for_and_identify_reads_the_record(folder, here, capsys, root):
    with simulated_arm(folder, stiffness=4000.0) as network:
        code, told = press(
            capsys, folder, network.address, "--yes", "--record", "rec", "--seconds", "3", "--probe", "0.2"
        )
    assert code == 0, told["ended"]
    assert set(told) == documented(root)["press, a real arm"] | {"command", "version", "options", "files"}
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    assert told["lateness"]["ticks"] > 200
    assert told["lateness"]["most_s"] < 1e-9
    assert told["lateness"]["missed"] == 0
    record = read_record(here / "rec" / "record.parquet")
    assert np.allclose(np.diff(record["t"]) * 100, np.round(np.diff(record["t"]) * 100), atol=1e-6)
    assert record["force_sampled"].max() < 15.0
    assert sorted(p.name for p in (here / "rec").iterdir()) == ["press.json", "record.parquet"]
    assert main(["identify", "rec/record.parquet", "--json"]) in {0, 1}
    found = json.loads(capsys.readouterr().out)
    assert "series-compliance" in {warn["code"] for warn in found["warnings"]}
    assert main(["identify", "rec/record.parquet", "--robot-stiffness", "50000:1000", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    K = found["parameters"]["K"]
    assert K["verdict"] == "identified"
    assert abs(K["value"] - 4000) < 2.0 * K["std"]
    assert K["std"] < 150
    assert 0.5 < told["stiffness_N_per_m"][0] / (4000 / (1 + 4000 / 5e4)) < 2.0


@pytest.mark.real_time
def test_it_presses_over_udp_with_an_arm_in_another_process(folder, here, capsys):
    with arm(folder, "--stiffness", "4000") as (_, address):
        code, told = press(capsys, folder, address, "--yes", "--record", "rec", "--seconds", "2")
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    assert told["lateness"]["p50_s"] <= told["lateness"]["p99_s"] <= told["lateness"]["p99.9_s"]
    assert len(read_record(here / "rec" / "record.parquet")) == told["lateness"]["ticks"] > 150


def test_a_servo_that_yields_presses_over_a_wire_and_its_record_shows_the_surface_alone(here, capsys):
    """For thirty of the loop's lags, so that its rise is a small part of the mean force."""
    servo_cell(here)
    with simulated_arm(here, stiffness=4000.0) as network:
        code, told = press(
            capsys, here, network.address, "--yes", "--record", "rec", "--probe", "0.2", "--seconds", "6"
        )
    assert code == 0, told["ended"]
    assert told["force_N"] == pytest.approx(10.0, rel=0.05)
    assert main(["identify", "rec/record.parquet", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert "series-compliance" not in {warn["code"] for warn in found["warnings"]}
    K = found["parameters"]["K"]
    assert abs(K["value"] - 4000) < 2.0 * K["std"]
    assert K["std"] < 150


def test_a_dry_run_moves_nothing(folder, here, capsys):
    with simulated_arm(folder) as network:
        code, told = press(capsys, folder, network.address, "--dry-run")
    assert code == 0
    assert not network.commands
    assert told["rate_Hz"] == pytest.approx(100, rel=0.01)
    assert told["noise_N"] == pytest.approx(0.1, rel=0.5)
    assert not list(here.iterdir())


def test_nothing_moves_where_nobody_can_be_asked(folder, here, capsys, monkeypatch):
    with simulated_arm(folder) as network:
        words = ["press", "--wire", network.address, "--gains", folder / "gains.toml", *WORDS]
        monkeypatch.setattr(sys, "stdin", io.StringIO())
        assert "no terminal to ask" in refused_after_plan(capsys, *words)
    assert not network.commands


def words_of(folder, address):
    return ["press", "--wire", address, "--gains", str(folder / "gains.toml"), *WORDS, "--json"]


def refused_after_plan(capsys, *words):
    assert main(list(map(str, words))) == 2
    return capsys.readouterr().err


FAULTS = {
    "silence": (lambda s, rng: "lose" if s > 0.5 else None, "no reading for"),
    "garbage": (lambda s, rng: "garble" if s > 0.5 else None, "datagrams that are none"),
    "delay": (lambda s, rng: 0.8 if s > 0.5 else None, "no reading for"),
    "a delay that grows": (lambda s, rng: max(0.0, s - 0.5) * 0.5, "late"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_on_the_wire_stops_the_arm_in_time_and_loses_nothing(folder, here, capsys, name):
    fault, says = FAULTS[name]
    gains = ForceLoop.load(folder / "gains.toml").gains
    with simulated_arm(folder, fault, gap=0.02) as network:
        code, told = press(capsys, folder, network.address, "--yes", "--record", "rec", "--seconds", "10")
    assert code == 1
    assert says in told["ended"]
    record = read_record(here / "rec" / "record.parquet")
    assert len(record) == told["lateness"]["ticks"] > 20
    first, last, tick = network.commands[0][0], network.commands[-1][0], gains.arm.tick
    inwards, outwards = network.times(-1.0), network.times(1.0)
    assert last <= network.rests[0]
    if name != "a delay that grows":
        # The last command into the surface went out with the last reading. Within a lag and a tick the press ended, and
        # in the tick after that the retreat began.
        assert inwards[-1] - first < 0.5 + 1.5 * tick
        assert outwards[0] - inwards[-1] < gains.theta + 2.5 * tick
    assert outwards[-1] > inwards[-1]


def test_losses_and_jitter_that_it_can_bear_are_counted(folder, here, capsys):
    def fault(s, rng):
        return "lose" if rng.random() < 0.1 else rng.random() * 0.01

    with simulated_arm(folder, fault, stiffness=4000.0) as network:
        code, told = press(capsys, folder, network.address, "--yes", "--seconds", "2")
    assert code == 0, told["ended"]
    assert told["lateness"]["missed"] > 10
    assert 0.008 < told["lateness"]["most_s"] <= 0.01
    assert told["force_N"] == pytest.approx(10.0, rel=0.1)


def test_a_second_master_is_refused(folder, here, capsys):
    with simulated_arm(folder) as network:
        first = network.open(network.address)
        assert "another master" in refused(capsys, *words_of(folder, network.address), "--dry-run")
        first.stop()
        assert main([*words_of(folder, network.address), "--dry-run"]) == 0  # when the first one has let go


def test_nobody_but_its_master_moves_an_arm_even_with_the_number_of_its_session(folder):
    down = Command((0.0, 0.0, -0.01), (0.4, 0.0, 0.29))

    def way(network, wire, sender):
        start = wire.read(1.0).position[2]
        for _ in range(20):
            sender.write(down)
            place = wire.read(1.0).position[2]
        return start - place

    with simulated_arm(folder, gap=0.05) as network:
        master = network.open(network.address)
        stranger = network.stranger(master)
        assert abs(way(network, master, stranger)) < 1e-6
        assert way(network, master, master) > 2e-4


@pytest.mark.real_time
def test_an_arm_rests_when_its_master_dies_and_its_record_is_recovered(folder, here, capsys):
    with arm(folder, "--gap", "0.05") as (_, address):
        words = [w for w in words_of(folder, address) if w != "--json"]
        command = [sys.executable, "-m", "palpate", *words, "--yes", "--record", "rec", "--seconds", "10"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as master:
            wait_for_rows(here / "rec" / "rows.f64")
            master.kill()
        time.sleep(1.2)  # after a second of silence another may come
        wire = open_wire(address)
        readings = [wire.read(1.0) for _ in range(50)][10:]
        wire.stop()
        wire.close()
    assert np.ptp([r.position[2] for r in readings]) < 1e-6
    assert main(["press", "--recover", "rec"]) == 0
    record = read_record(here / "rec" / "record.parquet")
    assert len(record) > 20
    assert (record["received"] > 0).all()
    assert "broken off" in (here / "rec" / "press.json").read_text()


@pytest.mark.parametrize(
    ("address", "says"),
    [
        ("sim", "there is no default"),
        ("sim:", "there is no default"),
        ("sim:127.0.0.1", "sim:127.0.0.1:4000"),
        ("sim:127.0.0.1:99999", "sim:127.0.0.1:4000"),
        ("sin:127.0.0.1:5", "did you mean 'sim'"),
        ("sim:127.0.0.1:9", "no simulated arm answers"),
    ],
)
def test_a_wrong_address_is_refused(folder, here, capsys, address, says):
    words = ["press", "--wire", address, "--gains", folder / "gains.toml", *WORDS, "--dry-run", "--json"]
    assert says in refused(capsys, *words)


class WebServer:
    """A socket at whose other end HTTP is spoken."""

    def connect(self, address):
        pass

    settimeout = send = connect

    def recv(self, size):
        return b"HTTP/1.1 400 Bad Request"

    def close(self):
        pass


def test_another_protocol_at_the_port_is_named():
    with pytest.raises(InputError, match="another protocol; is it the port of a simulated arm"):
        sim.SimWire("127.0.0.1", 80, SimulatedClock(), WebServer())


def test_gains_of_another_rate_are_refused(folder, here, capsys, tmp_path):
    text = (folder / "gains.toml").read_text()
    text = text.replace("rate = 100.0", "rate = 50.0").replace("rate = 100\n", "rate = 50\n")
    (tmp_path / "other.toml").write_text(text)
    with simulated_arm(folder) as network:
        words = words_of(folder, network.address)
        words[words.index("--gains") + 1] = tmp_path / "other.toml"
        assert "100 readings a second, and the gains are for 50" in refused(capsys, *words, "--dry-run")


def test_gains_of_another_highest_force_are_refused(folder, here, capsys):
    words = [*words_of(folder, "sim:127.0.0.1:9"), "--dry-run", "--force-max", "60:N"]
    assert "--force-max is 60 N, and the gains are for" in refused(capsys, *words)


def test_an_untared_sensor_is_refused(folder, here, capsys):
    with simulated_arm(folder, bias=(1.0, 0.0, 90.0)) as network:
        assert "tare it" in refused(capsys, *words_of(folder, network.address), "--dry-run")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "--wire is missing"),
        (("--wire", "x", "--gains", "G", *WORDS, "--surface", "K=5000"), "--surface is for a simulated arm"),
        (("--wire", "sim:127.0.0.1:9"), "--gains, --force, --normal, --force-limit"),
        (("--wire", "x", "--gains", "G", *WORDS, "--normal", "0,0,0"), "must have a length"),
        (("--wire", "x", "--gains", "G", *WORDS, "--force-limit", "9:N"), "must lie between the force"),
        (("--wire", "x", "--gains", "G", *WORDS, "--speed-limit", "0.001:mm/s"), "certified approach"),
        (("--wire", "x", "--gains", "G", *WORDS, "--travel-limit", "-1:mm"), "travel limit"),
        (
            ("--wire", "x", "--gains", "G", *WORDS, "--time-limit", "5:kg"),
            "unknown unit of time in --time-limit",
        ),
    ],
)
def test_bad_words_are_refused(folder, here, capsys, words, says):
    words = [str(folder / "gains.toml") if w == "G" else w for w in words]
    merged = dict(zip(words[::2], words[1::2], strict=True))
    flat = [w for pair in merged.items() for w in pair]
    assert says in refused(capsys, "press", *flat, "--json", "--yes")


def test_a_wire_that_is_lost_says_for_how_long(folder):
    with simulated_arm(folder, lambda *_: "lose") as network:
        wire = network.open(network.address)
        wire.read(1.0)
        wire.write(Command((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
        begun = network.clock.now
        with pytest.raises(NoReadingError, match="no reading for 150 ms"):
            while True:
                wire.read(0.15)
        assert network.clock.now - begun == pytest.approx(0.15, abs=0.011)
