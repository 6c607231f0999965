"""Where the loop that runs is stable: by proof where its law has one, else by its linear model.

It takes seconds, so it is worked out by a process of its own (`python -m palpate_live.stability`): a loop as JSON on
each line in, answers as JSON lines out, the last of each with `"more": false`.
"""

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from math import isfinite
from typing import Any

import msgspec

from palpate.bench.tables import Experiment
from palpate.controllers import CautiousController
from palpate.errors import InputError, PalpateError
from palpate.force.claims import Claim
from palpate.force.gains import Gains
from palpate.units import plain, quantity

Answer = dict[str, Any]
NICE = 10


class OfBench(msgspec.Struct, frozen=True, tag="bench"):
    """The loop of an experiment."""

    experiment: Experiment


class OfArm(msgspec.Struct, frozen=True, tag="arm"):
    """The cautious law on an arm, before a surface.

    Args:
        gains: of the law.
        stiffness: of the surface [N/m].
        damping: of the surface [N s/m].
    """

    gains: Gains
    stiffness: float
    damping: float


Asked = OfBench | OfArm


class Stability:
    """Answers for the loop that was asked for last.

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

    def ask(self, asked: Asked) -> None:
        """Has it worked out for these numbers; what was asked before is forgotten."""
        self._wanted = msgspec.json.encode(asked) + b"\n"
        self.latest = {
            "stiffness": None,
            "proved": False,
            "text": "Computing the stable surfaces of this loop …",
        }
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
                [sys.executable, "-m", "palpate_live.stability"],
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


def answers(asked: Asked) -> Iterator[Answer]:
    """Answers on the loop's stability, a fast one first, then better ones.

    Each has `stiffness`, the interval of surfaces [N/m] or None, and its `label`; `proved`, whether this surface is one
    of which a proof holds; and `text`.
    """
    try:
        if isinstance(asked, OfArm):
            yield from _of_arm(asked)
        elif isinstance(asked.experiment.controller, CautiousController):
            yield from _of_arm(_as_arm(asked.experiment, asked.experiment.controller))
        else:
            yield from _linear(asked.experiment)
    except PalpateError as error:
        yield {"stiffness": None, "proved": False, "text": f"Its stability is unknown: {error}."}


def _as_arm(experiment: Experiment, table: CautiousController) -> OfArm:
    """The cautious law on the bench's arm."""
    from palpate.controllers.cautious_press import gains_on_bench

    made: Any = gains_on_bench
    gains = made(1.0 / experiment.run.rate, table.spring, table.damping, table.force, table.cap)
    return OfArm(gains, float(experiment.surface.stiffness), float(experiment.surface.damping))


def _of_arm(asked: OfArm) -> Iterator[Answer]:
    """By the certificate of the cautious law: its gain held at that for the stiffest surface, then while it adapts."""
    from palpate.force.expected import margins

    gains = asked.gains
    own = margins(gains, gains.seen_cap)
    said = f"On the stiffest surface {_margins(own.gain, own.phase, own.delay)}."
    nothing: Answer = {"stiffness": None, "proved": False, "label": ""}
    yield nothing | {"text": f"Proving on which surfaces it is stable … {said}", "more": True}
    held = next((claim for claim in _proof(_encode(gains), False) if claim.kind == "held"), None)
    if held is None:
        yield nothing | {"text": f"Nothing could be proved. {said}"}
        return
    covered = _covers(held, gains, asked.stiffness, asked.damping)
    told = f"Proved stable with a fixed gain: K + B/θ from {_span(held, gains)}, {_damping_range(held)}."
    if not covered:
        told += " The proof does not cover the present surface."
    answer: Answer = {
        "stiffness": list(_ends(held, gains)),
        "proved": covered,
        "label": "proved stable" if covered else "proved stable for others",
    }
    yield answer | {"text": f"{told} {said}", "more": True}
    adapting = [claim for claim in _proof(_encode(gains), True) if claim.kind == "adapting"]
    if adapting:
        every = (
            "every constant K"
            if gains.arm.kind == "position"
            else f"every constant K from {_span(adapting[0], gains)}"
        )
        told += f" Proved while it adapts: {every}, {_damping_range(adapting[0])}."
    yield answer | {"text": f"{told} {said}"}


@cache
def _proof(encoded: bytes, adapting: bool) -> tuple[Claim, ...]:
    """Proved claims of gains, given as JSON; a certificate that fails its check has none."""
    from palpate.force import certify

    certificate = certify(msgspec.json.decode(encoded, type=Gains), adapting=adapting)
    return certificate.claims if certificate.check().holds else ()


def _encode(gains: Gains) -> bytes:
    return msgspec.json.encode(gains)


def _ends(claim: Claim, gains: Gains) -> tuple[float, float]:
    """A claim's surfaces by their own K + B/theta [N/m]; one that the arm's own spring hides is at the cap."""
    if gains.arm.kind != "position":
        return claim.low, claim.high
    return gains.arm.surface(claim.low), min(gains.arm.surface(claim.high), gains.cap)


def _span(claim: Claim, gains: Gains) -> str:
    low, high = _ends(claim, gains)
    return f"{quantity(low, 'N/m', digits=3)} to {quantity(high, 'N/m', digits=3)}"


def _damping_range(claim: Claim) -> str:
    return "without damping" if claim.most == 0.0 else f"B/K up to {quantity(claim.most, 's', digits=2)}"


def _covers(claim: Claim, gains: Gains, stiffness: float, damping: float) -> bool:
    """Whether a surface is one of the claim's."""
    total = stiffness + damping / gains.theta
    felt = gains.arm.seen(total) if gains.arm.kind == "position" else total
    return claim.low <= felt <= claim.high and claim.least <= damping / stiffness <= claim.most


def _linear(experiment: Experiment) -> Iterator[Answer]:
    """By the loop's linear model, friction of the joints left out."""
    from palpate_studies.analysis import linearise, margins, stable_stiffness

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
        said += "; with this gain the answer is the same on every surface from 100 N/m to 3 MN/m"
    yield known | {"text": f"{said}."}


def _margins(gain: float, phase: float, delay: float) -> str:
    parts = []
    if isfinite(gain):
        parts.append(f"the gain may grow by a factor of {plain(gain, 2)}")
    if isfinite(delay):
        parts.append(f"the force may lag {quantity(delay, 's', digits=2)} more")
    if isfinite(phase):
        parts.append(f"the phase margin is {phase:.0f}°")
    return ", ".join(parts) or "no gain and no delay makes it unstable"


def main() -> None:
    """Answers line by line until its input ends."""
    os.nice(NICE)
    for line in sys.stdin.buffer:
        asked = msgspec.json.decode(line, type=Asked)
        last: Answer = {"stiffness": None, "proved": False, "text": ""}
        for answer in answers(asked):
            last = answer
            if answer.get("more"):
                _say(answer)
        _say({**last, "more": False})


def _say(answer: Answer) -> None:
    sys.stdout.buffer.write(msgspec.json.encode(answer) + b"\n")
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
