"""The Silverbox (Wigren and Schoukens, 2013): an electronic circuit that obeys the equation of a stiffening spring.

The data are not distributed here: their page, nonlinearbenchmark.org, states no licence. A user names the file that he
has downloaded. The splits are those of the benchmark's own loader: estimation on the first three quarters of the
multisine, and three tests, whose state may be found from their first 50 samples.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files import read_text
from palpate_benchmark.duffing import Part

RATE = 1e7 / 2**14
"""[Hz], 610.35."""
ROWS = 131072
STATE_ROWS = 50
"""Of a test, from which its state may be found."""
ESTIMATION = (40650, 105712)
TESTS = {
    "test multisine": (105712, 127400),
    "test arrow": (100, 40575),
    "test arrow, no extrapolation": (100, 32100),
}
"""Rows of the benchmark's record SNLS80mV, the end excluded."""
_COLUMNS = (("V1", "V2"), ("force_V", "position_V"))
_MOST = 20_000_000
"""Bytes of a text of so many rows."""
_GROWS = 0.3
"""The arrow's amplitude grows from nothing: its first tenth has less than this of its last tenth's."""


@dataclass(frozen=True)
class Silverbox:
    """A record with its split.

    Args:
        official: whether it is the benchmark's own record; another has no arrow, and is split by three quarters.
        estimation: what may be used to estimate.
        tests: what may not, by name.
    """

    official: bool
    estimation: Part
    tests: dict[str, Part]


def load_silverbox(path: Path) -> Silverbox:
    """The record of a file: SNLS80mV as .csv or .mat, or another of the same circuit and rate.

    Raises:
        InputError: no such file, other columns, or too few rows.
    """
    u, x = _signals(path)
    if len(u) < 4096 or not (np.isfinite(u).all() and np.isfinite(x).all()):
        raise InputError(
            f"{path}: a record of the Silverbox has {ROWS} finite rows, got {len(u)}; download it again"
        )
    begin, end = TESTS["test arrow"]
    tenth = (end - begin) // 10
    official = len(u) == ROWS and u[begin : begin + tenth].std() < _GROWS * u[end - tenth : end].std()
    three = 3 * len(u) // 4
    rows = (
        {"estimation": ESTIMATION, **TESTS}
        if official
        else {"estimation": (0, three), "test": (three, len(u))}
    )
    parts = {name: Part.of(u, x, RATE, *ends) for name, ends in rows.items()}
    return Silverbox(bool(official), parts.pop("estimation"), parts)


def _signals(path: Path) -> tuple[Array, Array]:
    """Force V1 and position V2 [V], each of shape (n,)."""
    if path.suffix.lower() == ".mat":
        return _from_mat(path)
    text = read_text(path, "a record of the Silverbox", most=_MOST)
    first = text.partition("\n")[0]
    head = [name.strip().strip('"') for name in first.split(",")]
    for names in _COLUMNS:
        if set(names) <= set(head):
            try:
                rows = np.genfromtxt(
                    text.splitlines()[1:], delimiter=",", usecols=[head.index(name) for name in names]
                )
            except ValueError as error:
                raise InputError(f"{path}: {' '.join(str(error).split())}; download it again") from None
            return np.atleast_2d(rows)[:, 0], np.atleast_2d(rows)[:, 1]
    raise InputError(
        f"{path} has the columns {first!r}; a record of the Silverbox has V1 (force) and V2 (position)"
    )


def _from_mat(path: Path) -> tuple[Array, Array]:
    import zlib

    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        found = loadmat(path)
        return np.ravel(found["V1"]).astype(float), np.ravel(found["V2"]).astype(float)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (KeyError, ValueError, TypeError, NotImplementedError, OSError, MatReadError, zlib.error) as error:
        raise InputError(f"{path} holds no V1 and V2 ({error}); a record of the Silverbox has both") from None
