"""The force loop as C: tune, export, compile it with what is here, and press on a spring without Python."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from palpate.force import gains_for, load_arm
from palpate.native import exported_law

compiler = next((name for name in ("cc", "gcc", "clang") if shutil.which(name)), None)
if compiler is None:
    print("no C compiler is here: install gcc or clang to run the law in C")
    sys.exit()

with tempfile.TemporaryDirectory() as place:
    gains = Path(place) / "gains.toml"
    gains.write_text(gains_for(load_arm("ur5e"), 20.0).to_toml(), encoding="utf-8")
    folder = Path(place) / "force_loop"
    exported_law(gains_file=gains).write(folder, replace=False)
    build = [
        compiler,
        "-O2",
        "-ffp-contract=off",
        "-I.",
        "example/press.c",
        "palpate_force.c",
        "-lm",
        "-o",
        "press",
    ]
    subprocess.run(build, cwd=folder, check=True)  # noqa: S603 - the compiler
    subprocess.run([folder / "press"], check=True)  # noqa: S603 - what it made
