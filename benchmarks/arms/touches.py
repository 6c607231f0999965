"""How far the first force goes over at a touch by arms of positions, whose tip swings on the arm's own stiffness.

`--swing 0` tries another share of a swing for which nothing is learned.
"""

import argparse

import numpy as np

from palpate.bench.summary import CONTACT
from palpate.force import gains
from palpate.press.prepare import PressSpec, prepare_press, surface_of
from palpate.robots.serial.from_toml import names

STIFFNESSES, DAMPING, FORCE, SECONDS = (5e3, 2e4, 6e4, 1e5, 2e5, 5e5), 50.0, 20.0, 1.0


def overshoot(arm: str, stiffness: float, seed: int) -> float:
    """Of the true force over what was asked for [N]."""
    surface = surface_of(f"K={stiffness},B={DAMPING}")
    question = PressSpec(
        arm=arm, force=FORCE, surface=surface, mode="position", seconds=SECONDS, probe=0.0, seed=seed
    )
    record = prepare_press(question).run()
    touched = int(np.argmax(record["phase"] == CONTACT))
    return max(float((record["force"] - FORCE)[touched:].max()), 0.0)


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--seeds", type=int, default=20)
    asked.add_argument("--arms", nargs="*", default=names())
    asked.add_argument("--swing", type=float, default=gains.SWING_FRACTION)
    words = asked.parse_args()
    gains.SWING_FRACTION = words.swing
    print("| arm | " + " | ".join(f"{k:g} N/m" for k in STIFFNESSES) + " |", "|---" * 7 + "|", sep="\n")
    for arm in words.arms:
        worst = [max(overshoot(arm, k, seed) for seed in range(words.seeds)) for k in STIFFNESSES]
        print(f"| {arm} | " + " | ".join(f"{w:.2f}" for w in worst) + " |", flush=True)


if __name__ == "__main__":
    main()
