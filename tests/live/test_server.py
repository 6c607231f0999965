"""The server: who is answered, what a page is told, and what becomes of slow readers, of many, and of those gone."""

import http.client
import re
import socket
import threading
import time
from contextlib import ExitStack, contextmanager, suppress
from urllib.parse import urlsplit

import numpy as np
import pytest

from live.conftest import PATIENCE, Stream, playing
from palpate.errors import InputError
from palpate.live import connections, server
from palpate.live.player import Feed, Player
from palpate.live.server import AUDIENCE, PER_ADDRESS, READERS, PageServer
from palpate.live.view import COLUMNS, SourceState, View


class Clock:
    """A source whose rows are their own time: nothing is simulated, so that what is tested is the serving."""

    def __init__(self, most=float("inf")):
        self.view = View(
            title="<b>clock</b>", about="</script><script>alert(1)</script>", rate=200.0,
            links=(1.0, 1.0, 1.0), rest=(0.0, 0.0, 0.0),
        )  # fmt: skip
        self.state = SourceState(values={"speed": 1.0}, seed=0)
        self.count, self.most = 0, most

    def advance(self, seconds):
        n = int(min(round(seconds / 0.005), self.most - self.count))
        rows = np.full((n, len(COLUMNS)), np.nan)
        rows[:, 0] = 0.005 * (self.count + np.arange(n))
        self.count += n
        if self.count >= self.most:
            self.state.ended = "done: the clock has run down"
        return rows

    def reset(self, seed=None):
        self.count, self.state.ended = 0, ""
        if seed is not None:
            self.state.seed = seed

    def set(self, key, value):
        if key != "speed":
            raise InputError(f"there is no slider {key!r}")
        self.state.values[key] = value


def asked(address, path=None, **headers):
    """Status, headers and text of what the server answers."""
    return answer_to("GET", address, path, **headers)


def answer_to(method, address, path=None, **headers):
    """The same for any method."""
    parts = urlsplit(str(address))
    connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=PATIENCE)
    connection.request(method, parts.path if path is None else path, headers=headers)
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders()), answer.read().decode()


def test_the_page_is_whole_and_asks_no_other_host():
    with playing(Clock()) as (_, address, _client):
        status, headers, text = asked(address)
    assert status == 200
    assert headers["Cache-Control"] == "no-store"
    assert headers["Referrer-Policy"] == "no-referrer"
    rules = dict(rule.split(" ", 1) for rule in headers["Content-Security-Policy"].split("; "))
    assert rules["default-src"] == rules["base-uri"] == rules["frame-ancestors"] == "'none'"
    assert re.fullmatch(r"('sha256-[\w+/=]{44}' ?)+", rules["script-src"])
    assert "default-src &#39;none&#39;" in text
    assert "unsafe-eval" not in text
    for tag in (' src="', ' href="', "@import", "url("):
        assert tag not in text, tag
    # What a stranger called it is text, in the page and in its data.
    assert "<b>clock" not in text
    assert "<script>alert" not in text
    assert "&lt;b&gt;clock" in text


def test_nobody_is_answered_without_the_token_or_by_another_name():
    with playing(Clock()) as (_, address, _client):
        host = urlsplit(str(address)).netloc
        assert asked(address, "/")[0] == 403
        assert asked(address, "/wrong/")[0] == 403
        assert asked(address, f"/{address.token[:-1]}/")[0] == 403
        assert asked(address, f"/{address.token}/page.html")[0] == 404
        assert asked(address, Host="rebound.example")[0] == 403
        assert asked(address, Host=host.replace("127.0.0.1", "localhost"))[0] == 200
        assert address.token not in asked(address, "/wrong/")[2]


@pytest.mark.parametrize(
    ("method", "status"),
    [(method, 405) for method in ("HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE")]
    + [("BREW", 501), ("get", 501)],
)
def test_only_get_is_answered(method, status):
    with playing(Clock()) as (_, address, _client):
        answered, headers, _ = answer_to(method, address)
    assert answered == status
    assert headers.get("Allow") == ("GET" if status == 405 else None)


def test_the_stream_is_refused_without_the_token_and_to_other_pages():
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    with playing(Clock()) as (_, address, client):
        url = str(address).replace("http", "ws")
        with pytest.raises(InvalidStatus) as refused, connect(url.replace(address.token, "wrong") + "stream"):
            pass
        assert refused.value.response.status_code == 403
        with (
            pytest.raises(InvalidStatus) as refused,
            connect(url + "stream", origin="http://elsewhere.example"),
        ):
            pass
        assert refused.value.response.status_code == 403
        client(origin=f"http://127.0.0.1:{address.port}").until(lambda c: len(c.rows))


def test_only_this_machine_can_connect():
    with playing(Clock()) as (_, address, _client):
        own = socket.gethostbyname(socket.gethostname())
        if own.startswith("127."):
            pytest.skip("this machine has no other address than loopback")
        with pytest.raises((ConnectionError, TimeoutError)):
            socket.create_connection((own, address.port), timeout=5).close()


def test_it_stands_still_until_somebody_watches():
    source = Clock()
    with playing(source) as (_, _address, client):
        time.sleep(0.1)
        assert source.count == 0
        client().until(lambda c: len(c.rows) > 10)


def test_pause_step_and_reset():
    source = Clock()
    with playing(source) as (_, _address, client):
        one = client().until(lambda c: len(c.rows) > 5)
        one.ask("pause", on=True)
        one.until(lambda c: c.state and not c.state["playing"])
        stood = source.count
        time.sleep(0.1)
        assert source.count == stood
        one.ask("step")
        one.until(lambda c: len(c.rows) == stood + 2)  # 10 ms are two rows
        assert source.count == stood + 2
        one.ask("reset", seed=7)
        one.until(
            lambda c: c.state["playing"] and c.state["seed"] == 7 and "clear" in c.kinds and len(c.rows)
        )
        assert one.column("t")[0] == 0.0


def test_the_end_pauses_and_going_on_begins_again():
    with playing(Clock(most=40)) as (_, _address, client):
        one = client().until(lambda c: len(c.rows) == 40 and c.state["ended"] and not c.state["playing"])
        one.ask("pause", on=False)
        one.until(lambda c: c.kinds.count("clear") > 1 and len(c.rows) == 40 and c.state["ended"])


def test_a_slider_moves_for_all_pages_and_the_last_of_many_counts():
    with playing(Clock()) as (_, _address, client):
        one, other = client(), client()
        for value in range(50):
            one.ask("set", key="speed", value=float(value))
        other.until(lambda c: c.state and c.state["values"]["speed"] == 49.0)
        one.ask("set", key="colour", value=1.0)
        other.until(lambda c: "no slider 'colour'" in c.state["refusal"])


@pytest.mark.parametrize(
    "message",
    [
        "",
        "[]",
        "{}",
        '{"do": "shout"}',
        '{"do": "pause"}',
        '{"do": "set", "key": 1, "value": "x"}',
        '{"do":"step","x":1}',
        "[" * 4000,
    ],
)
def test_what_is_no_request_is_refused_and_the_stream_goes_on(message):
    with playing(Clock()) as (player, _address, client):
        one = client().until(lambda c: len(c.rows))
        one.send(message)
        one.until(lambda c: "refused" in c.kinds)
        assert "unknown request" in one.refused
        had = len(one.rows)
        one.until(lambda c: len(c.rows) > had)
        assert player.failure is None


def test_too_long_a_message_closes_that_page_alone():
    from websockets.exceptions import ConnectionClosed

    with playing(Clock()) as (_, _address, client):
        one, other = client(), client()
        one.send("x" * 100_000)
        with pytest.raises(ConnectionClosed):
            one.until(lambda c: False)
        other.until(lambda c: len(c.rows) > 5)


def test_a_page_that_comes_back_gets_the_seconds_that_it_missed():
    with playing(Clock()) as (_, _address, client):
        client().until(lambda c: len(c.rows) > 20).close()
        time.sleep(0.05)
        again = client().until(lambda c: len(c.rows) > 25)
    np.testing.assert_allclose(np.diff(again.column("t")), 0.005, atol=1e-12)
    assert again.column("t")[0] == 0.0


def test_a_slow_reader_loses_rows_not_memory():
    source = Clock()
    with Player(source, feed := Feed(rows=400)) as player, PageServer(player) as address:
        parts = urlsplit(str(address))
        slow = socket.create_connection((parts.hostname, parts.port), timeout=PATIENCE)
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        slow.sendall(handshake(address))
        slow.recv(2048)  # the handshake, and then nothing any more
        for _ in range(400):
            feed.put(source.advance(2.0))
            time.sleep(0.001)
        # All that is kept for it is the ring, whatever it has not read.
        assert len(feed.since(-1, 0)[2]) == 400
        other = Stream(address).until(lambda c: len(c.rows) > 10)
        other.close()
        slow.close()
    assert player.failure is None


def test_there_is_an_end_to_how_many_read():
    from websockets.exceptions import InvalidStatus

    with playing(Clock()) as (_, _address, client):
        for _ in range(READERS):
            client().until(lambda c: len(c.kinds))
        with pytest.raises(InvalidStatus) as refused:
            client()
        assert refused.value.response.status_code == 503


def test_a_port_in_use_is_said_in_a_line():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with (
            Player(Clock(), Feed()) as player,
            pytest.raises(InputError, match=f"port {port} is in use"),
            PageServer(player, port),
        ):
            pass
    with (
        Player(Clock(), Feed()) as player,
        pytest.raises(InputError, match="0 to 65535"),
        PageServer(player, 70000),
    ):
        pass


def test_a_defect_of_the_source_ends_it_and_is_raised():
    class Broken(Clock):
        def advance(self, seconds):
            raise ZeroDivisionError("broken")

    with Player(Broken(), Feed()) as player:
        player.watch()
        with pytest.raises(ZeroDivisionError):
            player.wait()


def test_threads_end_with_the_block():
    with playing(Clock()) as (_, _address, client):
        client().until(lambda c: len(c.rows))
    left = [thread.name for thread in threading.enumerate() if thread.name.startswith("live")]
    assert left == []


NETWORK = "127.0.0.2"
"""The loopback's second address stands for one on a network."""


@contextmanager
def shared(source):
    """A shared page: its player, the address that steers, and the audience's."""
    player = Player(source, Feed())
    with player, PageServer(player) as host, PageServer(player, host=NETWORK, steers=False) as audience:
        yield player, host, audience


def listener(address, number):
    """A stream of a machine of its own."""
    return Stream(address, source_address=(f"127.0.1.{number}", 0))


def idle(address, number=1):
    """A connection that asks for nothing."""
    parts = urlsplit(str(address))
    return socket.create_connection(
        (parts.hostname, parts.port), timeout=PATIENCE, source_address=(f"127.0.2.{number}", 0)
    )


def dropped(connection):
    """True if the other end has ended it; waits for that."""
    try:
        return connection.recv(1) == b""
    except ConnectionError:
        return True


def test_the_host_steers_whoever_came_first():
    with shared(Clock()) as (_, host, audience):
        assert str(audience).startswith(f"http://{NETWORK}:")
        assert asked(audience)[0] == 200
        assert asked(audience, Host="palpate.example")[0] == 403
        watching = Stream(audience).until(lambda s: "watching" in s.kinds and s.state is not None)
        steering = Stream(host).until(lambda s: s.state is not None)
        watching.ask("set", key="speed", value=3.0)
        watching.until(lambda s: "refused" in s.kinds)
        assert watching.refused == "this page only watches"
        steering.ask("set", key="speed", value=2.0)
        steering.until(lambda s: s.state["values"]["speed"] == 2.0)
        assert "watching" not in steering.kinds
        watching.until(lambda s: s.state["values"]["speed"] == 2.0)
        steering.close()
        # Nobody inherits it, from the same machine or another, and the host's next page steers at once.
        watching.ask("set", key="speed", value=4.0)
        watching.until(lambda s: s.kinds.count("refused") == 2)
        back = Stream(host)
        back.ask("set", key="speed", value=5.0)
        back.until(lambda s: s.state is not None and s.state["values"]["speed"] == 5.0)
        watching.close()
        back.close()


def test_the_address_that_steers_is_not_on_the_network():
    with shared(Clock()) as (_, host, audience):
        assert host.host == "127.0.0.1"
        assert host.token != audience.token
        assert asked(audience, f"/{host.token}/")[0] == 403
        assert asked(host, f"/{audience.token}/")[0] == 403
        with pytest.raises(ConnectionError):
            socket.create_connection((NETWORK, host.port), timeout=PATIENCE).close()


def test_an_audience_of_any_size_leaves_the_host_its_place(monkeypatch):
    from websockets.exceptions import InvalidStatus

    monkeypatch.setattr(server, "ALIVE_TIMEOUT", PATIENCE)  # those here answer no ping
    with shared(Clock()) as (_, host, audience), ExitStack() as held:
        for number in range(AUDIENCE):
            one = held.enter_context(idle(audience, 1 + number))
            one.sendall(handshake(audience))
            assert b"101" in one.recv(64)
        with pytest.raises(InvalidStatus) as refused:
            listener(audience, 200)
        assert refused.value.response.status_code == 503
        for number in range(200):
            held.enter_context(idle(audience, 1 + number))
        steering = Stream(host)
        held.callback(steering.close)
        steering.ask("set", key="speed", value=2.0)
        steering.until(lambda s: s.state is not None and s.state["values"]["speed"] == 2.0)


def test_one_address_takes_few_places():
    with shared(Clock()) as (_, _host, audience), ExitStack() as held:
        lines = [held.enter_context(idle(audience)) for _ in range(PER_ADDRESS + 1)]
        assert dropped(lines[-1])
        one = listener(audience, 1).until(lambda s: len(s.rows) > 5)  # another address has its own
        one.close()
        lines[0].close()
        again = Stream(audience, source_address=("127.0.2.1", 0)).until(lambda s: len(s.rows) > 5)
        again.close()


@pytest.mark.parametrize("steers", [True, False])
def test_idle_connections_give_way_to_new_ones(steers):
    with shared(Clock()) as (_, host, audience), ExitStack() as held:
        address = host if steers else audience
        lines = [held.enter_context(idle(address, 1 + i)) for i in range(connections.MAX_WAITING)]
        assert asked(address)[0] == 200
        assert dropped(lines[0])
        one = listener(address, 1).until(lambda s: len(s.rows) > 5)
        one.close()


def test_an_idle_connection_is_dropped(monkeypatch):
    monkeypatch.setattr(server, "REQUEST_TIMEOUT", 0.2)
    with shared(Clock()) as (_, host, audience), idle(host) as one, idle(audience) as other:
        other.sendall(b"GET / HTTP/1.1\r\nHost: ")
        assert dropped(one)
        assert dropped(other)


@pytest.mark.parametrize("reads", [False, True])
def test_a_page_that_takes_nothing_or_answers_no_ping_loses_its_place(monkeypatch, reads):
    """There is one place, and another page gets it."""
    from websockets.exceptions import InvalidStatus

    monkeypatch.setattr(server, "ALIVE_TIMEOUT", 0.3)
    monkeypatch.setattr(server, "AUDIENCE", 1)
    source, end = Clock(), time.monotonic() + PATIENCE
    with shared(source) as (player, _, audience), idle(audience) as dead:
        dead.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        dead.sendall(handshake(audience))
        said = b""
        while b"watching" not in said:  # it has the place
            said += dead.recv(64)
        while True:
            assert time.monotonic() < end
            if reads and dropped(dead):
                break
            player.feed.put(source.advance(2.0))
            with suppress(InvalidStatus):
                listener(audience, 1).close()
                break


def handshake(address):
    """The request for the stream, by hand."""
    parts = urlsplit(str(address))
    return (
        f"GET {parts.path}stream HTTP/1.1\r\nHost: {parts.netloc}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    ).encode()


def test_idle_connections_do_not_delay_the_end():
    with ExitStack() as held:
        with shared(Clock()) as (_, host, audience):
            for address in (host, audience):
                held.enter_context(idle(address))
            time.sleep(0.1)
            begun = time.monotonic()
        assert time.monotonic() - begun < server.REQUEST_TIMEOUT / 2
