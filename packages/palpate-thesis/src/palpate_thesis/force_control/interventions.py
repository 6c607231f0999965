"""Runs in which the weights of the neural controller are looked at or changed between ticks."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Experiment, build
from palpate.bench.force_input import COLUMNS
from palpate.bench.summary import CONTACT, LOST
from palpate.controllers import alone
from palpate.controllers.neural import NeuralState

LOOK = 1000
"""Ticks between two looks at the weights, unless others are given."""
COLUMN = {name: i for i, name in enumerate(COLUMNS)}


class WeightsAtMoment(NamedTuple):
    """State of the controller, and the rows since the previous look."""

    t: float  # since contact [s]
    rows: Array  # of the ticks in contact since the previous look, shape (n, columns)
    neural: NeuralState | None  # None of any other controller


def watch(
    experiment: Experiment,
    seed: int,
    duration: float,
    look: Callable[[WeightsAtMoment], None],
    waiting: Callable[[], None] | None = None,
    every: int = LOOK,
) -> float | None:
    """Run like `Bench.run`, from the same random numbers, without a record, until contact is lost.

    Args:
        experiment: any; `look` is called in contact.
        seed: of the noise.
        duration: of contact [s].
        look: called between ticks of contact with the controller's own weights: it may change them, and has to copy
            what it stores.
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
        phase = rows[:, COLUMN["phase"]]
        lost = (phase == LOST) | ~np.isfinite(rows).all(axis=1)
        if lost.any():
            return (march.ticks - every + int(np.argmax(lost)) - march.contact) * march.loop.tick
        _, state = alone(march.loop.controller, march.state.controller)
        neural = state if isinstance(state, NeuralState) else None
        look(WeightsAtMoment(march.since_contact, rows[phase == CONTACT], neural))
        if march.since_contact >= duration:
            return None
    return None if march.contact is not None else float("nan")


FROM_TORQUES = slice(7, 10)
"""Columns of the hidden weights of the 9-12-3 network from the torques among its inputs."""
HOLD_INTERVAL = 20
"""Ticks after which weights that are held at zero are set back."""


def layers(state: NeuralState) -> tuple[Array, Array]:
    """Weights of the hidden and of the output layer of the 9-12-3 network, shapes (12, 10) and (3, 13); views."""
    w = state.network.weights
    return w[:120].reshape(12, 10), w[120:].reshape(3, 13)


def hold(columns: slice) -> Callable[[WeightsAtMoment], None]:
    """A look that sets these columns of the hidden weights to zero."""

    def look(moment: WeightsAtMoment) -> None:
        if moment.neural is not None:
            layers(moment.neural)[0][:, columns] = 0.0

    return look
