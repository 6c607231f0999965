"""One check of a part, and its outcome."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from palpate.plugins import reason


@dataclass(frozen=True)
class Check:
    """A sentence that must be true of a part; calling it raises an AssertionError if it is not.

    Args:
        law: a function of what is checked; its name is the sentence.
        subject: a part, or a maker of an identifier.
    """

    law: Callable[[Any], None]
    subject: Any

    def __call__(self) -> None:
        self.law(self.subject)

    def __str__(self) -> str:
        return self.law.__name__

    @property
    def sentence(self) -> str:
        """The outcome of the check in words."""
        return self.law.__name__.replace("_", " ")


@dataclass(frozen=True)
class CheckOutcome:
    """Outcome of a check.

    Args:
        sentence: what must be true.
        failed: why it is not; "" if it is.
    """

    sentence: str
    failed: str


def outcomes(checks: Iterable[Check]) -> Iterator[CheckOutcome]:
    """Runs all checks; an exception of one does not stop the others."""
    for one in checks:
        try:
            one()
        except AssertionError as error:
            yield CheckOutcome(one.sentence, " ".join(str(error).split()) or "it fails")
        except Exception as error:  # noqa: BLE001 - whatever the user's own code raises
            yield CheckOutcome(one.sentence, reason(error))
        else:
            yield CheckOutcome(one.sentence, "")


def require(ok: object, why: str) -> None:
    """Raises the AssertionError of a check; not by `assert`, which an optimising interpreter leaves out."""
    if not ok:
        raise AssertionError(why)
