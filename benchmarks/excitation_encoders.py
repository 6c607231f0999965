"""Predictions of `palpate excite` for fine and coarse position sensors, beside the results of presses.

    python benchmarks/excitation_encoders.py                # 30 runs of each: two minutes

10 s of a multisine of 15 N with 5 N to each side on three surfaces. The motion and the force come from the design's own
phasors, the force through the sensor's low-pass and with its noise, the position rounded to the encoder's steps from a
place of the run's own; `ContactIdentifier` reads them. Columns: predicted
standard deviation over the truth, and the rms error over it.
"""

from __future__ import annotations

import argparse
from itertools import product

import numpy as np
from numpy.typing import NDArray

from palpate.excitation import Budget, Design, DesignProblem, KnownBandwidth, Sensors, SurfaceRange, design
from palpate.excitation.sensors import ForceChain
from palpate.identifiers import ContactIdentifier

Array = NDArray[np.float64]

SURFACES = {"soft, damped": (5.2e3, 200.0, 0.1), "soft": (5.2e3, 60.0, 0.3), "rubber": (60e3, 150.0, 0.3)}
STEPS = (1.6e-6, 1e-5, 4e-5)  # m
NAMES = ("K", "B", "M")
RUNS = 30
CHAIN = ForceChain()
RATE, SECONDS = 1000.0, 10.0


def designed(surface: tuple[float, float, float], step: float) -> Design:
    """The excitation for a surface, exactly known, and an encoder."""
    ranges = SurfaceRange(*((value, value) for value in surface))
    sensors = Sensors(CHAIN, position_step=step)
    asked, loop = dict.fromkeys(NAMES, 0.1), KnownBandwidth(60.0)
    return design(DesignProblem(ranges, Budget(15.0, 20.0), asked, sensors, loop, duration=SECONDS))


def signals(made: Design, begin: float) -> tuple[Array, Array]:
    """Position [m] and force through the sensor's low-pass [N], from an instant of the wave on."""
    wave, problem = made.wave, made.problem
    omega = 2 * np.pi * np.array(wave.frequencies)
    force = problem.forces(omega, np.array(wave.amplitudes))[0] * np.exp(1j * np.array(wave.phases))
    surface, t = made.predictions[0].surface, begin + np.arange(round(SECONDS * RATE)) / RATE
    turned = np.exp(1j * np.outer(t, omega))
    position = np.imag(turned @ (force / surface.impedance(omega)))
    felt = np.imag(turned @ (force * CHAIN.low_pass.at(omega)))
    return position + problem.budget.mean / surface.stiffness, felt + problem.budget.mean


def errors(made: Design, step: float, seed: int) -> Array:
    """Relative errors of K, B and M in one press."""
    random = np.random.default_rng(seed)
    position, force = signals(made, random.uniform(0, SECONDS))
    place = random.uniform(0, 1)
    position = (np.round(position / step + place) - place) * step
    # A fresh reading each tick, of the noise density of the sensor's own sampling.
    force += random.normal(0, CHAIN.noise * np.sqrt(RATE / CHAIN.sampling), len(force))
    contact = ContactIdentifier(CHAIN.low_pass, RATE, CHAIN.low_pass.lag, touch=0.0)
    contact.update_many(position, force)
    return contact.estimate().theta[[2, 1, 0]] / made.predictions[0].surface.values - 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=RUNS)
    runs = parser.parse_args().runs
    print("| surface, step of the position | " + " | ".join(NAMES) + " |")
    print("|---|" + "---|" * len(NAMES))
    for (name, surface), step in product(SURFACES.items(), STEPS):
        made = designed(surface, step)
        predicted = np.array([made.worst()[n] for n in NAMES]) / 1.96
        rms = np.sqrt(np.mean([np.square(errors(made, step, seed)) for seed in range(runs)], axis=0))
        cells = [f"{p:.2%}, {r / p:.3g}" for p, r in zip(predicted, rms, strict=True)]
        print(f"| {name}, {1e6 * step:g} um | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
