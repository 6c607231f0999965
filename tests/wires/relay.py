"""Stands between a master and an arm and hands on what both say; from SIGUSR1 on it spoils what the arm says.

`python relay.py rtde|franka OWN-ADDRESS ARM-ADDRESS garbage|delay|loss`, both of the loopback. RTDE is a stream: it is
spoiled packet by packet. libfranka's states are datagrams, for which the master names a port that is put in place of.
"""

import contextlib
import os
import random
import selectors
import signal
import socket
import struct
import sys
import time
from collections import deque

PORTS = {"rtde": (30004, 30003, 29999), "franka": (1337,)}
DELAY, LOST, DISORDER = 0.8, 0.1, 0.03
"""[s]; a fraction; the largest delay of a packet that others overtake [s]."""
REPLAYED = 50
"""Packets before the fault that are said again and again after it."""


class Spoiler:
    """What becomes of a packet of the arm's.

    Args:
        fault: `garbage`, `flip` (one bit of each packet), `replay`, `reorder`, `delay` or `loss`.
    """

    def __init__(self, fault):
        self.fault, self.on, self.rng = fault, False, random.Random(0)
        self.past, self.count = deque(maxlen=REPLAYED), 0

    def __call__(self, data):
        """When to send what: pairs of a time [s] and bytes."""
        if not self.on:
            self.past.append(data)
            return [(time.monotonic(), data)]
        if self.fault == "loss" and self.rng.random() < LOST:
            return []
        self.count += 1
        delay = {"delay": DELAY, "reorder": DISORDER * self.rng.random()}.get(self.fault, 0.0)
        return [(time.monotonic() + delay, self.spoiled(data))]

    def spoiled(self, data):
        if self.fault == "garbage":
            return self.rng.randbytes(len(data))
        if self.fault == "replay":
            return self.past[self.count % len(self.past)]
        if self.fault == "flip":
            bit = self.rng.randrange(8 * len(data))
            return (int.from_bytes(data, "big") ^ 1 << bit).to_bytes(len(data), "big")
        return data


class Relay:
    """All sockets, and what waits for its time.

    Args:
        kind: of the protocol.
        own: address that the master is told.
        arm: address of the arm.
        spoil: a `Spoiler`.
    """

    def __init__(self, kind, own, arm, spoil):
        self.kind, self.own, self.arm, self.spoil = kind, own, arm, spoil
        self.selector, self.held, self.streams = selectors.DefaultSelector(), [], {}
        for port in PORTS[kind]:
            listening = socket.create_server((own, port))
            self.selector.register(listening, selectors.EVENT_READ, lambda one, p=port: self.accept(one, p))

    def run(self):
        while True:
            for key, _ in self.selector.select(0.0005):
                key.data(key.fileobj)
            now = time.monotonic()
            while self.held and self.held[0][0] <= now:
                _, data, send = self.held.pop(0)
                self.quietly(send, data)

    def quietly(self, act, *args):
        with contextlib.suppress(OSError):  # who was meant has gone
            act(*args)

    def accept(self, listening, port):
        master, _ = listening.accept()
        arm = socket.create_connection((self.arm, port), source_address=(self.own, 0))
        for one in (master, arm):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.streams[arm] = b""
        self.selector.register(master, selectors.EVENT_READ, lambda one: self.said(one, arm))
        spoiled = self.packets if port == 30004 else self.said
        self.selector.register(arm, selectors.EVENT_READ, lambda one: spoiled(one, master))

    def said(self, one, other):
        """Hand on as it is."""
        data = self.received(one, other)
        if data and self.kind == "franka" and data[:4] == struct.pack("<I", 0) and len(data) == 16:
            data = data[:14] + struct.pack("<H", self.states(*struct.unpack("<H", data[14:])))
        if data:
            self.quietly(other.sendall, data)

    def packets(self, arm, master):
        """RTDE's packets, each with its size in front."""
        buffer = self.streams[arm] + self.received(arm, master)
        while len(buffer) >= 3 and len(buffer) >= (size := struct.unpack_from(">H", buffer)[0]) >= 3:
            self.hold(buffer[:size], master.sendall)
            buffer = buffer[size:]
        self.streams[arm] = buffer

    def states(self, port):
        """A port for the arm's states, which go on to that one of the master's; its answers go back."""
        near, far = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        near.bind((self.own, 0))
        far.bind((self.own, 0))
        came = []

        def state(one):
            data, who = one.recvfrom(65536)
            came[:] = [who]
            self.hold(data, lambda d: near.sendto(d, (self.own, port)))

        def answer(one):
            data = one.recv(65536)
            if came:
                self.quietly(far.sendto, data, came[0])

        self.selector.register(far, selectors.EVENT_READ, state)
        self.selector.register(near, selectors.EVENT_READ, answer)
        return far.getsockname()[1]

    def hold(self, data, send):
        self.held += [(due, what, send) for due, what in self.spoil(data)]
        self.held.sort(key=lambda one: one[0])

    def received(self, one, other):
        try:
            data = one.recv(65536)
        except OSError:
            data = b""
        if not data:
            for gone in (one, other):
                self.quietly(self.selector.unregister, gone) if gone in self.selector.get_map() else None
                gone.close()
        return data


def main():
    kind, own, arm, fault = sys.argv[1:5]
    spoil = Spoiler(fault)
    signal.signal(signal.SIGUSR1, lambda *_: setattr(spoil, "on", True))
    relay = Relay(kind, own, arm, spoil)
    sys.stdout.write(f"{kind}:{own}\n")
    sys.stdout.flush()
    with contextlib.suppress(OSError):  # where the system gives it: a relay is not to be late by itself
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(40))
    relay.run()


if __name__ == "__main__":
    main()
