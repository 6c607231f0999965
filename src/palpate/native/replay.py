"""The program that repeats recorded ticks in C and counts those that differ from Python's in a bit."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from palpate.arrays import Array
from palpate.errors import InputError
from palpate.native.module import Module, Sources

FLAGS = "-std=c99 -O2 -ffp-contract=off -Wall -Wextra -Wconversion -Wpedantic -Werror"
MARK = "# Made by palpate: recorded ticks, rows of little-endian doubles behind this line.\n"
_PROGRAM = """// Made by palpate: repeats recorded ticks and counts those that differ from Python's in a bit.
#include "{name}.h"

#include <stdio.h>
#include <string.h>

enum {{ INPUTS = {inputs}, ROW = INPUTS + 3 }};

static double state_digest(const void *numbers, size_t size) {{
    uint64_t hash = 14695981039346656037u, word;
    double value;
    for (size_t i = 0; i < size / sizeof value; ++i) {{
        memcpy(&value, (const char *)numbers + i * sizeof value, sizeof value);
        memcpy(&word, &value, sizeof word);
        hash = (hash ^ (value != value ? 1u : word)) * 1099511628211u;
    }}
    memcpy(&value, &hash, sizeof value);
    return value;
}}

int main(int count, char **arguments) {{
    static {name}_state state;
    static double row[ROW];
{scratch}    const {name}_gains *gains = &{name}_default_gains;
    const double *in = row + 1;
    long ticks = 0, unequal = 0;
    int sign = 0;
    FILE *file = fopen(count > 1 ? arguments[1] : "press.bin", "rb");
    if (!file) {{
        puts("no recorded ticks: name their file");
        return 2;
    }}
    while (sign != '\\n' && sign != EOF) {{
        sign = fgetc(file);
    }}
    while (fread(row, sizeof row, 1, file) == 1) {{
        double value, digest;
        if (row[0] > 0.0) {{
            {name}_init(gains, &state);
        }}
        value = {value};
        digest = row[ROW - 1] != 0.0 ? state_digest(&state, sizeof state) : 0.0;
        if (memcmp(&value, &row[ROW - 2], sizeof value) != 0 || memcmp(&digest, &row[ROW - 1], sizeof digest) != 0) {{
            ++unequal;
        }}
        ++ticks;
    }}
    fclose(file);
    printf("ticks %ld unequal %ld\\n", ticks, unequal);
    return ticks == 0 || unequal > 0;
}}
"""


def program(module: Module, inputs: int) -> str:
    """The C of the program for a module."""
    update = module.entries[0]
    texts = []
    at = 0
    scratch = ""
    for argument in update.arguments:
        if argument.out:
            scratch += f"    static double {argument.name}[{argument.count}];\n"
            texts.append(argument.name)
        else:
            texts.append(f"&in[{at}]" if argument.shape else f"in[{at}]")
            at += max(argument.count, 1) if argument.shape else 1
    call = f"{module.name}_update(gains, &state, {', '.join(texts)})"
    digest = f"({call}, state_digest({texts[-1]}, sizeof {texts[-1]}))"
    value = digest if update.writes else f"(double){call}"
    return _PROGRAM.format(name=module.name, inputs=inputs, value=value, scratch=scratch)


def write_rows(path: Path, presses: Iterable[Array]) -> None:
    """Write recorded presses to a file that the program reads."""
    with path.open("wb") as file:
        file.write(MARK.encode())
        for rows in presses:
            file.write(np.ascontiguousarray(rows, "<f8").tobytes())


def compiler() -> list[str]:
    """The command of the machine's C compiler: `CC`, or the first that there is.

    Raises:
        InputError: there is none.
    """
    named = shlex.split(os.environ.get("CC", ""))
    for command in [named] if named else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(command[0]):
            return command
    raise InputError(
        f"no C compiler: {named[0] if named else 'cc'} is not there; install gcc or clang, or name one in CC"
    )


def unequal_ticks(module: Module, sources: Sources, inputs: int, presses: Iterable[Array]) -> tuple[int, int]:
    """Compile a module, repeat presses in it, and count the ticks and those that differ in a bit.

    Raises:
        InputError: no compiler, or one that refuses the sources.
    """
    command = compiler()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name, text in ((f"{module.name}.c", sources.source), (f"{module.name}.h", sources.header)):
            (folder / name).write_text(text, encoding="utf-8")
        (folder / "replay.c").write_text(program(module, inputs), encoding="utf-8")
        build = [*command, *shlex.split(FLAGS), f"{module.name}.c", "replay.c", "-o", "replay", "-lm"]
        built = subprocess.run(build, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
        if built.returncode != 0:
            says = built.stderr or f"exit code {built.returncode}"
            first = next((line for line in says.splitlines() if "error" in line), says[:200])
            raise InputError(f"{command[0]} refuses the C: {first}; name another compiler in CC")
        write_rows(folder / "press.bin", presses)
        run = subprocess.run([folder / "replay"], cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
    numbers = run.stdout.split()
    if run.returncode not in (0, 1) or len(numbers) != 4:
        raise InputError(
            f"the compiled law ended with code {run.returncode}: compile it with -fsanitize=address,undefined"
        )
    return int(numbers[1]), int(numbers[3])
