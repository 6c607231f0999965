"""Force controllers of others: edges and overshoot by a simulation in time that shares nothing with the proofs.

    python benchmarks/force/others.py --settings 1000

Each setting is drawn at random and simulated as its makers' equations stand, with the delay as a line of past values,
400 steps a delay. The stiffness at which the motion begins to grow is bisected to 0.3 %. The corrected numbers of the
force loops then take a step of force on surfaces from a hundredth of the stiffest to it.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from palpate.analysis.others_controllers import HALF, PERIOD, certify_controller

KINDS = ("ros2-admittance", "fzi", "crisp")
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
            own = {"mass": m, "k": k, "d": rng.uniform(0.7, 2.0) * 2.0 * np.sqrt(m * k)}
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
    return f"a:\n  ros__parameters:\n    task: {{k_pos_x: {own['k']}, d_pos_x: {own['d']}}}\n"


def simulate(kind: str, own: dict[str, np.ndarray], K: np.ndarray, push: float, turns: int) -> np.ndarray:
    """Position or force of all settings side by side, shape (steps, n): a push at first, or a desired force of 1 N."""
    T = own["T"]
    dt = T / STEPS
    x, v = np.full(len(T), push), np.zeros(len(T))
    line = np.full((STEPS, len(T)), push) if push else np.zeros((STEPS, len(T)))
    rates = np.zeros((STEPS, len(T)))
    seen = np.empty((turns * STEPS, len(T)))
    F = 0.0 if push else 1.0
    for i in range(len(seen)):
        old, old_rate = line[i % STEPS].copy(), rates[i % STEPS].copy()
        if kind == "ros2-admittance":
            a = (F - K * old - 2.0 * own["zeta"] * np.sqrt(own["M"] * own["S"]) * v - own["S"] * x) / own["M"]
        elif kind == "fzi":
            a = (HALF * PERIOD * own["scale"] * own["p"] * (F - K * old) - v) / dt  # the velocity itself
        else:
            a = (-own["k"] * old - own["d"] * old_rate - K * x) / own["mass"]
        line[i % STEPS], rates[i % STEPS] = x, v
        v = v + a * dt
        x = x + v * dt
        seen[i] = x
    return seen


def grows(seen: np.ndarray) -> np.ndarray:
    """Whether the last quarter is larger than the one in the middle."""
    n = len(seen)
    late, early = (np.sqrt((seen[a:b] ** 2).mean(axis=0)) for a, b in ((3 * n // 4, n), (n // 4, n // 2)))
    return late > early


def edges(kind: str, count: int, rng: np.random.Generator) -> None:
    """Exact edges against the onset in time."""
    drawn = settings(kind, count, rng)
    exact, share, seconds, fixed = [], [], [], []
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.yaml"
        for own in drawn:
            path.write_text(text(kind, own), encoding="utf-8")
            begin = perf_counter()
            told, out = certify_controller(path, kind, own["T"], own.get("mass"))
            seconds.append(perf_counter() - begin)
            exact.append(told["exact"]["stiffness"][1])
            share.append((told["proved"]["stiffness"] or [0, 0])[1] / exact[-1])
            fixed.append(out if told["corrected"] else "")
    arrays = {name: np.array([own[name] for own in drawn]) for name in drawn[0]}
    edge = np.array(exact)
    low, high = 0.9 * edge, 1.1 * edge
    for _ in range(6):
        middle = 0.5 * (low + high)
        up = grows(simulate(kind, arrays, middle, 1e-3, TURNS))
        low, high = np.where(up, low, middle), np.where(up, middle, high)
    off = np.abs(0.5 * (low + high) / edge - 1.0)
    print(
        f"{kind}: {count} settings, edge off by {100 * np.median(off):.2f} % (median), {100 * off.max():.2f} % at most,"
        f" within 1 % in {(off < 0.01).sum()}; proved share {100 * min(share):.1f} % at least; "
        f"corrected {sum(map(bool, fixed))}; {max(seconds):.2f} s at most"
    )
    if kind != "crisp":
        overshoot(kind, drawn, fixed)


def overshoot(kind: str, drawn: list[dict[str, float]], fixed: list[str]) -> None:
    """Over a step of force with the corrected numbers, on eight surfaces each."""
    from ruamel.yaml import YAML

    from palpate.analysis.others_controllers import STIFFEST

    new = []
    for own, out in ((own, out) for own, out in zip(drawn, fixed, strict=True) if out):
        read = YAML(typ="safe").load(out)["a"]["ros__parameters"]
        change = (
            {"zeta": read["admittance"]["damping_ratio"][0]}
            if kind != "fzi"
            else {"p": read["pd_gains"]["trans_x"]["p"]}
        )
        new.append({**own, **change})
    arrays = {name: np.array([own[name] for own in new]) for name in new[0]}
    worst, stable = np.zeros(len(new)), np.ones(len(new), bool)
    for K in np.geomspace(1e-2, 1.0, 6) * STIFFEST:
        seen = simulate(kind, arrays, np.full(len(new), K), 0.0, TURNS)
        end = 1.0 / (K + arrays["S"]) if kind != "fzi" else np.full(len(new), 1.0 / K)
        worst = np.maximum(worst, seen.max(axis=0) / end - 1.0)
        stable &= np.abs(seen).max(axis=0) < 10.0 * end
    print(f"  corrected: {stable.sum()} of {len(new)} stable, over by {100 * worst.max():.1f} % at most")


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
