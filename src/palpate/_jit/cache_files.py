"""Files of the kernel cache, each with its hash: a spoiled one is compiled again, never executed."""

from __future__ import annotations

import hashlib
import pickle
from contextlib import suppress
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any

_HASH = hashlib.sha256().digest_size


def _unpickle(data: bytes) -> Any:
    return pickle.loads(data)  # noqa: S301 - as Numba does, but only of a file that is as it was written


@cache
def hashed_files() -> type:
    """Numba's class of a kernel's cache files, with hashes; Numba is imported at the first call.

    A data file holds machine code as a pickle, and the index names it: a bit that flips in either may execute anything.
    The index begins with its own hash and holds that of each data file, so a data file of other sources, which a power
    cut between two writes leaves behind, is not taken either.
    """
    from numba.core.caching import IndexDataCacheFile

    class HashedFiles(IndexDataCacheFile):  # type: ignore[misc]
        """Index: hash, then a pickle of (version, stamp, {key: (file, hash of the file)})."""

        def load(self, key: Any) -> Any:
            """The kernel of a key; None where there is none, or its file is not as it was written."""
            name, digest = self._load_index().get(key, ("", b""))
            data = self._read(name) if name else b""
            return _unpickle(data) if hashlib.sha256(data).digest() == digest else None

        def save(self, key: Any, data: Any) -> None:
            """Adds a kernel: its data first, so that no index names a file that is not there yet."""
            overloads = self._load_index()
            taken = {name for other, (name, _) in overloads.items() if other != key}
            name = next(name for name in map(self._data_name, count(1)) if name not in taken)
            dumped = self._dump(data)
            self._write(name, dumped)
            self._save_index({**overloads, key: (name, hashlib.sha256(dumped).digest())})

        def _load_index(self) -> dict[Any, tuple[str, bytes]]:
            data = self._read(self._index_name)
            digest, held = data[:_HASH], data[_HASH:]
            if hashlib.sha256(held).digest() != digest:
                return {}
            version, dumped = _unpickle(held)
            if version != self._version:  # another Numba's pickle may not even be readable
                return {}
            stamp, overloads = _unpickle(dumped)
            return dict(overloads) if stamp == self._source_stamp else {}

        def _save_index(self, overloads: dict[Any, tuple[str, bytes]]) -> None:
            held = pickle.dumps((self._version, self._dump((self._source_stamp, overloads))))
            self._write(self._index_name, hashlib.sha256(held).digest() + held)

        def _read(self, name: str) -> bytes:
            with suppress(OSError):  # never there, or unreadable: compiled again
                return Path(self._data_path(name)).read_bytes()
            return b""

        def _write(self, name: str, data: bytes) -> None:
            with self._open_for_write(self._data_path(name)) as file:
                file.write(data)

    return HashedFiles
