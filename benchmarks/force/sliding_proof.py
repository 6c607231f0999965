"""Tries to find an unstable slide inside what its certificate proves: the normal off, friction pulling, both changing.

    python benchmarks/force/sliding_proof.py [--draws 1000000] [--runs 2000] [--ticks 1000] [--arms ur5e fr3] [--seed 0]

The loop of a tip that is moved along a normal off by phi, with friction mu, is that of a surface of m K, m = cos phi
(cos phi -+ mu sin phi), for phi up to 10 degrees and mu up to 0.9. `fixed`: K even in the logarithm over what is
proved, phi and mu at random, judged by eigenvalues. `redrawn`: phi and mu drawn anew every tick, half at their ends.
`worst`: at every tick the end of m that leaves the state largest in the norm of the loop's middle. A run grows if its
state is larger after all ticks; its K is one on which the loop settles within them. `outside`: the eigenvalues at the
upper end with 5 times the gain.
"""

from __future__ import annotations

import argparse

import numpy as np
from falsify import BATCH, matrices
from msgspec.structs import replace

from palpate.force.arm import load_arm
from palpate.force.certificate import Certificate
from palpate.force.certifying import certify
from palpate.force.gains import gains_for
from palpate.force.lyapunov import single
from palpate.force.slide_table import Slide
from palpate.force.sliding.slide_proof import MAX_MISALIGNMENT, slide_proof

MU_MAX = 0.9
TITLES = {"ur5e": "UR5e", "fr3": "FR3", "iiwa14": "iiwa 14"}


def factors(rng, shape, ends):
    """Factors m of random angles and frictions, a share `ends` of them at the ends of both."""
    phi = rng.uniform(-MAX_MISALIGNMENT, MAX_MISALIGNMENT, shape)
    mu = rng.uniform(0.0, MU_MAX, shape)
    extreme = rng.random(shape) < ends
    phi, mu = np.where(extreme, np.sign(phi) * MAX_MISALIGNMENT, phi), np.where(extreme, MU_MAX, mu)
    return np.cos(phi) * (np.cos(phi) + mu * np.sin(phi))


def unstable(gains, claim, rng, draws, low, high, times=1.0):
    """Loops with an eigenvalue of 1 or more, of so many."""
    found = 0
    for first in range(0, draws, BATCH):
        n = min(BATCH, draws - first)
        K = np.exp(rng.uniform(np.log(low), np.log(high), n)) * factors(rng, n, 0.2)
        values = np.linalg.eigvals(matrices(gains, claim, K, 0.0 * K, times * gains.gain, 0))
        found += int((np.abs(values).max(axis=1) >= 1.0).sum())
    return found


def growing(gains, claim, rng, args, low, high, worst):
    """Runs whose state is larger at their end, m being anything at each tick, or the worst end of it."""
    grown = 0
    for _ in range(args.runs):
        m = factors(rng, args.ticks, 0.5)
        ends, settles = np.array([m.min(), m.max()]), 1.0
        while settles > 0.01:  # within the run
            K = np.exp(rng.uniform(np.log(low), np.log(high)))
            low_end, high_end = matrices(gains, claim, K * ends, 0.0 * ends, gains.gain, 0)
            settles = np.abs(np.linalg.eigvals(low_end)).max() ** args.ticks
        L = single(0.5 * (low_end + high_end)) if worst else None
        x = rng.standard_normal(len(low_end))
        before = np.linalg.norm(x)
        for share in (m - ends[0]) / (ends[1] - ends[0]):
            one, two = low_end @ x, high_end @ x
            either = (1.0 - share) * one + share * two
            x = either if L is None else max(one, two, key=lambda v: np.linalg.norm(L.T @ v))
        grown += np.linalg.norm(x) >= before
    return int(grown)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=1_000_000)
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--ticks", type=int, default=1000)
    parser.add_argument("--arms", nargs="+", default=["ur5e", "fr3"], choices=TITLES)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    print(
        "| | K proved, as felt [N/m] | fixed: unstable | redrawn: growing | worst: growing | outside: unstable |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    for name in args.arms:
        gains = replace(gains_for(load_arm(name), 15.0, cap=4e4), slide=Slide(speed=0.03, mu_max=MU_MAX))
        certificate: Certificate = certify(gains, adapting=False)
        claim, (low, high) = certificate.claims[0], slide_proof(certificate)["felt_stiffness"]
        rng = np.random.default_rng(args.seed)
        inside = unstable(gains, claim, rng, args.draws, low, high)
        runs = [growing(gains, claim, rng, args, low, high, worst) for worst in (False, True)]
        few = max(args.draws // 100, 1)
        beyond = unstable(gains, claim, rng, few, 0.9 * high, high, 5.0)
        cells = [
            f"{low:.3g} to {high:.3g}",
            f"{inside} of {args.draws}",
            *(f"{n} of {args.runs}" for n in runs),
        ]
        print(f"| {TITLES[name]} | {' | '.join(cells)} | {100 * beyond / few:.0f} % |", flush=True)


if __name__ == "__main__":
    main()
