"""The cautious law in a user's own control loop: force and position in, speed out, a tick at a time."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate._jit import kernel, law
from palpate.errors import InputError
from palpate.files import write_text
from palpate.force.contact_evidence import AIR
from palpate.force.flat import (
    BOUND,
    FOUND,
    LAST,
    PHASE,
    SINCE,
    STATE,
    STD,
    TIDE,
    VARIANCE,
    flattened,
    law_in,
    put_state,
    state_in,
)
from palpate.force.gains import Gains, load_gains
from palpate.force.stage import LEARNING, LOCKED

if TYPE_CHECKING:
    from palpate.force.certificate import Certificate


PHASES = {AIR: "air", LEARNING: "learning", LOCKED: "locked"}
FINE, BLIND, STALE, SATURATED, LIMITED, LATE, UNREACHED, PULLED = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0
TROUBLES = {
    FINE: "",
    BLIND: "a reading was no number: the tip was held",
    STALE: "the force reading has not changed for longer than the loop's lag: the tip was held; "
    "the sensor, or what reads it, stands still (a simulated one needs noise)",
    SATURATED: "the force sensor is at the end of its scale: the tip withdrew",
    LIMITED: "the force is above its limit: the tip withdrew",
    LATE: "ticks were missed: nothing was learned from them",
    UNREACHED: "the force asked for cannot be reached: the command went three times as far as that takes; "
    "a motor is at its limit, or something blocks the tip: it was held",
    PULLED: "the force is negative beyond its noise: its sign is turned, or the sensor was not tared in the air; "
    "the tip was held",
}
FARTHEST = 3.0
"""Of the way to F_d on the surface as it is known, that a command may go without the force coming nearer.

Measured by benchmarks/force/in_vain.py: where nothing is wrong it is a third of that way at most; the proof lets the
stiffness be wrong by a factor of 2, and half of that again is room for friction.
"""
LEAST = 8.0
"""Standard deviations of the noise: the least force that may be asked for, and the least that counts as a pull."""
NEAR = 0.05
"""Of F_d: an error that counts, and a change of the force that starts the count anew; the band of what is settled."""
# Behind the law's own state: ticks without a good reading, ticks since the reading changed, the trouble of this tick,
# how far the command has gone in vain [N], and from which force.
_BLIND, _UNCHANGED, _TROUBLE, _VAIN, _FROM, EXTRA = STATE, STATE + 1, STATE + 2, STATE + 3, STATE + 4, 5


@law
def safe_step(numbers, state, desired, force, position, missed):
    """One tick, with a safe answer to everything that is no reading: the speed [m/s]; the state changes in place."""
    control = law_in(numbers)
    lag = control.theta / control.tick
    if not (abs(force) < inf and abs(position) < inf):
        state[_BLIND] += 1.0
        state[_TROUBLE] = BLIND
        return 0.0
    if state[_BLIND] > lag or missed > lag:  # too long to go on from what was known
        renewed(control, state)
    elif state[_BLIND] > 0.0 or missed > 0.0:
        state[SINCE] = 0.0  # the low-pass has to forget the gap before anything is learned
    trouble = LATE if missed > 0.0 or state[_BLIND] > 0.0 else FINE
    state[_BLIND] = 0.0
    state[_UNCHANGED] = state[_UNCHANGED] + 1.0 if force == state[LAST] and state[0] > 0.0 else 0.0
    speed, after = control.step(state_in(state), desired, force, position)
    put_state(state, after)
    if abs(force) >= 0.99 * control.full_scale:
        trouble, speed = SATURATED, -control.approach if force > 0.0 else 0.0
    elif force > control.force_limit:
        trouble, speed = LIMITED, min(speed, -control.approach)
    elif after.watch.mean < -LEAST * control.noise:
        trouble, speed = PULLED, 0.0
    elif state[_UNCHANGED] > max(lag, 5.0 * control.period / control.tick):
        trouble, speed = STALE, 0.0
    elif in_vain(control, state, after, desired, speed) > FARTHEST * desired:
        trouble, speed = UNREACHED, 0.0
    state[_TROUBLE] = trouble
    return speed


@law
def in_vain(control, state, after, desired, speed):
    """Force that the command would have added since the error last fell [N]."""
    stiffness = control.cap * max(after.known.found.x, 0.0)
    low = after.watch.mean < (1.0 - NEAR) * desired and after.stage.phase != AIR
    if not low or abs(after.watch.mean - state[_FROM]) > NEAR * desired:
        state[_VAIN], state[_FROM] = 0.0, after.watch.mean
    else:
        state[_VAIN] += control.tick * speed * stiffness / (1.0 + control.compliance * stiffness)
    return state[_VAIN]


@law
def renewed(control, state):
    """In the air, knowing nothing but the sensor's noise."""
    variance, tide = state[VARIANCE], state[TIDE]
    put_state(state, control.start())
    state[VARIANCE], state[TIDE] = variance, tide


_step = kernel(safe_step)


@dataclass(frozen=True)
class SurfaceEstimate:
    """Estimate of the surface.

    Args:
        stiffness: K as the measured position feels it [N/m].
        stiffness_std: its standard deviation [N/m].
        damping: B [N s/m].
        damping_std: its standard deviation [N s/m].
        bound: K_u, from which the gain follows [N/m].
    """

    stiffness: float
    stiffness_std: float
    damping: float
    damping_std: float
    bound: float


class ForceLoop:
    """Presses with the force asked for, on any surface within the gains' cap, from the air on.

    In the user's own loop, once a tick::

        loop = ForceLoop.load("gains.toml")
        while True:
            x_command += tick * loop.update(force, position)

    What it does where something is wrong is the same each time, and `trouble` names it: a reading that is no number,
    or has not changed for longer than the loop's lag: the tip is held. Readings missing for longer than the lag:
    all but the sensor's noise is forgotten, as in the air. A saturated sensor, or a force above its limit: the tip
    withdraws at least at the speed of the approach. A force that pulls: the tip is held. Contact lost: back to the
    speed of the approach.

    Args:
        gains: from `palpate tune`.
        certificate: of these gains, if there is one.

    Raises:
        InputError: a certificate of another arm, rate or law.
    """

    def __init__(self, gains: Gains, certificate: Certificate | None = None):
        if certificate is not None:
            certificate.check_of(gains)
        self.gains, self.certificate = gains, certificate
        self._desired = gains.force
        self._numbers = flattened(gains.cautious())
        self._state = np.zeros(STATE + EXTRA)
        self.reset()
        self._bind()

    @classmethod
    def load(cls, path: str | Path, certificate: str | Path | None = None) -> ForceLoop:
        """From the files that `palpate tune` and `palpate certify` wrote.

        Raises:
            InputError: a file that is none, or a certificate of other gains.
        """
        from palpate.force.certificate import Certificate

        proof = None if certificate is None else Certificate.load(Path(certificate))
        return cls(load_gains(Path(path)), proof)

    def save(self, path: str | Path) -> None:
        """Writes the gains, the file there whole or not at all."""
        write_text(Path(path), self.gains.to_toml())

    def reset(self) -> None:
        """Back into the air, knowing nothing."""
        self._state[:] = 0.0
        self._state[:STATE] = flattened(self.gains.cautious().start())

    @property
    def desired(self) -> float:
        """F_d [N]."""
        return self._desired

    @desired.setter
    def desired(self, force: float) -> None:
        value = float(force)
        least, most = LEAST * self.gains.arm.sensor.noise, self.gains.force_limit
        if not least <= value < most:
            raise InputError(
                f"the desired force must be from {least:g} N (8 standard deviations of the noise) to below the force "
                f"limit of {most:g} N, got {value:g} N"
            )
        self._desired = value

    def update(self, force: float, position: float, missed: float = 0.0) -> float:
        """The speed of the commanded position for this tick [m/s].

        Args:
            force: on the surface, positive where it presses [N].
            position: of the tip along the normal as the arm's encoders have it, growing into the surface [m].
            missed: ticks that were lost since the last call.
        """
        return self._one(self._numbers, self._state, self._desired, force, position, missed)

    @property
    def estimate(self) -> SurfaceEstimate | None:
        """Estimate of the surface; None in free motion and until there is one."""
        s, cap, theta = self._state, self.gains.seen_cap, self.gains.theta
        if s[PHASE] == AIR or s[STD] == 0.0:
            return None
        return SurfaceEstimate(
            float(cap * s[FOUND]),
            float(cap * s[STD]),
            float(cap * theta * s[FOUND + 1]),
            float(cap * theta * s[STD + 1]),
            float(s[BOUND]),
        )

    @property
    def phase(self) -> str:
        """`air`, `learning` or `locked`."""
        return PHASES[float(self._state[PHASE])]

    @property
    def trouble(self) -> str:
        """Fault of the last tick, in words; empty if there was none."""
        return TROUBLES[float(self._state[_TROUBLE])]

    @property
    def noise(self) -> float:
        """Standard deviation of a force reading, as measured in the air [N]."""
        return float(np.sqrt(self._state[VARIANCE]))

    @property
    def state(self) -> tuple[float, ...]:
        """Everything that it remembers, as plain numbers; to be given back by assignment."""
        return tuple(self._state.tolist())

    @state.setter
    def state(self, numbers: Any) -> None:
        given = np.array(numbers, dtype=np.float64)
        if (
            given.shape != self._state.shape
            or not np.isfinite(given).all()
            or float(given[PHASE]) not in PHASES
        ):
            raise InputError(
                f"a state is {len(self._state)} finite numbers from ForceLoop.state; give those back"
            )
        self._state[:] = given

    def _bind(self) -> None:
        """The compiled step without the look-up by type that half of a short call's time goes into."""
        import numba

        example = (self._numbers, self._state.copy(), 1.0, 0.0, 0.0, 0.0)
        _step(*example)
        entry = _step.compiled.overloads[tuple(map(numba.typeof, example))].entry_point
        self._one = entry

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_one"}

    def __setstate__(self, known: dict[str, Any]) -> None:
        self.__dict__.update(known)
        self._bind()
