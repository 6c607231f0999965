"""Result of a press over a wire, and its record.

Rows go into a file that is mapped into memory: what is written there outlives the process. When the press ends they
become `record.parquet`, which `palpate identify` takes as it takes the record of a run.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files import RECORD, check_place, fresh_folder, with_author, write_json
from palpate.force import SlidingLoop
from palpate.logs import write_record
from palpate.press.at_rest import SETTLING_BAND
from palpate.press.sequence import mean_over
from palpate.press.unload import Unloading
from palpate.records import Record
from palpate.units import cone95
from palpate.wires.at_rest import AtRest
from palpate.wires.order import Order
from palpate.wires.realtime import Lateness


@dataclass(frozen=True)
class Outcome:
    """Result of a press.

    Args:
        ended: why, in words.
        ok: it pressed with the force for as long as was asked.
        unloading: how the tip was led out of the surface.
        touched: the force was reached in contact.
        force: mean over the last third of the hold [N]; None if it was not reached.
        settled: seconds from the touch until the force was within 5 % for good; None if it was not.
        stiffness: of the surface, as the position feels it, and its standard deviation [N/m]; None if the force was
            never reached, or the loop has no estimate.
        surface: normal and friction at the end of a slide with their intervals; None of a press, or if it never slid.
        lateness: of the loop.
        rest: what was seen before.
        free_stroke: force over the position in the free stroke, as plain JSON values; None without one.
        troubles: ticks of each trouble of the law, by its sentence.
    """

    ended: str
    ok: bool
    unloading: Unloading
    touched: bool
    force: float | None
    settled: float | None
    stiffness: tuple[float, float] | None
    surface: Mapping[str, Any] | None
    lateness: Lateness
    rest: AtRest
    free_stroke: Mapping[str, Any] | None
    troubles: Mapping[str, int]

    def to_json(self) -> dict[str, Any]:
        """The result as plain JSON values."""
        return {
            "ended": self.ended,
            "ok": self.ok,
            "unloaded": self.unloading.to_json(),
            "touched": self.touched,
            "force_N": self.force,
            "settled_s": self.settled,
            "stiffness_N_per_m": self.stiffness and list(self.stiffness),
            **({"surface": self.surface} if self.surface else {}),
            "lateness": self.lateness.to_json(),
            **self.rest.to_json(),
            "free_stroke": self.free_stroke,
            "troubles": dict(self.troubles),
        }


def describe_surface(loop: SlidingLoop) -> dict[str, Any]:
    """Normal and friction of a slide with their 95 % intervals, as plain JSON values."""
    mu = loop.friction
    return {
        "normal": loop.normal.tolist(),
        "cone95_deg": cone95(loop.normal_cone95),
        "friction": None if mu is None else {"value": float(mu), "ci95": list(mu.ci95)},
    }


def force_reached(times: Array, forces: Array) -> float | None:
    """Mean force over the last third of the time since the touch [N]; None without a sample."""
    late = forces[times > 2.0 / 3.0 * times[-1]] if len(times) else forces
    return float(late.mean()) if len(late) else None


def settling_time(times: Array, forces: Array, order: Order) -> float | None:
    """Time from which on the force stays within 5 % of the desired force [s]; None if it does not.

    The force is a mean over the loop's whole lag: noise of single readings is not the force. A force that is
    lowered now and then is judged up to the first time.
    """
    if not len(times):
        return None
    if order.task.probe:
        before = times < times[-1] / 3.0
        times, forces = times[before], forces[before]
    gains = order.loop.gains
    smooth = mean_over(forces, gains.theta, gains.arm.tick)
    outside = np.flatnonzero(np.abs(smooth / order.task.force - 1.0) > SETTLING_BAND)
    if not len(outside):
        return 0.0
    return float(times[outside[-1] + 1]) if outside[-1] < len(smooth) - 1 else None


UNITS = {
    "t": "s",
    "received": "s",
    "x_measured": "m",
    "force_sampled": "N",
    "speed": "m/s",
    "x_command": "m",
    "bound": "N/m",
    "phase": "1",
    "missed": "1",
    **{f"force_{axis}": "N" for axis in "xyz"},
    **{f"torque_{axis}": "N m" for axis in "xyz"},
    **{f"position_{axis}": "m" for axis in "xyz"},
    **{f"quaternion_{axis}": "1" for axis in "xyzw"},
}
"""Columns of a row. The first are along the direction of the press, the force without its bias in free motion."""
_ROWS, _HEAD = "rows.f64", "press.json"


class Rows:
    """Rows of a press, in memory or in a file of a fixed size.

    Args:
        folder: where they are kept, which must not exist; None keeps them in memory alone.
        max_rows: rows that there may be.
        about: what is known beforehand, plain JSON values.

    Raises:
        InputError: palpate may not write there.
    """

    def __init__(self, folder: Path | None, max_rows: int, about: dict[str, Any]):
        self.folder, self.about, self.count = folder, about, 0
        shape = (max_rows, len(UNITS))
        if folder is None:
            self._rows: Any = np.zeros(shape)
            return
        if folder.exists() or folder.is_symlink():
            raise InputError(f"{folder} exists; choose another place for --record")
        check_place(folder, "--record")
        with fresh_folder(folder, replace=False) as draft:
            write_json(draft / _HEAD, with_author({"unfinished": True, **about}))
            _reserve(draft / _ROWS, 8 * max_rows * len(UNITS))
        self._rows = np.memmap(folder / _ROWS, dtype=np.float64, mode="r+", shape=shape)

    @property
    def full(self) -> bool:
        """True if there is no room for another row."""
        return self.count >= len(self._rows)

    def add(self, *values: float) -> None:
        """Keep one row, in the order of `UNITS`; the first column is written last, so that a half row is none."""
        row = self._rows[self.count]
        row[1:] = values[1:]
        row[0] = values[0]
        self.count += 1

    def note_hold(self, stamp: float) -> None:
        """Note when the force was reached first, by the arm's clock [s]."""
        first = float(self._rows[0, 0]) if self.count else stamp
        self.about.setdefault("held_from_s", stamp - first)

    def record(self) -> Record:
        """Record of all rows until now."""
        return _record(np.array(self._rows[: self.count]), self.about)

    def finish(self, outcome: dict[str, Any]) -> Path | None:
        """Make the record, and say how it ended; returns where it is, None where nothing came."""
        if self.folder is None:
            return None
        self._rows.flush()
        path = _finish(self.folder, self.record(), {**self.about, **outcome})
        return path if self.count else None


def _reserve(path: Path, size: int) -> None:
    """Room on the disk for all rows: a disk that is full in mid-press would end the process.

    Raises:
        OSError: there is no room.
    """
    with path.open("xb") as file:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, size)
        else:
            file.truncate(size)


def recover(folder: Path) -> Path:
    """Make the record of a press whose process was killed; returns where it is.

    Raises:
        InputError: nothing of the kind is there.
    """
    rows, head = folder / _ROWS, folder / _HEAD
    if not (rows.is_file() and head.is_file()) or rows.is_symlink():
        raise InputError(f"{folder} holds no press that was broken off; name the folder of --record")
    try:
        about = msgspec.json.decode(head.read_bytes(), type=dict[str, Any])
    except msgspec.DecodeError as error:
        raise InputError(f"{head} is spoiled ({error}); it cannot be recovered") from None
    if about.pop("unfinished", None) is None:  # the record was made, and its rows were not removed yet
        rows.unlink()
        return folder / RECORD
    numbers = np.fromfile(rows, dtype=np.float64)
    numbers = numbers[: len(numbers) // len(UNITS) * len(UNITS)].reshape(-1, len(UNITS))
    written = numbers[numbers[:, 1] != 0.0]  # a time of receipt is never 0
    return _finish(folder, _record(written, about), {**about, "ended": "broken off", "ok": False})


def _finish(folder: Path, record: Record, outcome: dict[str, Any]) -> Path:
    if len(record):
        write_record(record, folder / RECORD)
    outcome = {name: value for name, value in outcome.items() if name != "written_by"}
    write_json(folder / _HEAD, with_author(outcome))
    (folder / _ROWS).unlink()
    return folder / RECORD


def _record(rows: Any, about: dict[str, Any]) -> Record:
    columns = {name: np.ascontiguousarray(rows[:, i]) for i, name in enumerate(UNITS)}
    columns["t"] -= columns["t"][:1]
    if about.get("path"):  # a slide has no depth along one direction: it is read as wrench and pose
        columns["time"] = columns.pop("t")
        del columns["x_measured"]
    units = {name: UNITS.get(name, "s") for name in columns}
    meta = {name: value for name, value in about.items() if name != "written_by"}
    source = about.get("position_from", "joints")
    return Record(columns, units, {"wire": meta, "position_from": source, "wrench_frame": "base"})
