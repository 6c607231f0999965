"""Measures the thesis, study by study; what is done is on disk at once, and an interrupted run goes on from there."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from palpate._jit import sources_stamp
from palpate.errors import InputError
from palpate.logs import whole
from palpate.report import style
from palpate.thesis.claims import Claim, with_wholes
from palpate.thesis.page import index_page
from palpate.thesis.runs import Runs
from palpate.thesis.study import Study

STATE = "thesis.json"


@dataclass
class Done:
    """One study as it stands on disk."""

    number: str
    title: str
    caption: str
    claims: list[Claim]
    seconds: float


@dataclass
class State:
    """What the folder holds, and for which sources and seeds."""

    stamp: str
    wanted: list[str]
    command: str
    done: dict[str, Done] = field(default_factory=dict)


def measure(
    studies: Sequence[Study],
    runs: Runs,
    folder: Path,
    *,
    command: str,
    force: bool = False,
    started: Callable[[Study], None] = lambda _: None,
) -> list[Done]:
    """Runs the studies and writes claims.json, index.html and a figure each into the folder, after each study.

    A folder that holds an unfinished measurement of the same sources, studies and seeds is gone on with.

    Raises:
        InputError: the folder holds anything else, and `force` is off.
    """
    state = _state(studies, runs, folder, command, force)
    _replace(folder / STATE, _json(state))  # from now on the folder is known for what it is
    for study in studies:
        if study.NUMBER in state.done:
            continue
        started(study)
        begun = time.perf_counter()
        data = study.run(runs)
        claims = list(study.check(data))
        style.save(study.plot(data), folder / f"{study.NUMBER}.png")
        seconds = time.perf_counter() - begun
        state.done[study.NUMBER] = Done(study.NUMBER, study.TITLE, study.CAPTION, claims, seconds)
        _write(state, folder)
    return [state.done[number] for number in state.wanted]


def _state(studies: Sequence[Study], runs: Runs, folder: Path, command: str, force: bool) -> State:
    wanted = [s.NUMBER for s in studies]
    stamp = f"{sources_stamp(*sorted(Path(__file__).parent.rglob('*.py')))} seeds {list(runs.seeds)}"
    fresh = State(stamp, wanted, command)
    if not folder.exists():
        folder.mkdir(parents=True)
        return fresh
    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder; choose another --out")
    if not any(folder.iterdir()):
        return fresh
    old = _stored(folder)
    if old is None:
        raise InputError(f"{folder} holds files that are no measurement of the thesis; choose another --out")
    if old.stamp == stamp and old.wanted == wanted and len(old.done) < len(wanted):
        return old
    if not force:
        raise InputError(
            f"{folder} holds a measurement already; choose another --out, or add --force to replace it"
        )
    return fresh


def _stored(folder: Path) -> State | None:
    try:
        return msgspec.json.decode((folder / STATE).read_bytes(), type=State)
    except (OSError, msgspec.DecodeError):
        return None


def _write(state: State, folder: Path) -> None:
    """Everything that the folder says, each file whole or as it was."""
    finished = [state.done[n] for n in state.wanted if n in state.done]
    rows = with_wholes([claim for done in finished for claim in done.claims])
    _replace(folder / "claims.json", _json([asdict(row) for row in rows]))
    _replace(folder / "index.html", index_page(state, finished, folder).encode())
    _replace(folder / STATE, _json(state))


def _json(value: Any) -> bytes:
    return msgspec.json.format(msgspec.json.encode(value), indent=2) + b"\n"


def _replace(path: Path, content: bytes) -> None:
    with whole(path) as draft:
        draft.write_bytes(content)
