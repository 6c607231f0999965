"""Laws in C beside Python's by compilers, optimisations and processors: ticks that differ in a bit; size and time.

Every compiler that is there is asked: gcc and clang on this machine, and Debian's cross compilers with QEMU's emulators
for aarch64 and for a Cortex-M7. Python's ticks are recorded once for each law, with every fault; each build repeats
them.

    python benchmarks/native/equality.py --ticks 1e7 --m7 1e5
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from palpate.force import load_arm
from palpate.force.gains import gains_for
from palpate.native.exporting import ExportedLaw, LawRequest, exported_law
from palpate.native.replay import program, write_rows

PLAIN = "-std=c99 -ffp-contract=off -Wall -Wextra -Wconversion -Wpedantic -Werror -I."
LEVELS = ("-O0", "-O1", "-O2", "-O3")
M7 = "-mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-d16"
STARTUP = """
void _start(void);
void reset(void);
void reset(void) {
    *(volatile unsigned *)0xE000ED88u |= 0xFu << 20; /* the floating-point unit */
    __asm volatile("dsb\\n isb");
    _start();
}
"""
SECTIONS = """
MEMORY { code (rx) : ORIGIN = 0x00000000, LENGTH = 4M  data (rwx) : ORIGIN = 0x20000000, LENGTH = 4M }
SECTIONS {
  .text : { LONG(stack_top) LONG(reset + 1) *(.text*) KEEP(*(.init)) KEEP(*(.fini)) *(.rodata*) } > code
  .ARM.exidx : { *(.ARM.exidx*) } > code
  .data : { *(.data*) . = ALIGN(8); } > data
  .preinit_array : { *(.preinit_array*) } > data
  .init_array : { *(.init_array*) } > data
  .fini_array : { *(.fini_array*) } > data
  .bss : { __bss_start__ = .; *(.bss*) *(COMMON) . = ALIGN(8); __bss_end__ = .; } > data
  end = .; __end__ = .; stack_top = ORIGIN(data) + LENGTH(data);
}
"""
TIMER = """
#include "NAME.h"
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
static double row[ROW]; static double *rows; static float *took;
static int order(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}
static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}
int main(int count, char **words) {
    FILE *file = fopen(words[count - 1], "rb"); int sign = 0; long n = 0, most = 400000; double sum = 0, begun;
    NAME_state state; const NAME_gains *gains = &NAME_default_gains;
    if (!file) return 2;
    while (sign != '\\n') sign = fgetc(file);
    rows = malloc(sizeof row * (size_t)most); took = malloc(sizeof *took * (size_t)most);
    while (n < most && fread(rows + ROW * n, sizeof row, 1, file) == 1) n++;
    begun = now();
    for (long k = 0; k < n; ++k) {
        const double *in = rows + ROW * k + 1;
        if (in[-1] > 0) NAME_init(gains, &state);
        sum += CALL;
    }
    printf("%.0f ", (now() - begun) / (double)n);
    for (long k = 0; k < n; ++k) {
        const double *in = rows + ROW * k + 1; double a = now();
        if (in[-1] > 0) NAME_init(gains, &state);
        sum += CALL;
        took[k] = (float)(now() - a);
    }
    qsort(took, (size_t)n, sizeof *took, order);
    printf("%.2f %g\\n", 1e-3 * (double)took[(long)(0.9999 * (double)n)], sum);
    return 0;
}
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ticks", type=float, default=1e6)
    parser.add_argument("--m7", type=float, default=1e4)
    parser.add_argument("--laws", nargs="+", default=["force", "squares", "identifier"])
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    worst = 0
    with tempfile.TemporaryDirectory() as place:
        for name in given.laws:
            worst += asked(Path(place), name, int(given.ticks), int(given.m7), given.seed)
    return int(worst > 0)


def exported(name: str, folder: Path) -> ExportedLaw:
    if name == "force":
        path = folder / "gains.toml"
        path.write_text(gains_for(load_arm("ur5e"), 20.0).to_toml(), encoding="utf-8")
        return exported_law(LawRequest(gains=path))
    if name == "squares":
        return exported_law(LawRequest("recursive-least-squares", forgetting=0.99))
    return exported_law(LawRequest("contact-identifier", sampling=480.0))


def asked(folder: Path, name: str, ticks: int, few: int, seed: int) -> int:
    law = exported(name, folder)
    own, recording = law.module.name, law.recording
    for file, text in (
        (f"{own}.c", law.sources.source), (f"{own}.h", law.sources.header),
        ("replay.c", program(law.module, recording.inputs)), ("startup.c", STARTUP), ("sections.ld", SECTIONS),
    ):  # fmt: skip
        (folder / file).write_text(text, encoding="utf-8")
    write_rows(folder / "rows", recording.presses(ticks, seed))
    write_rows(folder / "few", recording.presses(few, seed))
    print(
        f"\n| {own}, state {8 * law.sources.numbers} bytes | ticks | differ in a bit |\n|---|---|---|",
        flush=True,
    )
    unequal = 0
    builds = [
        ([compiler], runner, level)
        for compiler, runner in (
            ("gcc", []),
            ("clang", []),
            ("aarch64-linux-gnu-gcc", ["qemu-aarch64-static"]),
        )
        for level in LEVELS
        if shutil.which(compiler) and (not runner or shutil.which(runner[0]))
    ]
    for command, runner, level in builds:
        words = [*command, *PLAIN.split(), level, f"{own}.c", "replay.c", "-lm", "-o", "replay"]
        words += ["-static"] if runner else []
        unequal += counted(folder, [*command, level], words, [*runner, "./replay", "rows"])
    if name != "identifier" and shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm"):
        words = ["arm-none-eabi-gcc", *M7.split(), *PLAIN.split(), "-O2", f"{own}.c", "replay.c"]
        words += ["startup.c", "-T", "sections.ld", "-specs=rdimon.specs", "-lm", "-o", "replay"]
        run = [
            "qemu-system-arm",
            "-M",
            "mps2-an500",
            "-display",
            "none",
            "-monitor",
            "none",
            "-serial",
            "null",
        ]
        run += ["-semihosting-config", "enable=on,target=native,arg=replay,arg=few", "-kernel", "replay"]
        unequal += counted(folder, ["Cortex-M7 (emulated), arm-none-eabi-gcc -O2"], words, run)
    measured(folder, law)
    return unequal


def counted(folder: Path, title: list[str], build: list[str], run: list[str]) -> int:
    built = subprocess.run(build, cwd=folder, check=False, capture_output=True, text=True)  # noqa: S603
    if built.returncode:
        print(f"| {' '.join(title)} | not built: {built.stderr.strip().splitlines()[-1]} | |", flush=True)
        return 1
    done = subprocess.run(run, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
    words = done.stdout.split()
    good = len(words) == 4
    print(
        f"| {' '.join(title)} | {words[1] if good else '-'} | {words[3] if good else done.stderr[-200:]} |",
        flush=True,
    )
    return int(words[3]) if good else 1


def measured(folder: Path, law: ExportedLaw) -> None:
    """Prints sizes of the code, and the time of a tick."""
    own = law.module.name
    text = program(law.module, law.recording.inputs)
    call = text.split("value = (double)")[1].split(";")[0]
    out = "".join(
        line + "\n"
        for line in text.splitlines()
        if line.startswith("    static double ") and "row" not in line
    )
    timer = (
        TIMER.replace("NAME", own)
        .replace("CALL", f"(double){call}")
        .replace("int order", out + "int order", 0)
    )
    timer = timer.replace(
        "static double row[ROW];",
        f"enum {{ ROW = {law.recording.inputs + 3} }};\nstatic double row[ROW];\n{out}",
    )
    (folder / "timer.c").write_text(timer, encoding="utf-8")
    flags = ["-O2", "-ffp-contract=off", "-fno-math-errno", "-I."]
    gcc = os.environ.get("CC", "gcc")
    subprocess.run([gcc, *flags, f"{own}.c", "timer.c", "-lm", "-o", "timer"], cwd=folder, check=True)  # noqa: S603
    nanoseconds, tail, *_ = subprocess.run(  # noqa: S603
        [folder / "timer", "rows"], cwd=folder, capture_output=True, text=True, check=True
    ).stdout.split()
    print(
        f"\na tick by {gcc} -O2: {nanoseconds} ns of the processor; 99.99 % within {tail} us, the clock's call included"
    )
    targets = ((gcc, []), ("aarch64-linux-gnu-gcc", []), ("arm-none-eabi-gcc", M7.split()))
    for compiler, more in targets:
        if shutil.which(compiler):
            for level in ("-O2", "-Os"):
                words = [
                    compiler,
                    *more,
                    *flags,
                    level,
                    "-fno-asynchronous-unwind-tables",
                    "-c",
                    f"{own}.c",
                    "-o",
                    "own.o",
                ]
                subprocess.run(words, cwd=folder, check=True)  # noqa: S603
                ask = ["size", "own.o"]
                sizes = subprocess.run(  # noqa: S603
                    ask, cwd=folder, capture_output=True, text=True, check=True
                )
                print(f"text by {compiler} {level}: {sizes.stdout.split()[6]} bytes", flush=True)


if __name__ == "__main__":
    sys.exit(main())
