"""An independent check of a certificate of palpate certify, in exact arithmetic.

    python -m palpate.certify.force_certificate certificate.json

It is written from the specification below alone, and shares no line with what makes certificates. Numbers are
integers over 2^160; a matrix has a bound of its elements' error. Each tick contracts if P - Phi^T P Phi is positive
definite for P = L L^T: proved by a root whose square differs from it by less than is left over.

The file is JSON: `form`, `gains` (as `gains.toml`, SI), `claims`, and `measured`, an inner loop from a log that takes
the place of `gains.arm.inner`. Let T = 1/rate, K_s the arm's `stiffness`, and for a position arm K_s' = infinity,
cap' = cap/(1 + cap/K_s), for a torque arm and a servo K_s' = K_s, cap' = cap. With K_eff(k) = 1/(1/K_s' + 1/k), f =
k/K_s' and theta' = theta (1 - relief (f + 1/2)/(f + 1)), g(k) = alpha/(theta' K_eff(k)); the gain at the cap is
g(cap').

*State.* `state` names its numbers in order, `units` has w0, k0, wf. x is the tip's position, v = xdot/w0; f1, f2, ...
are the sensor's low-pass in units of k0, f(i+1) the derivative of f(i) divided by wf; r1 ... rn are the readings of
age 1 to n, in k0; u the speed that the law commands [m/s]; c0 the commanded position [m], c1 ... (position arm) those
of earlier ticks; t1 ... (torque arm) torques in k0 of this tick (t1) and earlier ones. At each tick:

- r1 takes the sensor's reading at the tick's beginning: f1, or (K x + B xdot)/k0 without a low-pass; r(i+1) takes
  r(i).
- u = -g k0 r(a) for a reading of age a; a = 0 is the reading at this tick's beginning. c0 grows by T u. c(i+1) takes
  c(i). Servo: u = (1 - s) u' - s g k0 r(a) and c0 grows by T (u + n (u - u')), u' the u of before, s = T/(T + l/10),
  n = n(k) = (l/(2 q) (1 + sqrt(max(1 - 4 m K_s q/D^2, 0))) + l/10)/T, l = D/K_s, q = 1 + k/K_s, at k = cap for a
  constant gain.
- During the tick an input is held. Position arm or servo of d ticks of delay: c(d - 1) as it was, and the new c0 for
  d = 0. Torque arm: K_s/k0 (new c0 - x) - D w0/k0 v, with x, v of the tick's beginning, late by d ticks by way of t1
  ... td.
- Within the tick, position arm: xddot = w^2 (input - x) - 2 z w xdot; torque arm: m xddot = k0 input - K x - B xdot;
  servo: m xddot = K_s (input - x) - D xdot - K x - B xdot; low-pass: a_0 (K x + B xdot)/k0 = f + ... with the
  Butterworth polynomials, several sections multiplied.

d = ceil(delay x rate - 1e-9). A `delay_interval` gives d by its upper end and e = d - floor(lower end x rate + 1e-9):
then d - e commands and e more readings are kept, and the cells' `loss` (0 ... e) is by how much the reading is
younger.

*Claims.* A surface is given by K + B/theta in `low` ... `high` and B/K in `least` ... `most`. `held` and `one-sided`:
g is 1 to `shares`[1] times the gain at the cap, `shares`[0] is 1, `ages` are equal. `adapting`: g is `shares` times
alpha/(theta K_eff(K + B/theta)), the age any of `ages` (with e, up to e more). Servo: g and n are g(k) and n(k) of
any k from (K + B/theta)/`shares`[1] to (K + B/theta)/`shares`[0]; the corners of a cell are both ends of g with both
ends of n. `ages`[1] is at least ceil(rate/sampling - 1e-9), and `ages`[0] is above 0 without a low-pass. Where
`shares`[0] is below 0.01 (position arm), K is fixed at `high`: only g K counts, and g runs from `shares`[0]
alpha/(theta high (1 + most/theta)) to `shares`[1] alpha/(theta high (1 + least/theta)). The cells, as rectangles in
these two numbers, have to cover the claim, each by the corners of its rectangle, for each `loss` and `part`; a cell
of a `one-sided` claim spans all of `low` ... `high`. Parts: the ranges of w^2 and of 2 z w are cut into `parts` each;
part = i parts + j.

*Cells.* With P = L L^T (`norm` is L by rows), P - Phi^T P Phi has to be positive definite at all corners: of K +
B/theta, B/K, g, the part, and for all ages. For a position arm with a known inner loop that is all, since Phi is
affine in each. For the others E = exp(T A) is not: each element of E is within b of the multilinear function through
the corners, b = sum over the parameters of 1/8 max |E''|, for which |E''| is at most twice the block at the upper
right of exp(T [[M, D, 0], [0, M, D], [0, 0, M]]): M has the largest sizes of A's elements (largest values on the
diagonal), D those of A's change along the parameter. The parameters are w^2 and 2 z w (with x counted from the held
input), or K + B/theta and 1/(1 + B/(K theta)). With |b_j| the norm of column j of b, as P bounds it, m the number of
columns that are not zero, and F the map from the state to (x, v, f..., input), P - (1 + h) Phi^T P Phi - (1 + 1/h)
F^T diag(m |b_j|^2) F has to be positive definite for some h > 0 at each corner.
"""

from __future__ import annotations

import json
import re
import sys
from fractions import Fraction
from functools import reduce
from itertools import pairwise, product
from math import ceil, factorial, floor, isqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

FORM, LAW = "palpate force certificate 2", "cautious adaptive control 7"
BITS = 160
ONE = 1 << BITS
SPARE = 1 << 40
"""Margin for rounding in units of 2^-160: 1e-36, for numbers near 1."""
MAX_RATE = 1000
"""Largest row sum of a matrix whose exponential is computed."""
SMALL = Fraction(1, 10**9)
PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803")
Exact = Any
"""A fraction, or an array of them."""


class RefusedError(Exception):
    """A certificate that does not hold; the text says why, in a line."""


class Ball(NamedTuple):
    """A matrix of integers over 2^160, no element further than `error` from the true one."""

    middle: Any
    error: int

    @classmethod
    def of(cls, exact: Exact, error: int = 1) -> Ball:
        """The ball of a matrix of fractions, rounded to 2^-160."""
        return cls(np.array([[round(v * ONE) for v in row] for row in exact], object), error)

    @property
    def largest(self) -> int:
        """Size of the largest element, with its error."""
        return int(abs(self.middle).max()) + self.error

    def __matmul__(self, other: Ball) -> Ball:
        n = len(other.middle)
        error = (n * (self.largest * other.error + other.largest * self.error) >> BITS) + n + 2
        return Ball((self.middle @ other.middle) >> BITS, error)

    def times(self, factor: Fraction) -> Ball:
        """The ball times a positive number."""
        n = factor.numerator
        d = factor.denominator
        return Ball(self.middle * n // d, self.error * n // d + 2)


def exponential(A: Ball) -> Ball:
    """exp(A): a Taylor series of A/2^s, squared s times; the rest of the series is below its last term."""
    n = len(A.middle)
    size = int(abs(A.middle).sum(axis=1).max()) + n * A.error
    if size > MAX_RATE * ONE:
        raise RefusedError("its loop moves too far within a tick")
    halvings = (2 * size // ONE).bit_length()
    small = A.times(Fraction(1, 1 << halvings))
    k = 0
    term = series = Ball(np.diag([ONE] * n).astype(object), 0)
    while term.largest > n + 8 and k < 400:
        k += 1
        term = (term @ small).times(Fraction(1, k))
        series = Ball(series.middle + term.middle, series.error + term.error)
    series = Ball(series.middle, series.error + 2 * n * term.largest)
    return reduce(lambda E, _: E @ E, range(halvings), series)


def is_positive(Q: Ball) -> bool:
    """True if every symmetric matrix within the ball is positive definite."""
    n = len(Q.middle)
    A = Q.middle - np.diag([n * Q.error + SPARE] * n)
    R = np.zeros((n, n), object)
    for j in range(n):
        column = (A[j:, j] << BITS) - (R[j:, : j + 1] @ R[j, : j + 1])
        if column[0] <= SPARE * SPARE:
            return False
        R[j:, j] = column // isqrt(column[0])
    return bool(n * abs((A << BITS) - R @ R.T).max() < SPARE << BITS)


def polynomial(low_pass: str) -> list[Fraction]:
    """a_0 ... a_n of the sensor's low-pass a_0/(s^n + ... + a_0), s in rad/s; [1] for none."""
    text = low_pass.strip().lower().replace(" ", "")
    coefficients = [Fraction(1)]
    two = Fraction(isqrt(2 << 400), 1 << 200)
    for section in [] if text == "none" else text.split("+b"):
        match = re.fullmatch(r"b?utterworth([123]):([0-9.e+-]+)(?:hz)?", section)
        if match is None:
            raise RefusedError(f"the low-pass {low_pass!r} is none of order 1 to 3")
        n = int(match[1])
        w = 2 * PI * Fraction(float(match[2]))
        factor: Any = ((1, 1), (1, two, 1), (1, 2, 2, 1))[n - 1]
        coefficients = list(
            np.convolve(np.array(coefficients, object), factor * w ** np.arange(n, -1, -1, dtype=object))
        )
    return coefficients


class Cell(NamedTuple):
    """A part of a claim: surfaces that one norm covers.

    Args:
        low: K + B/theta from [N/m].
        high: K + B/theta to [N/m].
        least: B/K from [s].
        most: B/K to [s].
        part: number of the part of the inner loop's intervals.
        loss: ticks of lost delay.
    """

    low: Fraction
    high: Fraction
    least: Fraction
    most: Fraction
    part: int
    loss: int

    @classmethod
    def of(cls, cell: dict[str, Any]) -> Cell:
        """The cell of an entry of the file."""
        low, high, least, most = (Fraction(cell[name]) for name in ("low", "high", "least", "most"))
        return cls(low, high, least, most, int(cell.get("part", 0)), int(cell.get("loss", 0)))

    def covers(self, bounds: tuple[Fraction, Fraction], times: tuple[Fraction, Fraction]) -> bool:
        """True if the cell holds all K + B/theta within bounds and all B/K within times."""
        return (
            self.low <= bounds[0]
            and bounds[1] <= self.high
            and self.least <= times[0]
            and times[1] <= self.most
        )


class ExactClaim:
    """Arm, sensor and law of a file, with one of its claims; names are those of the page on force."""

    def __init__(self, gains: dict[str, Any], inner: dict[str, Any] | None, claim: dict[str, Any]):
        arm = gains["arm"]
        inner_loop = inner or arm["inner"]
        rate = Fraction(arm["rate"])
        self.claim = claim
        self.kind = claim["kind"]
        self.tick = 1 / rate
        self.period = max(ceil(rate / Fraction(arm["sensor"]["sampling"]) - SMALL), 1)
        self.filter = polynomial(arm["sensor"].get("low_pass", "none"))
        self.order = len(self.filter) - 1
        self.p = 2 + self.order
        self._read_arm(inner_loop, rate)
        self._read_law(gains)
        self._read_claim(claim)
        self._motions: dict[Any, Ball] = {}
        self._last = -10
        self._sound()

    def _read_arm(self, inner_loop: dict[str, Any], rate: Fraction) -> None:
        """Numbers of the inner loop, and its delay in ticks."""
        self.torque = inner_loop["kind"] == "torque"
        self.servo = inner_loop["kind"] == "servo"
        self.yields = self.torque or self.servo
        self.series = Fraction(inner_loop["stiffness"])
        self.ends: list[tuple[Fraction, Fraction]] = []
        if self.yields:
            self.mass = Fraction(inner_loop["mass"])
            self.damping = Fraction(inner_loop["damping"])
        else:
            bandwidth = inner_loop.get("bandwidth_interval") or (inner_loop["bandwidth"],) * 2
            damping = inner_loop.get("damping_interval") or (inner_loop["damping"],) * 2
            w = [2 * PI * Fraction(v) for v in bandwidth]
            z = [2 * Fraction(v) for v in damping]
            self.ends = [(w[0] ** 2, w[1] ** 2), (z[0] * w[0], z[1] * w[1])]
        interval = inner_loop.get("delay_interval")
        low, high = interval or (inner_loop["delay"],) * 2
        longest = ceil(Fraction(high) * rate - SMALL)
        self.unsure = longest - floor(Fraction(low) * rate + SMALL) if interval else 0
        self.delay = longest - self.unsure

    def _read_law(self, gains: dict[str, Any]) -> None:
        """Numbers of the law, and its gain and lead at the cap."""
        self.theta = Fraction(gains["theta"])
        self.alpha = Fraction(gains.get("alpha", 0.42))
        self.relief = Fraction(gains.get("relief", 0.0))
        self.compliance = 1 / self.series if self.yields else Fraction(0)
        cap = Fraction(gains["cap"])
        cap = cap if self.yields else cap / (1 + cap / self.series)
        self.gain = self._gain(cap)
        self.smooth = Fraction(1)
        self.ahead = Fraction(0)
        if self.servo:
            self.smooth = self.tick / (self.damping / self.series / 10 + self.tick)
            self.ahead = self._lead(cap)

    def _read_claim(self, claim: dict[str, Any]) -> None:
        """Surfaces, gains, ages and units of the claim, and the names of the state."""
        names = ("low", "high", "least", "most")
        self.low, self.high, self.least, self.most = (Fraction(claim[name]) for name in names)
        self.shares = [Fraction(v) for v in claim["shares"]]
        self.ages = list(claim["ages"])
        self.parts = claim.get("parts", 1)
        self.w0, self.k0, self.wf = (Fraction(claim["units"][name]) for name in ("w0", "k0", "wf"))
        self.readings = self.ages[1] + self.unsure
        sent = "t" if self.torque else "c"
        commands = self.delay + 1 if self.torque else max(self.delay, 1)
        self.state = ["x", "v", *(f"f{i + 1}" for i in range(self.order))]
        self.state += [*(f"r{i + 1}" for i in range(self.readings)), "u", "c0"]
        self.state += [f"{sent}{i}" for i in range(1, commands)]

    def _gain(self, bound: Fraction) -> Fraction:
        """The gain for K_u."""
        felt = self.compliance * bound
        lag = self.theta * (1 - self.relief * (felt + Fraction(1, 2)) / (felt + 1))
        return self.alpha / lag * (self.compliance + 1 / bound)

    def _lead(self, bound: Fraction) -> Fraction:
        """Ticks of lead on a servo's smoothed speed for K_u."""
        lag = self.damping / self.series
        total = 1 + bound / self.series
        discriminant = 1 - 4 * self.mass * self.series / self.damping**2 * total
        root = (
            Fraction(isqrt(round(discriminant * (1 << 400))), 1 << 200) if discriminant > 0 else Fraction(0)
        )
        return (lag / 2 / total * (1 + root) + lag / 10) / self.tick

    def _sound(self) -> None:
        (young, old), (lowest, highest) = self.ages, self.shares
        adapting = self.kind == "adapting"
        fine = {
            "kind": self.kind in {"held", "adapting"} or (self.kind == "one-sided" and not self.yields),
            "shares": 0 < lowest <= highest if adapting else lowest == 1 <= highest,
            "ages": 0 <= young <= old >= self.period and (adapting or young == old) and (young or self.order),
            "intervals": 0 <= self.low <= self.high > 0 <= self.least <= self.most and 1 <= self.parts <= 100,
            "state": min(self.w0, self.k0, self.wf) > 0 and list(self.claim["state"]) == self.state,
        }
        if not all(fine.values()):
            raise RefusedError(f"its {self.kind!r} claim is none of this arm and law: {fine}")

    def rates(self, K: Fraction, B: Fraction, inner: Any) -> Exact:
        """Matrix of d/dt of x, v, f... from these and from the held input, which is the last."""
        p = self.p
        n = self.order
        if inner is not None:
            stiffness, damping = inner
            drive = stiffness
        else:
            drive = (self.series if self.servo else self.k0) / self.mass
            stiffness = (K + self.series * self.servo) / self.mass
            damping = (B + self.damping * self.servo) / self.mass
        A = np.full((p + 1, p + 1), Fraction(0), object)
        A[0, 1] = self.w0
        A[1, [0, 1, p]] = -stiffness / self.w0, -damping, drive / self.w0
        for i in range(n - 1):
            A[2 + i, 3 + i] = self.wf
        if n:
            A[p - 1, 2:p] = [-a / self.wf ** (n - 1 - i) for i, a in enumerate(self.filter[:n])]
            A[p - 1, :2] = self.filter[0] / self.wf ** (n - 1) / self.k0 * np.array([K, B * self.w0])
        return A

    def held_rows(self, K: Fraction, B: Fraction, gain: Fraction, ahead: Fraction, age: int) -> Exact:
        """Rows of the tick below the first p, and last the row of the input that is held in the tick."""
        one = Fraction(1)
        rows = {"r1": {"f1": one} if self.order else {"x": K / self.k0, "v": B * self.w0 / self.k0}}
        rows |= {f"r{i}": {f"r{i - 1}": one} for i in range(2, self.readings + 1)}
        reading = {f"r{age}": one} if age else rows["r1"]
        rows["u"] = {name: -self.smooth * gain * self.k0 * v for name, v in reading.items()}
        if self.servo:
            rows["u"]["u"] = 1 - self.smooth
        command = {"c0": one} | {name: self.tick * (1 + ahead) * v for name, v in rows["u"].items()}
        command["u"] = command.get("u", 0) - self.tick * ahead
        rows["c0"] = command
        name, first = ("t", 2) if self.torque else ("c", 1)
        rows |= {f"{name}{i}": {f"{name}{i - 1}": one} for i in range(first, len(self.state))}
        if self.torque:
            command = rows["t1"] = self._spring_force(command)
        if self.delay:
            command = {f"t{self.delay}" if self.torque else f"c{self.delay - 1}": one}
        table = [*(rows[name] for name in self.state[self.p :]), command]
        return [[Fraction(row.get(name, 0)) for name in self.state] for row in table]

    def _spring_force(self, command: dict[str, Fraction]) -> dict[str, Fraction]:
        """Row of a torque arm's force: spring from tip to command, and damping."""
        stiffness = self.series / self.k0
        row = {name: stiffness * v for name, v in command.items()}
        row["x"] = row.get("x", Fraction(0)) - stiffness
        row["v"] = row.get("v", Fraction(0)) - self.damping * self.w0 / self.k0
        return row

    # More than seven arguments: those of a corner.
    def phi(
        self, K: Fraction, B: Fraction, inner: Any, gain: Fraction, ahead: Fraction, age: int
    ) -> tuple[Ball, Any]:
        """The matrix of the tick, and the map from the state to x, v, f... and the held input, shape (p + 1, n)."""
        if (K, B, inner) not in self._motions:
            motion = exponential(Ball.of(self.rates(K, B, inner) * self.tick))
            self._motions[K, B, inner] = Ball(motion.middle[: self.p], motion.error)
        rows = Ball.of(self.held_rows(K, B, gain, ahead, age))
        unchanged = ONE * np.eye(self.p, len(self.state), dtype=object)
        start = Ball(np.vstack([unchanged, rows.middle[-1:]]), rows.error)
        top = self._motions[K, B, inner] @ start
        return Ball(np.vstack([top.middle, rows.middle[:-1]]), max(top.error, rows.error)), start

    def cells(self) -> list[Cell]:
        """The cells of the claim."""
        return list(map(Cell.of, self.claim["cells"]))

    def check_tiles(self) -> None:
        """Check that the cells cover the claim, for every part of the inner loop and every delay."""
        losses = range(1 if self.kind == "adapting" else self.unsure + 1)
        for part, loss in product(range(self.parts**2), losses):
            cells = [c for c in self.cells() if c.part == part and c.loss == loss]
            if self.kind == "one-sided" and any(c.low > self.low or c.high < self.high for c in cells):
                raise RefusedError("a cell of its 'one-sided' claim is not of all that contact may be")
            bounds = spans([end for c in cells for end in (c.low, c.high)], self.low, self.high)
            times = spans([end for c in cells for end in (c.least, c.most)], self.least, self.most)
            for tile in product(bounds, times):
                if not any(c.covers(*tile) for c in cells):
                    raise RefusedError(f"the cells of its {self.kind!r} claim leave a gap")

    def corners(self, cell: Cell) -> list[tuple[Any, ...]]:
        """K, B, inner loop, gain, lead and age of all extremes of a cell."""
        bounds = dict.fromkeys((cell.low, cell.high))
        times = dict.fromkeys((cell.least, cell.most))
        surfaces = [
            (bound / (1 + time / self.theta), time * bound / (1 + time / self.theta))
            for bound, time in product(bounds, times)
        ]
        if self.kind != "adapting":
            age = self.ages[1] + self.unsure - cell.loss
            laws = [(share * self.gain, self.ahead, age) for share in dict.fromkeys(self.shares)]
        else:
            if self._gain_fades:  # g K alone counts
                surfaces = [(cell.high, time * cell.high) for time in times]
            laws = self._adapting_laws(cell)
        inners = self._inner_loops(cell.part)
        return [(*surface, inner, *law) for surface in surfaces for inner in inners for law in laws]

    @property
    def _gain_fades(self) -> bool:
        """True if the smallest gain of an adapting position arm is next to nothing."""
        return not self.yields and self.shares[0] < Fraction(1, 100)

    def _adapting_laws(self, cell: Cell) -> list[tuple[Any, ...]]:
        """Gain, lead and age of all extremes of an adapting law."""
        extremes = list(zip(self.shares, (cell.high, cell.low), strict=True))
        gains = [share * self.alpha * (self.compliance + 1 / b) / self.theta for share, b in extremes]
        leads = [self.ahead]
        if self._gain_fades:
            gains = [gains[0] / (1 + cell.most / self.theta), gains[1] / (1 + cell.least / self.theta)]
        if self.servo:  # the shares are of K + B/theta over K_u, with which gain and lead fall
            estimates = [b / share for share, b in extremes]
            gains = list(map(self._gain, estimates))
            leads = list(map(self._lead, estimates))
        ages = range(self.ages[0], self.ages[1] + self.unsure + 1)
        return list(product(dict.fromkeys(gains), leads, ages))

    def _inner_loops(self, part: int) -> list[Any]:
        """Stiffness and damping per mass of the inner loop, at all extremes of a part of their intervals."""
        if self.yields:
            return [None]
        edges = []
        for i, (a, b) in zip(divmod(part, self.parts), self.ends, strict=True):
            step = (b - a) / self.parts
            edges.append(dict.fromkeys((a + i * step, a + (i + 1) * step)))
        return list(product(*edges))

    def curvature(self, cell: Cell) -> Exact:
        """Elements of the distance of exp(T A) from the multilinear function through its corners, at most.

        A is affine in each of its parameters alone; the distance is at most the sum of h^2/8 |E''|. With c so large
        that A + c has no negative diagonal, and M the elements' largest sizes in that, |E''| is at most exp(-c T) times
        the second derivative of exp(T (M + s D)) for |dA/ds| <= D: twice the last block of one of 3 x 3 blocks.
        None where A is affine in all that varies. For a position arm x is counted from the held input: at rest it is 0.
        """
        if not self.yields and all(a == b for a, b in self.ends):
            return None
        corners = self.corners(cell)
        rates = np.array([self.rates(*corner[:3]) for corner in corners])
        if self.yields:
            steps = self._steps_of_surface(cell)
        else:
            rates[:, :-1, -1] += rates[:, :-1, 0]
            steps = self._steps_of_inner_loop([corner[2] for corner in corners])
        zero = np.full_like(rates[0], Fraction(0))
        diagonals = [-A[i, i] for A in rates for i in range(len(A))]
        c = Fraction(float(max(0, *diagonals)) * (1.0 + 1e-9))
        M = abs(rates + c * np.diag([Fraction(1)] * len(zero))).max(axis=0)
        fade = exponential(Ball.of([[-c * self.tick]])).largest
        bound = zero
        for D in steps:
            if not D.any():
                continue
            blocks = np.block([[M, D, zero], [zero, M, D], [zero, zero, M]])
            exact = exponential(Ball.of(blocks * self.tick))
            corner = abs(exact.middle[: len(M), 2 * len(M) :]) + exact.error
            bound = bound + corner * fade * Fraction(1, 4 * ONE * ONE)
        return bound[:-1]

    def _steps_of_surface(self, cell: Cell) -> list[Exact]:
        """Largest changes of A over a cell, along K + B/theta and along B/K."""
        unloaded = self.rates(Fraction(0), Fraction(0), None)
        of_K = abs(self.rates(Fraction(1), Fraction(0), None) - unloaded)
        of_B = self.theta * abs(self.rates(Fraction(0), Fraction(1), None) - unloaded)
        low, high = (1 / (1 + time / self.theta) for time in (cell.most, cell.least))
        along = np.maximum(low * of_K + (1 - low) * of_B, high * of_K + (1 - high) * of_B)
        return [(cell.high - cell.low) * along, (high - low) * cell.high * (of_K + of_B)]

    def _steps_of_inner_loop(self, inners: list[Any]) -> list[Exact]:
        """Largest changes of A over a part of the inner loop, along its stiffness and along its damping."""
        stiffness, damping = (max(values) - min(values) for values in zip(*inners, strict=True))
        steps = [np.full((self.p + 1, self.p + 1), Fraction(0), object) for _ in range(2)]
        steps[0][1, 0] = stiffness / self.w0
        steps[1][1, 1] = damping
        return steps

    def check_cell(self, cell: Cell, norm: list[list[float]]) -> None:
        """Check that every tick of a cell contracts in its norm."""
        n = len(self.state)
        if [len(row) for row in norm] != [n] * n:
            raise RefusedError("a norm is not of the loop's size")
        L = np.array([[Fraction(v) for v in row] for row in norm])
        size = abs(L).max()
        root = Ball.of(L / size if size else L, 0).middle
        P = Ball((root @ root.T) >> BITS, 0)  # this very matrix is the norm
        bound = self.curvature(cell)
        W = None if bound is None else self._weights(P, bound)
        ticks = (self.phi(*corner) for corner in self.corners(cell))
        if not is_positive(P) or not all(self._contracts(P, W, *tick) for tick in ticks):
            raise RefusedError(f"a cell of its {self.kind!r} claim does not contract")

    def _weights(self, P: Ball, bound: Exact) -> Ball:
        """W with |D y|^2 <= y^T W y in the norm P, from the columns of the bound of D (Cauchy and Schwarz)."""
        middle = abs(P.middle[: self.p, : self.p])
        tiny = Fraction(1, ONE)
        sizes = [column @ middle @ column / ONE for column in bound.T]
        count = sum(size > tiny for size in sizes) * (1 + Fraction(1, 1 << 40))
        weights = [size * (count if size > tiny else 1 << 60) for size in sizes]
        return Ball.of(np.diag(weights))

    def _contracts(self, P: Ball, W: Ball | None, Phi: Ball, start: Ball) -> bool:
        """True if |Phi x| + |D x| < |x| in the norm P, D the distance of the exponential from its corners."""
        after = symmetric(P, Phi)
        if W is None:
            return is_positive(Ball(P.middle - after.middle, after.error))
        if not self.yields:
            relative = start.middle[:1] - start.middle[-1:]
            start = Ball(np.vstack([relative, start.middle[1:]]), 2 * start.error)
        distance = symmetric(W, start)
        for halves in sorted(range(-60, 1), key=lambda i: abs(i - self._last)):
            h = Fraction(2.0 ** (0.5 * halves))  # any will do: (a + b)^2 <= (1 + h) a^2 + (1 + 1/h) b^2
            a = after.times(1 + h)
            b = distance.times(1 + 1 / h)
            if is_positive(Ball(P.middle - a.middle - b.middle, a.error + b.error)):
                self._last = halves
                return True
        return False


def symmetric(P: Ball, X: Ball) -> Ball:
    """X^T P X, made symmetric."""
    square = Ball(X.middle.T, X.error) @ (P @ X)
    return Ball((square.middle + square.middle.T) // 2, square.error + 1)


def spans(edges: list[Fraction], low: Fraction, high: Fraction) -> list[tuple[Fraction, Fraction]]:
    """Intervals between neighbouring edges within low ... high."""
    if low == high:
        return [(low, high)]
    return list(pairwise(sorted({low, high, *(e for e in edges if low < e < high)})))


def check(data: bytes | str) -> int:
    """Check that all cells of a certificate contract, and that they cover its claims; their number.

    Args:
        data: the file.

    Raises:
        RefusedError: it does not hold; its text says why.
    """
    try:
        file = json.loads(data)
        count = 0
        if file["form"] != FORM or file["gains"].get("law", LAW) != LAW:
            raise RefusedError(f"it is not of the form {FORM!r} and the law {LAW!r}")
        for claim in file["claims"]:
            exact = ExactClaim(file["gains"], file.get("measured"), claim)
            exact.check_tiles()
            for cell, entry in zip(exact.cells(), claim["cells"], strict=True):
                exact.check_cell(cell, entry["norm"])
                count += 1
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise RefusedError(f"it is no certificate: {type(error).__name__} {error}") from None
    if not count:
        raise RefusedError("it claims nothing")
    return count


def check_slide(data: bytes | str, low: float, high: float) -> None:
    """Check that a slide on K from low to high is proved, normal off by up to 10 degrees, friction up to mu_max.

    For each K one cell without damping holds all of m K, with cos phi (cos phi - mu sin phi) <= m <= cos phi (cos phi +
    mu sin phi); the last is largest at tan 2 phi = mu, and there (1 + sqrt(1 + mu^2))/2.

    Args:
        data: the file of a certificate that holds.
        low: of K as the measured position feels it, from [N/m].
        high: to [N/m].

    Raises:
        RefusedError: some K is not proved.
    """
    file = json.loads(data)
    mu = Fraction(file["gains"]["slide"]["mu_max"])
    least, most = _normal_ratios(mu)
    ends = sorted(
        (Fraction(cell["low"]) / least, Fraction(cell["high"]) / most)
        for claim in file["claims"]
        if claim["kind"] != "adapting"
        for cell in claim["cells"]
        if not cell["least"]
    )
    reached = Fraction(low)
    for start, end in ends:
        if start <= reached:
            reached = max(reached, end)
    if reached < Fraction(high) or least <= 0:
        raise RefusedError(f"a slide is not proved on surfaces above {float(reached):.6g} N/m")


def _normal_ratios(mu: Fraction) -> tuple[Fraction, Fraction]:
    """Bounds of m for a friction mu and a normal off by up to 10 degrees."""
    x = PI / 18
    series = ((-1) ** k * x ** (2 * k + 1) / factorial(2 * k + 1) for k in range(8))
    sine = sum(series, Fraction(0)) + SMALL**2
    series = ((-1) ** k * x ** (2 * k) / factorial(2 * k) for k in range(8))
    cosine = sum(series, Fraction(0))
    least = (cosine - SMALL**2) * (cosine - SMALL**2 - mu * sine)
    most = (cosine + SMALL**2) * (cosine + SMALL**2 + mu * sine)
    if mu * (cosine**2 - sine**2) < 2 * sine * cosine:
        most = (1 + Fraction(isqrt(ceil((1 + mu**2) * ONE**2)) + 1, ONE)) / 2
    return least, most


if __name__ == "__main__":
    try:
        sys.stdout.write(f"holds: {check(Path(sys.argv[1]).read_bytes())} cells\n")
    except RefusedError as refused:
        sys.exit(f"does not hold: {refused}")
