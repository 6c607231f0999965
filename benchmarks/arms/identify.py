"""What identification finds on each arm's press, torques and positions, on a soft and on a stiff surface.

`--markdown docs/arms.md` puts the table between the marks of that page.
"""

import argparse
from pathlib import Path

from pages import put

from palpate.press.prepare import Question, prepared, surface_of
from palpate.press.summary import summarise
from palpate.report.numbers import with_half
from palpate.robots.serial.from_toml import names

STIFFNESSES, DAMPING, FORCE = (5e3, 6e4), 50.0, 20.0
HEAD = "| arm | mode | K [N/m] | K found | B found, 50 N s/m | force, last second [N] | overshoot [N] | settling [s] |"


def row(arm: str, mode: str, stiffness: float, seed: int) -> str:
    surface = surface_of(f"K={stiffness},B={DAMPING}")
    pressing = prepared(Question(arm=arm, force=FORCE, surface=surface, mode=mode, seed=seed))
    summary = summarise(pressing.run(), pressing.asked)
    found, force = summary["identified"]["parameters"], summary["force"]
    K, B = (told(found[name]) for name in ("K", "B"))
    settling = "-" if force["settling_s"] is None else f"{force['settling_s']:.2f}"
    pressed = f"{force['mean_N']:.3f} ± {force['std_N']:.3f}"
    return f"| {arm} | {mode} | {stiffness:g} | {K} | {B} | {pressed} | {force['overshoot_N']:.2f} | {settling} |"


def told(parameter: dict) -> str:
    if parameter["value"] is None or parameter["ci95"] is None:
        return parameter["verdict"]
    low, high = parameter["ci95"]
    note = "" if parameter["verdict"] == "identified" else f" ({parameter['verdict']})"
    return with_half(parameter["value"], 0.5 * (high - low)) + note


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--seed", type=int, default=0)
    asked.add_argument("--markdown", type=Path)
    words = asked.parse_args()
    lines = [HEAD, "|" + "---|" * HEAD.count(" | ") + "---|"]
    print(HEAD)
    for mode in ("torque", "position"):
        for arm in names():
            for stiffness in STIFFNESSES:
                lines.append(row(arm, mode, stiffness, words.seed))
                print(lines[-1], flush=True)
    put(words.markdown, "identify", lines)


if __name__ == "__main__":
    main()
