"""Explanation 7: the continuous least squares that the thesis names as its source, beside its recursive ones."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate.arrays import Array
from palpate.bench import Experiment, with_values
from palpate.errors import InputError
from palpate.identifiers import RecursiveLeastSquares
from palpate.identifiers.estimator import LARGEST, NAMES, VAGUE
from palpate.records import Record
from palpate.report import style
from palpate_thesis.claims import ThesisClaim, claim, often
from palpate_thesis.force_control.panels import panels
from palpate_thesis.least_squares import press_runs
from palpate_thesis.look import Figure
from palpate_thesis.runs import Runs

NUMBER = "continuous-least-squares"
SURFACES: Mapping[str, Experiment] = {
    "foam": with_values(press_runs.PLAIN, {"run.press": press_runs.FIRST}),
    "rubber": with_values(press_runs.RUBBER, {"run.press": press_runs.FIRST}),
}
TICK = 1e-3
START = (0.0, 0.0, 2e5)
LARGE = (1e10, 1e10, 1e10)
"""P(0) of the bench's least squares; of the continuous ones, over a tick, the same trust in the start."""
SCALES = {"p I": (1.0, 1.0, 1.0), "p diag(1, 1e4, 1e8)": (1.0, 1e4, 1e8)}
SIZES = 10.0 ** np.arange(-2, 11)
"""p of P(0) with which Euler's steps are tried."""
SAME, RIGHT = 0.02, 0.10
"""How far the two may be apart; and how far K from f/x, as shares."""
KEYS = "MBK"


class BothIdentifiers(NamedTuple):
    """One press: both identifiers on the same samples, and Euler's steps of the continuous one's equations."""

    recursive: Array  # M, B, K after each sample, shape (k, 3)
    continuous: Array
    simulated: Array  # continuous, of a force that obeys (5.1) in this motion: over the truth, shape (3,)
    ratio: float  # f/x [N/m]
    euler: dict[str, Array]  # K at the end over f/x, by the shape of P(0), over SIZES; NaN: diverged

    @property
    def apart(self) -> Array:
        """Largest difference of M, B and K from half a second on, over their largest size there, shape (3,)."""
        one, other = self.continuous[500:], self.recursive[500:]
        return np.asarray(np.abs(one - other).max(axis=0) / np.abs(other).max(axis=0))

    @property
    def later(self) -> float:
        """Difference of the times from which K keeps within 10 % [s]."""
        times = [press_runs.settled_after(theta[:, 2]) for theta in (self.continuous, self.recursive)]
        return abs(times[0] - times[1])


def compare(record: Record) -> BothIdentifiers:
    """Both identifiers on the first press of a run, with the thesis' own signals."""
    press = press_runs.contact(record)
    phi, force = press_runs.thesis_signals(press)
    surface = record.meta["experiment"]["surface"]
    truth = np.array([surface["mass"], surface["damping"], surface["stiffness"]])
    ratio = press_runs.ratio(press, (press_runs.FIRST - 1.0, press_runs.FIRST))
    return BothIdentifiers(
        press_runs.trajectory(phi, force, START, LARGE),
        continuous(phi, force),
        continuous(phi, phi @ truth)[-1] / truth,
        ratio,
        {name: by_euler(phi, force, scale)[:, 2] / ratio for name, scale in SCALES.items()},
    )


def continuous(phi: Array, force: Array) -> Array:
    """Estimates of `ContinuousLeastSquares` after each sample but the first, which has the start's, shape (k, 3)."""
    nodes = at_nodes(np.column_stack([phi, force]), TICK)
    found = press_runs.trajectory(*nodes, START, [p / TICK for p in LARGE])
    return np.vstack([START, found[1::2]])


def by_euler(phi: Array, force: Array, scale: Sequence[float]) -> Array:
    """Estimates at the end from explicit steps of theta' and P', a tick long, for each of `SIZES`; shape (n, 3)."""
    theta = np.tile(START, (len(SIZES), 1))
    P = SIZES[:, None, None] * np.diag(scale)
    with np.errstate(all="ignore"):
        for row, f in zip(phi, force, strict=True):
            g = P @ row
            theta = theta + TICK * g * (f - theta @ row)[:, None]
            P = P - TICK * g[:, :, None] * g[:, None, :]
    return np.where(np.isfinite(theta), theta, np.nan)


def run(runs: Runs) -> dict[str, list[BothIdentifiers]]:
    """One press a seed on each surface."""
    return runs.by_name(SURFACES, compare)


def check(data: Mapping[str, Sequence[BothIdentifiers]]) -> Sequence[ThesisClaim]:
    """The same as the recursive ones; right in simulation; and whether Euler's steps would do."""
    every = [one for found in data.values() for one in found]
    right = {name: np.array([reaches(one, name) for one in every]) for name in SCALES}
    return [
        *(_same(data, key) for key in "KBM"),
        claim(
            f"{NUMBER}.simulation",
            often(np.abs(one.simulated - 1.0).max() <= SAME for one in every),
            **{key: [100 * abs(one.simulated[i] - 1.0) for one in every] for i, key in enumerate(KEYS)},
            same=SAME,
        ),
        claim(
            f"{NUMBER}.euler",
            bool(np.mean(right["p I"].any(axis=1)) >= 0.9),
            plain=_sizes(right["p I"]),
            scaled=_sizes(right["p diag(1, 1e4, 1e8)"]),
            lowest=SIZES[0],
            highest=SIZES[-1],
            right=RIGHT,
        ),
    ]


def _same(data: Mapping[str, Sequence[BothIdentifiers]], key: str) -> ThesisClaim:
    apart = {name: [100 * one.apart[KEYS.index(key)] for one in found] for name, found in data.items()}
    every = [one for found in data.values() for one in found]
    return claim(
        f"{NUMBER}.{key}",
        all(often(share <= 100 * SAME for share in found) for found in apart.values()),
        **apart,
        key=key,
        later=1e3 * max(one.later for one in every),
        masses=[float(one.continuous[-1, 0]) for one in every],
        same=SAME,
    )


def reaches(one: BothIdentifiers, shape: str) -> Array:
    """With which of `SIZES` Euler's steps come to f/x."""
    return np.asarray(np.abs(one.euler[shape] - 1.0) <= RIGHT)


def _sizes(right: Array) -> str:
    """In words, the sizes of P(0) that do in nine of ten runs."""
    good = [f"{p:.0e}" for p, share in zip(SIZES, right.mean(axis=0), strict=True) if share >= 0.9]
    return f"p = {', '.join(good)}" if good else "no p"


def plot(data: Mapping[str, Sequence[BothIdentifiers]]) -> Figure:
    """M, B and K of both over time; K by Euler's steps over the size of P(0)."""
    drawing, grid = panels([1.9, 1.9, 2.2], 2, 11.0)
    cells = [axis for row in grid for axis in row]
    for (name, (one, *_)), color in zip(data.items(), style.SERIES, strict=False):
        recursive, continuous = one.recursive[30:], one.continuous[30:]
        t = TICK * np.arange(30, len(one.continuous))
        for axis, i, scale in zip(cells, (2, 1, 0), (1e-3, 1.0, 1.0), strict=False):
            axis.plot(t, scale * recursive[:, i], color=color, linewidth=2.6, alpha=0.3, label=name)
            axis.plot(t, scale * continuous[:, i], color=style.INK, linewidth=0.8)
        apart = np.abs(continuous / recursive - 1.0)[:, 2]
        cells[3].semilogy(t, apart, color=color, linewidth=1.0)
        for axis, shape in zip(cells[4:], SCALES, strict=True):
            axis.loglog(SIZES, one.euler[shape], "o-", color=color, linewidth=1.0, markersize=4, label=name)
    labels = ("$K_e$ [kN/m]", "$B_e$ [N s/m]", "$M_e$ [kg]", "difference in $K_e$")
    for axis, label in zip(cells, labels, strict=False):
        axis.set(ylabel=label, xlabel="time since 5 N [s]", xlim=(0.0, press_runs.FIRST))
    cells[0].set_title("pale: recursive; dark: continuous")
    cells[3].set_title("as a share")
    for axis, shape in zip(cells[4:], SCALES, strict=True):
        axis.axhline(1.0, **style.KNOWN)
        axis.set(xlabel="p", ylabel="$K_e$ over f/x", ylim=(0.7, 50.0), xlim=(SIZES[0] / 2, 2e6))
        axis.set_title(f"Euler's steps of 1 ms, P(0) = {shape}; no dot: diverged")
    style.legend(cells[0])
    return drawing


NODES = (0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0))[:, None]
"""Of Gauss and Legendre in a tick: with two of them the integral of a product of two straight lines is exact."""


class ContinuousLeastSquares(RecursiveLeastSquares):
    """Minimises the integral of the squared error over time, not its sum over samples (Kalaycioglu and Brown).

    theta' = P phi (f - phi . theta), P' = rate P - P phi (P phi)^T. Between two samples regressor and force are
    straight lines. There P^-1 and P^-1 theta have integrals in closed form, so that no step can make it unstable.

    When to use it: beside the thesis' source. `RecursiveLeastSquares` with `covariance` x `tick` is its integral by
    rectangles, fifty times as fast, and the same where regressors do not jump from sample to sample.

    Args:
        theta: initial estimate, shape (n,); M, B, K unless others are named.
        covariance: initial P, shape (n, n): of theta, for a force with noise of spectral density 1. As little trust as
            the bench's estimators have, if left out.
        tick: time between two samples [s].
        rate: at which the past is forgotten [1/s]; 0 forgets nothing.
        names: of the parameters, in the order of the regressor.

    Raises:
        InputError: as of `RecursiveLeastSquares`; a tick that is not above 0.
    """

    def __init__(
        self,
        theta: ArrayLike = (0.0, 0.0, 0.0),
        covariance: ArrayLike | None = None,
        tick: float = 1e-3,
        rate: float = 0.0,
        names: tuple[str, ...] = NAMES,
    ):
        if not (math.isfinite(tick) and tick > 0.0 <= rate):
            raise InputError(f"tick must be above 0 and rate 0 or more, got {tick} and {rate}")
        P = np.diag(np.square(VAGUE)) / tick if covariance is None else covariance
        super().__init__(theta, P, math.exp(-rate * tick / 2.0), names)
        self.tick, self._last = tick, np.empty((0, self._n + 1))

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Takes one sample in, a tick after the one before; the first only begins the line to the second."""
        try:
            self.update_many([regressor], [force])  # type: ignore[arg-type]
        except (TypeError, ValueError):
            raise self._refusal(regressor, force) from None

    def update_many(self, regressors: ArrayLike, forces: ArrayLike) -> None:
        """Takes k samples in, all of them or, where one is not finite, none."""
        phi, y = np.array(regressors, dtype=np.float64), np.array(forces, dtype=np.float64)
        if phi.ndim != 2 or phi.shape[1] != self._n or y.shape != phi.shape[:1]:
            raise InputError(
                f"regressors must have shape (k, {self._n}), forces (k,), got {phi.shape}, {y.shape}"
            )
        samples = np.vstack([self._last, np.column_stack([phi, y])])
        if not (np.abs(samples) < LARGEST).all():
            raise InputError("every sample must be finite numbers up to 1e30; leave others out")
        self._last = samples[-1:]
        super().update_many(*at_nodes(samples, self.tick))

    def _worth(self, weight: float) -> Any:
        return weight / len(NODES)


def at_nodes(samples: Array, tick: float) -> tuple[Array, Array]:
    """Regressors, shape (2 (k - 1), n), and forces at the nodes between k samples, shape (k, n + 1), force last.

    The sum of their products is the integral of the products of the lines through the samples.
    """
    lines = samples[:-1, None] + NODES * np.diff(samples, axis=0)[:, None]
    nodes = math.sqrt(tick / len(NODES)) * lines.reshape(-1, samples.shape[1])
    return nodes[:, :-1], nodes[:, -1]
