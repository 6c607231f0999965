"""Other people's force controllers on the same arm: each turns a force error into a speed of the commanded position.

None knows the surface. Where a law wants a stiffness it is told `NOMINAL`; where it has a free gain, that is the one
that makes it equal to the fixed integral on that stiffness. In the air all approach at the cautious law's speed.
"""

from typing import Any, NamedTuple

from palpate._jit import law, part
from palpate._vector import Vec3, exp

NOMINAL = 7e3
"""Stiffness that fixed gains are tuned for [N/m]."""


@part
class AfterTouch(NamedTuple):
    """Any law, after an approach at a given speed."""

    law: Any
    approach: float
    noise: float

    def start(self):
        return 0.0, self.law.start()

    def step(self, state, desired, force, position):
        touched, inner = state
        if touched == 0.0 and force < 4.0 * self.noise:
            return self.approach, state
        speed, inner = self.law.step(inner, desired, force, position)
        return speed, (1.0, inner)

    def stiffness_bound(self, state):
        """None is known of it."""
        return 0.0


@part
class Integral(NamedTuple):
    """v = g e, the gain fixed."""

    gain: float

    def start(self):
        return 0.0

    def step(self, state, desired, force, position):
        return self.gain * (desired - force), state


@part
class FilteredDerivative(NamedTuple):
    """v = g (e - T_d dF/dt), the rate through a low-pass (thesis, 2.3)."""

    gain: float
    lead: float
    smoothing: float
    tick: float

    def start(self):
        return 0.0, 0.0

    def step(self, state, desired, force, position):
        rate, last = state
        rate += self.tick / self.smoothing * ((force - last) / self.tick - rate)
        return self.gain * (desired - force - self.lead * rate), (rate, force)


@part
class EstimatedRate(NamedTuple):
    """The same with the rate from a believed stiffness and the measured speed (thesis, 4.4)."""

    gain: float
    lead: float
    stiffness: float
    tick: float

    def start(self):
        return 0.0, 0.0

    def step(self, state, desired, force, position):
        last, ticks = state
        rate = self.stiffness * (position - last) / self.tick if ticks > 0.0 else 0.0
        return self.gain * (desired - force - self.lead * rate), (position, ticks + 1.0)


@part
class Fuzzy(NamedTuple):
    """A rule base on error and rate scales a fixed gain from a third to three times (after Xu's fuzzy compensation)."""

    gain: float
    scale: float
    rate_scale: float
    tick: float

    def start(self):
        return 0.0, 0.0

    def step(self, state, desired, force, position):
        smooth, last = state
        error = desired - force
        smooth += 0.1 * ((force - last) / self.tick - smooth)
        far = min(abs(error) / self.scale, 1.0)
        closing = max(min(smooth * error / (abs(error) + 1e-9) / self.rate_scale, 1.0), -1.0)
        # far and not closing: more; near and fast: less
        rule = far * (1.0 - closing) - (1.0 - far) * max(closing, 0.0)
        return self.gain * exp(1.1 * max(min(rule, 1.0), -1.0)) * error, (smooth, force)


@part
class FeedbackErrorLearning(NamedTuple):
    """Feedback g e teaches a feed-forward of F_d, its rate and 1 (Gomi and Kawato)."""

    gain: float
    rate: float
    tick: float

    def start(self):
        return Vec3(0.0, 0.0, 0.0), 0.0

    def step(self, state, desired, force, position):
        weights, last = state
        feedback = self.gain * (desired - force)
        phi = Vec3(desired / 20.0, (desired - last) / 20.0, 1.0)
        weights += (self.rate * self.tick * feedback) * phi
        return feedback + weights @ phi, (weights, desired)


@part
class Admittance(NamedTuple):
    """M vdot + D v = e (Hogan); at a rate its damping goes down the squared force error (after Cohen and Flash)."""

    mass: float
    damping: float
    rate: float
    tick: float

    def start(self):
        return 0.0, self.damping, 0.0

    def step(self, state, desired, force, position):
        speed, damping, owed = state
        error = desired - force
        owed += self.tick / self.mass * (-speed - damping * owed)  # d speed / d damping
        damping += self.rate * self.tick * error * owed * damping * damping
        damping = min(max(damping, 0.05 * self.damping), 20.0 * self.damping)
        speed += self.tick / self.mass * (error - damping * speed)
        return speed, (speed, damping, owed)


@part
class DescendingGain(NamedTuple):
    """The gain goes down the squared error within 0 and twice its middle (after Fukuda's indirect scheme)."""

    middle: float
    rate: float
    tick: float

    def start(self):
        return self.middle, 0.0

    def step(self, state, desired, force, position):
        gain, owed = state
        error = desired - force
        owed += self.tick * (error - gain * NOMINAL * owed)  # d (K x) / d gain over K
        gain += self.rate * self.tick * self.middle * error * owed / (desired * desired)
        gain = min(max(gain, 0.0), 2.0 * self.middle)
        return gain * error, (gain, owed)


@part
class Observer(NamedTuple):
    """A fixed gain that an observer of stability lowers while the error alternates quickly."""

    gain: float
    window: float
    tick: float

    def start(self):
        return 1.0, 0.0, 0.0

    def step(self, state, desired, force, position):
        share, index, side = state
        error = desired - force
        now = 1.0 if error > 0.05 * desired else -1.0 if error < -0.05 * desired else side
        index += self.tick / self.window * (-index)
        if now * side < 0.0:
            index += 1.0
        share += self.tick / self.window * ((1.0 if index < 1.0 else 0.1) - share)
        return self.gain * share * error, (share, index, now)


@part
class Ekf(NamedTuple):
    """Gain scheduling by a Kalman filter of force and stiffness, dF = K dx (after Roveda)."""

    unit: float
    noise: float
    walk: float
    first: float
    tick: float

    def start(self):
        return 0.0, self.first, Vec3(1.0, 0.0, self.first * self.first), 0.0, 0.0

    def step(self, state, desired, force, position):
        f, K, P, last, ticks = state
        dx = position - last if ticks > 0.0 else 0.0
        f += K * dx
        a, b, c = P.x + 2.0 * dx * P.y + dx * dx * P.z, P.y + dx * P.z, P.z + self.walk
        s = a + 1e-4 + self.noise * self.noise
        miss = force - f
        f, K = f + (a + 1e-4) / s * miss, min(max(K + b / s * miss, 50.0), 1e6)
        P = Vec3((a + 1e-4) * (1.0 - (a + 1e-4) / s), b * (1.0 - (a + 1e-4) / s), c - b * b / s)
        return self.unit / K * (desired - force), (f, K, P, position, ticks + 1.0)


@law
def sigmoid(w, inputs):
    """A neuron with its threshold."""
    return 2.0 / (1.0 + exp(-max(min(w @ inputs, 30.0), -30.0))) - 1.0


@part
class TaughtNeurons(NamedTuple):
    """Three sigmoid neurons of error, speed and force, taught by back-propagation of the force error.

    With `feedback` it adds to a fixed gain (the thesis' scheme), without it is the controller (Yabuta and Yamada).
    """

    gain: float
    feedback: float
    rate: float
    scale: float
    first: Vec3
    second: Vec3
    third: Vec3

    def start(self):
        return self.first, self.second, self.third, Vec3(0.0, 0.0, 0.0)

    def step(self, state, desired, force, position):
        a, b, c, out = state
        error = desired - force
        inputs = Vec3(error / self.scale, force / self.scale, 1.0)
        h = Vec3(sigmoid(a, inputs), sigmoid(b, inputs), sigmoid(c, inputs))
        push = self.gain * self.scale * (out @ h)
        delta = self.rate * error / self.scale
        a += (delta * out.x * 0.5 * (1.0 - h.x * h.x)) * inputs
        b += (delta * out.y * 0.5 * (1.0 - h.y * h.y)) * inputs
        c += (delta * out.z * 0.5 * (1.0 - h.z * h.z)) * inputs
        out += delta * h
        return self.feedback * self.gain * error + push, (a, b, c, out)


def rivals(gains: Any, rng: Any) -> dict[str, Any]:
    """Every law by its name, for these gains.

    Args:
        gains: of the cautious law.
        rng: of the networks' first weights.
    """
    theta, tick, sigma = gains.theta, gains.arm.tick, gains.arm.sensor.noise
    unit = gains.alpha / theta
    g = unit * (gains.compliance + 1.0 / NOMINAL)
    damping, mass = 1.0 / g, theta / g
    draw = lambda: Vec3(*(0.3 * rng.standard_normal(3)).tolist())  # noqa: E731
    first = {
        "fixed integral, 7 kN/m": Integral(g),
        "fixed integral, stiffest": Integral(gains.gain),
        "impedance": Admittance(mass, damping, 0.0, tick),
        "filtered force derivative": FilteredDerivative(g, theta, 0.01, tick),
        "estimated force rate": EstimatedRate(g, theta, NOMINAL, tick),
        "fuzzy compensation": Fuzzy(g, 0.5 * gains.force, gains.force / theta, tick),
        "feedback-error learning": FeedbackErrorLearning(g, 2.0, tick),
        "learned impedance": Admittance(mass, damping, 0.5, tick),
        "self-tuning": DescendingGain(g, 20.0, tick),
        "stability observer": Observer(g, 6.0 * theta, tick),
        "EKF gain scheduling": Ekf(unit, sigma, 1e4, NOMINAL, tick),
        "network beside a fixed gain": TaughtNeurons(g, 1.0, 0.01, gains.force, draw(), draw(), draw()),
        "network alone": TaughtNeurons(g, 0.0, 0.01, gains.force, draw(), draw(), draw()),
    }
    cautious = gains.cautious()
    own = {
        "point estimate (no bound)": cautious._replace(bounding=0.0),
        "cautious": cautious,
        "cautious, no lock": cautious._replace(locking=0.0),
        "cautious, no backstop": cautious._replace(backing=0.0),
    }
    return {name: AfterTouch(one, gains.approach, sigma) for name, one in first.items()} | own
