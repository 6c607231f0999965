"""An admittance controller of ros2_control: joints and wrench in, a twist out, without ROS on this machine.

The arm is a simulated one in another process, which speaks DDS as ROS 2 does; with a real one only domain and topics
are others. `ros2 topic list` names them, and nothing about signs and frames is guessed.
"""

import os
import shlex
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from palpate.cli import main

if find_spec("cyclonedds") is None:
    sys.exit(print("this example needs cyclonedds: pip install '.[ros2]' in palpate's sources"))

DOMAIN = 30 + os.getpid() % 150
# Nothing of this example leaves the machine: DDS is kept on the loopback.
os.environ["CYCLONEDDS_URI"] = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
# The controller makes the arm slow, 2 Hz; its update rate is 100 Hz.
Path("cell.toml").write_text(
    'title = "our arm under an admittance controller"\nrate = 100\n[inner]\nkind = "position"\nbandwidth = 2\n'
    "damping = 1.0\ndelay = 0.05\nstiffness = 5e4\nmass = 3.7\n[sensor]\nsampling = 100\nnoise = 0.1\n"
    "full_scale = 100\n[limits]\nspeed = 0.25\nstiffness = 1e5\n"
)


def palpate(command: str) -> int:
    """Run a command in this process, as a shell would."""
    print(f"$ palpate {command}", flush=True)
    return main(shlex.split(command))


simulated = Path(__file__).resolve().parents[1] / "tests" / "rehearsal" / "ros2_arm.py"
node = [sys.executable, str(simulated), "--domain", str(DOMAIN), "--joints", "--arm", "cell.toml"]
with subprocess.Popen(node, stdout=subprocess.PIPE, text=True) as arm:  # noqa: S603
    assert arm.stdout is not None
    arm.stdout.readline()
    wire = (
        f"'ros2:{DOMAIN}?wrench=/ft/wrench&joints=/joint_states&arm=ur5e&command=/command&as=twist"
        "&wrench-frame=tool&force-sign=reaction'"
    )
    limits = "--force-limit 40:N --speed-limit 50:mm/s --travel-limit 15:mm --time-limit 20:s"
    try:
        palpate("tune --arm cell.toml --stiffness 1e3:1e4 --force 15 --out gains.toml")
        words = f"press --wire {wire} --force 15:N --gains gains.toml --normal 0,0,-1 {limits} --seconds 6 --probe 0.2"
        palpate(f"{words} --dry-run")
        if palpate(f"{words} --yes --record first"):
            sys.exit(
                "the press ended before it was done, as said above: a busy machine is late; run this again"
            )
        palpate("identify first/record.parquet --robot-stiffness 50000:2000")
    finally:
        arm.kill()
