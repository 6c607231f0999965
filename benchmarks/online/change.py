"""A surface changes from 7 to 62 kN/m under given motion, the force continuous: how soon is the new stiffness known?

    python benchmarks/online/change.py                  # 40 seeds each
    python benchmarks/online/change.py --seeds 200

Time until K is within 2 % and stays there, medians over seeds, against an estimator that is told the instant and
starts then. "samples" are the force sensor's own, 480 a second with 0.6 N of noise; "chain" is the whole bench at
1 kHz: low-pass, 480 Hz, delay, 12 bits and an encoder of 5 um, through `ContactIdentifier`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import numpy as np
from others import Filterpy, Padasip
from pressing import NOISE, START, TONES, VAGUE, Array, followed, motion, regressors, samples_to_know

from palpate.bench import ForceSensorTable, given_motion
from palpate.environments import KelvinVoigt
from palpate.identifiers import (
    ContactIdentifier,
    RecursiveLeastSquares,
    RestartingLeastSquares,
    SIFt,
)
from palpate.records import Record
from palpate.signals.low_pass import LowPass

BEFORE, AFTER = (60.0, 7e3), (150.0, 62e3)  # B [N s/m], K [N/m]
RATE, LOOP = 480.0, 1000.0
SECONDS, CHANGE = 10.0, 4.0  # of a run, and from when on the surface is the other [s]
DRIFT = (10.0, 5e3, 10.0)  # of B, K and the offset [a root second]
ESTIMATORS: dict[str, Callable[[], Any]] = {
    "restarting": lambda: RestartingLeastSquares(START, VAGUE),
    "exponential 0.995": lambda: RecursiveLeastSquares(START, VAGUE, 0.995),
    "SIFt 0.99": lambda: RecursiveLeastSquares(START, VAGUE, SIFt(0.99)),
    "padasip 0.995": lambda: Padasip(START, VAGUE, 0.995),
    "filterpy, Kalman": lambda: Filterpy(START, VAGUE, DRIFT, 1.0 / RATE, NOISE),
}
SETTLED = 10.0  # time constants after which a low-pass has forgotten
FOUR = np.diag([1e2, 1e8, 1e12, 1e6])  # of M, B, K, offset in the chain


def samples(kind: str, seed: int) -> tuple[Array, Array, int]:
    """Regressors, forces, and the first sample of the new surface."""
    random = np.random.default_rng(seed)
    change = round(CHANGE * RATE)
    x, v = motion(random, kind, round(SECONDS * RATE), RATE)
    force = BEFORE[0] * v + BEFORE[1] * x
    new = slice(change, None)
    force[new] = force[change] + AFTER[0] * (v[new] - v[change]) + AFTER[1] * (x[new] - x[change])
    return regressors(x, v), force + random.normal(0.0, NOISE, len(x)), change


def on_samples(kind: str, seeds: int) -> None:
    """Prints a row for each estimator."""
    took: dict[str, list[int]] = {name: [] for name in ("told", *ESTIMATORS)}
    early, restarts, wrong = 0, 0, 0
    for seed in range(seeds):
        phi, force, change = samples(kind, seed)
        told = followed(RecursiveLeastSquares(START, VAGUE), phi[change:], force[change:])
        took["told"].append(samples_to_know(told, AFTER[1]))
        for name, make in ESTIMATORS.items():
            estimator = make()
            estimator.update_many(phi[:change], force[:change])
            if name == "restarting":
                early += estimator.changes
            took[name].append(samples_to_know(followed(estimator, phi[change:], force[change:]), AFTER[1]))
            if name == "restarting":
                restarts += estimator.changes
                estimate = estimator.estimate()
                wrong += abs(estimate.theta[1] - AFTER[1]) > 1.96 * estimate.std[1]
    print(f"\nsamples, {kind}; {seeds} seeds")
    for name, counts in took.items():
        row(name, np.array(counts) / RATE, np.array(took["told"]) / RATE)
    print(
        f"  restarts a run {restarts / seeds:.2f}, before the change {early}; truth outside 95 %: {wrong / seeds:.2f}"
    )


def row(name: str, seconds: Array, told: Array) -> None:
    """Prints times and their ratios to those of the estimator that was told."""
    ratio, left = seconds / told, SECONDS - CHANGE
    time = f"{1e3 * np.median(seconds):7.0f} ms" if np.median(seconds) < left else f"> {1e3 * left:5.0f} ms"
    print(
        f"  {name:20} {time}   ratio: median {np.median(ratio):6.2f}, "
        f"90 % of runs below {np.quantile(ratio, 0.9):6.2f}"
    )


def record_of(kind: str, seed: int) -> Record:
    """A run on the rig: the surface of `BEFORE`, then that of `AFTER`, each with 0.1 kg."""
    random = np.random.default_rng(seed)
    x, _ = motion(random, kind, round(SECONDS * LOOP), LOOP)
    soft, hard = (KelvinVoigt(K, B, 0.1) for B, K in (BEFORE, AFTER))
    rig = given_motion(
        [(0.0, soft), (CHANGE, hard)], sensor=ForceSensorTable(phase=random.uniform(0.0, 1.0 / RATE))
    )
    return rig.run(x, seed=seed)


def through(record: Record, estimator: Any, told: bool = False) -> Array:
    """The stiffness at each tick, with the front-end that the record's instruments ask for.

    Who is told is fed from the first sample on that the low-pass saw nothing of the old surface in.
    """
    force = record.meta["instruments"]["force"]
    low_pass = LowPass.parse(force["filter"])
    lag = low_pass.lag + force["delay_s"]
    idle = RecursiveLeastSquares(np.zeros(4), FOUR)
    sees = ContactIdentifier(
        low_pass, LOOP, lag, sampling=force["sampling_Hz"], estimator=idle if told else estimator
    )
    begins = round((CHANGE + lag + SETTLED / low_pass.decay) * LOOP) + sees.delay
    K = np.empty(len(record))
    ticks = zip(record["x_measured"].tolist(), record["force_sampled"].tolist(), strict=True)
    for k, (position, reading) in enumerate(ticks):
        if told and k == begins:
            sees.estimator = estimator
        sees.update(position, reading)
        K[k] = estimator.theta[2]
    return K[round(CHANGE * LOOP) :]


def on_the_chain(kind: str, seeds: int) -> None:
    """The same through the bench's instruments."""
    told, ours, restarts = [], [], 0
    for seed in range(seeds):
        record = record_of(kind, seed)
        estimator = RestartingLeastSquares(np.zeros(4), FOUR)
        ours.append(samples_to_know(through(record, estimator), AFTER[1]) / LOOP)
        restarts += estimator.changes
        fresh = RecursiveLeastSquares(np.zeros(4), FOUR)
        told.append(samples_to_know(through(record, fresh, told=True), AFTER[1]) / LOOP)
    print(f"\nchain, {kind}; {seeds} seeds")
    row("told", np.array(told), np.array(told))
    row("restarting", np.array(ours), np.array(told))
    print(f"  restarts a run {restarts / seeds:.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=40)
    seeds = parser.parse_args().seeds
    for kind in TONES:
        on_samples(kind, seeds)
    for kind in TONES:
        on_the_chain(kind, seeds)


if __name__ == "__main__":
    main()
