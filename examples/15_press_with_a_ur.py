"""A UR cell, from its log to gains to a press: dry run, cautious press, identification, better gains, second press.

The arm is simulated and speaks the protocol of a UR controller, so that ur-rtde itself moves it. For a real arm, change
the address and omit `--yes`, so that the command asks for confirmation. Each line is a command that can be typed.
"""

import contextlib
import io
import shlex
import subprocess
import sys
from pathlib import Path

from palpate.cli import main

ADDRESS = "127.0.0.15"
LIMITS = "--force-limit 40:N --speed-limit 50:mm/s --travel-limit 15:mm --time-limit 20:s"

# A UR whose RTDE runs at 125 Hz: the file of the shipped arm with its own numbers.
Path("cell.toml").write_text(
    'title = "our UR, 125 Hz"\nrate = 125\n[inner]\nkind = "position"\nbandwidth = 10\ndamping = 0.9\ndelay = 0.016\n'
    'stiffness = 5e4\nmass = 3.7\n[sensor]\nlow_pass = "butterworth3:120"\nsampling = 125\nnoise = 0.1\n'
    "full_scale = 100\n[limits]\nspeed = 0.25\nstiffness = 1e6\n"
)


def palpate(command: str, into: str | None = None) -> int:
    """Run a command in this process, as a shell would."""
    print(f"$ palpate {command}" + (f" > {into}" if into else ""), flush=True)
    if into is None:
        return main(shlex.split(command))
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        code = main(shlex.split(command))
    Path(into).write_text(printed.getvalue())
    return code


simulated = Path(__file__).resolve().parents[1] / "tests" / "rehearsal" / "rtde_arm.py"
controller = [sys.executable, str(simulated), "--address", ADDRESS, "--arm", "cell.toml"]
with subprocess.Popen([*controller, "--stiffness", "6000"], stdout=subprocess.PIPE, text=True) as arm:  # noqa: S603
    assert arm.stdout is not None
    wire = arm.stdout.readline().strip()
    try:
        # Gains for any surface, proved before anything is known of it; what is said of the cell is kept in a file.
        palpate(
            "tune --arm cell.toml --stiffness 1e3:1e5 --force 20 --out cautious.toml --json", "cautious.json"
        )
        keep = f"--gains cautious.toml --normal 0,0,-1 {LIMITS} --save-options ur.toml"
        palpate(f"press --wire {wire} --force 20:N {keep} --dry-run")
        moved = f"press --wire {wire} --force 20:N --options ur.toml --yes --seconds 3 --probe 0.2"
        if palpate(f"{moved} --record first"):
            # A machine that is busy is late, and then the arm is stopped: that is as it should be.
            sys.exit(
                "the press ended before it was done, as said above; run this again when the machine is quieter"
            )
        # What it touched, and gains for that. The tip of the simulated arm has no mass: for a real one add what is its
        # cell.toml's, as --robot-mass 3.7:0.4.
        known = "--robot-stiffness 50000:2000"
        palpate(f"identify first/record.parquet {known}")
        palpate(f"identify first/record.parquet {known} --json", "found.json")
        if palpate("tune found.json --arm cell.toml --force 20 --out gains.toml --json", "tuned.json") == 0:
            palpate(f"{moved} --gains gains.toml --record second")
    finally:
        arm.kill()
