"""What others' estimators and the thesis' two find in the presses that palpate is judged on, in one table.

    python benchmarks/identification/baselines.py --trials 40      # all presses: twenty minutes on one core
    python benchmarks/identification/baselines.py foam-chirp --trials 200

The presses, the surfaces, the noise and the bound are those of `accuracy.py`. What each row is given:

- palpate, force filter known: `identify` with the force sensor's low-pass and lag, least squares.
- palpate, lag known: `identify` with the lag alone, which here holds the mean wait of a fresh reading for its row too.
- palpate on line: `ContactIdentifier` before recursive least squares or a Kalman filter.
- thesis: recursive least squares as the bench runs it, on the thesis' signals (force through 120 Hz, acceleration
  through 35 Hz, the rest raw) and on raw ones; and the neural identifier with the thesis' scales and probe, from
  weights of the trial's seed, averaged over the last half second. None has an interval.
- padasip, filterpy: from the touch on, each millisecond, the force as it is held; the position, first and second
  differences of the position behind a Butterworth filter of second order and 35 Hz, and a one for the offset. Nothing
  is done about lags: so they are fed where they are called from a loop.
- padasip, filterpy, behind palpate's front-end: with the regressors of `ContactIdentifier`.
- MuJoCo: `mujoco.sysid` is a residual between a model's rollouts and the data under `mujoco.minimize.least_squares`,
  and its reports, which want packages that the lock leaves out. So the row is that residual and that optimiser: a mass
  on a sprung and damped slide joint, driven by the fresh force readings brought forward by the lag, against the
  position; intervals as `mujoco.sysid` has them. It starts from the nominal surface and stays within 1.6 times it.

The two Kalman filters are told the noise of a sample and that parameters walk a millionth of their first doubt in a
root second.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import os
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "online"))
sys.path.insert(0, str(Path(__file__).parent))

from accuracy import CONDITIONS, line
from others import Filterpy, Padasip
from presses import FIELDS, NAMES, Condition, Trial, log_of, press, trial

from palpate.bench import load
from palpate.errors import InputError
from palpate.identification import identify
from palpate.identifiers import ContactIdentifier, KalmanFilter, RecursiveLeastSquares
from palpate.records import Record
from palpate.signals.low_pass import LowPass
from palpate_thesis.neural_identifier import network

Array = NDArray[np.float64]
Found = tuple[dict[str, float], dict[str, float]]
"""Values and standard deviations by parameter; a deviation that a method does not give is not a number."""

PRESSES = ("foam-step", "rubber-step", "foam-chirp", "rubber-chirp")
RATE, SAMPLING, NOISE = 1000.0, 480.0, 0.6  # of the log, of the force sensor [Hz]; of a force sample [N]
TOUCH = 2.0  # [N]
CUTOFF = 35.0  # of what a user takes derivatives of, and knows a touch by [Hz]
ORDER = ("M", "B", "K", "offset")
START, DOUBT = np.zeros(4), np.array([10.0, 1e4, 1e6, 1e3])
WALK = 1e-6 * DOUBT
EVEN = 1e10 * np.eye(4)  # padasip starts from a multiple of the identity: that of the thesis' bench
SUBSTEPS = {"foam": 4, "rubber": 10}  # of Runge-Kutta in a millisecond, stable as far as `ROOM` lets B/M grow
ROOM = 1.6  # the factor that MuJoCo's parameters stay within
SETTLING = 0.1  # after the first reading that MuJoCo is not judged on [s]
MUJOCO = "MuJoCo, rollouts under minimize"


class Told(Filterpy):
    """filterpy's Kalman filter, with its covariance."""

    @property
    def covariance(self) -> Array:
        """P, shape (4, 4)."""
        return np.asarray(self._filter.P)


@dataclass(frozen=True)
class Case:
    """One press, as the methods are given it.

    Args:
        record: of the bench.
        material: "foam" or "rubber".
        low_pass, lag: of the force sensor; the lag of a fresh reading, low-pass included [s].
        seed: of the trial.
    """

    record: Record
    material: str
    low_pass: LowPass
    lag: float
    seed: int

    @property
    def log(self) -> Record:
        """Time, position and force."""
        return log_of(self.record)

    @property
    def waited(self) -> float:
        """The lag of a reading in its row: a fresh one has waited for the row by half a row in the mean [s]."""
        return self.lag + 0.5 / RATE

    @property
    def touched(self) -> int:
        """The first row in contact, for those who find it themselves."""
        return int(np.argmax(smoothed(self.record["force_sampled"]) > TOUCH))


def smoothed(signal: Array) -> Array:
    """Behind a Butterworth filter of second order, from rest."""
    from scipy.signal import butter, lfilter

    return np.asarray(lfilter(*butter(2, CUTOFF, fs=RATE), signal - signal[0])) + signal[0]


def by_identify(case: Case) -> Found:
    """`identify` that is told the lag only."""
    found = identify(case.log, model="kelvin-voigt-mass", lag=case.waited).estimate
    if found is None:
        raise InputError("no contact was found")
    return _named(found.names, found.theta, found.std)


def on_line(case: Case, estimator: Any) -> Any:
    """The estimator after the press, behind palpate's front-end."""
    loop = ContactIdentifier(
        case.low_pass, RATE, case.lag, sampling=SAMPLING, touch=TOUCH, estimator=estimator
    )
    log = case.log
    loop.update_many(log["position"], log["force"])
    return estimator


def as_called(case: Case, estimator: Any) -> Any:
    """The estimator after the press, behind the front-end of whoever has none."""
    log, begin = case.log, case.touched
    x, force = log["position"], log["force"]
    v = np.diff(smoothed(x), prepend=x[0]) * RATE
    a = np.diff(v, prepend=0.0) * RATE
    phi = np.column_stack([a, v, x - x[begin], np.ones_like(x)])
    estimator.update_many(phi[begin:], force[begin:])
    return estimator


def by_squares(case: Case, fed: Callable[[Case, Any], Any]) -> Found:
    """palpate's recursive least squares."""
    found = fed(case, RecursiveLeastSquares(START, np.diag(DOUBT**2), names=ORDER)).estimate()
    return _named(found.names, found.theta, found.std)


def by_kalman(case: Case, fed: Callable[[Case, Any], Any]) -> Found:
    """palpate's Kalman filter."""
    estimator = KalmanFilter(START, np.diag(DOUBT**2), WALK, 1 / SAMPLING, NOISE, ORDER)
    found = fed(case, estimator).estimate()
    return _named(found.names, found.theta, found.std)


def by_padasip(case: Case, fed: Callable[[Case, Any], Any]) -> Found:
    """padasip's recursive least squares."""
    return _named(ORDER, fed(case, Padasip(START, EVEN, 1.0)).theta, np.full(4, np.nan))


def by_filterpy(case: Case, fed: Callable[[Case, Any], Any], rate: float) -> Found:
    """filterpy's Kalman filter, a sample each 1/rate."""
    found = fed(case, Told(START, np.diag(DOUBT**2), WALK, 1 / rate, NOISE))
    return _named(ORDER, found.theta, np.sqrt(np.diag(found.covariance)))


def by_thesis(case: Case, front: str) -> Found:
    """What the bench's own recursive least squares say at the end of the press."""
    return {name: float(case.record[f"{name}_{front}"][-1]) for name in NAMES}, _unknown()


def by_network(case: Case) -> Found:
    """The thesis' neural identifier."""
    seen = network.press_of(case.record, case.material)
    _, answers = network.learn(seen, network.NetworkChoice(), case.seed)
    late = answers[-round(network.LATE / network.TICK) :, :3].mean(axis=0)
    return dict(zip(NAMES, late.tolist(), strict=True)), _unknown()


class Rollouts:
    """A mass on a spring and a damper in MuJoCo, driven by the force that was read, against the position.

    Parameters: K, B and M over their nominal values, and where the spring rests [mm].

    Args:
        case: the press.
    """

    def __init__(self, case: Case):
        import mujoco

        log, steps = case.log, SUBSTEPS[case.material]
        begin = case.touched
        t, x, force = (log[name][begin:] for name in ("time", "position", "force"))
        fresh = np.flatnonzero(np.diff(log["force"], prepend=np.nan) != 0)
        middles = t[0] + (np.arange((len(t) - 1) * steps) + 0.5) / (RATE * steps)
        self._drive = np.interp(middles, log["time"][fresh] - case.waited, log["force"][fresh])
        self._position, self._steps = x - x[0], steps
        self._first = round(SETTLING * RATE)
        surface = load(f"{case.material}-hybrid").surface
        self.nominal = np.array([getattr(surface, FIELDS[name]) for name in NAMES])
        self.start = np.array([1.0, 1.0, 1.0, 1e3 * (self._position.mean() - force.mean() / self.nominal[0])])
        self.bounds = (
            np.array([1 / ROOM, 1 / ROOM, 1 / ROOM, self.start[3] - 10.0]),
            np.array([ROOM, ROOM, ROOM, self.start[3] + 10.0]),
        )
        off = " ".join(f'{name}="disable"' for name in ("contact", "constraint", "sensor"))
        self._model = mujoco.MjModel.from_xml_string(
            f"""<mujoco><option gravity="0 0 0" timestep="{1 / (RATE * steps)}" integrator="RK4"><flag {off}/></option>
            <worldbody><body><joint name="x" type="slide" axis="1 0 0" stiffness="1" damping="1"/>
            <geom type="sphere" size="0.01" mass="1"/></body></worldbody>
            <actuator><motor joint="x"/></actuator></mujoco>"""
        )
        self._data = mujoco.MjData(self._model)

    def __call__(self, parameters: Array) -> Array:
        """Simulated less measured position over the measured one's deviation; shapes (4, k) to (m, k)."""
        return np.column_stack([self._residual(p) for p in parameters.T])

    def _residual(self, p: Array) -> Array:
        import mujoco
        from mujoco import rollout

        (K, B, M), model = p[:3] * self.nominal, self._model
        model.jnt_stiffness[0], model.dof_damping[0], model.body_mass[1] = K, B, M
        model.qpos_spring[0] = 1e-3 * p[3]
        mujoco.mj_setConst(model, self._data)  # the mass matrix of a body on its own is a constant to MuJoCo
        state = np.zeros((1, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
        states, _ = rollout.rollout(model, self._data, state, self._drive[None, :, None])
        simulated = states[0, self._steps - 1 :: self._steps, 1]
        return ((simulated - self._position[1:]) / self._position.std())[self._first :]


def by_rollouts(case: Case) -> Found:
    """MuJoCo's optimiser on MuJoCo's rollouts."""
    from mujoco import minimize

    rollouts = Rollouts(case)
    best, trace = minimize.least_squares(
        rollouts.start,
        rollouts,
        rollouts.bounds,
        xtol=1e-4,
        gtol=1e-6,
        max_iter=30,
        verbose=minimize.Verbosity.FULLITER,  # which alone keeps the Jacobian
        output=io.StringIO(),
    )
    J = next(step.jacobian for step in reversed(trace) if step.jacobian is not None)
    left = rollouts(best.reshape(-1, 1)).ravel()
    variance = left @ left / (len(left) - len(best))
    std = np.sqrt(variance * np.diag(np.linalg.inv(J.T @ J)))
    scale = rollouts.nominal
    return _named(NAMES, best.ravel()[:3] * scale, std[:3] * scale)


METHODS: dict[str, Callable[[Case], Found]] = {
    "palpate, lag known": by_identify,
    "palpate on line, least squares": partial(by_squares, fed=on_line),
    "palpate on line, Kalman filter": partial(by_kalman, fed=on_line),
    "thesis, least squares": partial(by_thesis, front="thesis"),
    "thesis, least squares, raw signals": partial(by_thesis, front="raw"),
    "thesis, network": by_network,
    "padasip RLS": partial(by_padasip, fed=as_called),
    "padasip RLS behind palpate's front-end": partial(by_padasip, fed=on_line),
    "filterpy Kalman": partial(by_filterpy, fed=as_called, rate=RATE),
    "filterpy Kalman behind palpate's front-end": partial(by_filterpy, fed=on_line, rate=SAMPLING),
    MUJOCO: by_rollouts,
}
MATCHED = "palpate, force filter known"


def trials(condition: Condition, seed: int, skipped: tuple[str, ...]) -> dict[str, Trial]:
    """One press, put to every method; a method that refuses it finds no numbers."""
    matched = trial(condition, seed)
    record, low_pass, lag = press(condition, seed)
    case = Case(record, condition.experiment.split("-")[0], low_pass, lag, seed)
    found = {MATCHED: matched}
    for name, method in METHODS.items():
        if name not in skipped:
            value, std = _or_none(method, case)
            found[name] = replace(matched, value=value, std=std, verdict={}, robust={}, codes=())
    return found


def _or_none(method: Callable[[Case], Found], case: Case) -> Found:
    try:
        return method(case)
    except InputError:
        return _unknown(), _unknown()


def _named(names: tuple[str, ...], theta: Array, std: Array) -> Found:
    return dict(zip(names, theta.tolist(), strict=True)), dict(zip(names, std.tolist(), strict=True))


def _unknown() -> dict[str, float]:
    return dict.fromkeys(NAMES, math.nan)


def main() -> None:
    """Run the presses asked for and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("presses", nargs="*", default=list(PRESSES), metavar="PRESS")
    parser.add_argument("--trials", type=int, default=40)
    parser.add_argument(
        "--mujoco-trials", type=int, default=8, help="the first so many: each takes ten seconds or more"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the first trial")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--json", type=Path, help="write every figure there")
    asked = parser.parse_args()
    unknown = set(asked.presses) - set(PRESSES)
    if unknown:
        parser.error(f"no press {', '.join(sorted(unknown))}; there are: {', '.join(PRESSES)}")
    seeds = range(asked.seed, asked.seed + asked.trials)
    skipped = [() if i < asked.mujoco_trials else (MUJOCO,) for i in range(len(seeds))]
    print(f"{asked.trials} trials each, seeds {seeds[0]} to {seeds[-1]}; 'cover': of 95 % intervals")
    print(
        f"{'':44}{'trials':>7}{'failed':>7}{'':>4}{'rms/bound':>11}{'bias/rms':>10}{'rms/truth':>11}"
        f"{'bound/truth':>13}{'cover':>8}"
    )
    figures = {}
    with ProcessPoolExecutor(asked.workers, mp_context=get_context("spawn")) as pool:
        for name in asked.presses:
            found = list(pool.map(trials, [CONDITIONS[name]] * len(seeds), seeds, skipped))
            figures[name] = _show(name, found)
    if asked.json:
        asked.json.write_text(json.dumps(figures, indent=1))


def _show(name: str, found: list[dict[str, Trial]]) -> dict[str, list[dict[str, Any]]]:
    print(name)
    return {
        method: _rows(method, [t[method] for t in found if method in t]) for method in (MATCHED, *METHODS)
    }


def _rows(method: str, tried: list[Trial]) -> list[dict[str, Any]]:
    there = [t for t in tried if all(math.isfinite(t.value[name]) for name in NAMES)]
    failed, rows = len(tried) - len(there), []
    for name in NAMES if there else ():
        row = line(name, there)
        bound = float(np.sqrt(np.mean([(t.bound[name] / t.truth[name]) ** 2 for t in there])))
        told = all(math.isfinite(t.std[name]) for t in there)
        rows.append({**vars(row), "failed": failed, "relative_bound": bound})
        if not told:
            rows[-1] |= {"coverage": None, "width": None}
        title = f"  {method:42}{len(tried):7}{failed:7}" if name == NAMES[0] else " " * 58
        cover = f"{row.coverage:8.0%}" if told else f"{'-':>8}"
        print(f"{title}{name:>4}{row.rms:11.3g}{row.bias:10.2f}{row.relative:11.2%}{bound:13.2%}{cover}")
    if not there:
        print(f"  {method:42}{len(tried):7}{failed:7}")
    return rows


if __name__ == "__main__":
    main()
