"""What the law does when the surface changes, moves or curves; wrong priors are in beyond.py.

    python benchmarks/force/disturbed.py [--touches 200] [--arms ur5e fr3] [--seed 0]

Changes in mid-press and sways of the surface as in the rows; an hour is in hours.py.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.progress import track
from touches import Draw, Rig, share

from palpate.force.expected import OVERSHOOT, STIFFENING_AT, step_of, stiffening

CHANGES = ((7e3, 62e3), (62e3, 7e3), (1e3, 1e6), (1e6, 1e3))
SWAYS = ((1e-3, 0.5), (1e-4, 2.0))
STIFFNESSES = (1e3, 7e3, 62e3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--touches", type=int, default=200)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"])
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    for name in told.arms:
        rig = Rig(name)
        print(f"\n{rig.arm.title}")
        changes(rig, told.seed)
        stiffening_surfaces(rig, told.seed)
        sways(rig, told.seed)
        curved(rig, told)


def changes(rig: Rig, seed: int) -> None:
    print(
        "  change of stiffness under 20 N, the force kept: largest and smallest force after, settled again after;"
    )
    print("  then the desired force steps to 25 N: largest force")
    for K, later in CHANGES:
        draw = Draw(K, 2.0 * 0.05 * np.sqrt(K), 20.0, 0.1, 0.0, 0.05)
        gains = rig.gains(20.0, 0.1)
        wanted = np.full(round(11.0 * rig.arm.rate), 20.0)
        wanted[round(8.0 * rig.arm.rate) :] = 25.0
        rows = rig.run(
            draw,
            gains.cautious(),
            [seed, 2],
            desired=wanted,
            approach=gains.approach,
            later=later,
            change=3.0,
            depth=20.0 / K,
        )
        force = rows[round(3.0 * rig.arm.rate) : round(8.0 * rig.arm.rate), 0]
        stepped = rows[round(8.0 * rig.arm.rate) :, 0].max()
        outside = np.flatnonzero(np.abs(force - 20.0) > 1.0)
        again = (outside[-1] + 1) / rig.arm.rate if len(outside) else 0.0
        what = f"{K / 1e3:g} -> {later / 1e3:g} kN/m"
        print(f"    {what:<20}{force.max():8.2f} N{force.min():8.2f} N{again:8.3f} s{stepped:9.2f} N")


def stiffening_surfaces(rig: Rig, seed: int) -> None:
    """From 3 kN/m, at the tick at which the force comes within 5 % or passes a half; without damping, little noise."""
    print(
        "  stiffer, as felt, while the force is below F_d: largest force; what is decided before a reading tells"
    )
    K, gains = 3e3, rig.gains(20.0, 0.01)
    draw, felt = Draw(K, 1e-3, 20.0, 0.01, 0.0, 0.0), rig.arm.seen(K)
    step = step_of(gains, felt if rig.arm.kind == "position" else K)
    still = rig.run(draw, gains.cautious(), [seed, 4], approach=gains.approach)[:, 0]
    for error in STIFFENING_AT:
        at = int(np.argmax(still > (1.0 - error) * 20.0))
        most = stiffening(gains, step, error)
        for times in (0.5 * most, most, 2.0 * most):
            rows = rig.run(
                draw, gains.cautious(), [seed, 4], approach=gains.approach, later=rig.arm.surface(times * felt),
                change=(at + 1) / rig.arm.rate, depth=still[at] / K,
            )  # fmt: skip
            over, decided = rows[:, 0].max() / 20.0 - 1.0, times / most * (OVERSHOOT + error) - error
            print(f"    {times:4.1f} times at {100 * error:2.0f} % off {share(over):>12}{share(decided):>12}")


def sways(rig: Rig, seed: int) -> None:
    print("  surface that moves under 20 N: rms error, smallest force, ticks without contact")
    for amplitude, hertz in SWAYS:
        for K in STIFFNESSES:
            draw = Draw(K, 2.0 * 0.1 * np.sqrt(K), 20.0, 0.1, 0.0, 0.1)
            gains = rig.gains(20.0, 0.1)
            rows = rig.run(
                draw, gains.cautious(), [seed, 3], 20.0, approach=gains.approach, sway=amplitude,
                frequency=2.0 * np.pi * hertz,
            )  # fmt: skip
            force = rows[len(rows) // 4 :, 0]
            rms = float(np.sqrt(np.mean((force - 20.0) ** 2)))
            what = f"+-{1e3 * amplitude:g} mm, {hertz:g} Hz, {K / 1e3:g} kN/m"
            print(f"    {what:<28}{rms:8.3f} N{force.min():8.2f} N{(force <= 0.0).sum():8d}")


def curved(rig: Rig, told: argparse.Namespace) -> None:
    """Hunt and Crossley: f = K p^n + B p^(n-1) pdot; the cap is the tangent's at 1.2 F_d, and a hundred times that."""
    print(
        f"  surfaces that stiffen as p^n, {told.touches} touches each: settled, p99 settling, most over, lost"
    )
    for n in (1.5, 2.0):
        for room in (1.0, 100.0):
            found = []
            for i in track(range(told.touches), f"p^{n:g}", transient=True):
                draw = rig.draw(np.random.default_rng([told.seed, 7, i]), stiffness=(1e3, 1e5))
                depth = draw.F / draw.K  # draw.K is the secant's stiffness at F_d
                K, B = draw.F / depth**n, 0.3 * draw.B / depth ** (n - 1.0)
                steepest = n * draw.K * 1.2 ** (1.0 - 1.0 / n) + 0.3 * draw.B / rig.theta * 1.2
                gains = rig.gains(draw.F, draw.noise, min(room * steepest, rig.arm.limits.stiffness))
                curve = Draw(K, B, draw.F, draw.noise, draw.phase, draw.zeta)
                rows = rig.run(
                    curve, gains.cautious(), [told.seed, 7, i], 8.0, approach=gains.approach, exponent=n
                )
                judged = rig.judge(draw, rows)
                found.append((judged.settling, judged.overshoot, judged.lost))
            settling, over, lost = np.array(found).T
            done, late = np.isfinite(settling).sum(), np.nanpercentile(settling, 99)
            what = f"p^{n:g}, cap x {room:g}"
            print(f"    {what:<22}{done:>5}  {late:6.2f} s  {share(over.max()):>10}  {(lost > 0).sum()}")


if __name__ == "__main__":
    main()
