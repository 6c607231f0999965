"""`palpate topics`: the signals of a log and their names."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated

from cyclopts import Group, Parameter

from palpate.cli._program import print_result
from palpate.cli._terminal import print_lines
from palpate.cli.options.common import WRITTEN
from palpate.logs.signals import GB, Signals

if TYPE_CHECKING:
    from palpate.logs.listing import Listing, SignalEntry
    from palpate.logs.proposal import Proposal


_HOW = Group("Reading", sort_key=1)


def topics(
    log: Path,
    /,
    *,
    join: Annotated[Path | None, Parameter(group=_HOW)] = None,
    delimiter: Annotated[str | None, Parameter(group=_HOW)] = None,
    max_size: Annotated[float, Parameter(group=_HOW)] = GB,
    max_seconds: Annotated[float, Parameter(group=_HOW)] = 600.0,
    json: Annotated[bool, Parameter(negative=(), group=WRITTEN)] = False,
) -> int:
    """List the signals of a log, and propose a command to identify it; a command is tried before it is proposed.

    palpate topics press.mcap

    Parameters
    ----------
    log
        Text in columns, JSON, Parquet, a spreadsheet, MATLAB, HDF5, npz, TDMS, an AFM curve, a ROS 1 bag, a ROS 2 bag
        or MCAP.
    join
        A second log with further columns, joined by time.
    delimiter
        Character between two cells of a text log; detected if not given.
    max_size
        Largest unpacked size, in GB; a larger log is refused.
    max_seconds
        Longest time to read it.
    json
        Print one JSON object and nothing else.
    """
    from palpate.from_log import try_proposal
    from palpate.logs.listing import list_log
    from palpate.report.page import Answer

    listing = list_log(log, delimiter, Signals(max_size=max_size, max_seconds=max_seconds).limits, join)
    proposals = [try_proposal(log, proposal) for proposal in listing.proposals]
    plain_proposals = [
        {"command": proposal.command(log), "guesses": list(proposal.guesses)} for proposal in proposals
    ]
    # A log of gigabytes is listed at once, and so is not read through for a digest.
    plain = {
        "files": [{"file": str(log), "sha256": None}],
        "entries": [entry.to_json() for entry in listing.entries],
        "troubles": listing.troubles,
        "identify": plain_proposals[0],
        "others": plain_proposals[1:],
    }
    lines = _table(log, listing)
    for proposal in proposals:
        lines += _proposal_lines(proposal, proposal.command(log))
    print_result(Answer(plain, show=lambda _: print_lines(*lines)), json=json)
    return 0


def _table(log: Path, listing: Listing) -> list[str]:
    """One line for each entry, never wrapped, so that other programs can search it."""
    begin = _begin(listing.entries)
    rows = [("name", "type", "count", "rate", "first", "last", "values")]
    for entry in listing.entries:
        times = (_number(None if time is None else time - begin, " s") for time in (entry.first, entry.last))
        words = (entry.name, entry.kind.replace("/msg/", "/"), str(entry.count), _number(entry.rate, " Hz"))
        rows.append((*words, *times, entry.about))  # type: ignore[arg-type]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    since = f", times from {_date(begin)} on" if begin else ""
    lines = [f"{log.name}: {len(listing.entries)} {_kind(listing.entries)}{since}"]
    for row, fields in zip(rows, [(), *(entry.fields for entry in listing.entries)], strict=True):
        cells = [
            cell.rjust(width) if place in _NUMBERS else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
        lines += wrap(", ".join(fields), 110, initial_indent="    ", subsequent_indent="    ")
    return [*lines, *listing.facts, *listing.troubles]


def _proposal_lines(proposal: Proposal, command: str | None) -> list[str]:
    """The proposed command, and its guessed parts."""
    guesses = [f"  {guess}" for guess in proposal.guesses]
    if command is None:
        return ["", "no command is proposed:", *guesses]
    return [
        "",
        f"to {proposal.purpose}{' (guessed parts are listed below)' if guesses else ''}:",
        f"  {command}",
        *(f"  {fact}" for fact in proposal.facts),
        *guesses,
    ]


_NUMBERS = range(2, 6)
_MIN_UNIX_TIME = 1e8
"""Time from which on a clock is taken to count from 1970 [s]: March 1973."""


def _begin(entries: list[SignalEntry]) -> float:
    """Origin of the times: the first one if they are dates [s since 1970], else 0."""
    first = min((entry.first for entry in entries if entry.first is not None), default=0.0)
    return first if first > _MIN_UNIX_TIME else 0.0


def _date(seconds: float) -> str:
    try:
        return f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M:%S} UTC"
    except (ValueError, OverflowError, OSError):
        return f"{seconds:g} s"


def _kind(entries: list[SignalEntry]) -> str:
    word = "topic" if all(entry.name.startswith("/") for entry in entries) else "column"
    return word if len(entries) == 1 else f"{word}s"


def _number(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.4g}{unit}"
