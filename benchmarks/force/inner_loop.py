"""How often the intervals of an inner loop hold the truth, by simulated logs of steps and sweeps.

    python benchmarks/force/inner_loop.py [--logs 200] [--seconds 5] [--seed 0]

Bandwidth 3 to 20 Hz, damping 0.5 to 1.5, delay 2 to 30 ms, at 500 Hz; noise of 10 um, white or coloured (0.95).
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.progress import track
from scipy.linalg import expm
from scipy.signal import lfilter

from palpate.errors import InputError
from palpate.force.inner_loop import identify_inner_loop

TICK, FINE, NOISE = 0.002, 10, 1e-5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    for kind in ("steps", "sweep"):
        for colour in (0.0, 0.95):
            report(kind, colour, told)


def report(kind: str, colour: float, told: argparse.Namespace) -> None:
    names, inside, halves, refused = ("bandwidth", "damping", "delay"), [], [], 0
    for i in track(range(told.logs), f"{kind}, colour {colour:g}", transient=True):
        rng = np.random.default_rng([told.seed, i])
        true = np.exp(rng.uniform(np.log([3.0, 0.5, 0.002]), np.log([20.0, 1.5, 0.03])))
        true[2] = TICK / FINE * round(true[2] * FINE / TICK)
        t, command, position = log(rng, kind, colour, told.seconds, *true)
        try:
            found = identify_inner_loop(t, command, position)
        except InputError:
            refused += 1
            continue
        ends = [getattr(found, name) for name in names]
        inside.append([p.low <= v <= p.high for p, v in zip(ends, true, strict=True)])
        halves.append([p.half / v for p, v in zip(ends, true, strict=True)])
    print(f"{kind}, noise of colour {colour:g}: {refused} of {told.logs} refused")
    for name, share, half in zip(names, np.mean(inside, axis=0), np.median(halves, axis=0), strict=True):
        print(f"  {name:<10} held by {100 * share:5.1f} %, half-width {100 * half:5.2f} % in the middle")


def log(rng, kind, colour, seconds, bandwidth, damping, delay):
    """Time, command and position; the delay in tenths of a tick."""
    n = round(seconds / TICK)
    t = TICK * np.arange(n)
    if kind == "steps":
        command = np.repeat(rng.uniform(-0.01, 0.01, n // 125 + 1), 125)[:n]
    else:
        rate = np.log(100.0) / seconds
        command = 0.005 * np.sin(2.0 * np.pi * 0.3 / rate * np.expm1(rate * t))
    w, h = 2.0 * np.pi * bandwidth, TICK / FINE
    M = np.zeros((3, 3))
    M[0, 1], M[1] = w, (-w, -2.0 * damping * w, w)
    E, late = expm(h * M), round(delay / h)
    x, position = np.array([command[0], 0.0]), np.empty(n)
    for k in range(n):
        position[k] = x[0]
        for j in range(k * FINE - late, (k + 1) * FINE - late):
            x = E[:2, :2] @ x + E[:2, 2] * command[max(j, 0) // FINE]
    noise = lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], NOISE * rng.standard_normal(n))
    return t, command, position + noise


if __name__ == "__main__":
    main()
