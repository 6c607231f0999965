"""Press with a robot that palpate does not know: a class of your own, `our_robot.py` beside this file, is its wire."""

import os
import shlex
import sys
from pathlib import Path

from palpate.cli import main

if os.name != "posix":
    sys.exit(print("a class of your own runs in a process beside palpate, which needs Linux or macOS"))

Path("cell.toml").write_text(
    'title = "our robot"\nrate = 100\n[inner]\nkind = "position"\nbandwidth = 2\ndamping = 1.0\ndelay = 0.05\n'
    "stiffness = 5e4\nmass = 3.7\n[sensor]\nsampling = 100\nnoise = 0.1\nfull_scale = 100\n[limits]\nspeed = 0.25\n"
    "stiffness = 1e5\n"
)


def palpate(command: str) -> int:
    """Run a command in this process, as a shell would."""
    print(f"$ palpate {command}", flush=True)
    return main(shlex.split(command))


if palpate("checks 'our_robot:OurWire?cell.toml'"):
    sys.exit("the wire does not do what every wire does, as said above")
palpate("tune --arm cell.toml --stiffness 1e3:1e4 --force 10 --out gains.toml")
limits = "--force-limit 40:N --speed-limit 50:mm/s --travel-limit 15:mm --time-limit 20:s"
words = f"--force 10:N --gains gains.toml --normal 0,0,-1 {limits} --seconds 3 --probe 0.2"
if palpate(f"press --wire 'our_robot:OurWire?cell.toml' {words} --yes --record first"):
    sys.exit("the press ended before it was done, as said above: a busy machine is late; run this again")
palpate("identify first/record.parquet --robot-stiffness 50000:2000")
