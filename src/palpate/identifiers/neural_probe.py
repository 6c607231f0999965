"""A network beside the surface that learns its force, and is asked for K, B and M (thesis, sec. 5.2 and 6.2).

It only watches, so a record is all that it needs to be replayed beside a run, after the fact; the scales and probes of
the thesis are those of sec. 6.2, by surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel, law
from palpate._jit.typed_edge import cast_array, cast_number, machine_code
from palpate.arrays import Array
from palpate.errors import InputError, unknown
from palpate.networks import Network, layers_of, network, random_layers
from palpate.networks.network import backward, descend, forward
from palpate.records import Readable, Record
from palpate.signals.types import Estimate


class Setting(NamedTuple):
    """For one surface, in the order displacement, velocity, acceleration.

    Args:
        scale: factors before the network.
        values: where it is asked [m, m/s, m/s^2].
    """

    scale: tuple[float, float, float]
    values: tuple[float, float, float]


SETTINGS = {
    "foam": Setting((1e3, 1e2, 1.0), (2e-3, 1e-2, 1.0)),
    "rubber": Setting((1e4, 1e2, 1.0), (2e-4, 1e-2, 0.5)),
}


CHANNELS = ("displacement", "velocity", "acceleration")
UNITS = ("m", "m/s", "m/s^2")
OUTSIDE = "probe-outside-learned"
_HUGE = 1e300  # a sample beyond it, or not a number, is no sample


@dataclass(frozen=True)
class Probed:
    """A network's answer to a probe: no measurement, and without a covariance.

    Args:
        stiffness, damping, mass: K [N/m], B [N s/m], M [kg] as the differences of its answers give them.
        force_at_zero: its answer where nothing moves and nothing is pressed [N]; a spring would say 0, and what is
            said instead is in K times the displacement.
        warnings: (code, text) of what makes the answer doubtful.
    """

    stiffness: float
    damping: float
    mass: float
    force_at_zero: float
    warnings: tuple[tuple[str, str], ...]


class NeuralProbe(Readable):
    """Learns force from displacement, velocity and acceleration, a sample at a time; any curve, no model.

    When to use it: to see what the thesis saw. For numbers to rely on, `RecursiveLeastSquares` or `identify`: a
    network's answer depends on the weights it starts from, and carries no interval.

    Args:
        setting: scales of displacement, velocity and acceleration before the network sees them, and the values that
            it is asked at [m, m/s, m/s^2]; the thesis' are in `SETTINGS`.
        amplitude: the largest force that it can say [N]. The thesis does not give it; it must exceed the force.
        learning_rate: eta, above 0.
        layers: neurons of each hidden layer.
        seed: of the weights at the start, or a generator.
        weights: the largest of them. The thesis gives neither.
        thresholds: False leaves them all at zero, so that the network says 0 N where nothing is pressed.

    Raises:
        InputError: numbers out of range.
    """

    def __init__(
        self,
        setting: Setting,
        amplitude: float = 40.0,
        learning_rate: float = 1e-4,
        layers: Sequence[int] = (4,),
        seed: int | np.random.Generator = 0,
        weights: float = 0.5,
        thresholds: bool = True,
    ):
        start = random_layers((3, *layers, 1), seed, weights)
        self._thresholds = 1.0 if thresholds else 0.0
        for layer in start:
            layer[:, 0] *= self._thresholds
        self._net: Network = network(start, amplitude, learning_rate)
        self.scale = _three(setting.scale, "scale")
        self.values = _probe_values(_three(setting.values, "values"))
        self.samples = 0
        self._memory = self._net.start()
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self._bind()

    @classmethod
    def thesis(
        cls,
        surface: str,
        amplitude: float = 40.0,
        learning_rate: float = 1e-4,
        seed: int | np.random.Generator = 0,
        weights: float = 0.5,
        thresholds: bool = True,
    ) -> NeuralProbe:
        """The 3-4-1 network with the scales and the probe of the thesis for "foam" or "rubber"."""
        if surface not in SETTINGS:
            raise unknown("surface", surface, SETTINGS)
        return cls(SETTINGS[surface], amplitude, learning_rate, (4,), seed, weights, thresholds)

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in: displacement, velocity and acceleration, shape (3,), and the force [N].

        Raises:
            InputError: a regressor of another shape, or a number that is not finite; the network is unchanged.
        """
        phi = cast_array("regressor", regressor, (3,))
        self.update_many(phi[None], np.array([cast_number("force", force)]))

    def update_many(self, regressors: ArrayLike, forces: ArrayLike) -> None:
        """Takes k samples in, as k calls of `update` would: regressors of shape (k, 3), forces of shape (k,)."""
        self._update(regressors, forces, trajectory=False)

    def trajectory(self, regressors: ArrayLike, forces: ArrayLike) -> Array:
        """As `update_many`; returns K, B, M after each sample and the error of the force before it, shape (k, 4)."""
        return self._update(regressors, forces, trajectory=True)

    def force(self, regressor: ArrayLike) -> float:
        """The force that the network gives for displacement, velocity and acceleration, shape (3,) [N]."""
        x = _three(regressor, "regressor")
        signals = self._memory.signals.copy()
        with np.errstate(over="ignore", invalid="ignore"):
            signals[:3] = self.scale * x
            forward(self._net.sizes, self._memory.weights, signals)
            answer = float(self._net.amplitude[0] * signals[-1])
        if not np.isfinite(answer):
            raise InputError(
                f"the network gives no finite force for the regressor {x.tolist()}; give a smaller one"
            )
        return answer

    def probe(
        self,
        displacement: float | None = None,
        velocity: float | None = None,
        acceleration: float | None = None,
    ) -> Probed:
        """K, B and M from four answers of the network, one input more set at a time.

        Args:
            displacement: [m], not 0; as in `values` when left out.
            velocity: [m/s], not 0; likewise.
            acceleration: [m/s^2], not 0; likewise.
        """
        inputs = (displacement, velocity, acceleration)
        chosen = [
            default if value is None else value for value, default in zip(inputs, self.values, strict=True)
        ]
        values = _probe_values(_three(chosen, "values"))
        net = self._net
        memory = self._memory
        answers = ask(net.sizes, memory.weights, net.amplitude, memory.signals.copy(), self.scale, values)
        K, B, M = map(float, answers)
        return Probed(K, B, M, self.force((0.0, 0.0, 0.0)), self._warnings(values))

    def estimate(self) -> Estimate:
        """K, B and M at the probe `values`, with a covariance that is not known: no verdict can be "identified"."""
        p = self.probe()
        theta = np.array([p.stiffness, p.damping, p.mass])
        return Estimate(("K", "B", "M"), theta, np.full((3, 3), np.nan), float(self.samples))

    @property
    def layers(self) -> tuple[Array, ...]:
        """The weights of each layer, shape (n, n_before + 1), thresholds in column 0; copies."""
        return layers_of(self._net.sizes, self._memory.weights.copy())

    def _warnings(self, values: Array) -> tuple[tuple[str, str], ...]:
        if not np.isfinite(self._low).all():
            return ((OUTSIDE, "nothing has been learned yet: update the network first"),)
        return tuple(
            (
                OUTSIDE,
                f"the probe's {name} {v:g} {unit} lies outside what was learned, {low:g} ... {high:g} {unit}",
            )
            for name, unit, v, low, high in zip(CHANNELS, UNITS, values, self._low, self._high, strict=True)
            if not low <= v <= high
        )

    def _update(self, regressors: ArrayLike, forces: ArrayLike, *, trajectory: bool) -> Array:
        phi = cast_array("regressors", regressors, (None, 3))
        y = cast_array("forces", forces, phi.shape[:1])
        out = np.empty((len(y) if trajectory else 0, 4))
        done = self._take(phi, y, out)
        self.samples += done
        if done < len(y):
            raise InputError(
                f"sample {done} is not finite: regressor {phi[done].tolist()}, force {y[done]}; leave it out "
                f"(the {done} before it were taken in)"
            )
        return out

    def _take(self, phi: Array, y: Array, out: Array) -> int:
        return int(self._follow(*self._arguments, phi, y, out))

    @property
    def _arguments(self) -> tuple[Any, ...]:
        net = self._net
        memory = self._memory
        scale = cast_array("scale", self.scale, (3,))
        values = cast_array("values", self.values, (3,))
        return (
            net.sizes,
            memory.weights,
            net.amplitude,
            memory.signals,
            memory.deltas,
            net.learning_rate,
            self._thresholds,
            scale,
            values,
            self._low,
            self._high,
        )

    def _bind(self) -> None:
        self._follow = machine_code(
            _follow, *self._arguments, np.empty((0, 3)), np.empty(0), np.empty((0, 4))
        )

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_follow"}

    def __setstate__(self, known: dict[str, Any]) -> None:
        self.__dict__.update(known)
        self._bind()


def _three(values: ArrayLike, name: str) -> Array:
    array = cast_array(f"{name}, which is {', '.join(CHANNELS)},", values, (3,)).copy()
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, got {array}")
    return array


def _probe_values(values: Array) -> Array:
    if (values == 0.0).any():
        raise InputError(f"a probe divides by its values: none may be 0, got {values}")
    return values


@law
def answer(sizes, weights, signals, x, v, a):
    """The network's output for scaled inputs, without its amplitude."""
    signals[0], signals[1], signals[2] = x, v, a
    forward(sizes, weights, signals)
    return signals[len(signals) - 1]


@law
def absorb(sizes, weights, amplitude, signals, deltas, learning_rate, thresholds, scale, phi, y):
    """One sample: the network answers, learns from its error, and the error before is returned [N]."""
    x, v, a = scale[0] * phi[0], scale[1] * phi[1], scale[2] * phi[2]
    error = y - amplitude[0] * answer(sizes, weights, signals, x, v, a)
    deltas[len(deltas) - 1] = error
    backward(sizes, weights, amplitude, signals, deltas)
    descend(sizes, weights, signals, deltas, learning_rate, thresholds)
    return error


@law
def ask(sizes, weights, amplitude, signals, scale, values):
    """K, B and M by differences of the network's answers (sec. 6.2)."""
    x, v, a = scale[0] * values[0], scale[1] * values[1], scale[2] * values[2]
    pressed = amplitude[0] * answer(sizes, weights, signals, x, 0.0, 0.0)
    moving = amplitude[0] * answer(sizes, weights, signals, x, v, 0.0)
    hastened = amplitude[0] * answer(sizes, weights, signals, x, v, a)
    return pressed / values[0], (moving - pressed) / values[1], (hastened - moving) / values[2]


# More than seven arguments: arrays that are changed in place, each by itself, as Numba has them fastest.
@kernel
def _follow(
    sizes,
    weights,
    amplitude,
    signals,
    deltas,
    learning_rate,
    thresholds,
    scale,
    values,
    low,
    high,
    phi,
    y,
    out,
):
    """Index of the first sample that is not finite, or how many there are."""
    for i in range(len(y)):
        if not abs(phi[i, 0]) + abs(phi[i, 1]) + abs(phi[i, 2]) + abs(y[i]) < _HUGE:
            return i
        for c in range(3):
            low[c], high[c] = min(low[c], phi[i, c]), max(high[c], phi[i, c])
        error = absorb(
            sizes, weights, amplitude, signals, deltas, learning_rate, thresholds, scale, phi[i], y[i]
        )
        if len(out) > 0:
            out[i, 0], out[i, 1], out[i, 2] = ask(sizes, weights, amplitude, signals, scale, values)
            out[i, 3] = error
    return len(y)


SIGNALS = ("displacement", "vx_raw", "ax_measured", "force_measured")
"""Of a bench's record: what the thesis' identifiers are given (sec. 6)."""


def watch(record: Record, probe: NeuralProbe, signals: tuple[str, str, str, str] = SIGNALS) -> Record:
    """Lets the network learn from a run's time in contact, and asks it after every sample.

    Args:
        record: of a bench, or with a column "phase" that is 1 in contact; without one, all of it is contact.
        probe: learns on; its answers are the record's.
        signals: columns of displacement [m], velocity, acceleration and force [N].

    Returns:
        A record with "t" from the first sample in contact, "K", "B", "M" of the probe after each sample, and
        "force_error", what the network's answer lacked before it learned from the sample.

    Raises:
        InputError: no contact in the record, a column that it does not have, samples that are not finite.
    """
    pressing = record["phase"] == 1.0 if "phase" in record.columns else np.ones(len(record), dtype=bool)
    if not pressing.any():
        raise InputError("the record has no contact: nothing to learn from")
    x, v, a, force = (record[name][pressing] for name in signals)
    answers = probe.trajectory(np.column_stack([x, v, a]), force)
    t = record["t"][pressing]
    columns = {"t": t - t[0], **dict(zip(("K", "B", "M", "force_error"), answers.T.copy(), strict=True))}
    units = {"t": "s", "K": "N/m", "B": "N s/m", "M": "kg", "force_error": "N"}
    warnings = [list(w) for w in probe.probe().warnings]
    return Record(columns, units, {**record.meta, "warnings": warnings})
