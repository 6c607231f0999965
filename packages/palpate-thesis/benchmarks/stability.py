"""Where the linear force laws of the thesis are stable: the edge by eigenvalues, and an interval that is proved.

    python packages/palpate-thesis/benchmarks/stability.py [--dampings 60 200 480]

The loop is that of figure 4.3 at 1 kHz: a tip on a spring and a damper, the sensor's low-pass, its delay, the
controller's filter, force gain and integral. Hybrid control has the thesis' two sets of gains. The network in the
thesis' loop is, to first order, an integral whose gain changes as it learns: its proof is of every gain from half of
what it starts from to half as much again, changing from tick to tick.

A cell of stiffnesses has one norm in which the ticks of its corners contract. A tick is affine in the integral gain,
and in the matrix exponential of the plant; the distance of that from the hull of its corners is bounded by its second
derivative, element by element, as docs/proofs.md derives it.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from palpate.arrays import Array
from palpate.controllers import Neural
from palpate.force.lyapunov import common
from palpate_thesis.force_control.linear_loop import TICK, TIP, LoopParameters

LOW, HIGH, SHARE = 300.0, 3e6, 0.99
"""Softest surface and stiffest that is looked at [N/m], and how far up the exact interval the proof goes."""
CONTRACTION, NARROWEST = 1e-9, 1e-4
"""Room for rounding in a norm below 1, and the narrowest cell, in its logarithm."""
PLANT = 5
"""Numbers of the state that the matrix exponential moves: place, rate and low-pass."""


class ForceLaw(NamedTuple):
    """A linear law: its force gain, its integral gains per tick from and to, and the tip that it moves [kg]."""

    name: str
    kf: float
    ki: tuple[float, float]
    tip: float

    def loop(self, damping: float, ki: float) -> LoopParameters:
        """On a surface of this damping [N s/m]."""
        return LoopParameters(self.kf, ki, damping, self.tip)


class StabilityCell(NamedTuple):
    """Stiffnesses [N/m] and the norm in which every tick on them contracts."""

    low: float
    high: float
    norm: Array


def laws() -> list[ForceLaw]:
    """Those of the thesis, with its gains."""
    network = Neural.thesis().network
    state = network.start()
    network.forward(state)
    return [
        ForceLaw("hybrid, foam", 1.0, (0.003, 0.003), TIP),
        ForceLaw("hybrid, rubber", 0.25, (0.0015, 0.0015), TIP),
        ForceLaw("network in the loop", 0.25, around(network.gain(state, 0)), TIP),
    ]


def around(gain: float) -> tuple[float, float]:
    """What a learning gain may become."""
    return 0.5 * gain, 1.5 * gain


def edge(law: ForceLaw, damping: float) -> float:
    """Stiffness from which the loop with its largest gain is unstable [N/m]; infinite if none is, 0 if all are."""
    loop = law.loop(damping, law.ki[1])
    grid = np.geomspace(LOW, HIGH, 200)
    unstable = loop.radius(grid) > 1.0
    first = int(np.argmax(unstable))
    if not unstable.any() or first == 0:
        return 0.0 if unstable.any() else np.inf
    low, high = grid[first - 1], grid[first]
    for _ in range(40):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if loop.radius(np.array([middle]))[0] > 1.0 else (middle, high)
    return float(high)


def prove(law: ForceLaw, damping: float, low: float, high: float) -> list[StabilityCell]:
    """Cells that cover these stiffnesses [N/m], from the softest on as far as they can be proved."""
    norm = norm_of(law, damping, low, high)
    if norm is not None:
        return [StabilityCell(low, high, norm)]
    if np.log(high / low) < NARROWEST:
        return []
    middle = float(np.sqrt(low * high))
    lower = prove(law, damping, low, middle)
    return lower + prove(law, damping, middle, high) if lower and lower[-1].high == middle else lower


def norm_of(law: ForceLaw, damping: float, low: float, high: float) -> Array | None:
    """L such that every tick on these stiffnesses, with every gain of the law, contracts; None if none is found."""
    ends = np.array([low, high])
    loops = [law.loop(damping, ki) for ki in dict.fromkeys(law.ki)]
    corners = [Phi for loop in loops for Phi in loop.ticks(ends)]
    near = loops[-1].ticks(np.array([np.sqrt(low * high)]))[0]
    if max(np.abs(np.linalg.eigvals(Phi)).max() for Phi in [*corners, near]) >= 1.0:
        return None
    L = common(corners, near)
    if L is None:
        return None
    back = np.linalg.inv(L.T)
    # What the exponential acts on: place, rate, low-pass, and the force command, a row of the tick.
    fed = [np.abs(np.vstack([np.eye(PLANT, len(L)), command(loop)]) @ back) for loop in loops]
    bend = np.abs(L.T[:, :PLANT]) @ curvature(law, damping, low, high) @ np.maximum.reduce(fed)
    size = max(float(np.linalg.norm(L.T @ Phi @ back, 2)) for Phi in corners)
    return L if size + float(np.linalg.norm(bend, 2)) < 1.0 - CONTRACTION else None


def command(loop: LoopParameters) -> Array:
    """Row of the force command by the state, shape (n,)."""
    some = np.array([LOW])
    (Phi,), (A, b, _) = loop.ticks(some), loop.zero_order_hold(some)
    row = Phi[1].copy()
    row[:PLANT] -= A[0, 1]
    return row / b[0, 1]


def curvature(law: ForceLaw, damping: float, low: float, high: float) -> Array:
    """Elements of the distance of exp(T A) from the straight line between its ends, at most, shape (5, 6)."""
    rates = law.loop(damping, 0.0).rates(np.array([low, high]))
    M, D = np.abs(rates).max(axis=0), np.abs(rates[1] - rates[0])
    np.fill_diagonal(M, np.diagonal(rates, axis1=1, axis2=2).max(axis=0))
    Z = np.zeros_like(M)
    third = expm(TICK * np.block([[M, D, Z], [Z, M, D], [Z, Z, M]]))[: len(M), 2 * len(M) :]
    return 0.25 * third[:PLANT]  # 1/8 of the second derivative, which is twice the block


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dampings", type=float, nargs="+", default=[60.0, 200.0, 480.0])
    told = parser.parse_args()
    print("| law | B_e [N s/m] | integral gain, per tick | unstable from [kN/m] | proved [kN/m] | cells |")
    print("|---" * 6 + "|")
    for law in laws():
        for damping in told.dampings:
            end = edge(law, damping)
            high = SHARE * min(end, HIGH)
            cells = prove(law, damping, LOW, high) if high > LOW else []
            gains = " to ".join(f"{ki:.3g}" for ki in dict.fromkeys(law.ki))
            far = f"over {1e-3 * HIGH:g}" if end == np.inf else f"{1e-3 * end:.3g}"
            proved = f"{1e-3 * LOW:g} to {1e-3 * cells[-1].high:.3g}" if cells else "nothing"
            print(f"| {law.name} | {damping:g} | {gains} | {far} | {proved} | {len(cells)} |", flush=True)


if __name__ == "__main__":
    main()
