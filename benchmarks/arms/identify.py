"""What identification finds on each arm's press, torques and positions, on a soft and on a stiff surface.

K, B and the force are of the first press; verdicts and intervals are counted, and the overshoot is the largest, over
all seeds.
"""

import argparse
from itertools import product

from palpate.press.engines import MODES
from palpate.press.prepare import PressSpec, prepare_press, surface_of
from palpate.press.summary import summarise
from palpate.robots.serial.from_toml import names
from palpate.units import with_half

STIFFNESSES, DAMPING, FORCE = (5e3, 6e4), 50.0, 20.0
HEAD = (
    "| arm | mode | K [N/m] | K found | identified | B found, 50 N s/m | identified | rejected | truth in the interval"
    " | force, last second [N] | largest overshoot [N] | settling [s] |"
)


def pressed(arm: str, mode: str, stiffness: float, seed: int) -> dict:
    surface = surface_of(f"K={stiffness},B={DAMPING}")
    pressing = prepare_press(PressSpec(arm=arm, force=FORCE, surface=surface, mode=mode, seed=seed))
    return summarise(pressing.run(), pressing.request)


def row(arm: str, mode: str, stiffness: float, seeds: int) -> str:
    presses = [pressed(arm, mode, stiffness, seed) for seed in range(seeds)]
    found = [press["identified"]["parameters"] for press in presses]
    K, B = (told(found[0][name]) for name in ("K", "B"))
    counted = {
        verdict: [sum(own[name]["verdict"] == verdict for own in found) for name in ("K", "B")]
        for verdict in ("identified", "rejected")
    }
    intervals = [
        (own[name]["ci95"], true)
        for own in found
        for name, true in (("K", stiffness), ("B", DAMPING))
        if own[name]["ci95"] is not None
    ]
    inside = sum(low < true < high for (low, high), true in intervals)
    force = presses[0]["force"]
    settling = "-" if force["settling_s"] is None else f"{force['settling_s']:.2f}"
    over = max(press["force"]["overshoot_N"] for press in presses)
    return (
        f"| {arm} | {mode} | {stiffness:g} | {K} | {counted['identified'][0]} of {seeds} | {B}"
        f" | {counted['identified'][1]} of {seeds} | {sum(counted['rejected'])} | {inside} of {len(intervals)}"
        f" | {force['mean_N']:.3f} ± {force['std_N']:.3f} | {over:.2f} | {settling} |"
    )


def told(parameter: dict) -> str:
    if parameter["value"] is None or parameter["ci95"] is None:
        return "-"
    low, high = parameter["ci95"]
    return with_half(parameter["value"], 0.5 * (high - low))


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--seeds", type=int, default=4)
    asked.add_argument("--arms", nargs="+", default=names(), choices=names())
    words = asked.parse_args()
    print(HEAD, "|" + "---|" * (HEAD.count("|") - 1), sep="\n")
    for mode, arm, stiffness in product(MODES, words.arms, STIFFNESSES):
        print(row(arm, mode, stiffness, words.seeds), flush=True)


if __name__ == "__main__":
    main()
