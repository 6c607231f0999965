"""Runs in which the weights of the neural controller are looked at or changed between ticks."""

from collections.abc import Callable

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, build
from palpate.bench.force_input import COLUMNS
from palpate.bench.summary import LOST
from palpate.controllers import alone
from palpate.controllers.neural import NeuralState

PHASE = list(COLUMNS).index("phase")
FROM_TORQUES = slice(7, 10)
"""Columns of the hidden weights of the 9-12-3 network from the torques among its inputs."""
HOLD_INTERVAL = 20
"""Ticks after which weights that are held at zero are set back."""
Look = Callable[[float, NeuralState | None], None]
"""Called with the time since contact [s] and the state of the neural controller, None of any other."""


def watch(
    experiment: Experiment,
    seed: int,
    duration: float,
    look: Look,
    waiting: Callable[[], None] | None = None,
    every: int = 1000,
) -> float | None:
    """Run like `Bench.run`, from the same random numbers, without a record, until contact is lost.

    Args:
        experiment: any; `look` is called in contact.
        seed: of the noise.
        duration: of contact [s].
        look: called between ticks of contact; it may change the weights, and has to copy what it stores.
        waiting: called when the loop has to be compiled first.
        every: ticks between two looks.

    Returns:
        Time from contact to its loss [s]; None if it was not lost, NaN if there was none.
    """
    march = build(experiment).simulation(seed, waiting=waiting)
    while march.ticks * march.loop.tick < experiment.run.duration + duration:
        rows = march.advance(every)
        if march.contact is None:
            continue
        lost = (rows[:, PHASE] == LOST) | ~np.isfinite(rows).all(axis=1)
        if lost.any():
            return (march.ticks - every + int(np.argmax(lost)) - march.contact) * march.loop.tick
        _, state = alone(march.loop.controller, march.state.controller)
        look(march.since_contact, state if isinstance(state, NeuralState) else None)
        if march.since_contact >= duration:
            return None
    return None if march.contact is not None else float("nan")


def layers(state: NeuralState) -> tuple[Array, Array]:
    """Weights of the hidden and of the output layer of the 9-12-3 network, shapes (12, 10) and (3, 13); views."""
    w = state.network.weights
    return w[:120].reshape(12, 10), w[120:].reshape(3, 13)


def without_torques(_: float, state: NeuralState | None) -> None:
    """Set the hidden weights from the torques among the network's inputs to zero."""
    if state is not None:
        layers(state)[0][:, FROM_TORQUES] = 0.0
