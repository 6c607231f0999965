"""How much of the machine a stranger's log may take: unpacked size and time."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

from palpate.errors import InputError

GB = 10**9


@dataclass(frozen=True)
class Limits:
    """The most that reading one log may take.

    Args:
        size: of what the log unpacks to [bytes]; of a file that is not packed, its own size.
        seconds: to read it [s].
    """

    size: float = 2.0 * GB
    seconds: float = 600.0

    def __post_init__(self) -> None:
        for name, value in (("--max-size", self.size), ("--max-seconds", self.seconds)):
            if not value > 0:
                raise InputError(f"{name} must be above 0, got {value:g}")


class LimitError(InputError):
    """A log takes more than it may; unlike damage, this is never read around."""


@dataclass
class Budget:
    """Remaining limits while one log is read.

    Args:
        path: the log.
        limits: of it.
    """

    path: Path
    limits: Limits = field(default_factory=Limits)
    _spent: float = 0.0
    _begun: float = field(default_factory=monotonic)

    def check(self, size: float) -> None:
        """Refuse something of this size [bytes] before it is unpacked or read into memory.

        Raises:
            LimitError: it is more than may still come.
        """
        if self._spent + size > self.limits.size:
            raise LimitError(
                f"{self.path} holds more than {self.limits.size / GB:.4g} GB unpacked, the limit for a log;"
                " if this size is intended, raise the limit with --max-size GB"
            )

    def take(self, size: float) -> None:
        """Count something that was unpacked [bytes], and the time so far.

        Raises:
            LimitError: that is more than may be.
        """
        self.check(size)
        self._spent += size
        if self.seconds_left <= 0:
            raise self.too_long()

    @property
    def seconds_left(self) -> float:
        """Until the limit of time [s]."""
        return self.limits.seconds - (monotonic() - self._begun)

    def too_long(self) -> LimitError:
        """The error for a log that takes too long."""
        return LimitError(
            f"{self.path} takes more than {self.limits.seconds:g} s to read, the limit for a log;"
            " if it is whole and merely long, raise the limit with --max-seconds S"
        )
