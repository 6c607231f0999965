"""Foxglove's protocol, by a client of its own: the door is the page's, and what comes through it is whole."""

import base64
import contextlib
import json
import socket
import struct
import time

import pytest
from websockets.exceptions import ConnectionClosed

from live.conftest import PATIENCE, playing
from live.test_server import Clock
from palpate.errors import InputError
from palpate_live.player import Feed, Player

foxglove = pytest.importorskip("foxglove", reason="foxglove-sdk is not installed")
PROTOCOL = "foxglove.sdk.v1"


@pytest.fixture
def address():
    from palpate_live.foxglove import viewers

    with Player(Clock(), Feed()) as player, viewers(player, 0, "https://app.foxglove.dev") as (line,):
        yield line.removeprefix("viewers: ")


def connected(address, **options):
    from websockets.sync.client import connect

    kinds = None if address.endswith("stream") else [PROTOCOL]
    return connect(address, subprotocols=kinds, open_timeout=PATIENCE, **options)


def status(address, **options):
    """How a viewer is refused."""
    from websockets.exceptions import InvalidStatus

    with pytest.raises(InvalidStatus) as refused, connected(address, **options):
        pass
    return refused.value.response.status_code


def test_a_foreign_page_a_foreign_name_and_no_token_are_refused(address):
    port = address.split(":")[2].split("/")[0]
    token = address.rstrip("/").rpartition("/")[2]
    assert status(address, origin="https://elsewhere.example") == 403
    assert status(address, origin="null") == 403
    assert status(f"ws://127.0.0.1:{port}/") == 403
    assert status(f"ws://127.0.0.1:{port}/{token[:-1]}/") == 403
    assert status(f"ws://127.0.0.1:{port}/{token}/stream") == 404
    assert (
        status(
            f"ws://rebound.example:{port}/{token}/", sock=socket.create_connection(("127.0.0.1", int(port)))
        )
        == 403
    )


@pytest.mark.parametrize("origin", [None, "https://app.foxglove.dev", "own"])
def test_a_viewer_with_the_address_is_served(address, origin):
    own = "http://" + address.split("/")[2]
    with connected(address, origin=own if origin == "own" else origin) as client:
        assert json.loads(client.recv(PATIENCE))["op"] == "serverInfo"
        (channel,) = json.loads(client.recv(PATIENCE))["channels"]  # a clock has no arm
        assert channel["topic"] == "/palpate/contact"
        assert json.loads(channel["schema"])["type"] == "object"
        for nonsense in (
            "{",
            "[" * 4000,
            json.dumps({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}),
        ):
            client.send(nonsense)
        client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": channel["id"]}]}))
        times = []
        while len(times) < 20:
            kind, number, stamp = struct.unpack_from("<BIQ", data := client.recv(PATIENCE))
            assert (kind, number) == (1, 7)
            row = json.loads(data[13:])
            assert stamp == round(row["t"] * 1e9)
            times.append(row["t"])
        assert times == pytest.approx([0.005 * i for i in range(20)])


def test_an_arm_is_a_scene_of_lines():
    """As Foxglove's own library encodes it: an arm and a surface, in SI."""
    from palpate.bench.tables import load
    from palpate_live.foxglove import viewers
    from palpate_live.simulation import WatchedSimulation

    with (
        Player(WatchedSimulation(load("foam-hybrid")), Feed()) as player,
        viewers(player, 0) as (line,),
        connected(line.removeprefix("viewers: ")) as client,
    ):
        client.recv(PATIENCE)
        arm = json.loads(client.recv(PATIENCE))["channels"][1]
        client.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 3, "channelId": arm["id"]}]}))
        data = client.recv(PATIENCE)
    assert arm["schemaName"] == "foxglove.SceneUpdate"
    assert b"SceneEntity" in base64.b64decode(arm["schema"])
    assert data[:5] == b"\x01\x03\x00\x00\x00"
    assert b"base" in data[13:]
    assert b"arm" in data[13:]


def test_readers_that_die_are_silent_and_others_are_served(address, caplog):
    """As tabs whose process is killed: the connection is reset while rows are sent."""
    with playing(Clock()) as (_, page, _client):
        stream = str(page).replace("http", "ws") + "stream"
        for url in (address, stream):
            for _ in range(3):
                with contextlib.suppress(OSError, ConnectionClosed), connected(url) as dying:
                    dying.recv(PATIENCE)
                    reset = struct.pack("ii", 1, 0)
                    dying.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, reset)
                    dying.socket.close()
            socket.create_connection(("127.0.0.1", int(url.split(":")[2].split("/")[0]))).close()
        time.sleep(0.2)
        with connected(address) as alive:
            assert json.loads(alive.recv(PATIENCE))["op"] == "serverInfo"
    assert not caplog.records


def test_an_origin_that_is_none_is_a_line():
    from palpate_live.foxglove import viewers

    with (
        pytest.raises(InputError, match="--foxglove-origin"),
        viewers(Player(Clock(), Feed()), 0, "app.foxglove.dev"),
    ):
        pass
