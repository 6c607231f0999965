"""A Franka presses under libfranka at 1 kHz, and its surface is identified.

The arm is simulated by franky-sim's server, which speaks libfranka's protocol. For a real arm, change the
address. The lag of such a loop is some 17 ms. The measured lateness of this machine is printed at the end; the press is
stopped if it exceeds that lag.
"""

import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from palpate.cli import main

if find_spec("pylibfranka") is None or find_spec("franky_sim") is None:
    sys.exit(print("this example needs pylibfranka (palpate[franka]), and franky-sim in place of an arm"))

ADDRESS = "127.0.0.17"
# The controller holds the joints' impedance: the tip is a mass on a damped spring, 3 kg, 2 kN/m, 300 N s/m here.
Path("cell.toml").write_text(
    'title = "our FR3 under joint impedance"\nrate = 1000\n[inner]\nkind = "torque"\nmass = 3\nstiffness = 2000\n'
    "damping = 300\ndelay = 0.001\n[sensor]\nsampling = 1000\nnoise = 0.2\nfull_scale = 100\n"
    "[limits]\nspeed = 0.25\nstiffness = 1e5\n"
)


def palpate(command: str) -> int:
    """Run a command in this process, as a shell would."""
    print(f"$ palpate {command}", flush=True)
    return main(shlex.split(command))


simulated = Path(__file__).resolve().parents[1] / "tests" / "rehearsal" / "franka_arm.py"
controller = [sys.executable, str(simulated), "--address", ADDRESS, "--arm", "cell.toml"]
with subprocess.Popen([*controller, "--stiffness", "6000"], stdout=subprocess.PIPE, text=True) as arm:  # noqa: S603
    assert arm.stdout is not None
    wire = arm.stdout.readline().strip()
    limits = "--force-limit 60:N --speed-limit 50:mm/s --travel-limit 40:mm --time-limit 20:s"
    try:
        palpate("tune --arm cell.toml --stiffness 1e3:1e5 --force 20 --out gains.toml")
        words = f"press --wire {wire} --force 20:N --gains gains.toml --normal 0,0,-1 {limits} --seconds 3 --probe 0.2"
        palpate(f"{words} --dry-run")
        if palpate(f"{words} --yes --record first"):
            sys.exit(
                "the press ended before it was done, as said above: a busy machine is late; run this again"
            )
        elif Path("first/record.parquet").exists():
            palpate("identify first/record.parquet")
    finally:
        arm.kill()
