"""Position and force in, mass, damping and stiffness out, a reading at a time: the on-line twin of an identification.

The position is read through the force sensor's own low-pass at the instants of the sensor's samples, with the weights
that `palpate.identification` uses for a log, so that a stream and a log of it give the same regressors.
"""

from math import ceil
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from palpate._jit import kernel
from palpate._jit.typed_edge import cast_array, cast_number, machine_code
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.identifiers import contact_state, contact_stream, octave_sums
from palpate.identifiers.contact_stream import take_tick
from palpate.identifiers.octave_fit import octave_fit
from palpate.identifiers.octave_sums import LineNoise
from palpate.identifiers.octave_system import OctaveData
from palpate.records import Readable
from palpate.signals.low_pass import FRACTIONS, LowPass, taps
from palpate.signals.types import Estimate

NAMES = ("M", "B", "K", "offset")
PASSIVE = NAMES[:3]
"""No passive surface has one of these below zero."""
_SETTLING_TIMES = 10.0
"""Times the low-pass' slowest mode falls by e until what was before is forgotten."""
_PRIOR_STDS = np.array([10.0, 1e4, 1e6, 1e3])
"""Deviation of each parameter before anything is known [kg], [N s/m], [N/m], [N]."""

MAX_POSITION, MAX_FORCE = 1e3, 1e6
"""Largest position [m] and force [N] that are readings of a sensor."""
FASTEST = contact_stream.FASTEST

_MAX_PRIOR_STDS = 10.0
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
            judged = contact_stream.AHEAD * max(settings[contact_stream.PERIOD], 1.0)
            settings[contact_stream.HOLD] += max(window.after - settings[contact_stream.LATE], judged)
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
        state = self._state
        filter_wait = state[contact_stream.AFTER] - state[contact_stream.LATE]
        decision_wait = contact_stream.AHEAD * max(state[contact_stream.PERIOD], 1.0)
        return max(ceil(filter_wait), ceil(state[contact_stream.HOLD]), ceil(decision_wait))

    @property
    def in_contact(self) -> bool:
        """True if the tip is in contact, `delay` ticks ago at the latest."""
        return bool(self._contact[contact_state.TOUCHING])

    @property
    def contacts(self) -> int:
        """Number of contacts so far."""
        return int(self._contact[contact_state.CONTACTS])

    @property
    def samples(self) -> int:
        """Number of samples in contact so far."""
        return int(self._sums[octave_sums.SEEN])

    def update(self, position: float, force: float) -> None:
        """Takes in a tick's position [m], growing into the surface, and force on the surface [N].

        A reading that is missing is NaN, and keeps its place: short gaps of the position are filled, longer ones cost
        the samples about them. A position that jumps faster than `FASTEST` is a missing one, unless the next confirms
        it.

        Raises:
            InputError: a number out of the range of any sensor; the estimate is unchanged.
        """
        position = cast_number("position", position)
        force = cast_number("force", force)
        if abs(position) > MAX_POSITION or abs(force) > MAX_FORCE:
            raise InputError(
                f"a tick must be finite, a position within {MAX_POSITION:g} m and a force within {MAX_FORCE:g} N, "
                f"got position {position}, force {force}; in its place call skip()"
            )
        count = self._one(self._state, self._weights, position, force, self._out)
        if count and self.estimator is not None:
            for row in self._out[:count]:
                self.estimator.update(row[:4], float(row[4]))

    def skip(self) -> None:
        """Takes in a tick that has no readings: it keeps its place in time."""
        self.update(np.nan, np.nan)

    def update_many(self, positions: ArrayLike, forces: ArrayLike) -> None:
        """Takes k ticks in, as k calls of `update` would: positions and forces of shape (k,)."""
        x = cast_array("positions", positions, (None,))
        f = cast_array("forces", forces, x.shape)
        for position, force in zip(x.tolist(), f.tolist(), strict=True):
            self.update(position, force)

    def estimate(self) -> Estimate:
        """M, B, K and the offset, with all that is known to make them uncertain, and whether the model holds.

        Where the force stands at the end of its range, contact is never kept for long enough, or a test of
        `octave_fit` fails, the estimate is `rejected`, with the reason.
        """
        given = self.estimator.estimate() if self.estimator is not None else None
        sample_limit = given.samples if given is not None else np.inf
        contact = self._contact
        track = self._track
        data = OctaveData(
            self._sums,
            self._lines,
            max(float(contact[contact_state.POWER]), float(contact[contact_state.QUANTUM]) ** 2 / 12),
            contact_stream.step_in(track),
            _PRIOR_STDS,
            self._lag_error,
            float(self.contacts),
        )
        fit = octave_fit(data, sample_limit)
        if given is None:
            theta = fit.theta if fit is not None else np.zeros(4)
            covariance = fit.covariance if fit is not None else np.diag(_PRIOR_STDS**2)
            samples = fit.system.samples if fit is not None else float(self.samples)
        else:
            theta = given.theta
            covariance = given.covariance
            if fit is not None:
                theta, added_covariance = fit.without_position_noise(given.theta, _PRIOR_STDS)
                covariance = covariance + fit.open + added_covariance
            samples = given.samples
        refused = self._refusal(theta) or (fit.rejected if fit is not None else "")
        return Estimate(NAMES, theta, covariance, samples, refused, passive=PASSIVE)

    @property
    def _lag_error(self) -> float:
        """Standard deviation of the lag, with the phase of the sensor's clock [s]."""
        state = self._state
        clock = self._state[contact_stream.AT_CLOCK : contact_stream.AT_POSITIONS]
        if not state[contact_stream.PERIOD]:
            return self.lag_std
        phase_width = min(clock[contact_stream.HIGH] - clock[contact_stream.LOW], 1.0)
        return float(np.hypot(self.lag_std, phase_width / self.rate / np.sqrt(12)))

    def _refusal(self, theta: Array) -> str:
        """Why none of the numbers can be trusted, whatever the fit says; empty if nothing speaks against them."""
        for name, value, largest in zip(NAMES, theta, _MAX_PRIOR_STDS * _PRIOR_STDS, strict=True):
            if abs(value) > largest:
                return f"{name} is beyond that of any contact: check the units of position and force"
        contact = self._contact
        if contact[contact_state.LIMITED]:
            return f"the force stands at {contact[contact_state.HIGHEST]:.4g} N while the tip moves on: it is saturated"
        if self.samples < octave_sums.ROWS and contact[contact_state.LOST] > 0:
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
        self._one = machine_code(_one, self._state.copy(), self._weights, 0.0, 0.0, self._out)

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
    settling = _SETTLING_TIMES / low_pass.decay * rate
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
    layout = contact_stream
    room = int(settings[layout.ROOM])
    queue = int(settings[layout.QUEUE])
    loop_state = np.zeros(layout.OWN)
    clock = np.array(contact_stream.UNSET)
    track = np.zeros(contact_stream.NUMBERS)
    loop_state[[layout.ORIGIN, layout.FORCE]], loop_state[layout.FRESH] = np.nan, -2.0
    track[[contact_stream.ROW, contact_stream.RESOLVED, contact_stream.GOOD, contact_stream.OPEN]] = -1.0
    track[contact_stream.LAST_SIXTH] = np.nan
    contact = np.zeros(contact_state.FIELDS)
    for place in (contact_state.KNOWN, contact_state.CERTAIN):
        contact[place + 4 : place + 20] = np.diag(_PRIOR_STDS).ravel()
    ring = np.full(2 * room, np.nan)
    parts = [settings, loop_state, clock, track, contact, octave_sums.no_sums(), ring]
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
