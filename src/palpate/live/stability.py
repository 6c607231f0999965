"""Where the loop that runs is stable: by proof where its law has one, else by its linear model.

It takes seconds, so it is worked out by a process of its own (`python -m palpate.live.stability`): an experiment as
JSON on each line in, answers as JSON lines out, the last of each with `"more": false`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from math import isfinite
from typing import Any

import msgspec

from palpate.bench.experiments.tables import Experiment
from palpate.controllers import CautiousController
from palpate.errors import InputError, PalpateError
from palpate.report.numbers import plain, quantity

Answer = dict[str, Any]
NICE = 10


class Stability:
    """Answers for the experiment that was asked for last.

    Args:
        told: called, from another thread, when there is a new answer.
    """

    def __init__(self, told: Callable[[], None]):
        self.latest: Answer | None = None
        self._told, self._wanted = told, b""
        self._news, self._ended = threading.Event(), False
        self._process: subprocess.Popen[bytes] | None = None
        self._thread = threading.Thread(target=self._work, name="stability", daemon=True)
        self._thread.start()

    def ask(self, experiment: Experiment) -> None:
        """Has it worked out for these numbers; what was asked before is forgotten."""
        self._wanted = msgspec.json.encode(experiment) + b"\n"
        self.latest = {"stiffness": None, "proved": False, "text": "Working out where this loop is stable …"}
        self._news.set()

    def close(self) -> None:
        """Ends the process and the thread."""
        self._ended = True
        self._news.set()
        if self._process is not None:
            self._process.kill()
        self._thread.join()

    def _work(self) -> None:
        with suppress(BrokenPipeError, ValueError):  # the process was ended
            while self._news.wait() is not None and not self._ended:
                self._news.clear()
                self._answer(self._wanted)
        if self._process is not None:
            self._process.kill()
            self._process.communicate()

    def _answer(self, asked: bytes) -> None:
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "palpate.live.stability"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(asked)
        self._process.stdin.flush()
        while line := self._process.stdout.readline():
            answer = msgspec.json.decode(line)
            if asked == self._wanted and not self._ended:
                self.latest = answer
                self._told()
            if not answer["more"]:
                return


def answers(experiment: Experiment) -> Iterator[Answer]:
    """What can be said of the loop, sooner and then better.

    Each has `stiffness`, the interval of surfaces [N/m] or None, and its `label`; `proved`, whether this surface is one
    of which a proof holds; and `text`.
    """
    try:
        if isinstance(experiment.controller, CautiousController):
            yield _proved(experiment, experiment.controller)
        else:
            yield from _linear(experiment)
    except PalpateError as error:
        yield {"stiffness": None, "proved": False, "text": f"Nothing is known of its stability: {error}."}


def _proved(experiment: Experiment, table: CautiousController) -> Answer:
    """By the certificate of the cautious law on the bench's arm."""
    from palpate.controllers.cautious_press import gains_on_bench
    from palpate.force import certify
    from palpate.force.steps import margins

    made: Any = gains_on_bench
    gains = made(1.0 / experiment.run.rate, table.spring, table.damping, table.force, table.cap)
    certificate = certify(gains, adapting=False)
    held = next((claim for claim in certificate.claims if claim.kind == "held"), None)
    own = margins(gains, gains.seen_cap)
    said = f"On the stiffest surface {_margins(own.gain, own.phase, own.delay)}."
    if held is None or not certificate.check().holds:
        return {"stiffness": None, "proved": False, "text": f"Nothing could be proved. {said}"}
    bare = experiment.surface.damping == 0.0
    text = (
        f"Proved stable with its gain held: every surface without damping from {quantity(held.low, 'N/m')} to "
        f"{quantity(held.high, 'N/m')}. {said}"
    )
    if not bare:
        text += " This surface has damping, of which nothing is proved."
    return {
        "stiffness": [held.low, held.high],
        "proved": bare,
        "label": "proved stable" if bare else "proved stable, were there no damping",
        "text": text,
    }


def _linear(experiment: Experiment) -> Iterator[Answer]:
    """By the loop's linear model, friction of the joints left out."""
    from palpate.analysis import linearise, margins, stable_stiffness

    known: Answer = {"stiffness": None, "proved": False, "label": "stable, linear model"}
    loop = linearise(experiment)
    stable = loop.stable
    said = (
        "Stable on this surface, by the linear model"
        if stable
        else "Unstable on this surface, by the linear model"
    )
    yield known | {"text": f"{said}.", "more": True}
    if stable:
        own = margins(loop)
        said += f": {_margins(own.gain, own.phase, own.delay)}"
        yield known | {"text": f"{said}.", "more": True}
    try:
        known["stiffness"] = list(stable_stiffness(experiment))
    except InputError:
        said += "; with this gain it is so on every surface from 100 N/m to 3 MN/m"
    yield known | {"text": f"{said}."}


def _margins(gain: float, phase: float, delay: float) -> str:
    parts = []
    if isfinite(gain):
        parts.append(f"the gain may grow {plain(gain, 2)} times")
    if isfinite(delay):
        parts.append(f"the force may come {quantity(delay, 's', digits=2)} later")
    if isfinite(phase):
        parts.append(f"the phase margin is {phase:.0f}°")
    return ", ".join(parts) or "no gain and no delay would make it unstable"


def main() -> None:
    """Answers line by line until its input ends."""
    os.nice(NICE)
    for line in sys.stdin.buffer:
        experiment = msgspec.json.decode(line, type=Experiment)
        last: Answer = {"stiffness": None, "proved": False, "text": ""}
        for answer in answers(experiment):
            last = answer
            if answer.get("more"):
                _say(answer)
        _say({**last, "more": False})


def _say(answer: Answer) -> None:
    sys.stdout.buffer.write(msgspec.json.encode(answer) + b"\n")
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
