"""A log, identified with the options of the command line."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from palpate.cli._program import command
from palpate.cli.options.arm import ArmOptions, FrameOptions
from palpate.cli.options.indenter import IndenterOptions
from palpate.cli.options.log import LogOptions, read
from palpate.errors import InputError

if TYPE_CHECKING:
    from palpate.contact_frame import Arm
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

    def known(self, log: Path, options: LogOptions) -> dict[str, Any]:
        """The keywords of `palpate.identify`."""
        ...


def answered(found: Identification) -> bool:
    """Whether a number is identified: at the working point, or a parameter."""
    point = [found.working_point.stiffness] if found.working_point else []
    return any(p.value is not None for p in (*point, *found.parameters.values()))


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
        from palpate.contact_frame import described, identify_contact
        from palpate.report.identification.source import Source, sha256_of

        known = self.fitted.known(log, self.source)
        samples = known.get("force_filter") is not None
        record = read(log, self.source, samples=samples)
        frame = self.frame.frame(self.arm.weighed() if "force_x" in record.columns else None)
        if "force_x" not in record.columns:
            if self.frame.of_space:
                raise InputError(
                    "--wrench-frame, --tcp, --normal and the like need a wrench and a pose; this log has one axis"
                )
            frame, known = None, known | {"force_sign": self.frame.sign}
        between = self._between(known, samples)
        found, along = identify_contact(record, frame, between, **known)
        found = self.pressed_by.modulus(found, self.fitted.tolerance)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        return (
            found,
            along,
            Source(
                str(log),
                self.options,
                sha256_of(log),
                command(),
                made=now,
                notes=tuple(described(along.meta)),
            ),
        )

    def _between(self, known: dict[str, Any], samples: bool) -> Arm:
        """The arm; with the stiffness from a press on a wall, if one is given."""
        from palpate.contact_frame import identify_contact, robot_stiffness

        between, wall = self.arm.arm(), self.arm.robot_stiffness_from
        if wall is None:
            return between
        hung = self.arm.weighed()
        whole = read(wall, replace(self.source, start=None, end=None), samples=samples)
        in_space = self.frame.of_space or "force_x" in whole.columns
        frame = self.frame.frame(hung) if in_space else None
        rigid = replace(between, position_from="tip")
        pressed, _ = identify_contact(whole, replace(frame, free=None) if frame else None, rigid, **known)
        return replace(between, stiffness=robot_stiffness(pressed, wall.name))

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
