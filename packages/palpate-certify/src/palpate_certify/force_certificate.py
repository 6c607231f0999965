"""An independent check of a certificate of palpate certify, in exact arithmetic.

    python -m palpate_certify.force_certificate certificate.json

It is written from the page on force alone, and shares no line with what makes certificates. Numbers are integers over
2^160; a matrix has a bound of its elements' error. Each tick contracts if P - Phi^T P Phi is positive definite for
P = L L^T: proved by a root whose square differs from it by less than is left over.
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
"""Of 2^-160, left for rounding: 1e-36, of numbers near 1."""
FASTEST = 1000
"""Largest rate within a tick that is computed."""
SMALL = Fraction(1, 10**9)
PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803")
Exact = Any
"""A fraction, or an array of them."""


class RefusedError(Exception):
    """Why a certificate does not hold, in a line."""


class Ball(NamedTuple):
    """A matrix of integers over 2^160, no element further than `error` from the true one."""

    middle: Any
    error: int

    @classmethod
    def of(cls, exact: Exact, error: int = 1) -> Ball:
        """Fractions, rounded to it."""
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
        """Of every element, by a positive number."""
        n, d = factor.numerator, factor.denominator
        return Ball(self.middle * n // d, self.error * n // d + 2)


def exponential(A: Ball) -> Ball:
    """exp(A): a Taylor series of A/2^s, squared s times; the rest of the series is below its last term."""
    n = len(A.middle)
    size = int(abs(A.middle).sum(axis=1).max()) + n * A.error
    if size > FASTEST * ONE:
        raise RefusedError("its loop moves too far within a tick")
    halvings = (2 * size // ONE).bit_length()
    small, k = A.times(Fraction(1, 1 << halvings)), 0
    term = whole = Ball(np.diag([ONE] * n).astype(object), 0)
    while term.largest > n + 8 and k < 400:
        k += 1
        term = (term @ small).times(Fraction(1, k))
        whole = Ball(whole.middle + term.middle, whole.error + term.error)
    whole = Ball(whole.middle, whole.error + 2 * n * term.largest)
    return reduce(lambda E, _: E @ E, range(halvings), whole)


def is_positive(Q: Ball) -> bool:
    """Whether every symmetric matrix within the ball is positive definite."""
    n = len(Q.middle)
    A = Q.middle - np.diag([n * Q.error + SPARE] * n)
    R = np.zeros((n, n), object)
    for j in range(n):
        rest = (A[j:, j] << BITS) - (R[j:, : j + 1] @ R[j, : j + 1])
        if rest[0] <= SPARE * SPARE:
            return False
        R[j:, j] = rest // isqrt(rest[0])
    return bool(n * abs((A << BITS) - R @ R.T).max() < SPARE << BITS)


def polynomial(low_pass: str) -> list[Fraction]:
    """a_0 ... a_n of the sensor's low-pass a_0/(s^n + ... + a_0), s in rad/s; [1] for none."""
    word, found = low_pass.strip().lower().replace(" ", ""), [Fraction(1)]
    two = Fraction(isqrt(2 << 400), 1 << 200)
    for section in [] if word == "none" else word.split("+b"):
        match = re.fullmatch(r"b?utterworth([123]):([0-9.e+-]+)(?:hz)?", section)
        if match is None:
            raise RefusedError(f"the low-pass {low_pass!r} is none of order 1 to 3")
        n, w = int(match[1]), 2 * PI * Fraction(float(match[2]))
        own: Any = ((1, 1), (1, two, 1), (1, 2, 2, 1))[n - 1]
        found = list(np.convolve(np.array(found, object), own * w ** np.arange(n, -1, -1, dtype=object)))
    return found


class ExactClaim:
    """Arm, sensor and law of a file, with one of its claims; names are those of the page on force."""

    def __init__(self, gains: dict[str, Any], inner: dict[str, Any] | None, claim: dict[str, Any]):
        arm = gains["arm"]
        own, rate = inner or arm["inner"], Fraction(arm["rate"])
        self.claim, self.kind, self.tick = claim, claim["kind"], 1 / rate
        self.torque, self.servo = own["kind"] == "torque", own["kind"] == "servo"
        self.series = Fraction(own["stiffness"])
        self.theta, self.alpha = Fraction(gains["theta"]), Fraction(gains.get("alpha", 0.42))
        cap, relief = Fraction(gains["cap"]), Fraction(gains.get("relief", 0.0))
        self.yields = self.torque or self.servo
        self.compliance = 1 / self.series if self.yields else Fraction(0)
        cap = cap if self.yields else cap / (1 + cap / self.series)
        self.relief = relief
        self.gain = self._gain(cap)
        low, high = own.get("delay_interval") or (own["delay"],) * 2
        most = ceil(Fraction(high) * rate - SMALL)
        self.unsure = most - floor(Fraction(low) * rate + SMALL) if own.get("delay_interval") else 0
        self.delay = most - self.unsure
        self.period = max(ceil(rate / Fraction(arm["sensor"]["sampling"]) - SMALL), 1)
        self.ends: list[tuple[Fraction, Fraction]] = []
        self.smooth, self.ahead = Fraction(1), Fraction(0)
        if self.yields:
            self.mass, self.damping = Fraction(own["mass"]), Fraction(own["damping"])
        else:
            w = [2 * PI * Fraction(v) for v in own.get("bandwidth_interval") or (own["bandwidth"],) * 2]
            z = [2 * Fraction(v) for v in own.get("damping_interval") or (own["damping"],) * 2]
            self.ends = [(w[0] ** 2, w[1] ** 2), (z[0] * w[0], z[1] * w[1])]
        if self.servo:
            self.smooth = self.tick / (self.damping / self.series / 10 + self.tick)
            self.ahead = self._lead(cap)
        self.filter = polynomial(arm["sensor"].get("low_pass", "none"))
        names = ("low", "high", "least", "most")
        self.low, self.high, self.least, self.most = (Fraction(claim[name]) for name in names)
        self.shares, self.ages = [Fraction(v) for v in claim["shares"]], list(claim["ages"])
        self.parts = claim.get("parts", 1)
        self.w0, self.k0, self.wf = (Fraction(claim["units"][name]) for name in ("w0", "k0", "wf"))
        self.order, self.readings = len(self.filter) - 1, self.ages[1] + self.unsure
        self.p, self._moved, self._last = 2 + self.order, {}, -10  # type: ignore[var-annotated]
        sent, late = "t" if self.torque else "c", self.delay + 1 if self.torque else max(self.delay, 1)
        self.state = ["x", "v", *(f"f{i + 1}" for i in range(self.order))]
        self.state += [*(f"r{i + 1}" for i in range(self.readings)), "u", "c0"]
        self.state += [f"{sent}{i}" for i in range(1, late)]
        self._sound()

    def _gain(self, bound: Fraction) -> Fraction:
        """The gain for K_u."""
        felt = self.compliance * bound
        lag = self.theta * (1 - self.relief * (felt + Fraction(1, 2)) / (felt + 1))
        return self.alpha / lag * (self.compliance + 1 / bound)

    def _lead(self, bound: Fraction) -> Fraction:
        """Ticks of lead on a servo's smoothed speed for K_u."""
        lag, total = self.damping / self.series, 1 + bound / self.series
        rest = 1 - 4 * self.mass * self.series / self.damping**2 * total
        root = Fraction(isqrt(round(rest * (1 << 400))), 1 << 200) if rest > 0 else Fraction(0)
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
        """d/dt of x, v, f... and of the held input, which is the last."""
        p, n = self.p, self.order
        A = np.full((p + 1, p + 1), Fraction(0), object)
        A[0, 1] = self.w0
        if self.servo:
            pull, damped = self.series + K, self.damping + B
            A[1, [0, 1, p]] = (
                -pull / self.mass / self.w0,
                -damped / self.mass,
                self.series / self.mass / self.w0,
            )
        elif inner is None:
            A[1, [0, 1, p]] = -K / self.mass / self.w0, -B / self.mass, self.k0 / self.mass / self.w0
        else:
            A[1, [0, 1, p]] = -inner[0] / self.w0, -inner[1], inner[0] / self.w0
        for i in range(n - 1):
            A[2 + i, 3 + i] = self.wf
        if n:
            A[p - 1, 2:p] = [-a / self.wf ** (n - 1 - i) for i, a in enumerate(self.filter[:n])]
            A[p - 1, :2] = self.filter[0] / self.wf ** (n - 1) / self.k0 * np.array([K, B * self.w0])
        return A

    def rest(self, K: Fraction, B: Fraction, gain: Fraction, ahead: Fraction, age: int) -> Exact:
        """All rows but the first p, and with them the row of the input that is held in this tick, which is the last."""
        one = Fraction(1)
        rows = {"r1": {"f1": one} if self.order else {"x": K / self.k0, "v": B * self.w0 / self.k0}}
        rows |= {f"r{i}": {f"r{i - 1}": one} for i in range(2, self.readings + 1)}
        used = {f"r{age}": one} if age else rows["r1"]
        taken = {k: -self.smooth * gain * self.k0 * v for k, v in used.items()}
        rows["u"] = taken | ({"u": 1 - self.smooth} if self.servo else {})
        held = {"c0": one} | {k: self.tick * (1 + ahead) * v for k, v in rows["u"].items()}
        held["u"] = held.get("u", 0) - self.tick * ahead
        rows["c0"] = held
        name, first = ("t", 2) if self.torque else ("c", 1)
        rows |= {f"{name}{i}": {f"{name}{i - 1}": one} for i in range(first, len(self.state))}
        if self.torque:
            stiff = self.series / self.k0
            less = {"x": stiff, "v": self.damping * self.w0 / self.k0}
            held = {k: stiff * held.get(k, 0) - less.get(k, 0) for k in (*held, "x", "v")}
            rows["t1"] = held
        if self.delay:
            held = {f"t{self.delay}" if self.torque else f"c{self.delay - 1}": one}
        wanted = [*(rows[name] for name in self.state[self.p :]), held]
        return [[Fraction(row.get(name, 0)) for name in self.state] for row in wanted]

    # More than seven arguments: those of a corner.
    def phi(
        self, K: Fraction, B: Fraction, inner: Any, gain: Fraction, ahead: Fraction, age: int
    ) -> tuple[Ball, Any]:
        """The matrix of the tick, and the map from the state to x, v, f... and the held input, shape (p + 1, n)."""
        if (K, B, inner) not in self._moved:
            whole = exponential(Ball.of(self.rates(K, B, inner) * self.tick))
            self._moved[K, B, inner] = Ball(whole.middle[: self.p], whole.error)
        rows = Ball.of(self.rest(K, B, gain, ahead, age))
        fed = Ball(
            np.vstack([ONE * np.eye(self.p, len(self.state), dtype=object), rows.middle[-1:]]), rows.error
        )
        top = self._moved[K, B, inner] @ fed
        return Ball(np.vstack([top.middle, rows.middle[:-1]]), max(top.error, rows.error)), fed

    def cells(self) -> list[tuple[Any, ...]]:
        """K + B/theta from and to, B/K from and to, part of the inner loop and loss, as the file has them."""
        names = ("low", "high", "least", "most")
        own = self.claim["cells"]
        return [(*(Fraction(c[k]) for k in names), int(c.get("part", 0)), int(c.get("loss", 0))) for c in own]

    def check_tiles(self) -> None:
        """That the cells cover the claim, for every part of the inner loop and every delay."""
        losses = range(1 if self.kind == "adapting" else self.unsure + 1)
        for place in product(range(self.parts**2), losses):
            own = [c for c in self.cells() if c[4:] == place]
            if self.kind == "one-sided" and any(c[0] > self.low or c[1] < self.high for c in own):
                raise RefusedError("a cell of its 'one-sided' claim is not of all that contact may be")
            bounds = spans([e for c in own for e in c[:2]], self.low, self.high)
            times = spans([e for c in own for e in c[2:4]], self.least, self.most)
            for (a, b), (s, t) in product(bounds, times):
                if not any(c[0] <= a and b <= c[1] and c[2] <= s and t <= c[3] for c in own):
                    raise RefusedError(f"the cells of its {self.kind!r} claim leave a gap")

    def corners(self, box: tuple[Any, ...]) -> list[tuple[Any, ...]]:
        """K, B, inner loop, gain, lead and age of all extremes of a cell."""
        low, high, least, most, part, loss = box
        old, theta = self.ages[1] + self.unsure, self.theta
        fades = self.kind == "adapting" and not self.yields and self.shares[0] < Fraction(1, 100)
        bounds, times = dict.fromkeys((low, high)), dict.fromkeys((least, most))
        surfaces = [(b / (1 + t / theta), t * b / (1 + t / theta)) for b, t in product(bounds, times)]
        leads = [self.ahead]
        if self.kind == "adapting":
            ends = [
                s * self.alpha * (self.compliance + 1 / b) / theta
                for s, b in zip(self.shares, (high, low), strict=True)
            ]
            if fades:  # g K alone counts
                surfaces = [(high, t * high) for t in times]
                ends = [ends[0] / (1 + most / theta), ends[1] / (1 + least / theta)]
            if self.servo:  # the shares are of K + B/theta over K_u, with which gain and lead fall
                reach = [b / s for s, b in zip(self.shares, (high, low), strict=True)]
                ends, leads = [self._gain(k) for k in reach], [self._lead(k) for k in reach]
            laws = list(product(dict.fromkeys(ends), leads, range(self.ages[0], old + 1)))
        else:
            laws = [(s * self.gain, self.ahead, old - loss) for s in dict.fromkeys(self.shares)]
        inners: list[Any] = [None]
        if not self.yields:
            parts = zip(divmod(part, self.parts), self.ends, strict=True)
            cut = [
                dict.fromkeys(a + (b - a) * Fraction(i + k, self.parts) for k in (0, 1))
                for i, (a, b) in parts
            ]
            inners = list(product(*cut))
        return [(*s, i, *law) for s in surfaces for i in inners for law in laws]

    def curvature(self, box: tuple[Any, ...]) -> Exact:
        """Elements of the distance of exp(T A) from the multilinear function through its corners, at most.

        A is affine in each of its parameters alone; the distance is at most the sum of h^2/8 |E''|. With c so large
        that A + c has no negative diagonal, and M the elements' largest sizes in that, |E''| is at most exp(-c T) times
        the second derivative of exp(T (M + s D)) for |dA/ds| <= D: twice the last block of one of 3 x 3 blocks.
        None where A is affine in all that varies. For a position arm x is counted from the held input: at rest it is 0.
        """
        if not self.yields and all(a == b for a, b in self.ends):
            return None
        low, high, least, most = box[:4]
        inners = [c[2] for c in self.corners(box)]
        rates = np.array([self.rates(*c[:3]) for c in self.corners(box)])
        if self.yields:
            none, of_K, of_B = (
                self.rates(Fraction(a), Fraction(b), None) for a, b in ((0, 0), (1, 0), (0, 1))
            )
            of_K, of_B = abs(of_K - none), self.theta * abs(of_B - none)
            share = [1 / (1 + t / self.theta) for t in (most, least)]
            along = reduce(np.maximum, [s * of_K + (1 - s) * of_B for s in share])
            steps = [(high - low) * along, (share[1] - share[0]) * high * (of_K + of_B)]
        else:
            rates[:, :-1, -1] += rates[:, :-1, 0]
            steps = [np.full_like(rates[0], Fraction(0)) for _ in range(2)]
            steps[0][1, 0], steps[1][1, 1] = (max(v) - min(v) for v in zip(*inners, strict=True))
            steps[0] = steps[0] / self.w0
        eye = np.diag([Fraction(1)] * len(rates[0]))
        c = Fraction(float(max(0, *(-A[i, i] for A in rates for i in range(len(A))))) * (1.0 + 1e-9))
        M, Z = abs(rates + c * eye).max(axis=0), 0 * eye
        fade = exponential(Ball.of([[-c * self.tick]])).largest
        found = Z
        for D in steps:
            made = exponential(Ball.of(np.block([[M, D, Z], [Z, M, D], [Z, Z, M]]) * self.tick))
            block = abs(made.middle[: len(M), 2 * len(M) :]) + made.error
            found = found + (block * fade * Fraction(1, 4 * ONE * ONE) if D.any() else 0)
        return found[:-1]

    def check_cell(self, box: tuple[Any, ...], norm: list[list[float]]) -> None:
        """That every tick of it contracts in its norm."""
        n = len(self.state)
        if [len(row) for row in norm] != [n] * n:
            raise RefusedError("a norm is not of the loop's size")
        L = np.array([[Fraction(v) for v in row] for row in norm])
        size = abs(L).max()
        root = Ball.of(L / size if size else L, 0).middle
        P = Ball((root @ root.T) >> BITS, 0)  # this very matrix is the norm
        bound = self.curvature(box)
        W = None if bound is None else self._weights(P, bound)
        if not is_positive(P) or not all(self._contracts(P, W, *self.phi(*c)) for c in self.corners(box)):
            raise RefusedError(f"a cell of its {self.kind!r} claim does not contract")

    def _weights(self, P: Ball, bound: Exact) -> Ball:
        """W with |D y|^2 <= y^T W y in the norm P: by columns of D's bound, by the inequality of Cauchy and Schwarz."""
        middle, tiny = abs(P.middle[: self.p, : self.p]), Fraction(1, ONE)
        sizes = [column @ middle @ column / ONE for column in bound.T]
        many = sum(v > tiny for v in sizes) * (1 + Fraction(1, 1 << 40))
        return Ball.of(np.diag([v * (many if v > tiny else 1 << 60) for v in sizes]))

    def _contracts(self, P: Ball, W: Ball | None, Phi: Ball, fed: Ball) -> bool:
        """Whether |Phi x| + |D x| < |x| in the norm P, D the distance of the exponential from its corners."""
        after = symmetric(P, Phi)
        if W is None:
            return is_positive(Ball(P.middle - after.middle, after.error))
        if not self.yields:
            fed = Ball(np.vstack([fed.middle[:1] - fed.middle[-1:], fed.middle[1:]]), 2 * fed.error)
        beside = symmetric(W, fed)
        for halves in sorted(range(-60, 1), key=lambda i: abs(i - self._last)):
            h = Fraction(2.0 ** (0.5 * halves))  # any will do: (a + b)^2 <= (1 + h) a^2 + (1 + 1/h) b^2
            a, b = after.times(1 + h), beside.times(1 + 1 / h)
            if is_positive(Ball(P.middle - a.middle - b.middle, a.error + b.error)):
                self._last = halves
                return True
        return False


def symmetric(P: Ball, X: Ball) -> Ball:
    """X^T P X, made symmetric."""
    found = Ball(X.middle.T, X.error) @ (P @ X)
    return Ball((found.middle + found.middle.T) // 2, found.error + 1)


def spans(edges: list[Fraction], low: Fraction, high: Fraction) -> list[tuple[Fraction, Fraction]]:
    """Intervals between neighbouring edges within low ... high."""
    if low == high:
        return [(low, high)]
    return list(pairwise(sorted({low, high, *(e for e in edges if low < e < high)})))


def check(data: bytes | str) -> int:
    """How many cells a certificate has, all of which contract, and which cover its claims.

    Args:
        data: the file.

    Raises:
        RefusedError: it does not hold; its text says why.
    """
    try:
        file, count = json.loads(data), 0
        if file["form"] != FORM or file["gains"].get("law", LAW) != LAW:
            raise RefusedError(f"it is not of the form {FORM!r} and the law {LAW!r}")
        for claim in file["claims"]:
            own = ExactClaim(file["gains"], file.get("measured"), claim)
            own.check_tiles()
            for box, cell in zip(own.cells(), claim["cells"], strict=True):
                own.check_cell(box, cell["norm"])
                count += 1
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise RefusedError(f"it is no certificate: {type(error).__name__} {error}") from None
    if not count:
        raise RefusedError("it claims nothing")
    return count


def check_slide(data: bytes | str, low: float, high: float) -> None:
    """That a slide on K from low to high is proved, its normal off by up to 10 degrees, friction up to mu_max.

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
    mu, x = Fraction(file["gains"]["slide"]["mu_max"]), PI / 18
    sine = (
        sum(((-1) ** k * x ** (2 * k + 1) / factorial(2 * k + 1) for k in range(8)), Fraction(0)) + SMALL**2
    )
    cosine = sum(((-1) ** k * x ** (2 * k) / factorial(2 * k) for k in range(8)), Fraction(0))
    least = (cosine - SMALL**2) * (cosine - SMALL**2 - mu * sine)
    most = (cosine + SMALL**2) * (cosine + SMALL**2 + mu * sine)
    if mu * (cosine**2 - sine**2) < 2 * sine * cosine:
        most = (1 + Fraction(isqrt(ceil((1 + mu**2) * ONE**2)) + 1, ONE)) / 2
    cells = [
        c for claim in file["claims"] if claim["kind"] != "adapting" for c in claim["cells"] if not c["least"]
    ]
    ends = sorted((Fraction(c["low"]) / least, Fraction(c["high"]) / most) for c in cells)
    reached = Fraction(low)
    for start, end in ends:
        if start <= reached:
            reached = max(reached, end)
    if reached < Fraction(high) or least <= 0:
        raise RefusedError(f"a slide is not proved on surfaces above {float(reached):.6g} N/m")


if __name__ == "__main__":
    try:
        sys.stdout.write(f"holds: {check(Path(sys.argv[1]).read_bytes())} cells\n")
    except RefusedError as refused:
        sys.exit(f"does not hold: {refused}")
