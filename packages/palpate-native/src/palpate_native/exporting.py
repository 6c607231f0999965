"""A law as a folder of C: which law, with which numbers, and the check that it is Python's to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.errors import InputError, unknown
from palpate.files import fresh_folder
from palpate.force.sliding.sliding_loop import DOWN
from palpate_native import laws, recording
from palpate_native.laws import FORCE, IDENTIFIER, LAWS, SLIDING
from palpate_native.module import Module, Sources, sources_of
from palpate_native.package import files_of, write_folder
from palpate_native.replay import unequal_ticks

TICKS = 1_000_000
"""Ticks of a check: some 250 presses."""
_VAGUE = 1e6
"""Variance of each parameter of least squares at their start."""


@dataclass(frozen=True)
class LawRequest:
    """A law and its numbers.

    Args:
        law: one of `LAWS`.
        gains: file of `palpate tune`, of a force loop or a sliding loop.
        into: direction into the surface of a sliding loop, in the base's axes, shape (3,).
        parameters: of least squares, 3 or 4.
        forgetting: of least squares, in (0, 1].
        low_pass: of the force sensor, of an identifier.
        rate: ticks a second, likewise [Hz].
        lag: of the force, its low-pass included, likewise [s].
        sampling: of the force sensor, likewise [Hz]; None if each tick has a fresh reading.
    """

    law: str = FORCE
    gains: Path | None = None
    into: tuple[float, float, float] = DOWN
    parameters: int = 3
    forgetting: float = 1.0
    low_pass: str = "butterworth3:120"  # noqa: S105 - a filter
    rate: float = 1000.0
    lag: float = 0.003
    sampling: float | None = None

    def __post_init__(self) -> None:
        if self.law not in LAWS:
            raise unknown("law", self.law, LAWS)
        of_gains = self.law in (FORCE, SLIDING)
        if of_gains and self.gains is None:
            raise InputError(f"a {self.law} is of gains: give the file of palpate tune, or another --law")
        if not of_gains and self.gains is not None:
            raise InputError(f"--law {self.law} takes no gains file; leave out {self.gains}")


@dataclass(frozen=True)
class ExportedLaw:
    """A law in C, and how Python runs it.

    Args:
        module: the law and its functions.
        sources: in C.
        recording: of Python's ticks.
        desired: force of the example [N].
    """

    module: Module
    sources: Sources
    recording: recording.Recording
    desired: float = 0.0

    def write(self, out: Path, version: str, *, replace: bool) -> None:
        """Writes the folder.

        Raises:
            InputError: it is there, and not to be replaced or not ours; or it cannot be written.
        """
        with fresh_folder(out, replace=replace) as draft:
            self.fill(draft, version)

    def fill(self, folder: Path, version: str) -> None:
        """Writes the files into an empty folder."""
        texts = files_of(self.module, self.sources, self.recording, version, self.desired)
        write_folder(folder, texts, self.recording)

    def check(self, ticks: int = TICKS, seed: int = 1) -> tuple[int, int]:
        """Compiles it here and repeats Python's ticks: how many, and how many differ in a bit.

        Raises:
            InputError: no compiler.
        """
        return unequal_ticks(
            self.module, self.sources, self.recording.inputs, self.recording.presses(ticks, seed)
        )


def exported_law(request: LawRequest, progress: Callable[[str], None] = lambda _: None) -> ExportedLaw:
    """A law in C.

    Raises:
        InputError: gains of another version, numbers that no law takes, a law outside the subset.
    """
    from palpate.force import ForceLoop, SlidingLoop, load_gains
    from palpate.identifiers import ContactIdentifier, RecursiveLeastSquares

    progress("compiling the law for Python")
    if request.gains is not None:
        gains = load_gains(request.gains)
        desired = gains.force
        if request.law == FORCE:
            module, ticks = laws.force_module(gains), recording.of_force_loop(ForceLoop(gains))
        else:
            module = laws.sliding_module(gains, request.into)
            ticks = recording.of_sliding_loop(SlidingLoop(gains, request.into))
    elif request.law == IDENTIFIER:
        identifier = ContactIdentifier(request.low_pass, request.rate, request.lag, sampling=request.sampling)
        module, ticks, desired = laws.identifier_module(identifier), recording.of_identifier(identifier), 0.0
    else:
        n = request.parameters
        if n not in (3, 4):
            raise InputError(f"C has least squares of 3 or 4 parameters, got --parameters {n}")
        estimator = RecursiveLeastSquares(np.zeros(n), _VAGUE * np.eye(n), request.forgetting)
        module, ticks, desired = laws.squares_module(estimator), recording.of_least_squares(estimator), 0.0
    progress("translating the law to C")
    return ExportedLaw(module, sources_of(module), ticks, desired)
