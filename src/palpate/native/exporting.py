"""A law as a folder of C: which law, its numbers, its files, and the check that it is Python's to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from palpate.errors import InputError, unknown
from palpate.files import fresh_folder
from palpate.force.sliding.sliding_loop import DOWN
from palpate.native import laws, recording
from palpate.native.laws import FORCE, LAWS, SLIDING, SQUARES
from palpate.native.module import Module, Sources, generate_sources
from palpate.native.replay import program, unequal_ticks, write_rows

CHECKED_TICKS = 1_000_000
"""Ticks of a check: some 250 presses."""
_VAGUE = 1e6
"""Variance of each parameter of least squares at their start."""
_CMAKE = """# Made by palpate
cmake_minimum_required(VERSION 3.16)
project({name} C)

add_library({name} STATIC {name}.c)
target_include_directories({name} PUBLIC
  $<BUILD_INTERFACE:${{CMAKE_CURRENT_SOURCE_DIR}}> $<INSTALL_INTERFACE:include>)
set_target_properties({name} PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF
  POSITION_INDEPENDENT_CODE ON)
target_compile_options({name} PRIVATE -ffp-contract=off -fno-math-errno -Wall -Wextra -Wconversion -Wpedantic)
find_library(MATH m)
if(MATH)
  target_link_libraries({name} PUBLIC m)
endif()

install(FILES {name}.h DESTINATION include)
install(TARGETS {name} EXPORT {name}Config ARCHIVE DESTINATION lib)
install(EXPORT {name}Config NAMESPACE {name}:: DESTINATION share/{name}/cmake)

include(CTest)
if(BUILD_TESTING)
  add_executable(replay test/replay.c)
  target_link_libraries(replay {name})
  add_test(NAME recorded_press COMMAND replay ${{CMAKE_CURRENT_SOURCE_DIR}}/test/press.bin)
endif()
"""
_READ = """<!-- Made by palpate -->
# {name}

It {title}. `{name}.c` was translated from palpate's laws, equal to the last bit with them; `palpate export --to c`
makes it again, and there is nothing to edit in it.

{notes}

    cmake -S . -B build && cmake --build build && ctest --test-dir build

`test/replay` repeats ticks that Python recorded, faults among them, and compares values and states by their bits.
Each operation has to be that of IEEE doubles: compile with `-ffp-contract=off`, and never with `-ffast-math`.
"""
_EXAMPLE = """// Made by palpate: an arm that follows its command at once presses on a spring.
#include "palpate_force.h"

#include <stdio.h>

int main(void) {
    const palpate_force_gains *gains = &palpate_force_default_gains;
    const double tick = gains->tick, wall = 0.002, stiffness = 0.1 * gains->cap, desired = %s;
    palpate_force_state state;
    double position = 0.0, force = 0.0;
    unsigned noise = 1;

    palpate_force_init(gains, &state);
    for (int k = 0; k < 5000; ++k) {
        noise = 1664525u * noise + 1013904223u;
        force = position > wall ? stiffness * (position - wall) : 0.0;
        force += gains->noise * ((double)(noise >> 8) / 8388608.0 - 1.0);
        position += tick * palpate_force_update(gains, &state, desired, force, position, 0.0);
        if (k %% 500 == 499) {
            printf("%%5.2f s  %%7.3f N  %%s %%s\\n", tick * (k + 1), force, palpate_force_phase(&state),
                palpate_force_trouble(&state));
        }
    }
    printf("stiffness: %%.0f N/m\\n", palpate_force_estimate(gains, &state).stiffness);
    return 0;
}
"""


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

    def write(self, out: Path, *, replace: bool) -> None:
        """Write the folder.

        Raises:
            InputError: it is there, and not to be replaced or not ours; or it cannot be written.
        """
        with fresh_folder(out, replace=replace) as draft:
            self.fill(draft)

    def fill(self, folder: Path) -> None:
        """Write the files into an empty folder."""
        for name, text in self.texts().items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
        write_rows(folder / "test" / "press.bin", self.recording.presses(recording.PRESS_TICKS // 2, 0))

    def texts(self) -> dict[str, str]:
        """The texts of the folder by their names; the recorded press is not among them."""
        name = self.module.name
        notes = "\n".join(f"    {note}" for note in self.module.notes)
        texts = {
            f"{name}.h": self.sources.header,
            f"{name}.c": self.sources.source,
            "CMakeLists.txt": _CMAKE.format(name=name),
            "README.md": _READ.format(name=name, title=self.module.title, notes=notes),
            "test/replay.c": program(self.module, self.recording.inputs),
        }
        if name == "palpate_force":
            texts["example/press.c"] = _EXAMPLE % repr(self.desired)
        return texts

    def check(self, ticks: int = CHECKED_TICKS, seed: int = 1) -> tuple[int, int]:
        """Compile it here and repeat Python's ticks: how many, and how many differ in a bit.

        Raises:
            InputError: no compiler.
        """
        return unequal_ticks(
            self.module, self.sources, self.recording.inputs, self.recording.presses(ticks, seed)
        )


def exported_law(
    law: str = FORCE,
    gains_file: Path | None = None,
    *,
    into: ArrayLike = DOWN,
    parameters: int = 3,
    forgetting: float = 1.0,
    progress: Callable[[str], None] = lambda _: None,
) -> ExportedLaw:
    """A law in C.

    Args:
        law: one of `LAWS`.
        gains_file: of `palpate tune`, for a force loop or a sliding loop.
        into: direction into the surface of a sliding loop, in the base's axes, shape (3,).
        parameters: of least squares, 3 or 4.
        forgetting: of least squares, in (0, 1].
        progress: called with what is being done.

    Raises:
        InputError: an unknown law, gains that are missing or of another version, numbers that no law takes.
    """
    if law not in LAWS:
        raise unknown("law", law, LAWS)
    if law == SQUARES and gains_file is not None:
        raise InputError(f"--law {law} takes no gains file; leave out {gains_file}")
    if law != SQUARES and gains_file is None:
        raise InputError(f"a {law} is of gains: give the file of palpate tune, or another --law")
    progress("compiling the law for Python")
    desired = 0.0
    if gains_file is None:
        module, ticks = _squares(parameters, forgetting)
    else:
        module, ticks, desired = _of_gains(law, gains_file, into)
    progress("translating the law to C")
    return ExportedLaw(module, generate_sources(module), ticks, desired)


def _of_gains(law: str, path: Path, into: ArrayLike) -> tuple[Module, recording.Recording, float]:
    """A force loop or a sliding loop, its recording, and its desired force [N]."""
    from palpate.force import ForceLoop, SlidingLoop, load_gains

    gains = load_gains(path)
    if law == SLIDING:
        loop = SlidingLoop(gains, into)
        return laws.sliding_module(gains, into), recording.record_sliding_loop(loop), gains.force
    return laws.force_module(gains), recording.record_force_loop(ForceLoop(gains)), gains.force


def _squares(parameters: int, forgetting: float) -> tuple[Module, recording.Recording]:
    from palpate.identifiers import RecursiveLeastSquares

    if parameters not in (3, 4):
        raise InputError(f"C has least squares of 3 or 4 parameters, got --parameters {parameters}")
    start = np.zeros(parameters), _VAGUE * np.eye(parameters)
    estimator = RecursiveLeastSquares(*start, forgetting)
    return laws.squares_module(estimator), recording.record_least_squares(estimator)
