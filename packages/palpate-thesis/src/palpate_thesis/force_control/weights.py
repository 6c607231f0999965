"""A long run of the neural controller, with its network's weights looked at now and then."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array
from palpate.bench import Bench, Experiment, build
from palpate.bench.force_input import COLUMNS
from palpate.bench.summary import CONTACT, LOST
from palpate.controllers import alone
from palpate.controllers.neural import NeuralState

LOOK = 1000
"""Ticks between two looks, unless others are asked for."""
COLUMN = {name: i for i, name in enumerate(COLUMNS)}


class WeightsAtMoment(NamedTuple):
    """The controller at a moment, and what went on since the look before."""

    t: float  # since contact [s]
    rows: Array  # of the ticks since the look before, in contact, shape (n, columns)
    neural: NeuralState | None  # None of any other controller


def watch(
    experiment: Experiment,
    seed: int,
    duration: float,
    look: Callable[[WeightsAtMoment], None],
    waiting: Callable[[], None] | None = None,
    every: int = LOOK,
    bench: Bench | None = None,
) -> float | None:
    """Runs like `Bench.run`, from the same random numbers, but keeps nothing and ends when contact is lost.

    Args:
        experiment: any; `look` is called in contact.
        seed: of the noise.
        duration: of contact [s].
        look: called between ticks of contact. The weights that it sees are the controller's own: copy what is to be
            kept, and write in them to see what they did.
        waiting: called when the loop has to be compiled first.
        every: so many ticks.
        bench: to be run in the place of the experiment's own.

    Returns:
        When contact was lost, since it was made [s]; None if it was not, NaN if it was never made.
    """
    march = (bench or build(experiment)).simulation(seed, waiting=waiting)
    while march.ticks * march.loop.tick < experiment.run.duration + duration:
        rows = march.advance(every)
        if march.contact is None:
            continue
        phase = rows[:, COLUMN["phase"]]
        gone = (phase == LOST) | ~np.isfinite(rows).all(axis=1)
        if gone.any():
            return (march.ticks - every + int(np.argmax(gone)) - march.contact) * march.loop.tick
        _, own = alone(march.loop.controller, march.state.controller)
        neural = own if isinstance(own, NeuralState) else None
        look(WeightsAtMoment(march.since_contact, rows[phase == CONTACT], neural))
        if march.since_contact >= duration:
            return None
    return None if march.contact is not None else float("nan")


HELD = {"poses": slice(1, 7), "motor 1's torque": slice(7, 8), "all torques": slice(7, 10)}
"""Columns of the hidden weights of the 9-12-3 network, by where they come from."""
HOLD = 20
"""Ticks after which weights that are held are set back."""


def layers(state: NeuralState) -> tuple[Array, Array]:
    """Weights of the hidden and of the output layer of the 9-12-3 network, shapes (12, 10) and (3, 13); views."""
    w = state.network.weights
    return w[:120].reshape(12, 10), w[120:].reshape(3, 13)


def hold(columns: slice) -> Callable[[WeightsAtMoment], None]:
    """A look that sets these columns of the hidden weights to zero, so that they cannot grow."""

    def look(one: WeightsAtMoment) -> None:
        if one.neural is not None:
            layers(one.neural)[0][:, columns] = 0.0

    return look
