"""A tool that is kept perpendicular to the surface it slides on, beside one that stands, on arms with joints.

    python benchmarks/force/sliding_turn.py [--seconds 8]

15 N at 30 mm/s on 20 kN/m, friction 0.3, a payload of 12 N, palpate's own physics, after three touches: the UR5e around
a circle of 40 mm in a bowl of 150 mm, the FR3 on a raster of 40 mm over a sphere of 150 mm. The angle is that of the
tool to the true normal, and the force error that of the true normal force, each from 0.5 s after the slide began.
"""

from __future__ import annotations

import argparse

from msgspec.structs import replace

from palpate._vector import Vec3
from palpate.force.gains import gains_for
from palpate.force.slide_table import Slide
from palpate.force.sliding.paths import directions
from palpate.slide.ground import ground_of
from palpate.slide.jointed_arm import HeldTip, jointed_arm
from palpate.slide.report import summarise

SPEED, RADIUS, EXTENT = 0.03, 0.15, 0.04
BEHIND, WEIGHT = 0.02, 12.0
"""The centre of the tip behind the tool's point [m], and the payload's weight [N]."""
CASES = (("ur5e", "circle", "bowl"), ("fr3", "raster", "sphere"))
TITLES = {"ur5e": "UR5e", "fr3": "FR3"}


def row(name: str, path: str, shape: str, seconds: float, tool: HeldTip | None) -> str:
    """A slide of an arm, with a tool that turns or with none."""
    arm = jointed_arm(name)
    slide = Slide(speed=SPEED, mu_max=0.9, radius=RADIUS, touches=0.01)
    gains = replace(gains_for(arm.inner, 15.0, cap=4e4), slide=slide)
    ground = ground_of(shape, RADIUS, 2e4, friction=0.3)
    ways = directions(path, seconds, gains.arm.rate, SPEED, EXTENT)
    found = summarise(arm.slide(gains, ground, ways, physics="own", tool=tool), gains, ground, turned=True)
    angle, error = found["tool"], 100.0 * found["force"]["rms_share"]
    cells = [
        f"{TITLES[name]}, {path}, {shape}", "stands" if tool is None else "turns",
        f"{angle['median_angle_deg']:.2g} deg", f"{angle['angle95_deg']:.2g} deg", f"{error:.2f} %",
    ]  # fmt: skip
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=8.0, help="of each slide")
    asked = parser.parse_args()
    print("| slide | tool | angle, median | 95 % below | force, rms |\n| --- | --- | --- | --- | --- |")
    for case in CASES:
        for tool in (None, HeldTip(BEHIND, Vec3(0.0, 0.0, WEIGHT))):
            print(row(*case, asked.seconds, tool), flush=True)


if __name__ == "__main__":
    main()
