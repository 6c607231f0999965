"""What each wire costs: a press with a simulated arm that speaks the maker's protocol in another process, at real time.

For each wire a press of some seconds at 125 Hz (libfranka: 1 kHz), its lateness, its force, and the K that
`palpate identify` finds in its record.
"""

import argparse
import contextlib
import io
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from palpate.cli import main as palpate
from palpate.force import load_arm
from palpate.press.engines import gains_for

REHEARSAL = Path(__file__).resolve().parents[2] / "tests" / "rehearsal"
STIFFNESS, SERIES, FORCE = 6000.0, 5e4, 20.0
HEAD = (
    "| wire | readings [Hz] | late by 50 % [ms] | 99 % | 99.9 % | most | missed of | force [N] | K found, 6000 N/m |"
    " ended |"
)
ARM = (
    'title = "a cell"\nrate = {rate}\n[inner]\n{inner}[sensor]\nsampling = {rate}\nnoise = 0.1\nfull_scale = 100\n'
    "[limits]\nspeed = 0.25\nstiffness = 1e5\n"
)
INNER = {
    "position": 'kind = "position"\nbandwidth = 1.5\ndamping = 1.0\ndelay = {delay}\nstiffness = 5e4\n',
    "servo": 'kind = "servo"\nmass = 10\nstiffness = 5e3\ndamping = 1e3\ndelay = 0.1\n',
}
ROS2 = "?wrench=/ft/wrench&{place}&command=/command&as=twist&wrench-frame=tool&force-sign=reaction"
ALONE = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
WIRES = {
    "sim": ("sim_arm", [], "{line}", 125),
    "rtde, speedL": ("rtde_arm", ["--address", "127.0.0.51"], "{line}", 125),
    "rtde, servoL": ("rtde_arm", ["--address", "127.0.0.52"], "{line}?as=servo", 125),
    "ros2, pose": ("ros2_arm", ["--domain", "61"], "{line}" + ROS2.format(place="pose=/tcp/pose"), 125),
    "ros2, joints": (
        "ros2_arm", ["--domain", "62", "--joints"], "{line}" + ROS2.format(place="joints=/joint_states&arm=ur5e"), 125,
    ),
    "franka": ("franka_arm", ["--address", "127.0.0.53"], "{line}", 1000),
}  # fmt: skip


def said(*words: str) -> tuple[int, dict]:
    """Exit code and JSON of a command."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        code = palpate([*words, "--json"])
    return code, json.loads(out.getvalue() or "{}")


def row(name: str, seconds: float, folder: Path, kind: str) -> str:
    module, where, address, rate = WIRES[name]
    own = folder / re.sub(r"\W+", "-", name)
    own.mkdir()
    # libfranka's loop has ten times the ticks in the same lag.
    inner = INNER[kind].format(delay=0.1 if rate == 1000 else 0.05)
    (own / "arm.toml").write_text(ARM.format(rate=rate, inner=inner))
    (own / "gains.toml").write_text(gains_for(load_arm(str(own / "arm.toml")), FORCE).to_toml())
    words = [sys.executable, str(REHEARSAL / f"{module}.py"), "--arm", str(own / "arm.toml"), *where]
    with subprocess.Popen([*words, "--stiffness", str(STIFFNESS)], stdout=subprocess.PIPE, text=True) as arm:  # noqa: S603
        assert arm.stdout is not None
        at = address.format(line=arm.stdout.readline().strip())
        try:
            _, told = said(
                "press", "--wire", at, "--gains", str(own / "gains.toml"), "--force", f"{FORCE:g}:N",
                "--normal", "0,0,-1",
                "--force-limit", "60:N", "--speed-limit", "50:mm/s", "--travel-limit", "30:mm", "--time-limit", "60:s",
                "--seconds", str(seconds), "--probe", "0.2", "--yes", "--record", str(own / "record"),
            )  # fmt: skip
        finally:
            arm.kill()
    late = told["lateness"]
    ms = [f"{1e3 * late[key]:.2f}" for key in ("p50_s", "p99_s", "p99.9_s", "most_s")]
    series = ["--robot-stiffness", f"{SERIES:g}:1000"] if kind == "position" else []
    _, found = said("identify", str(own / "record" / "record.parquet"), *series)
    K = found["parameters"]["K"]
    shown = f"{K['value']:.0f} ± {0.5 * (K['ci95'][1] - K['ci95'][0]):.0f}" if K["value"] else K["verdict"]
    force = "-" if told["force_N"] is None else f"{told['force_N']:.2f}"
    ticks = f"{late['missed']} of {late['ticks']}"
    return f"| {name} | {told['rate_Hz']:.0f} | {' | '.join(ms)} | {ticks} | {force} | {shown} | {told['ended']} |"


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--seconds", type=float, default=6.0)
    asked.add_argument("--wires", nargs="+", default=list(WIRES), choices=WIRES)
    asked.add_argument("--kind", default="position", choices=INNER, help="of arm")
    words = asked.parse_args()
    os.environ.setdefault("CYCLONEDDS_URI", ALONE)
    print(HEAD, "|" + "---|" * HEAD.count(" | ") + "---|", sep="\n")
    with tempfile.TemporaryDirectory() as folder:
        for name in words.wires:
            print(row(name, words.seconds, Path(folder), words.kind), flush=True)


if __name__ == "__main__":
    main()
