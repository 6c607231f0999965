"""How much of the machine a stranger's file may take: unpacked size and time."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

from palpate.errors import InputError

GB = 10**9
OWN = 2 * GB
"""Address space of the interpreter and its libraries themselves [bytes]: with less, they abort."""
COPIES = 3
"""Memory per unpacked byte: the data exist packed, unpacked and as the answer."""


def address_space() -> float:
    """Most of the memory that this process may address [bytes]: `ulimit -v`; infinite without such a limit."""
    try:
        import resource
    except ImportError:  # not on Windows
        return math.inf
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return math.inf if limit == resource.RLIM_INFINITY else limit


def check_address_space() -> None:
    """Refuse to begin where a library would abort the process.

    Raises:
        InputError: this process may address less memory than the libraries need.
    """
    if address_space() < OWN:
        raise InputError(
            f"this process may address {address_space() / GB:.2g} GB of memory, and its libraries need {OWN / GB:g} GB;"
            " raise the limit with: ulimit -v unlimited"
        )


@dataclass(frozen=True)
class ReadingLimits:
    """The most that reading one file may take.

    Args:
        size: of what it unpacks to [bytes]; of a file that is not packed, its own size.
        seconds: to read it [s].
        what: the file is, as "a log"; errors say it.
        larger, longer: remedies where it is too large, and where it takes too long.
    """

    size: float = 2.0 * GB
    seconds: float = 600.0
    what: str = "a log"
    larger: str = "if this size is intended, raise the limit with --max-size GB"
    longer: str = "if it is whole and merely long, raise the limit with --max-seconds S"

    def __post_init__(self) -> None:
        for name, value in (("--max-size", self.size), ("--max-seconds", self.seconds)):
            if not value > 0:
                raise InputError(f"{name} must be above 0, got {value:g}")


class LimitError(InputError):
    """A file takes more than it may; unlike damage, this is never read around."""


@dataclass
class ReadingBudget:
    """Remaining limits while one file is read.

    Args:
        path: the file.
        limits: of it.
    """

    path: Path
    limits: ReadingLimits = field(default_factory=ReadingLimits)
    _spent: float = 0.0
    _begun: float = field(default_factory=monotonic)

    def check(self, size: float) -> None:
        """Refuse something of this size [bytes] before it is unpacked or read into memory.

        Raises:
            LimitError: it is more than may still come.
        """
        if COPIES * (self._spent + size) + OWN > address_space():
            raise LimitError(
                f"{self.path} needs {(COPIES * (self._spent + size) + OWN) / GB:.4g} GB of memory to be read, and this"
                f" process may address {address_space() / GB:.4g} GB; raise the limit with: ulimit -v unlimited"
            )
        if self._spent + size > self.limits.size:
            raise LimitError(
                f"{self.path} holds more than {self.limits.size / GB:.4g} GB unpacked,"
                f" the limit for {self.limits.what}; {self.limits.larger}"
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
        """The error for a file that takes too long."""
        return LimitError(
            f"{self.path} takes more than {self.limits.seconds:g} s to read, the limit for {self.limits.what};"
            f" {self.limits.longer}"
        )
