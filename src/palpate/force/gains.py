"""A tuned loop as one value and one TOML file: the arm, the force, and the numbers of the law."""

from __future__ import annotations

import hashlib
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from palpate._vector import Mat3, Vec3
from palpate.arrays import Array
from palpate.errors import InputError
from palpate.files import as_toml, read_text
from palpate.force.arm import Arm, PositionLoop, Positive, ServoLoop, Table, from_toml
from palpate.force.ceiling import BIAS_FRACTION, check_force_max, force_ceiling
from palpate.force.lag import lag_of, relief_of
from palpate.force.law import Cautious, gain
from palpate.force.sampled_loop import filter_of
from palpate.force.slide_table import Slide

ALPHA = 0.42
"""Gain in units of 1/theta, L = alpha e^(-s theta)/(theta s): 0.42 gives a gain margin of pi/(2 alpha) = 3.7.
Measured by benchmarks/force/first_touches.py: 0.45 overshoots by 9 % on the stiffest surfaces, 0.36 is a
quarter slower."""
LAW = "cautious adaptive control 7"
"""Name of the law in adaptive control (a gain that the estimate's uncertainty lowers), and its version.
A certificate of another one is refused."""
LEVEL_FRACTION = 0.0075
"""Fraction of F_d that a sensor may show in free motion, or two standard deviations if that is more.
Measured by benchmarks/force/free_motion.py: twice as much costs 0.05 s on the softest surfaces, hums exceed half as
much."""
MIN_DRIFT = 0.35
"""Drift that is followed, whatever a sensor's maker states [N/s]: what rises more slowly at the approach is no surface.
Above the 0.3 N/s that benchmarks/force/free_motion.py puts to it; the softest surface is this over the approach."""
_MIN_NOISE_FRACTION = 1e-5
"""Least noise over F_d that is believed, so that a simulated sensor without noise has finite information."""
_MOMENTUM_FRACTION = 0.5
"""Share of F_d that the tip's own momentum, v sqrt(K m), may add at the touch; on a surface with a damping ratio of 1
the damping's 2 v sqrt(K m) is then F_d."""
_APPROACH_FACTOR = 1.15
"""Approach speed over the speed that the law asks for at the cap; 1.3 overshoots by 7.6 % there, 1.6 by 13.6 %
(benchmarks/force/first_touches.py)."""
_FLOOR_FRACTION = 0.02
"""Lowest K_u in alpha F_d/(theta v_max): there the speed leaves its limit at an error of 2 % of F_d, within half of the
band of 5 % that counts as settled, so that a higher gain would change nothing that counts."""
_BOUND_DEVIATIONS, _BOUND_MARGIN = 1.5, 0.03
"""Standard deviations, and a relative room, from the estimate to K_u.
Measured by benchmarks/force/first_touches.py, as K_eff(K_u)/K_eff: in one touch of some thousand it is below the half
that the proof asks for."""
MIN_APPROACH = 1e-6
"""Slowest approach that is tuned for [m/s]: a micrometre a second, the step of an encoder of many arms."""
MAX_LAG_TICKS = 2000
"""Ticks of lag that are tuned for: a press is foretold tick by tick, for tens of lags."""
_FORGETTING_DECAYS = 5.0
"""Decay times of the sensor's low-pass after which an edge counts as forgotten: e^-5 of it, 0.7 %, is left."""

SWING_FRACTION = 0.5
"""Share of the swing of a position arm's tip for which nothing is learned after a touch: in its first half the force
grows at another pace than the command's, so that a stiff surface would pass for a soft one.
Measured by benchmarks/arms/touches.py."""


class Gains(Table):
    """A tuned loop.

    Raises:
        InputError: a force that noise hides or the sensor cannot read, limits that do not fit.
    """

    arm: Arm
    force: Positive
    """F_d, the smallest that will be asked for [N]."""
    theta: Positive
    """Whole lag of the loop [s]."""
    cap: Positive
    """Largest K + B/theta of any surface that there may be [N/m]."""
    approach: Positive
    """Speed in free motion [m/s]."""
    force_limit: Positive
    """Above which the tip withdraws [N]."""
    level: Positive
    """Largest force that the sensor may show in free motion, either way [N]: below it, whatever the signal, the tip is
    never faster than the approach."""
    alpha: Annotated[float, Meta(gt=0, le=1)] = ALPHA
    force_max: Positive | None = None
    """F_max, which the force does not exceed under the assumptions of `palpate.force.ceiling` [N]; none if left out."""
    relief: Annotated[float, Meta(ge=0, le=0.3)] = 0.0
    """rho: share of the lag that a torque arm does not have on a stiff surface, see `relief_of`."""
    law: str = LAW
    slide: Slide | None = None
    """Numbers of a slide; none in gains that only press. No certificate depends on them."""

    def __post_init__(self) -> None:
        if self.law != LAW:
            raise InputError(f"these gains are for the law {self.law!r}, this is {LAW!r}; tune again")
        least = 8.0 * self.arm.sensor.noise
        if self.force < least:
            raise InputError(
                f"a force of {self.force:g} N is below 8 standard deviations of the sensor's noise ({least:g} N); "
                "ask for more, or use a quieter sensor"
            )
        if not self.force < self.force_limit <= self.arm.sensor.full_scale:
            raise InputError(
                f"the force limit must lie between the force of {self.force:g} N and the sensor's full scale of "
                f"{self.arm.sensor.full_scale:g} N, got {self.force_limit:g} N"
            )
        check_force_max(self.arm, self.force, self.force_max)
        if self.approach > self.speed:
            ceiling = (
                "arm's limit" if self.speed == self.arm.limits.speed else f"ceiling of {self.force_max:g} N"
            )
            raise InputError(
                f"the approach of {self.approach:g} m/s is faster than the {ceiling}, {self.speed:g} m/s"
            )
        if self.arm.sensor.sampling < 4.0 / self.theta:
            raise InputError(
                f"the sensor's {self.arm.sensor.sampling:g} readings a second are fewer than 4 in the loop's lag of "
                f"{1e3 * self.theta:.3g} ms; use a faster sensor"
            )

    @property
    def speed(self) -> float:
        """Largest commanded speed [m/s]: the arm's limit, or what keeps the force F_d below F_max."""
        return self.speed_at(self.force)

    def speed_at(self, desired: float) -> float:
        """Largest commanded speed with which a desired force stays below F_max [m/s]; the arm's limit without F_max."""
        limit = self.arm.limits.speed
        if self.force_max is None:
            return limit
        return min(limit, force_ceiling(self.arm, desired, self.force_max, self.cap, self.theta))

    @property
    def seen_cap(self) -> float:
        """The cap as the measured position feels it [N/m]."""
        return self.arm.seen(self.cap) if self.arm.kind == "position" else self.cap

    @property
    def compliance(self) -> float:
        """Compliance of the spring between commanded and measured position [m/N]."""
        return 0.0 if self.arm.kind == "position" else 1.0 / self.arm.series

    @property
    def gain(self) -> float:
        """g at K_u = cap [m/(s N)]."""
        return self.gain_at(self.seen_cap)

    def gain_at(self, bound: float) -> float:
        """g for K_u = bound [m/(s N)]."""
        return float(gain(self, bound))  # type: ignore[no-untyped-call]

    @property
    def floor(self) -> float:
        """Lowest K_u that the law uses [N/m]."""
        return max(_FLOOR_FRACTION * self.alpha * self.force / (self.theta * self.speed), 1.0)

    @property
    def bias(self) -> float:
        """Largest force at rest that is taken out of the readings [N]."""
        return BIAS_FRACTION * self.force

    @property
    def drift(self) -> float:
        """Slowest rise that counts as a surface's [N/s]."""
        return max(MIN_DRIFT, self.arm.sensor.drift or 0.0)

    def cautious(self) -> Cautious:
        """Numbers of the compiled law."""
        arm = self.arm
        low_pass = arm.low_pass
        memory = (
            _FORGETTING_DECAYS / low_pass.decay if low_pass.sections else arm.tick
        ) + 1.0 / arm.sensor.sampling
        swing = SWING_FRACTION * arm.inner.swing if isinstance(arm.inner, PositionLoop) else 0.0
        servo = arm.inner if isinstance(arm.inner, ServoLoop) else None
        E, e0, e1, c = followed(arm)
        step = arm.sensor.resolution or 0.0
        numbers: dict[str, Any] = {
            "tick": arm.tick, "theta": self.theta, "alpha": self.alpha, "compliance": self.compliance,
            "relief": self.relief, "lead": servo.lag if servo else 0.0, "inertia": servo.inertia if servo else 0.0,
            "cap": self.seen_cap, "floor": self.floor, "speed": self.speed,
            "approach": self.approach, "level": 2.0 * self.level, "bias": self.bias, "drift": self.drift,
            "noise": arm.sensor.noise, "resolution": step,
            "least": max((0.25 * arm.sensor.noise) ** 2, step**2 / 12.0, (_MIN_NOISE_FRACTION * self.force) ** 2),
            "memory": memory, "blind": memory + swing,
            "period": max(1.0 / arm.sensor.sampling, arm.tick), "E": E, "e0": e0, "e1": e1, "c": c,
            "d": 0.0 if low_pass.sections else 1.0, "z": _BOUND_DEVIATIONS, "eps": _BOUND_MARGIN,
            "full_scale": arm.sensor.full_scale, "force_limit": self.force_limit,
        }  # fmt: skip
        return Cautious(**numbers)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything that a proof of stability rests on: arm, rate, lag, law and gain."""
        known = {
            key: value
            for key, value in msgspec.to_builtins(self).items()
            if key not in {"slide", "force_max"}
        }
        return hashlib.sha256(msgspec.json.encode(known)).hexdigest()

    def to_toml(self) -> str:
        """Text of the gains file."""
        return "# Made by palpate tune; ForceLoop.load takes it.\n" + as_toml(msgspec.to_builtins(self))


def load_gains(path: Path) -> Gains:
    """Gains from the file that `palpate tune` wrote.

    Raises:
        InputError: no such file, another law, a number out of range.
    """
    return from_toml(read_text(path, "gains"), str(path), Gains)


def gains_for(
    arm: Arm,
    force: float,
    *,
    cap: float | None = None,
    theta: float | None = None,
    limit: float | None = None,
    force_max: float | None = None,
) -> Gains:
    """The law's gains for an arm that presses with a force.

    Args:
        arm: what moves.
        force: F_d, the smallest that will be asked for [N].
        cap: stiffest surface that there may be, K + B/theta [N/m]; the arm's limit if left out.
        theta: whole lag of the loop [s]; the arm's own if left out.
        limit: force above which the tip withdraws [N]; F_max, or else the sensor's full scale, if left out.
        force_max: F_max, which the force shall not exceed [N]; none if left out.

    Raises:
        InputError: numbers that no loop can be tuned for.
    """
    theta = known_lag(arm) if theta is None else theta
    cap = arm.limits.stiffness if cap is None else cap
    approach = approach_speed(arm, force, theta, cap)
    if force_max is not None:
        check_force_max(arm, force, force_max)
        approach = min(approach, force_ceiling(arm, force, force_max, cap, theta))
    if approach < MIN_APPROACH:
        raise InputError(
            f"surfaces of up to {cap:g} N/m allow an approach of {approach:.2g} m/s, which comes nowhere; lower the "
            f"stiffness cap, or press harder{'' if force_max is None else ', or raise F_max'}"
        )
    return Gains(
        arm=arm, force=force, theta=theta, cap=cap, relief=_known_relief(_any_noise(arm), theta),
        force_limit=limit or force_max or arm.sensor.full_scale, force_max=force_max,
        approach=approach, level=free_motion_level(arm, force),
    )  # fmt: skip


def free_motion_level(arm: Arm, force: float) -> float:
    """Largest force that a sensor is taken to show in free motion [N], for a desired force [N]."""
    return max(LEVEL_FRACTION * force, 2.0 * arm.sensor.noise)


def known_lag(arm: Arm) -> float:
    """theta of an arm [s], worked out once.

    Raises:
        InputError: a lag of so many ticks that the loop is to be run slower.
    """
    theta = _known_lag(_any_noise(arm))
    if theta * arm.rate > MAX_LAG_TICKS:
        raise InputError(
            f"{arm.title}: the loop's lag of {theta:.3g} s is {theta * arm.rate:.3g} ticks; at most {MAX_LAG_TICKS} "
            "are taken: check [inner], or run the force loop slower"
        )
    return theta


@lru_cache(maxsize=64)
def _known_lag(arm: Arm) -> float:
    return lag_of(arm)


@lru_cache(maxsize=64)
def _known_relief(arm: Arm, theta: float) -> float:
    return relief_of(arm, theta, ALPHA)


def _any_noise(arm: Arm) -> Arm:
    """The arm but for its noise, which no lag depends on."""
    return msgspec.structs.replace(arm, sensor=msgspec.structs.replace(arm.sensor, noise=1.0))


def approach_speed(arm: Arm, force: float, theta: float, cap: float, alpha: float = ALPHA) -> float:
    """Highest speed in free motion [m/s]: what a touch at K_u = cap bears, and what the tip's mass allows.

    Args:
        arm: what moves.
        force: F_d [N].
        theta: [s].
        cap: K_cap of the surface [N/m].
        alpha: gain in units of 1/theta.
    """
    speed = min(arm.limits.speed, _APPROACH_FACTOR * alpha * force / (theta * arm.seen(cap)))
    mass = arm.inner.mass
    if isinstance(arm.inner, ServoLoop):
        return min(speed, force / touch_peak(arm.inner, theta, cap))
    return speed if mass is None else min(speed, _MOMENTUM_FRACTION * force / float(np.sqrt(cap * mass)))


def touch_peak(servo: ServoLoop, theta: float, stiffness: float) -> float:
    """Largest force within theta of the touch of a servo whose command goes on, over its speed [N s/m].

    m xddot = K_s (x_c - x) - D xdot - K x from x = 0, x_c = D v/K_s and the speed v of both on.
    """
    from scipy.linalg import expm

    n = 200
    rate_squared = servo.stiffness / servo.mass
    rates = np.zeros((4, 4))  # of x, xdot, x_c and the constant speed of the command
    rates[0, 1] = rates[2, 3] = 1.0
    rates[1, :3] = -rate_squared - stiffness / servo.mass, -servo.damping / servo.mass, rate_squared
    step = expm(theta / n * rates)
    state = np.array([0.0, 1.0, servo.lag, 1.0])
    peak = 0.0
    for _ in range(n):
        state = step @ state
        peak = max(peak, stiffness * float(state[0]))
    return peak


def followed(arm: Arm) -> tuple[Mat3, Vec3, Vec3, Vec3]:
    """The sensor's low-pass on a position that runs straight between ticks: z' = E z + e0 x + e1 x', read by c."""
    from scipy.linalg import expm

    A, b, c = filter_of(arm.low_pass)
    n = len(b)
    M = np.zeros((n + 2, n + 2))
    M[:n, :n], M[:n, n], M[n, n + 1] = A * arm.tick, b * arm.tick, 1.0
    both = expm(M)
    wide = np.zeros((3, 3))
    wide[:n, :n] = both[:n, :n]
    full = both[:n, n]
    ramp = both[:n, n + 1]
    E = Mat3(*map(padded_vector, wide))
    return E, padded_vector(full - ramp), padded_vector(ramp), padded_vector(c)


def padded_vector(values: Array) -> Vec3:
    """Up to three numbers as a vector, zeros behind them."""
    return Vec3(*(float(v) for v in np.concatenate([values, np.zeros(3 - len(values))])))
