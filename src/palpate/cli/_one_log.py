"""A log, identified with the options of the command line."""

from __future__ import annotations

from dataclasses import dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from palpate.cli._program import command
from palpate.cli.options.arm import ArmOptions, FrameOptions
from palpate.cli.options.indenter import IndenterOptions
from palpate.cli.options.log import LogOptions

if TYPE_CHECKING:
    from palpate.from_log import LogIdentifier
    from palpate.identification import Identification
    from palpate.records import Record
    from palpate.report.identification.source import Source


_LOG, _FRAME, _ARM, _INDENTER = LogOptions(), FrameOptions(), ArmOptions(), IndenterOptions()


class Fitted(Protocol):
    """Options of the identification itself."""

    @property
    def tolerance(self) -> float:
        """Largest half-width of an identified parameter, as a share of its value."""
        ...

    def known(self) -> dict[str, Any]:
        """The keywords of `palpate.identify`."""
        ...


def answered(found: Identification) -> bool:
    """Whether a number is identified, at the working point or a parameter, and no unit or column is doubtful."""
    from palpate.report.identification.words import unit_warnings

    point = [found.working_point.stiffness] if found.working_point else []
    return not unit_warnings(found) and any(p.value is not None for p in (*point, *found.parameters.values()))


@dataclass(frozen=True)
class OneLog:
    """Options that are common to all logs."""

    fitted: Fitted
    source: LogOptions = _LOG
    frame: FrameOptions = _FRAME
    arm: ArmOptions = _ARM
    pressed_by: IndenterOptions = _INDENTER

    def identified(self, log: Path) -> tuple[Identification, Source]:
        """Read and identify a log; the result names its file.

        Raises:
            InputError: the log or an option is wrong, in one line.
        """
        found, _, source = self.identified_along(log)
        return found, source

    def identified_along(self, log: Path) -> tuple[Identification, Record, Source]:
        """The same, with the force and the position along the normal."""
        from palpate.contact_frame import describe
        from palpate.report.identification.source import Source, sha256_of

        found, along = self.identifier.identify(log)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        notes = tuple(describe(along.meta))
        return found, along, Source(str(log), self.options, sha256_of(log), command(), made=now, notes=notes)

    @property
    def identifier(self) -> LogIdentifier:
        """The options, as the library takes them."""
        from palpate.contact_frame import ContactFrame
        from palpate.from_log import LogIdentifier

        return LogIdentifier(
            self.source, self.frame.frame() or ContactFrame(), self.arm.arm(), self.arm.weighed(),
            self.arm.robot_stiffness_from, self.pressed_by.shape(), self.pressed_by.ratio, self.fitted.known(),
        )  # fmt: skip

    @property
    def options(self) -> dict[str, Any]:
        """The options of logs, frame, arm and indenter, as plain values."""
        return {
            own.name: _plain(value)
            for part in (self.source, self.frame, self.arm, self.pressed_by)
            for own in fields(part)
            if (value := getattr(part, own.name)) != own.default
        }


def _plain(value: Any) -> Any:
    if isinstance(value, Path):
        return str(value)
    return list(value) if isinstance(value, tuple) else value
