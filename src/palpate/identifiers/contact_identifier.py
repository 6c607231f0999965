"""Position and force in, mass, damping and stiffness out, a reading at a time: the on-line twin of an identification.

The position is read through the force sensor's own low-pass at the instants of the sensor's samples, with the weights
that `palpate.identification` uses for a log, so that a stream and a log of it give the same regressors.
"""

from math import ceil
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identifiers.estimator import entry
from palpate.identifiers.kernels import contact_state, contact_stream, octave_sums
from palpate.identifiers.kernels.contact_stream import take_tick
from palpate.identifiers.kernels.octave_sums import LineNoise
from palpate.identifiers.octave_fit import octave_fit
from palpate.identifiers.octave_system import OctaveData
from palpate.records import Readable
from palpate.signals.low_pass import FRACTIONS, LowPass, taps
from palpate.signals.types import Estimate

NAMES = ("M", "B", "K", "offset")
PASSIVE = NAMES[:3]
"""No passive surface has one of these below zero."""
_FORGOTTEN = 10.0
"""Times the low-pass' slowest mode falls by e until what was before is forgotten."""
_VAGUE = np.array([10.0, 1e4, 1e6, 1e3])
"""Deviation of each parameter before anything is known [kg], [N s/m], [N/m], [N]."""

FARTHEST, STRONGEST = 1e3, 1e6
"""Largest position [m] and force [N] that are readings of a sensor."""
FASTEST = contact_stream.FASTEST

_RANGE = 10.0
"""Deviations of the prior within which a contact's parameters are."""


class Estimator(Protocol):
    """An estimator that takes the regressors: any of `palpate.identifiers`."""

    def update(self, regressor: ArrayLike, force: float) -> None:
        """Take one sample in."""

    def estimate(self) -> Estimate:
        """The estimate of the samples so far."""


class ContactIdentifier(Readable):
    """Identifies a contact on line from what a control loop has: a position and a force each tick.

    When to use it: the force sensor's low-pass and lag are known, and the loop runs at an even rate. What it says of
    a tick, it says some ticks later (`delay`): to read the position at an instant takes its neighbours on both sides.

    Args:
        low_pass: of the force sensor, or its text, as `butterworth3:120`.
        rate: ticks a second [Hz].
        lag: how much later a fresh force reading stands in the loop than the force it measured, the low-pass
            included [s].
        lag_std: standard deviation of that calibration [s].
        sampling: samples of the force sensor a second [Hz]; None if each tick has a fresh one.
        touch: force above which the tip is in contact, and half of which it is again free below [N]; 0 if it never
            leaves the surface; None has contact found, and its loss, from position and force (`contact_state`).
        estimator: of `NAMES`, four regressors, for a surface that changes; None for least squares that forget nothing,
            noise of the position taken out.

    Raises:
        InputError: a low-pass of less than second order, a rate that is too low for it, a number out of range.
    """

    def __init__(
        self,
        low_pass: LowPass | str,
        rate: float,
        lag: float,
        *,
        lag_std: float = 0.0,
        sampling: float | None = None,
        touch: float | None = None,
        estimator: Estimator | None = None,
    ):
        self.low_pass = LowPass.parse(low_pass) if isinstance(low_pass, str) else low_pass
        _check(self.low_pass, rate, lag, lag_std, sampling, touch)
        self.rate, self.lag_std, self.touch, self.estimator = rate, lag_std, touch, estimator
        dt = 1 / rate
        window = taps(self.low_pass, dt, 3)
        self._weights = np.ascontiguousarray(window.weights[:, ::-1] / np.array([dt**2, dt, 1.0])[:, None])
        self._lines = LineNoise.of(self._weights[FRACTIONS // 2], dt, 1 / (sampling or rate))
        settings = _settings(self.low_pass, rate, lag, sampling, touch)
        settings[[contact_stream.BEFORE, contact_stream.AFTER]] = window.before, window.after
        if settings[contact_stream.HOLD] > 0:  # contact is decided when the regressor is there
            settings[contact_stream.HOLD] += max(window.after - settings[contact_stream.LATE], 0.0)
        room = (
            self._weights.shape[2]
            + ceil(abs(settings[contact_stream.LATE]))
            + ceil(settings[contact_stream.HOLD])
        )
        settings[contact_stream.ROOM] = room = 2 * room + int(settings[contact_stream.GAP]) + 8
        settings[contact_stream.QUEUE] = 2 * room
        self._state = _state(settings)
        self._out = np.empty((2 * room, 5))
        self._bind()

    @property
    def delay(self) -> int:
        """Ticks between a reading and its part in the estimate, where none is missing."""
        s = self._state
        waits = s[contact_stream.AFTER] - s[contact_stream.LATE]
        return max(ceil(waits), ceil(s[contact_stream.HOLD]), 0)

    @property
    def in_contact(self) -> bool:
        """Whether the tip is in contact, `delay` ticks ago at the latest."""
        return bool(self._contact[contact_state.TOUCHING])

    @property
    def contacts(self) -> int:
        """How many contacts there were."""
        return int(self._contact[contact_state.CONTACTS])

    @property
    def samples(self) -> int:
        """How many samples came through."""
        return int(self._sums[octave_sums.SEEN])

    def update(self, position: float, force: float) -> None:
        """Takes in a tick's position [m], growing into the surface, and force on the surface [N].

        A reading that is missing is NaN, and keeps its place: short gaps of the position are filled, longer ones cost
        the samples about them. A position that jumps faster than `FASTEST` is a missing one, unless the next confirms
        it.

        Raises:
            InputError: a number out of the range of any sensor; the estimate is unchanged.
        """
        if abs(position) > FARTHEST or abs(force) > STRONGEST:
            raise InputError(
                f"a tick must be finite, a position within {FARTHEST:g} m and a force within {STRONGEST:g} N, "
                f"got position {position}, force {force}; in its place call skip()"
            )
        taken = self._one(self._state, self._weights, position, force, self._out)
        if taken and self.estimator is not None:
            for row in self._out[:taken]:
                self.estimator.update(row[:4], float(row[4]))

    def skip(self) -> None:
        """Takes in a tick that has no readings: it keeps its place in time."""
        self.update(np.nan, np.nan)

    def update_many(self, positions: ArrayLike, forces: ArrayLike) -> None:
        """Takes k ticks in, as k calls of `update` would: positions and forces of shape (k,)."""
        x, f = np.asarray(positions, dtype=np.float64), np.asarray(forces, dtype=np.float64)
        if x.ndim != 1 or x.shape != f.shape:
            raise InputError(f"positions and forces must have one shape (k,), got {x.shape} and {f.shape}")
        for position, force in zip(x.tolist(), f.tolist(), strict=True):
            self.update(position, force)

    def estimate(self) -> Estimate:
        """M, B, K and the offset, with all that is known to make them uncertain, and whether the model holds.

        Where the force stands at the end of its range, contact is never kept for long enough, or a test of
        `block_fit` fails, the estimate is `rejected`, with the reason.
        """
        own = self.estimator.estimate() if self.estimator is not None else None
        since = own.samples if own is not None else np.inf
        c, track = self._contact, self._track
        data = OctaveData(
            self._sums,
            self._lines,
            max(float(c[contact_state.POWER]), float(c[contact_state.QUANTUM]) ** 2 / 12),
            contact_stream.step_in(track),
            _VAGUE,
            self._lag_error,
            float(self.contacts),
        )
        fit = octave_fit(data, since)
        if own is None:
            theta = fit.theta if fit is not None else np.zeros(4)
            covariance = fit.covariance if fit is not None else np.diag(_VAGUE**2)
            worth = fit.system.samples if fit is not None else float(self.samples)
        else:
            theta, covariance = own.theta, own.covariance
            if fit is not None:
                theta, opened = fit.without_position_noise(own.theta, _VAGUE)
                covariance = covariance + fit.open + opened
            worth = own.samples
        refused = self._refusal(theta) or (fit.rejected if fit is not None else "")
        return Estimate(NAMES, theta, covariance, worth, refused, passive=PASSIVE)

    @property
    def _lag_error(self) -> float:
        """Standard deviation of the lag, with the phase of the sensor's clock [s]."""
        s, clock = self._state, self._state[contact_stream.AT_CLOCK : contact_stream.AT_POSITIONS]
        if not s[contact_stream.PERIOD]:
            return self.lag_std
        between = min(clock[contact_stream.HIGH] - clock[contact_stream.LOW], 1.0)
        return float(np.hypot(self.lag_std, between / self.rate / np.sqrt(12)))

    def _refusal(self, theta: Array) -> str:
        """Why none of the numbers can be trusted, whatever the fit says; empty if nothing speaks against them."""
        for name, value, most in zip(NAMES, theta, _RANGE * _VAGUE, strict=True):
            if abs(value) > most:
                return f"{name} is beyond that of any contact: check the units of position and force"
        c = self._contact
        if c[contact_state.LIMITED]:
            return f"the force stands at {c[contact_state.HIGHEST]:.4g} N while the tip moves on: it is saturated"
        if self.samples < octave_sums.ROWS and c[contact_state.LOST] > 0:
            return "contact is lost again before the low-pass has settled"
        return ""

    @property
    def _contact(self) -> Array:
        return self._state[contact_stream.AT_CONTACT : contact_stream.AT_SUMS]

    @property
    def _track(self) -> Array:
        return self._state[contact_stream.AT_POSITIONS : contact_stream.AT_CONTACT]

    @property
    def _sums(self) -> Array:
        return self._state[contact_stream.AT_SUMS : contact_stream.AT_RING]

    def _bind(self) -> None:
        self._one = entry(_one, self._state.copy(), self._weights, 0.0, 0.0, self._out)

    def __getstate__(self) -> dict[str, Any]:
        return {
            name: value.copy() if name == "_state" else value
            for name, value in self.__dict__.items()
            if name not in ("_one", "_out")
        }

    def __setstate__(self, known: dict[str, Any]) -> None:
        self.__dict__.update(known)
        self._out = np.empty((int(self._state[contact_stream.QUEUE]), 5))
        self._bind()


def _settings(
    low_pass: LowPass, rate: float, lag: float, sampling: float | None, touch: float | None
) -> Array:
    """The settings of `contact_stream`, but for those of the taps and the room."""
    settings = np.zeros(contact_stream.SETTINGS)
    settling = _FORGOTTEN / low_pass.decay * rate
    settings[contact_stream.GAP] = max(ceil(rate / (2 * low_pass.cutoff)) - 1, 0)
    settings[contact_stream.PERIOD] = 0.0 if sampling is None else rate / sampling
    settings[contact_stream.LATE] = (lag - low_pass.lag) * rate
    settings[contact_stream.SETTLING] = settling
    settings[contact_stream.HOLD] = 0.0 if touch == 0 else 2 * settling if touch else settling
    settings[contact_stream.TOUCH] = -1.0 if touch is None else touch
    settings[contact_stream.AVERAGED] = ceil(settling * (sampling or rate) / rate)
    settings[contact_stream.DT] = 1 / rate
    return settings


def _state(settings: Array) -> Array:
    """The state before the first tick."""
    s = contact_stream
    room, queue = int(settings[s.ROOM]), int(settings[s.QUEUE])
    own, clock, track = np.zeros(s.OWN), np.array(contact_stream.UNSET), np.zeros(contact_stream.NUMBERS)
    own[[s.ORIGIN, s.FORCE]], own[s.FRESH] = np.nan, -2.0
    track[[contact_stream.ROW, contact_stream.RESOLVED, contact_stream.GOOD, contact_stream.OPEN]] = -1.0
    track[contact_stream.LAST_SIXTH] = np.nan
    contact = np.zeros(contact_state.FIELDS)
    for at in (contact_state.KNOWN, contact_state.CERTAIN):
        contact[at + 4 : at + 20] = np.diag(_VAGUE).ravel()
    ring = np.full(2 * room, np.nan)
    parts = [settings, own, clock, track, contact, octave_sums.no_sums(), ring]
    return np.concatenate([*parts, np.zeros(queue * contact_state.SAMPLE)])


@kernel
def _one(state, weights, x, force, out):
    return take_tick(state, weights, x, force, out)


def _check(
    low_pass: LowPass, rate: float, lag: float, lag_std: float, sampling: float | None, touch: float | None
) -> None:
    if low_pass.roll_off < 2:
        raise InputError(f"the low-pass must be of second order at least, got {low_pass}")
    if not 4 * low_pass.cutoff <= rate < np.inf:
        raise InputError(
            f"the rate must be at least four times the cut-off of {low_pass.cutoff:g} Hz, got {rate:g} Hz"
        )
    for name, value in (("lag", lag), ("lag_std", lag_std)):
        if not 0 <= value < np.inf:
            raise InputError(f"the {name} must be a number of seconds from 0, got {value:g}")
    if sampling is not None and not 0 < sampling <= rate:
        raise InputError(f"sampling must be above 0 and at most the rate of {rate:g} Hz, got {sampling:g}")
    if touch is not None and not 0 <= touch < np.inf:
        raise InputError(f"touch must be a force of 0 N or more, got {touch:g}")
