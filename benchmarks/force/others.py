"""Force controllers of others: edges and overshoot by a simulation in time that shares nothing with the proofs.

    python benchmarks/force/others.py --settings 1000

Each setting is drawn at random and simulated as its makers' equations stand, with the delay as a line of past values,
200 steps a delay. The stiffness at which the motion begins to grow is bisected to 0.3 %. The corrected numbers then
take a step of force on surfaces from a hundredth of the stiffest to it. An impedance has no force loop: of it only
whether it is stable is counted, since its overshoot is the swing of its tip, whatever the numbers of the file.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate_certify.controller_file import HALF, PERIOD, STIFFEST, certify_controller

KINDS = ("ros2-admittance", "fzi", "crisp", "franka")
STEPS, TURNS = 200, 600
"""Steps a delay, and delays of a simulation."""


def settings(kind: str, count: int, rng: np.random.Generator) -> list[dict[str, float]]:
    """Numbers of so many controllers."""
    found = []
    for _ in range(count):
        T = float(np.exp(rng.uniform(np.log(0.004), np.log(0.06))))
        if kind == "ros2-admittance":
            M, S = np.exp(rng.uniform(np.log([1.0, 50.0]), np.log([30.0, 2000.0])))
            own = {"M": M, "S": S, "zeta": rng.uniform(0.7, 10.0)}
        elif kind == "fzi":
            own = {"p": np.exp(rng.uniform(np.log(0.005), np.log(0.5))), "scale": rng.uniform(0.2, 1.0)}
        else:
            m, k = rng.uniform(1.0, 8.0), np.exp(rng.uniform(np.log(100.0), np.log(2000.0)))
            d = 2.0 * np.sqrt(k) if kind == "franka" else rng.uniform(0.7, 2.0) * 2.0 * np.sqrt(m * k)
            own = {"mass": m, "k": k, "d": d}
            T = min(T, 0.2 * own["d"] / k, 0.3 * m / own["d"])  # else it is not stable without contact either
        found.append({"T": T, **{name: float(value) for name, value in own.items()}})
    return found


def text(kind: str, own: dict[str, float]) -> str:
    """The parameter file."""
    if kind == "ros2-admittance":
        lists = {"mass": own["M"], "damping_ratio": own["zeta"], "stiffness": own["S"]}
        rows = "".join(f"      {name}: {[value] * 6}\n" for name, value in lists.items())
        axes = [True, False, False, False, False, False]
        return f"a:\n  ros__parameters:\n    admittance:\n      selected_axes: {axes}\n{rows}".replace(
            "True", "true"
        ).replace("False", "false")
    if kind == "fzi":
        gains = (
            f"    solver: {{error_scale: {own['scale']}}}\n    pd_gains:\n      trans_x: {{p: {own['p']}}}\n"
        )
        return f"a:\n  ros__parameters:\n    command_interfaces: [velocity]\n{gains}"
    if kind == "franka":
        return f"a:\n  translational_stiffness: {own['k']}\n"
    return f"a:\n  ros__parameters:\n    task: {{k_pos_x: {own['k']}, d_pos_x: {own['d']}}}\n"


class Motion(NamedTuple):
    """Of all settings side by side: mean squares of the second and the last quarter, largest value and size."""

    early: Array
    late: Array
    top: Array
    size: Array


def simulate(kind: str, own: dict[str, Array], K: Array, push: float, turns: int) -> Motion:
    """Motion of the position: after a push, or towards a desired force of 1 N (of an impedance: a goal of 1 N/k)."""
    T = own["T"]
    dt = T / STEPS
    x, v = np.full(len(T), push), np.zeros(len(T))
    line = np.full((STEPS, len(T)), push) if push else np.zeros((STEPS, len(T)))
    rates = np.zeros((STEPS, len(T)))
    F, n = 0.0 if push else 1.0, turns * STEPS
    early, late, top, size = np.zeros((4, len(T)))
    for i in range(n):
        old, old_rate = line[i % STEPS].copy(), rates[i % STEPS].copy()
        if kind == "ros2-admittance":
            a = (F - K * old - 2.0 * own["zeta"] * np.sqrt(own["M"] * own["S"]) * v - own["S"] * x) / own["M"]
        elif kind == "fzi":
            a = (HALF * PERIOD * own["scale"] * own["p"] * (F - K * old) - v) / dt  # the velocity itself
        else:
            a = (F - own["k"] * old - own["d"] * old_rate - K * x) / own["mass"]
        line[i % STEPS], rates[i % STEPS] = x, v
        v = v + a * dt
        x = x + v * dt
        np.maximum(top, x, out=top)
        np.maximum(size, np.abs(x), out=size)
        if 4 * i >= 3 * n:
            late += x * x
        elif n <= 4 * i < 2 * n:
            early += x * x
    return Motion(early, late, top, size)


def edges(kind: str, count: int, rng: np.random.Generator) -> None:
    """Exact edges against the onset in time."""
    drawn = settings(kind, count, rng)
    exact, share, fixed = [], [], []
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.yaml"
        for own in drawn:
            path.write_text(text(kind, own), encoding="utf-8")
            told, out, *_ = certify_controller(path, kind, own["T"], own.get("mass"))
            exact.append(told["exact"]["stiffness"][1])
            share.append((told["proved"]["stiffness"] or [0, 0])[1] / exact[-1])
            fixed.append(out if told["corrected"] else "")
    arrays = {name: np.array([own[name] for own in drawn]) for name in drawn[0]}
    edge = np.array(exact)
    low, high = 0.9 * edge, 1.1 * edge
    for _ in range(6):
        middle = 0.5 * (low + high)
        moved = simulate(kind, arrays, middle, 1e-3, TURNS)
        up = moved.late > moved.early
        low, high = np.where(up, low, middle), np.where(up, middle, high)
    off = np.abs(0.5 * (low + high) / edge - 1.0)
    print(
        f"{kind}: {count} settings, edge off by {100 * np.median(off):.2f} % (median), {100 * off.max():.2f} % at most,"
        f" within 1 % in {(off < 0.01).sum()}; proved share {100 * min(share):.1f} % at least; "
        f"corrected {sum(map(bool, fixed))}"
    )
    after_correction(kind, drawn, fixed)


def numbers_of(kind: str, file: dict[str, Any]) -> dict[str, float]:
    """Those of a corrected file."""
    read = file["a"].get("ros__parameters", file["a"])
    if kind == "ros2-admittance":
        return {"zeta": read["admittance"]["damping_ratio"][0]}
    if kind == "fzi":
        return {"p": read["pd_gains"]["trans_x"]["p"]}
    if kind == "franka":
        return {"k": read["translational_stiffness"], "d": 2.0 * np.sqrt(read["translational_stiffness"])}
    return {"k": read["task"]["k_pos_x"], "d": read["task"]["d_pos_x"]}


def after_correction(kind: str, drawn: list[dict[str, float]], fixed: list[str]) -> None:
    """With the corrected numbers, on six surfaces each: what is stable, and by how much a step of force goes over."""
    from ruamel.yaml import YAML

    parser = YAML(typ="safe")
    new = [
        {**own, **numbers_of(kind, parser.load(out))} for own, out in zip(drawn, fixed, strict=True) if out
    ]
    if not new:
        return
    arrays = {name: np.array([own[name] for own in new]) for name in new[0]}
    spring = arrays.get("S", arrays.get("k", np.zeros(len(new))))
    worst, stable = np.zeros(len(new)), np.ones(len(new), bool)
    for K in np.geomspace(1e-2, 1.0, 6) * STIFFEST:
        moved, end = simulate(kind, arrays, np.full(len(new), K), 0.0, TURNS), 1.0 / (K + spring)
        worst = np.maximum(worst, moved.top / end - 1.0)
        stable &= moved.size < 10.0 * end
        stable &= moved.late < 1.001 * (TURNS * STEPS // 4) * end**2 + moved.early
    over = "" if spring is arrays.get("k") else f", over by {100 * worst.max():.1f} % at most"
    print(f"  corrected: {stable.sum()} of {len(new)} stable{over}")


def main() -> None:
    """Print a line for each controller."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--settings", type=int, default=1000)
    parser.add_argument("--kinds", nargs="*", default=KINDS)
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    for kind in told.kinds:
        edges(kind, told.settings, np.random.default_rng(told.seed))


if __name__ == "__main__":
    main()
