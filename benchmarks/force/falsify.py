"""Tries to find an unstable loop inside the proof, and says what lies just outside.

    python benchmarks/force/falsify.py [--draws 1000000] [--runs 2000] [--arms ur5e fr3] [--seed 0]

Constant surfaces by their eigenvalues; the adapting law with its gain, and the age of its readings, drawn anew every
tick; surfaces drawn anew every tick within a cell. The proof is made first, timed, and checked.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from rich.progress import track
from scipy.linalg import expm
from touches import Rig

from palpate.force.certifying import certify, exact_interval
from palpate.force.sampled_loop import Law

BATCH = 2000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=1_000_000)
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--ticks", type=int, default=1000)
    parser.add_argument("--arms", nargs="+", default=["ur5e"])
    parser.add_argument("--seed", type=int, default=0)
    told = parser.parse_args()
    for name in told.arms:
        report(name, told)


def report(name: str, told: argparse.Namespace) -> None:
    rig = Rig(name)
    gains = rig.gains(20.0, 0.1)
    started, burnt = time.perf_counter(), time.process_time()
    proof = certify(gains, adapting=rig.arm.kind == "position")
    made = time.perf_counter() - started, time.process_time() - burnt
    burnt = time.process_time()
    verdict = proof.check()
    checked = time.process_time() - burnt
    held = proof.claims[0]
    rng = np.random.default_rng(told.seed)
    print(f"\n{rig.arm.title}")
    print(
        f"  made in {made[0]:.1f} s ({made[1]:.1f} s of one core), checked in {checked:.2f} s: holds {verdict.holds}"
    )
    print(
        f"  cells {verdict.cells}, least contraction {1 - verdict.contraction:.2g}, rounding {verdict.rounding:.2g}"
    )
    exact = exact_interval(gains)[1]
    print(f"  proved up to {100 * held.high / exact:.2f} % of the exact boundary without damping")
    inside = unstable(rig, gains, held, rng, told.draws, held.low, held.high)
    print(f"  unstable among {told.draws} surfaces inside       {inside}")
    few = max(told.draws // 100, 1)
    outside = unstable(rig, gains, held, rng, few, exact, 1.1 * exact, damped=False)
    print(f"  unstable among {few} just outside, undamped  {100 * outside / few:.1f} %")
    print(
        f"  growing, surface redrawn every tick in a cell    {wandering(gains, held, rng, told)} of {told.runs}"
    )
    for claim in (c for c in proof.claims if c.kind == "adapting"):
        print(
            f"  growing, gain and jitter redrawn every tick      {adapting(gains, claim, rng, told)} of {told.runs}"
        )


def surfaces(gains, claim, rng, n, low, high, damped=True):
    """K and B even in the logarithm of K + B/theta, and in B/K."""
    bound = np.exp(rng.uniform(np.log(low), np.log(high), n))
    times = rng.uniform(claim.least, claim.most, n) if damped else np.zeros(n)
    K = bound / (1.0 + times / gains.theta)
    return K, times * K


def matrices(gains, claim, K, B, gain, loss):
    """Of many surfaces at once; affine in (K, B) for a position arm."""
    loop = claim.prover(gains).loop
    if gains.arm.kind == "position":
        unit, law = loop.force_unit, Law(gain)
        zero = loop.phi(0.0, 0.0, law, loss)
        one, two = loop.phi(unit, 0.0, law, loss) - zero, loop.phi(0.0, unit, law, loss) - zero
        return zero + np.multiply.outer(K / unit, one) + np.multiply.outer(B / unit, two)
    return stacked(loop, K, B, Law(gain), loss)


def stacked(loop, K, B, law, loss):
    """`SampledLoop.phi` of many surfaces, shape (n, size, size): what happens within a tick is affine in (K, B) too."""
    zero, one, two = (held_rates(loop, *kb) for kb in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    rates = zero + np.multiply.outer(K, one - zero) + np.multiply.outer(B, two - zero)
    within, p = expm(loop.arm.tick * rates), len(zero) - 1
    none, reading = np.zeros((p, p)), loop.force_gain(1.0, 0.0)
    if not len(loop.low_pass[1]):
        raise SystemExit("a sensor without a low-pass reads the surface itself: not written here")
    rest = loop.tick_matrix(none, np.zeros(p), reading, law, loss)
    acting = (loop.tick_matrix(none, np.ones(p), reading, law, loss) - rest)[0]
    Phi = np.broadcast_to(rest, (len(K), *rest.shape)).copy()
    Phi[:, :p] += within[:, :p, p:] * acting
    Phi[:, :p, :p] += within[:, :p, :p]
    return Phi


def held_rates(loop, K, B):
    """d/dt of z and the held input, shape (p + 1, p + 1)."""
    A, b = loop.rates(K, B)
    return np.vstack([np.column_stack([A, b]), np.zeros(len(b) + 1)])


def unstable(rig, gains, claim, rng, draws, low, high, damped=True) -> int:
    found = 0
    for first in track(range(0, draws, BATCH), "surfaces", transient=True):
        K, B = surfaces(gains, claim, rng, min(BATCH, draws - first), low, high, damped)
        values = np.linalg.eigvals(matrices(gains, claim, K, B, gains.gain, 0))
        found += int((np.abs(values).max(axis=1) >= 1.0).sum())
    return found


def wandering(gains, claim, rng, told) -> int:
    """Runs in which the norm of a random state has not shrunk, the surface being any of a cell at each tick."""
    grown = 0
    for _ in track(range(told.runs), "redrawn surfaces", transient=True):
        cell = claim.cells[rng.integers(len(claim.cells))]
        L = cell.L
        x = rng.standard_normal(len(L))
        before = np.linalg.norm(L.T @ x)
        K, B = surfaces(gains, cell, rng, 50, cell.low, cell.high)
        for Phi in matrices(gains, claim, K, B, gains.gain, 0):
            x = Phi @ x
        grown += np.linalg.norm(L.T @ x) >= before
    return int(grown)


def adapting(gains, claim, rng, told) -> int:
    """Runs whose state is larger after so many ticks, gain and age of the reading being anything at each."""
    prover, unit = claim.prover(gains), gains.arm.series
    grown, loop = 0, prover.loop
    for _ in track(range(told.runs), "adapting", transient=True):
        time_of = rng.uniform(claim.least, claim.most)
        K = unit / (1.0 + time_of / gains.theta)
        ends = [s * gains.alpha / gains.theta / unit for s in claim.shares]
        corner = {
            (g, loss): loop.phi(K, time_of * K, Law(ends[g]), loss)
            for g in range(2) for loss in range(prover.younger + 1)
        }  # fmt: skip
        x = rng.standard_normal(loop.size)
        before = np.linalg.norm(x)
        share = rng.choice([0.0, 1.0, -1.0], told.ticks)  # either end, or anything between
        share = np.where(share < 0.0, rng.uniform(size=told.ticks), share)
        losses = rng.integers(prover.younger + 1, size=told.ticks)
        for s, loss in zip(share, losses, strict=True):
            x = (1.0 - s) * (corner[0, loss] @ x) + s * (corner[1, loss] @ x)
        grown += np.linalg.norm(x) >= before
    return int(grown)


if __name__ == "__main__":
    main()
