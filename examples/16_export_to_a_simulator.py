"""From a log to a MuJoCo scene with the identified foam: identify, export, press it there.

Each line is a command that can be typed. The damping is not identifiable from this log alone; with the calibrated lag
of its force (7.6 ms) it is.
"""

import contextlib
import io
import json
import shlex
import sys
from pathlib import Path

from palpate.cli import main

LOG = Path(__file__).resolve().parent / "data" / "press.csv"

Path("scene.xml").write_text(
    '<mujoco model="press"><option timestep="0.001" cone="elliptic"/><worldbody>'
    '<geom name="foam" type="box" size="0.2 0.2 0.05"/>'
    '<body name="tool" pos="0 0 0.3"><joint type="slide" axis="0 0 1"/>'
    '<geom name="tip" type="sphere" size="0.02" mass="2"/></body></worldbody></mujoco>'
)


def palpate(command: str, into: str | None = None) -> None:
    """Run a command in this process, as a shell would."""
    print(f"$ palpate {command}" + (f" > {into}" if into else ""), flush=True)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed if into else sys.stdout):
        if main(shlex.split(command)):
            raise SystemExit(1)
    if into:
        Path(into).write_text(printed.getvalue())


columns = "--time time_s --position position_mm:mm --force force_N:N"
palpate(f"identify {LOG} {columns} --lag 0.0076:0.0002 --json", into="found.json")
palpate("export found.json --to mujoco --model scene.xml --geom foam --check")
told = json.loads(Path("scene-foam.xml.json").read_text())
K, B = (told["parameters"][name]["value"] for name in "KB")
error = told["check"][0]["error_K"]
print(f"the foam of scene-foam.xml: K = {K:.0f} N/m, B = {B:.0f} N s/m, pressed to within {error:.1e}")
