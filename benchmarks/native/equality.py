"""Laws in C beside Python's by compilers, optimisations and processors: ticks that differ in a bit; size and time.

Every compiler that is there is asked: gcc and clang on this machine, and Debian's cross compilers with QEMU's emulators
for aarch64 and for a Cortex-M7. Python's ticks are recorded once for each law, with every fault; each build repeats
them. What was measured is kept in `--out` beside a hash of its C, and is not measured again while that stays.

    python benchmarks/native/equality.py                  # 1e7 ticks by gcc and clang (slides 1e6), aarch64 1e6, M7 1e5
    python benchmarks/native/equality.py --ticks 1e6 --emulated 1e5 --m7 1e4
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from msgspec.structs import replace

from palpate.files import write_json
from palpate.force import load_arm
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.native.exporting import ExportedLaw, exported_law
from palpate.native.replay import MARK, program, write_rows

LAWS = {"force loop": "force", "sliding loop": "slide", "least squares of 3": "squares"}
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
static double row[ROW]; static double *rows;
static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}
int main(int count, char **words) {
    FILE *file = fopen(words[count - 1], "rb"); int sign = 0; long n = 0, most = 400000;
    double sum = 0, total = 0, begun;
    NAME_state state; const NAME_gains *gains = &NAME_default_gains;
    if (!file) return 2;
    while (sign != '\\n') sign = fgetc(file);
    rows = malloc(sizeof row * (size_t)most);
    while (n < most && fread(rows + ROW * n, sizeof row, 1, file) == 1) n++;
    for (long block = 0; block < n; block += 4000) { /* a press at a time, the least of ten repeats */
        double least = 0;
        for (int repeat = 0; repeat < 10; ++repeat) {
            begun = now();
            for (long k = block; k < n && k < block + 4000; ++k) {
                const double *in = rows + ROW * k + 1;
                if (in[-1] > 0) NAME_init(gains, &state);
                sum += CALL;
            }
            begun = now() - begun;
            least = repeat && least < begun ? least : begun;
        }
        total += least;
    }
    printf("%.0f %g\\n", total / (double)n, sum);
    return 0;
}
"""


class Bench:
    """Measurements that are kept from one run to the next.

    Args:
        out: folder of what was measured.
        folder: for sources, recordings and programs.
    """

    def __init__(self, out: Path, folder: Path):
        self.file, self.folder = out / "equality.json", folder
        out.mkdir(parents=True, exist_ok=True)
        self.known = json.loads(self.file.read_text()) if self.file.exists() else {}
        self.recorded: dict[str, int] = {}

    def measured(self, law: ExportedLaw, title: str, ticks: int, ask) -> list[float] | None:
        """What `ask` gives, or gave before for the same C."""
        text = law.sources.header + law.sources.source + program(law.module, law.recording.inputs)
        text = re.sub(r"\S*palpate\S*\.py:\d+", "", text)
        key = f"{hashlib.sha256(text.encode()).hexdigest()[:16]} {law.module.name}: {title}, {ticks}"
        if key not in self.known:
            value = ask()
            now = (
                json.loads(self.file.read_text()) if self.file.exists() else {}
            )  # another run may have written
            self.known = {"written_by": "palpate", **self.known, **now, key: value}
            write_json(self.file, self.known)
        print(f"{law.module.name}: {title}: {self.known[key]}", file=sys.stderr, flush=True)
        return self.known[key]

    def rows(self, law: ExportedLaw, ticks: int, seed: int) -> Path:
        """The file of that many recorded ticks: the first of the longest recording."""
        path, count = self.folder / f"{law.module.name}.rows", self.recorded.get(law.module.name, 0)
        if count < ticks:
            write_rows(path, law.recording.presses(ticks, seed))
            self.recorded[law.module.name] = count = ticks
        if count == ticks:
            return path
        short = self.folder / "few.rows"
        with path.open("rb") as source:
            short.write_bytes(source.read(len(MARK) + 8 * (law.recording.inputs + 3) * ticks))
        return short

    def unequal(self, build: list[str], run: list[str], law: ExportedLaw, ticks: int, seed: int):
        """Ticks, and those that differ in a bit; none where the compiler refuses."""
        rows = self.rows(law, ticks, seed)
        command([*build, f"{law.module.name}.c", "replay.c", "-lm", "-o", "replay"], self.folder)
        words = command([word.replace("ROWS", rows.name) for word in run], self.folder, codes=(0, 1)).split()
        return [int(words[1]), int(words[3])]


def command(words: list[str], folder: Path, codes: tuple[int, ...] = (0,)) -> str:
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode not in codes:
        raise SystemExit(f"{' '.join(words)}: {done.stderr[-500:]}")
    return done.stdout


def exported(name: str, folder: Path) -> ExportedLaw:
    if name == "force":
        path = folder / "gains.toml"
        path.write_text(gains_for(load_arm("ur5e"), 20.0, limit=60.0).to_toml(), encoding="utf-8")
        return exported_law(gains_file=path)
    if name == "slide":
        path, gains = folder / "slide.toml", gains_for(load_arm("ur5e"), 15.0, cap=4e4)
        path.write_text(replace(gains, slide=Slide(speed=0.03, mu_max=0.9)).to_toml(), encoding="utf-8")
        return exported_law("sliding-loop", path)
    return exported_law("recursive-least-squares", forgetting=0.99)


def builds(given: argparse.Namespace) -> Iterator[tuple[str, str, list[str], list[str], int]]:
    """Title, level, build, run and ticks of each that the machine has the programs for."""
    targets = (
        ("gcc", [], [], given.ticks),
        ("clang", [], [], given.ticks),
        ("aarch64-linux-gnu-gcc", ["-static"], ["qemu-aarch64-static"], given.emulated),
    )
    for compiler, more, runner, ticks in targets:
        if all(map(shutil.which, (compiler, *runner))):
            for level in LEVELS:
                build = [compiler, *PLAIN.split(), level, *more]
                yield compiler, level, build, [*runner, "./replay", "ROWS"], int(ticks)
    if shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm"):
        build = ["arm-none-eabi-gcc", *M7.split(), *PLAIN.split(), "-O2", "startup.c", "-T", "sections.ld"]
        run = "qemu-system-arm -M mps2-an500 -display none -monitor none -serial null -kernel replay"
        run += " -semihosting-config enable=on,target=native,arg=replay,arg=ROWS"
        yield (
            "arm-none-eabi-gcc, Cortex-M7",
            "-O2",
            [*build, "-specs=rdimon.specs"],
            run.split(),
            int(given.m7),
        )


def write_sources(law: ExportedLaw, folder: Path) -> None:
    own = law.module.name
    for file, text in (
        (f"{own}.c", law.sources.source), (f"{own}.h", law.sources.header), ("timer.c", timer(law)),
        ("replay.c", program(law.module, law.recording.inputs)), ("startup.c", STARTUP), ("sections.ld", SECTIONS),
    ):  # fmt: skip
        (folder / file).write_text(text, encoding="utf-8")


def of_law(bench: Bench, name: str, given: argparse.Namespace) -> dict[str, str]:
    """The cells of a law's column, by the first word of their row."""
    law, folder = exported(name, bench.folder), bench.folder
    write_sources(law, folder)
    cells: dict[str, list[str]] = {}
    most = int(given.slides if name == "slide" else given.ticks)
    for title, level, build, run, asked in builds(given):
        ticks = min(asked, most)
        counts = bench.measured(
            law, f"{title} {level}", ticks,
            lambda b=build, r=run, t=ticks: bench.unequal(b, r, law, t, given.seed),
        )  # fmt: skip
        cells.setdefault(title, []).append(f"{counts[1]} of {counts[0]:.0e}".replace("e+0", "e"))
    rows = {title: one[0] + (" each" if len(one) > 1 else "") if len(set(one)) == 1 else ", ".join(one)
            for title, one in cells.items()}  # fmt: skip
    rows["state"] = f"{8 * law.sources.numbers} bytes"
    for compiler in ("gcc", "clang"):
        if shutil.which(compiler):
            took = bench.measured(
                law, f"a tick by {compiler} -O2", 400_000, lambda c=compiler: tick_time(bench, law, c)
            )
            rows[f"a tick by {compiler} -O2, the least of ten repeats"] = f"{took[0]:.0f} ns"
    sizes = []
    for compiler, more in (
        ("gcc", ""),
        ("clang", ""),
        ("aarch64-linux-gnu-gcc", ""),
        ("arm-none-eabi-gcc", M7),
    ):
        if shutil.which(compiler):
            size = bench.measured(
                law, f"code by {compiler} -O2", 0, lambda c=compiler, m=more: code(bench, law, c, m)
            )
            sizes.append(f"{1e-3 * size[0]:.1f}")
    rows["code by gcc, clang, gcc for aarch64, for Cortex-M7, -O2 [kB]"] = ", ".join(sizes)
    return rows


FLAGS = ["-O2", "-std=gnu99", "-ffp-contract=off", "-fno-math-errno", "-I."]


def tick_time(bench: Bench, law: ExportedLaw, compiler: str) -> list[float]:
    """Time of a tick [ns]: of each press the least of ten repeats."""
    rows = bench.rows(law, 400_000, 1).name
    command([compiler, *FLAGS, f"{law.module.name}.c", "timer.c", "-lm", "-o", "timer"], bench.folder)
    return [float(command(["./timer", rows], bench.folder).split()[0])]


def code(bench: Bench, law: ExportedLaw, compiler: str, more: str) -> list[int]:
    """Bytes of the code, constants included."""
    words = [compiler, *more.split(), *FLAGS, "-fno-asynchronous-unwind-tables", "-c", f"{law.module.name}.c"]
    command([*words, "-o", "own.o"], bench.folder)
    return [int(command(["size", "own.o"], bench.folder).split()[6])]


def timer(law: ExportedLaw) -> str:
    """The program that measures a tick."""
    text = program(law.module, law.recording.inputs)
    lines = text.splitlines()
    out = "".join(
        f"{line}\n" for line in lines if line.startswith("    static double ") and "row" not in line
    )
    call = text.split("value = ")[1].split(";")[0]
    if law.module.entries[0].writes:
        call = re.sub(r"digest_of\((\w+),.*", r"\1[0])", call)
    filled = TIMER.replace("NAME", law.module.name).replace("CALL", call)
    size = f"enum {{ ROW = {law.recording.inputs + 3} }};\nstatic double row[ROW];\n{out}"
    return filled.replace("static double row[ROW];", size)


def table(columns: dict[str, dict[str, str]], given: argparse.Namespace) -> str:
    """The table of all laws, in Markdown."""
    rows = dict.fromkeys(row for cells in columns.values() for row in cells)
    levels = ", ".join(LEVELS)
    lines = [f"| ticks that differ in a bit, of | {' | '.join(columns)} |", "|---|" + "---|" * len(columns)]
    for row in rows:
        title = f"{row} {levels}" if row in {"gcc", "clang", "aarch64-linux-gnu-gcc"} else row
        title += " -O2" if "M7" in row and "gcc," in row and "code" not in row else ""
        emulated = ", emulated" if "aarch64-linux" in title or title.startswith("arm-none") else ""
        lines.append(
            f"| {title}{emulated} | {' | '.join(cells.get(row, '') for cells in columns.values())} |"
        )
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ticks", type=float, default=1e7)
    parser.add_argument(
        "--slides",
        type=float,
        default=1e6,
        help="of the sliding loop at most, which Python records most slowly",
    )
    parser.add_argument("--emulated", type=float, default=1e6)
    parser.add_argument("--m7", type=float, default=1e5)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--laws", nargs="+", default=list(LAWS.values()))
    parser.add_argument("--out", type=Path, default=Path("runs/native"))
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=given.out if given.out.is_dir() else None) as place:
        bench = Bench(given.out, Path(place))
        columns = {title: of_law(bench, name, given) for title, name in LAWS.items() if name in given.laws}
    print(table(columns, given))
    bad = [
        cell
        for cells in columns.values()
        for cell in cells.values()
        if " of " in cell and not cell.startswith("0 ")
    ]
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
