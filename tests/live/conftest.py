"""A page that is served, a client of its stream, and a browser where there is one."""

import json
import time
from contextlib import ExitStack, contextmanager

import headless
import numpy as np
import pytest

from palpate.bench.tables import load, with_values
from palpate.live.player import Feed, Player
from palpate.live.server import PageServer
from palpate.live.simulation import WatchedSimulation
from palpate.live.view import AT, COLUMNS

PATIENCE = headless.PATIENCE
"""Within which what has to happen does [s]."""


class Stream:
    """A page's end of the stream, without the page."""

    def __init__(self, address, **options):
        from websockets.sync.client import connect

        url = str(address).replace("http", "ws") + "stream"
        self._held = ExitStack()
        self._socket = self._held.enter_context(
            connect(url, compression=None, open_timeout=PATIENCE, **options)
        )
        self.kinds, self.state, self.lost = [], None, 0
        self.rows = np.empty((0, len(COLUMNS)))

    def ask(self, do, **more):
        self._socket.send(json.dumps({"do": do, **more}))

    def send(self, text):
        self._socket.send(text)

    def until(self, wanted):
        """Reads until `wanted(self)` is true; fails where nothing comes any more, or never what is wanted."""
        end = time.monotonic() + PATIENCE
        while not wanted(self):
            assert time.monotonic() < end, f"not within {PATIENCE:.0f} s; the state is {self.state}"
            message = self._socket.recv(timeout=PATIENCE)
            if isinstance(message, bytes):
                self.rows = np.concatenate([self.rows, np.frombuffer(message).reshape(-1, len(COLUMNS))])
                continue
            told = json.loads(message)
            self.kinds.append(told["kind"])
            if told["kind"] == "state":
                self.state = told
            elif told["kind"] == "clear":
                self.rows = self.rows[:0]
            elif told["kind"] == "lost":
                self.lost += told["rows"]
            elif told["kind"] == "refused":
                self.refused = told["why"]
        return self

    def column(self, name):
        return self.rows[:, AT[name]]

    def close(self):
        self._held.close()


def near(name="foam-hybrid", **more):
    """An experiment that touches soon, so that nothing is waited for."""
    return with_values(load(name), {"approach.hold": 0.1, "approach.first": 0.463, **more})


@pytest.fixture
def simulation():
    return WatchedSimulation(near(), seed=1)


@contextmanager
def playing(source):
    """A source that is served: its player, its address, and what connects a client to it."""
    clients = []

    def client(**options):
        clients.append(Stream(address, **options))
        return clients[-1]

    with Player(source, Feed()) as player, PageServer(player) as address:
        try:
            yield player, address, client
        finally:
            for one in clients:
                one.close()
    assert player.failure is None
