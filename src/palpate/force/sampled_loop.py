"""The sampled force loop, exact: arm, surface, sensor and law from tick to tick as one matrix."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from math import pi

import numpy as np

from palpate.arrays import Array
from palpate.force.arm import Arm, PositionLoop, ServoLoop, TorqueLoop
from palpate.force.law import SMOOTHING
from palpate.signals.low_pass import LowPass


@dataclass(frozen=True)
class Law:
    """Linear part of the law at a tick.

    Args:
        gain: g [m/(s N)].
        kept: share of the low-passed command that stays from tick to tick, tau/(tau + T).
        ahead: ticks by which the command is ahead of that low-pass, x_c = x_c + T (u + ahead (u - u of before)).
    """

    gain: float
    kept: float = 0.0
    ahead: float = 0.0


def law_for(arm: Arm, gain: float, bound: float) -> Law:
    """The law with a gain g [m/(s N)] at K_u = bound [N/m]: with a servo's lead, as `law.lead_speed` has it."""
    inner = arm.inner
    if not isinstance(inner, ServoLoop):
        return Law(gain)
    total = 1.0 + bound / inner.stiffness
    late = SMOOTHING * inner.lag
    lead = 0.5 * inner.lag / total * (1.0 + np.sqrt(max(1.0 - inner.inertia * total, 0.0)))
    return Law(gain, late / (late + arm.tick), float(lead + late) * arm.rate)


@dataclass(frozen=True)
class SampledLoop:
    """x_(k+1) = Phi x_k for the loop of v = LP_tau(g (F_d - F_m)) on a surface F = K x + B xdot.

    The surface is what the arm feels: for a position arm K_eff and B_eff; for others the surface's own, since there the
    spring in series is part of the dynamics. Delays are whole ticks, rounded up; within a tick the command
    is held and everything else is continuous (matrix exponential).

    The state, in this order: x, xdot/w0, force/k0 through the sensor's low-pass, the readings on their way,
    the command's low-pass, the commands on their way.

    Args:
        arm: what moves.
        extra: ticks of delay beyond the arm's own.
        unit: k0 [N/m]; the series stiffness if left out. Near the surface's own, all numbers are of one size.
        inner: w^2 [1/s^2] and 2 z w [1/s] of a position arm's inner loop; the arm's own if left out.
        tip: the servo that acts, while the law is for the arm's own; that one if left out.
    """

    arm: Arm
    extra: int = 0
    unit: float | None = None
    inner: tuple[float, float] | None = None
    tip: ServoLoop | None = None

    def later(self, ticks: int) -> SampledLoop:
        """This loop with more ticks of delay."""
        return replace(self, extra=self.extra + ticks)

    @cached_property
    def force_unit(self) -> float:
        """k0 [N/m]: forces are counted in k0 times a metre."""
        return self.arm.series if self.unit is None else self.unit

    @cached_property
    def rate_unit(self) -> float:
        """w0 [rad/s]: rates are counted in w0 times a metre."""
        inner = self.arm.inner
        if isinstance(inner, PositionLoop):
            return 2.0 * pi * inner.bandwidth
        return float(np.sqrt(inner.stiffness / inner.mass))

    @cached_property
    def low_pass(self) -> tuple[Array, Array, Array]:
        """The sensor's low-pass A, b, c: shapes (n, n), (n,), (n,); n is 0 where it has none."""
        return filter_of(self.arm.low_pass)

    @cached_property
    def lines(self) -> tuple[int, int]:
        """Number of readings and of commands, or of torques beside a command, that are kept."""
        commands = self.delay + 1 if self.arm.kind == "torque" else max(self.delay, 1)
        return self.arm.sensor_ticks + self.arm.unsure_ticks + self.extra, commands

    @cached_property
    def delay(self) -> int:
        """Ticks from a command to the inner loop.

        What the arm's delay may be shorter by is counted with the readings' age: delays in one loop commute.
        """
        return self.arm.delay_ticks - self.arm.unsure_ticks

    @cached_property
    def size(self) -> int:
        """Numbers of the state."""
        return 2 + len(self.low_pass[1]) + self.lines[0] + 1 + self.lines[1]

    @cached_property
    def state(self) -> tuple[str, ...]:
        """Names of the state: position, rate, sensor, readings by age, filtered command, commands, torques."""
        readings, commands = self.lines
        sent = range(1, commands)
        return (
            "x", "v", *(f"f{i + 1}" for i in range(len(self.low_pass[1]))),
            *(f"r{i + 1}" for i in range(readings)), "u", "c0",
            *(f"t{i}" if self.arm.kind == "torque" else f"c{i}" for i in sent),
        )  # fmt: skip

    @cached_property
    def units(self) -> dict[str, float]:
        """w0 of v [rad/s], k0 of f, r and t [N/m], and the sensor's rate in which f2, f3 are derivatives [rad/s]."""
        rate = float(np.prod([(2.0 * pi * f) ** n for n, f in self.arm.low_pass.sections]))
        order = max(self.arm.low_pass.roll_off, 1)
        return {"w0": self.rate_unit, "k0": self.force_unit, "wf": rate ** (1.0 / order)}

    def rates(self, stiffness: float, damping: float) -> tuple[Array, Array]:
        """A and b of zdot = A z + b u, of tip and sensor between ticks; u is the held command or torque."""
        F, f, _ = self.low_pass
        n = len(f)
        w = self.rate_unit
        A = np.zeros((2 + n, 2 + n))
        b = np.zeros(2 + n)
        inner = self.arm.inner
        A[0, 1] = w
        if isinstance(inner, PositionLoop):
            square, rate = inner.squared if self.inner is None else self.inner
            A[1, 0], A[1, 1], b[1] = -square / w, -rate, square / w
        elif isinstance(inner, ServoLoop):
            servo = inner if self.tip is None else self.tip
            K = servo.stiffness
            D = servo.damping
            m = servo.mass
            A[1, 0], A[1, 1], b[1] = -(K + stiffness) / m / w, -(D + damping) / m, K / m / w
        else:
            A[1, 0], A[1, 1] = -stiffness / inner.mass / w, -damping / inner.mass
            b[1] = self.force_unit / inner.mass / w  # the held torque is counted in k0 too
        A[2:, 2:] = F
        A[2:, 0], A[2:, 1] = f * stiffness / self.force_unit, f * damping * w / self.force_unit
        return A, b

    def phi(self, stiffness: float, damping: float, law: Law, loss: int = 0) -> Array:
        """The matrix of a tick, shape (size, size).

        Args:
            stiffness: K [N/m].
            damping: B [N s/m].
            law: its gain and low-pass.
            loss: ticks of age by which the reading in use is younger than the oldest; all of them for this tick's own.
        """
        A, b = self.rates(stiffness, damping)
        return self.tick_matrix(
            *zero_order_hold(A, b, self.arm.tick), self.force_gain(stiffness, damping), law, loss
        )

    def force_gain(self, stiffness: float, damping: float) -> Array:
        """The sensor's reading of tip and low-pass, before its age, in k0, shape (2 + n,)."""
        _, f, c = self.low_pass
        if len(f):
            return np.concatenate([[0.0, 0.0], c])
        return np.array([stiffness, damping * self.rate_unit]) / self.force_unit

    def tick_matrix(self, E: Array, e: Array, reading: Array, law: Law, loss: int = 0) -> Array:
        """The matrix of a tick from what happens within it: z' = E z + e u.

        Args:
            E: shape (2 + n, 2 + n).
            e: shape (2 + n,).
            reading: of z, shape (2 + n,).
            law: of this tick.
            loss: as for `phi`.
        """
        tick = self.arm.tick
        inner = self.arm.inner
        p = len(e)
        readings = self.lines[0]
        delay = self.delay
        filtered, command = p + readings, p + readings + 1  # y, then x_c and those on their way
        Phi = np.zeros((self.size, self.size))
        # The readings: z's is read at this tick, joins the line, and comes out `readings` ticks later.
        Phi[p, :p] = reading
        for i in range(1, readings):
            Phi[p + i, p + i - 1] = 1.0
        # y = kept y + (1 - kept) g (0 - F), in rate of x_c.
        Phi[filtered, filtered] = law.kept
        fed = -(1.0 - law.kept) * law.gain * self.force_unit
        if loss < readings:
            Phi[filtered, p + readings - 1 - loss] = fed
        else:  # of this very tick
            Phi[filtered, :p] = fed * reading
        # x_c = x_c + T y, the new y, and what it is ahead of that.
        Phi[command] = tick * (1.0 + law.ahead) * Phi[filtered]
        Phi[command, filtered] -= tick * law.ahead
        Phi[command, command] += 1.0
        for i in range(1, self.lines[1]):
            Phi[command + i, command + i - 1] = 1.0
        # What acts during this tick: the command sent `delay` ticks ago; with none, the one of this tick.
        acting = Phi[command] if delay == 0 else np.eye(self.size)[command + delay - 1]
        if isinstance(inner, TorqueLoop):
            k = inner.stiffness / self.force_unit
            d = inner.damping * self.rate_unit / self.force_unit
            acting = k * acting  # torque of a tick: K_p (x_c - x) - D xdot as read at this tick
            if delay:
                return self._delayed_torque(Phi, E, e, k, d)
            acting[0] -= k
            acting[1] -= d
        Phi[:p, :p] = E
        Phi[:p] += np.outer(e, acting)
        return Phi

    def _delayed_torque(self, Phi: Array, E: Array, e: Array, k: float, d: float) -> Array:
        """The matrix where the torque is computed from this tick's readings and acts some ticks later.

        The line after x_c then holds torques, not commands.
        """
        p = len(e)
        readings = self.lines[0]
        delay = self.delay
        command = p + readings + 1
        Phi[:p, :p] = E
        Phi[:p, command + delay] += e
        first = Phi[command].copy() * k
        first[0] -= k
        first[1] -= d
        Phi[command + 1] = first
        return Phi


def zero_order_hold(A: Array, b: Array, time: float) -> tuple[Array, Array]:
    """z(t) = E z(0) + e u for zdot = A z + b u and a held u."""
    from scipy.linalg import expm

    n = len(b)
    M = np.zeros((n + 1, n + 1))
    M[:n, :n], M[:n, n] = A, b
    both = expm(time * M)
    return both[:n, :n], both[:n, n]


@cache
def filter_of(low_pass: LowPass) -> tuple[Array, Array, Array]:
    """A chain of Butterworth low-passes as a continuous-time A, b, c; empty for none.

    The states are the output and its derivatives over powers of a rate of its own size.
    """
    poles = [
        2 * pi * cutoff * np.exp(1j * pi * (2 * k + order + 1) / (2 * order))
        for order, cutoff in low_pass.sections
        for k in range(order)
    ]
    n = len(poles)
    if n == 0:
        return np.zeros((0, 0)), np.zeros(0), np.zeros(0)
    w = float(np.abs(np.prod(poles)) ** (1.0 / n))
    a = np.real(np.poly(np.array(poles) / w))  # s^n + a1 s^(n-1) + ... in units of w
    A = np.diag(np.ones(n - 1), 1)
    A[-1] = -a[:0:-1]
    b = np.zeros(n)
    c = np.zeros(n)
    b[-1], c[0] = w * a[-1], 1.0
    return w * A, b, c
