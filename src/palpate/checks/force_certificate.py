"""An independent check of a certificate of palpate certify, in exact arithmetic, of Python's own library alone.

    python -m palpate.checks.force_certificate certificate.json

It is written from the page on force alone, and shares no line with what makes certificates. Numbers are integers over
2^160; a matrix has a bound of its elements' error. Each tick contracts if P - Phi^T P Phi is positive definite for
P = L L^T: proved by a root whose square differs from it by less than is left over.
"""

from __future__ import annotations

import json
import re
import sys
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise, product
from math import ceil, floor, isqrt
from operator import add, mul
from pathlib import Path
from typing import Any

FORM, LAW = "palpate force certificate 2", "cautious adaptive control 7"
BITS = 160
ONE = 1 << BITS
SPARE = 1 << 40
"""Of 2^-160, left for rounding: 1e-36, of numbers near 1."""
FASTEST = 1000
"""Largest rate within a tick that is computed."""
Real = Fraction
Box = tuple[Real, Real, Real, Real, int, int]
Surface = tuple[Real, Real]
Rows = list[list[Real]]


class RefusedError(Exception):
    """Why a certificate does not hold, in a line."""


@dataclass(frozen=True)
class Ball:
    """A matrix of integers over 2^160, no element further than `error` from the true one."""

    rows: tuple[tuple[int, ...], ...]
    error: int

    @classmethod
    def of(cls, rows: Rows, error: int = 1) -> Ball:
        """Fractions, rounded to it."""
        return cls(tuple(tuple(round(v * ONE) for v in row) for row in rows), error)

    @property
    def largest(self) -> int:
        """Size of the largest element, with its error."""
        return max(max(map(abs, row)) for row in self.rows) + self.error

    @property
    def transpose(self) -> Ball:
        """The matrix with rows for columns."""
        return Ball(tuple(zip(*self.rows, strict=True)), self.error)

    def __matmul__(self, other: Ball) -> Ball:
        n, columns = len(other.rows), []
        for column in zip(*other.rows, strict=True):
            used = [i for i, v in enumerate(column) if v] or [0]  # most are sparse
            values = [column[i] for i in used]
            columns.append([sum(map(mul, [row[i] for i in used], values)) >> BITS for row in self.rows])
        rows = tuple(zip(*columns, strict=True))
        error = n * (self.largest * other.error + other.largest * self.error >> BITS) + n + 1
        return Ball(rows, error)

    def times(self, factor: Real) -> Ball:
        """Of every element, by a number."""
        n, d = factor.numerator, factor.denominator
        return Ball(tuple(tuple(v * n // d for v in row) for row in self.rows), self.error * abs(n) // d + 2)


def total(A: Ball, B: Ball) -> Ball:
    """Sum of two matrices, with their errors."""
    both = zip(A.rows, B.rows, strict=True)
    return Ball(tuple(tuple(map(add, x, y)) for x, y in both), A.error + B.error)


def exponential(A: Ball) -> Ball:
    """exp(A): a Taylor series of A/2^s, squared s times; the rest of the series is below its last term."""
    n = len(A.rows)
    size = max(sum(map(abs, row)) for row in A.rows) + n * A.error
    if size > FASTEST * ONE:
        raise RefusedError("its loop moves too far within a tick")
    halvings = (2 * size // ONE).bit_length()
    small = A.times(Fraction(1, 1 << halvings))
    term = whole = Ball(tuple(tuple(ONE * (i == j) for j in range(n)) for i in range(n)), 0)
    k = 0
    while term.largest > n + 8 and k < 400:
        k += 1
        term = (term @ small).times(Fraction(1, k))
        whole = total(whole, term)
    whole = Ball(whole.rows, whole.error + 2 * n * term.largest)
    for _ in range(halvings):
        whole = whole @ whole
    return whole


def is_positive(Q: Ball) -> bool:
    """Whether every symmetric matrix within the ball is positive definite."""
    n, A = len(Q.rows), Q.rows
    lift = n * Q.error + SPARE
    R: list[list[int]] = []
    for i in range(n):
        row: list[int] = []
        for j in range(i):
            row.append(((A[i][j] << BITS) - sum(map(mul, row, R[j]))) // R[j][j])
        rest = (A[i][i] - lift << BITS) - sum(v * v for v in row)
        if rest <= SPARE * SPARE:
            return False
        row.append(isqrt(rest))
        R.append(row)
    for i in range(n):
        for j in range(i + 1):
            aim = A[i][j] - (lift if i == j else 0) << BITS
            if n * abs(aim - sum(map(mul, R[i], R[j]))) >= SPARE << BITS:
                return False
    return True


@lru_cache
def pi() -> Real:
    """To 2^-200, by Machin's formula."""

    def arctan(inverse: int) -> Real:
        one = 1 << 220
        total, power, k = 0, one // inverse, 0
        while power:
            total += (-1) ** k * (power // (2 * k + 1))
            power, k = power // inverse**2, k + 1
        return Fraction(total, one)

    return 16 * arctan(5) - 4 * arctan(239)


def root(value: Real) -> Real:
    """Square root, to 2^-200 of a number near one."""
    return Fraction(isqrt(int(value * (1 << 400))), 1 << 200)


def exact(value: Any) -> Real:
    """A number of the file."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise RefusedError(f"{value!r} is no number")
    return Fraction(value)


class ExactLoop:
    """Arm, sensor and law of a file, in exact numbers; the names are those of the page on force."""

    def __init__(self, gains: dict[str, Any], inner: dict[str, Any] | None):
        arm = gains["arm"]
        own, sensor = inner or arm["inner"], arm["sensor"]
        self.tick = 1 / exact(arm["rate"])
        self.torque = own["kind"] == "torque"
        self.series = exact(own["stiffness"])
        self.theta, self.alpha = exact(gains["theta"]), exact(gains.get("alpha", 0.42))
        cap, relief = exact(gains["cap"]), exact(gains.get("relief", 0.0))
        self.compliance = 1 / self.series if self.torque else Fraction(0)
        self.cap = cap if self.torque else cap / (1 + cap / self.series)
        felt = self.compliance * self.cap
        lag = self.theta * (1 - relief * (felt + Fraction(1, 2)) / (felt + 1))
        self.gain = self.alpha / lag * (self.compliance + 1 / self.cap)
        own_rate, small = exact(arm["rate"]), Fraction(1, 10**9)
        low, high = own.get("delay_interval") or (own["delay"],) * 2
        most = ceil(exact(high) * own_rate - small)
        self.unsure = most - floor(exact(low) * own_rate + small) if own.get("delay_interval") else 0
        self.delay = most - self.unsure
        self.period = max(ceil(own_rate / exact(sensor["sampling"]) - small), 1)
        if self.torque:
            self.mass, self.damping = exact(own["mass"]), exact(own["damping"])
        else:
            f = [2 * pi() * exact(v) for v in own.get("bandwidth_interval") or (own["bandwidth"],) * 2]
            z = [exact(v) for v in own.get("damping_interval") or (own["damping"],) * 2]
            self.ends = [(f[0] ** 2, f[1] ** 2), (2 * z[0] * f[0], 2 * z[1] * f[1])]
        self.filter = polynomial(sensor.get("low_pass", "none"))

    @property
    def known(self) -> bool:
        """Whether the tick is affine in all that varies."""
        return not self.torque and all(a == b for a, b in self.ends)


def polynomial(low_pass: str) -> list[Real]:
    """a_0 ... a_n of the sensor's low-pass a_0/(s^n + ... + a_0), s in rad/s; [1] for none."""
    word = low_pass.strip().lower().replace(" ", "")
    found = [Fraction(1)]
    for section in [] if word == "none" else word.split("+b"):
        match = re.fullmatch(r"b?utterworth([123]):([0-9.e+-]+)(?:hz)?", section)
        if match is None:
            raise RefusedError(f"the low-pass {low_pass!r} is none of order 1 to 3")
        n, w = int(match[1]), 2 * pi() * exact(float(match[2]))
        middle = {1: [], 2: [root(Fraction(2))], 3: [Fraction(2)] * 2}[n]
        own = [a * w ** (n - i) for i, a in enumerate([Fraction(1), *middle, Fraction(1)])]
        product_ = [Fraction(0)] * (len(found) + n)
        for (i, a), (j, b) in product(enumerate(found), enumerate(own)):
            product_[i + j] += a * b
        found = product_
    return found


class Tick:
    """The matrix of a tick for one claim: the state's order and units are the file's."""

    def __init__(self, loop: ExactLoop, claim: dict[str, Any]):
        self.loop, units = loop, claim["units"]
        self.w0, self.k0, self.wf = (exact(units[name]) for name in ("w0", "k0", "wf"))
        if not min(self.w0, self.k0, self.wf) > 0:
            raise RefusedError("a unit of its state is not above 0")
        self.order = len(loop.filter) - 1
        self.readings = claim["ages"][1] + loop.unsure
        sent = range(1, loop.delay + 1 if loop.torque else max(loop.delay, 1))
        self.p = 2 + self.order
        self.state = (
            ["x", "v"] + [f"f{i + 1}" for i in range(self.order)]
            + [f"r{i + 1}" for i in range(self.readings)] + ["u", "c0"]
            + [f"{'t' if loop.torque else 'c'}{i}" for i in sent]
        )  # fmt: skip
        if list(claim["state"]) != self.state:
            raise RefusedError("its state is in another order")
        self._moved: dict[tuple[Surface, Surface | None], Ball] = {}

    def rates(self, surface: Surface, inner: Surface | None) -> Rows:
        """d/dt of x, v, f... and of the held input, which is the last."""
        (K, B), loop, p = surface, self.loop, self.p
        A = [[Fraction(0)] * (p + 1) for _ in range(p + 1)]
        A[0][1] = self.w0
        if inner is None:
            A[1][0], A[1][1] = -K / loop.mass / self.w0, -B / loop.mass
            A[1][p] = self.k0 / loop.mass / self.w0
        else:
            A[1][0], A[1][1], A[1][p] = -inner[0] / self.w0, -inner[1], inner[0] / self.w0
        for i in range(self.order - 1):
            A[2 + i][3 + i] = self.wf
        if self.order:
            last, n = A[1 + self.order], self.order
            for i in range(n):
                last[2 + i] = -loop.filter[i] / self.wf ** (n - 1 - i)
            into = loop.filter[0] / self.wf ** (n - 1) / self.k0
            last[0], last[1] = into * K, into * B * self.w0
        return A

    def within(self, surface: Surface, inner: Surface | None) -> Ball:
        """[E e]: x, v, f... a tick later, from those of now and the held input, shape (p, p + 1)."""
        key = surface, inner
        if key not in self._moved:
            A = self.rates(surface, inner)
            whole = exponential(Ball.of([[v * self.loop.tick for v in row] for row in A]))
            self._moved[key] = Ball(whole.rows[: self.p], whole.error)
        return self._moved[key]

    def rest(self, surface: Surface, gain: Real, age: int) -> Rows:
        """All rows but the first p, and with them the row of the input that is held in this tick, which is the last."""
        loop, one, first = self.loop, Fraction(1), self.state[: self.p]
        direct = {"x": surface[0] / self.k0, "v": surface[1] * self.w0 / self.k0}
        rows = {"r1": {"f1": one} if self.order else direct}
        rows |= {f"r{i}": {f"r{i - 1}": one} for i in range(2, self.readings + 1)}
        used = rows["r1"] if age == 0 else {f"r{age}": one}
        rows["u"] = {k: -gain * self.k0 * v for k, v in used.items()}
        rows["c0"] = {"c0": one} | {k: loop.tick * v for k, v in rows["u"].items()}
        name, late = "t" if loop.torque else "c", range(2 if loop.torque else 1, len(self.state))
        rows |= {f"{name}{i}": {f"{name}{i - 1}": one} for i in late}
        if loop.torque:
            stiff, rate = loop.series / self.k0, loop.damping * self.w0 / self.k0
            torque = {k: stiff * v for k, v in rows["c0"].items()}
            rows["t1"] = torque | {"x": torque.get("x", 0) - stiff, "v": torque.get("v", 0) - rate}
            held = {f"t{loop.delay}": one} if loop.delay else rows["t1"]
        else:
            held = {f"c{loop.delay - 1}": one} if loop.delay else rows["c0"]
        wanted = [rows[name] for name in self.state[len(first) :]]
        return [[Fraction(row.get(name, 0)) for name in self.state] for row in [*wanted, held]]

    def phi(self, surface: Surface, inner: Surface | None, gain: Real, age: int) -> tuple[Ball, Ball]:
        """The matrix of the tick, and the map from the state to x, v, f... and the held input, shape (p + 1, n)."""
        rows = Ball.of(self.rest(surface, gain, age))
        n, p = len(self.state), self.p
        first = tuple(tuple(ONE * (i == j) for j in range(n)) for i in range(p))
        fed = Ball((*first, rows.rows[-1]), rows.error)
        top = self.within(surface, inner) @ fed
        return Ball(top.rows + rows.rows[:-1], max(top.error, rows.error)), fed


def majorant(rates: list[Rows], steps: list[Rows], tick: Real) -> Rows:
    """Elements of the distance of exp(T A) from the multilinear function through its corners, at most.

    A is affine in each of its parameters alone; the distance is at most the sum of h^2/8 |E''|. With c so large that
    A + c has no negative diagonal, and M the elements' largest sizes in that, |E''| is at most exp(-c T) times the
    second derivative of exp(T (M + s D)) for |dA/ds| <= D: twice the last block of an exponential of 3 x 3 blocks.
    """
    n = len(rates[0])
    each = list(product(range(n), range(n)))
    c = Fraction(float(max(Fraction(0), *(-A[i][i] for A in rates for i in range(n)))) * (1.0 + 1e-9))
    fade = exponential(Ball.of([[-c * tick]])).largest
    found = [[Fraction(0)] * n for _ in range(n)]
    for D in steps:
        whole = [[Fraction(0)] * (3 * n) for _ in range(3 * n)]
        for b, (i, j) in product(range(3), each):
            whole[b * n + i][b * n + j] = max(abs(A[i][j] + c * (i == j)) for A in rates) * tick
            if b < 2:
                whole[b * n + i][(b + 1) * n + j] = D[i][j] * tick
        made = exponential(Ball.of(whole))
        for i, j in each if any(map(any, D)) else ():
            found[i][j] += Fraction(fade * (abs(made.rows[i][2 * n + j]) + made.error), 4 * ONE * ONE)
    return found


class Claims:
    """Check of one claim."""

    def __init__(self, loop: ExactLoop, claim: dict[str, Any]):
        self.loop, self.claim, self.kind = loop, claim, claim["kind"]
        self.low, self.high, self.least, self.most = (
            exact(claim[k]) for k in ("low", "high", "least", "most")
        )
        self.shares = [exact(v) for v in claim["shares"]]
        self.ages = list(claim["ages"])
        self.parts = claim.get("parts", 1)
        self._sound()
        self.tick = Tick(loop, claim)
        self._last = -10

    def _sound(self) -> None:
        (young, old), (lowest, highest) = self.ages, self.shares
        adapting = self.kind == "adapting"
        if self.kind not in ("held", "one-sided", "adapting") or (
            self.kind == "one-sided" and self.loop.torque
        ):
            raise RefusedError(f"a claim of kind {self.kind!r} is none of such an arm")
        if not (0 < lowest <= highest if adapting else lowest == 1 <= highest):
            raise RefusedError(f"the shares of its {self.kind} claim are not of the law's gain")
        if not (isinstance(young, int) and isinstance(old, int) and 0 <= young <= old >= self.loop.period):
            raise RefusedError(f"the ages of its {self.kind} claim are not those of the sensor")
        if (not adapting and young != old) or (young == 0 and len(self.loop.filter) == 1):
            raise RefusedError(f"the ages of its {self.kind} claim are not covered by its norms")
        if not (
            0 <= self.low <= self.high
            and 0 <= self.least <= self.most
            and self.high > 0
            and 1 <= self.parts <= 100
        ):
            raise RefusedError(f"an interval of its {self.kind} claim is empty")

    @property
    def fades(self) -> bool:
        """Whether the gain of the claim goes to next to nothing: K is fixed then, since g K alone counts."""
        return self.kind == "adapting" and not self.loop.torque and self.shares[0] < Fraction(1, 100)

    def cells(self) -> list[Box]:
        """As the file has them."""
        names = ("low", "high", "least", "most")
        found = []
        for c in self.claim["cells"]:
            a, b, s, t = (exact(c[k]) for k in names)
            found.append((a, b, s, t, int(c.get("part", 0)), int(c.get("loss", 0))))
        return found

    def check_tiles(self) -> None:
        """That the cells cover the claim, for every part of the inner loop and every delay."""
        cells = self.cells()
        losses = range(self.loop.unsure + 1) if self.kind != "adapting" else range(1)
        for part, loss in product(range(self.parts**2), losses):
            own = [c for c in cells if c[4:] == (part, loss)]
            if self.kind == "one-sided" and any(c[0] > self.low or c[1] < self.high for c in own):
                raise RefusedError("a cell of its one-sided claim is not of all that contact may be")
            bounds = spans([e for c in own for e in c[:2]], self.low, self.high)
            times = spans([e for c in own for e in c[2:4]], self.least, self.most)
            for (a, b), (s, t) in product(bounds, times):
                if not any(c[0] <= a and b <= c[1] and c[2] <= s and t <= c[3] for c in own):
                    raise RefusedError(f"the cells of its {self.kind} claim leave a gap")

    def surface(self, bound: Real, time: Real) -> Surface:
        """K and B of K + B/theta and B/K."""
        K = bound / (1 + time / self.loop.theta)
        return K, time * K

    def surfaces(self, box: Box) -> list[Surface]:
        """K and B of the corners of a cell."""
        low, high, least, most = box[:4]
        if self.fades:
            return [(high, t * high) for t in dict.fromkeys((least, most))]
        return [self.surface(b, t) for b in dict.fromkeys((low, high)) for t in dict.fromkeys((least, most))]

    def laws(self, box: Box) -> list[tuple[Real, int]]:
        """Extreme gains, and ages of the reading in use."""
        loop, (lowest, highest), old = self.loop, self.shares, self.ages[1] + self.loop.unsure
        if self.kind != "adapting":
            return [(s * loop.gain, old - box[5]) for s in dict.fromkeys((lowest, highest))]
        ends = [
            share * loop.alpha * (loop.compliance + 1 / bound) / loop.theta
            for share, bound in ((lowest, box[1]), (highest, box[0]))
        ]
        if self.fades:
            ends = [ends[0] / (1 + box[3] / loop.theta), ends[1] / (1 + box[2] / loop.theta)]
        return list(product(dict.fromkeys(ends), range(self.ages[0], old + 1)))

    def inner(self, part: int) -> list[Surface | None]:
        """Corners of a part of what a position arm's inner loop may be; None for a torque arm."""
        if self.loop.torque:
            return [None]
        ends = []
        for place, (a, b) in zip(divmod(part, self.parts), self.loop.ends, strict=True):
            ends.append([a + (b - a) * Fraction(i, self.parts) for i in (place, place + 1)])
        return [(w, z) for w in dict.fromkeys(ends[0]) for z in dict.fromkeys(ends[1])]

    def curvature(self, box: Box) -> Rows | None:
        """The distance of [E e] from the hull of its corners; None where there is none."""
        if self.loop.known:
            return None
        tick, inners, theta = self.tick, self.inner(box[4]), self.loop.theta
        counted = [
            self._from_rest(tick.rates(surface, inner)) for surface in self.surfaces(box) for inner in inners
        ]
        low, high, least, most = box[:4]
        if not self.loop.torque:
            (w1, w2), (z1, z2) = ([min(v), max(v)] for v in zip(*(i for i in inners if i), strict=True))
            steps = [[[Fraction(0)] * (tick.p + 1) for _ in range(tick.p + 1)] for _ in range(2)]
            steps[0][1][0], steps[1][1][1] = (w2 - w1) / tick.w0, z2 - z1
            return majorant(counted, steps, self.loop.tick)
        none, one, zero = (tick.rates((Fraction(a), Fraction(b)), None) for a, b in ((0, 0), (1, 0), (0, 1)))
        of_K = [[abs(a - b) for a, b in zip(x, y, strict=True)] for x, y in zip(one, none, strict=True)]
        of_B = [[abs(a - b) for a, b in zip(x, y, strict=True)] for x, y in zip(zero, none, strict=True)]
        each = [list(zip(x, y, strict=True)) for x, y in zip(of_K, of_B, strict=True)]
        share = [1 / (1 + t / theta) for t in (most, least)]
        along = [
            [(high - low) * max(s * k + theta * (1 - s) * b for s in share) for k, b in row] for row in each
        ]
        across = [[(share[1] - share[0]) * high * (k + theta * b) for k, b in row] for row in each]
        return majorant(counted, [along, across], self.loop.tick)

    def _from_rest(self, A: Rows) -> Rows:
        """For a position arm, x counted from the held input: at rest nothing is left of both."""
        if not self.loop.torque:
            for row in A[:-1]:
                row[-1] += row[0]
        return A

    def check_cell(self, box: Box, norm: list[list[float]]) -> None:
        """That every tick of it contracts in its norm."""
        n = len(self.tick.state)
        if [len(row) for row in norm] != [n] * n:
            raise RefusedError("a norm is not of the loop's size")
        L = [[exact(v) for v in row] for row in norm]
        size = max(abs(v) for row in L for v in row)
        if not size > 0:
            raise RefusedError(f"a cell of its {self.kind} claim does not contract")
        root_ = Ball.of([[v / size for v in row] for row in L], 0)
        P = root_ @ root_.transpose
        P = Ball(P.rows, 0)  # this very matrix is the norm
        curvature = self.curvature(box)
        contracts = is_positive(P) and all(
            self._contracts(P, root_, box, curvature, surface, inner, gain, age)
            for surface in self.surfaces(box)
            for inner in self.inner(box[4])
            for gain, age in self.laws(box)
        )
        if not contracts:
            raise RefusedError(f"a cell of its {self.kind} claim does not contract")

    def _contracts(
        self, P: Ball, L: Ball, box: Box, curvature: Rows | None, surface: Surface,
        inner: Surface | None, gain: Real, age: int,
    ) -> bool:  # fmt: skip
        """Whether |Phi x| + |D x| < |x| in the norm P, D the distance of the exponential from its corners."""
        Phi, fed = self.tick.phi(surface, inner, gain, age)
        after = (P @ Phi).transpose @ Phi
        if curvature is None:
            return is_positive(minus(P, after))
        W = self._weights(P, curvature)
        if not self.loop.torque:
            fed = Ball(
                (tuple(a - b for a, b in zip(fed.rows[0], fed.rows[-1], strict=True)), *fed.rows[1:]),
                2 * fed.error,
            )
        beside = (W @ fed).transpose @ fed
        for halves in sorted(range(-60, 1), key=lambda i: abs(i - self._last)):
            h = Fraction(2.0 ** (0.5 * halves))  # any will do: (a + b)^2 <= (1 + h) a^2 + (1 + 1/h) b^2
            if is_positive(minus(minus(P, after.times(1 + h)), beside.times(1 + 1 / h))):
                self._last = halves
                return True
        return False

    def _weights(self, P: Ball, curvature: Rows) -> Ball:
        """W with |D y|^2 <= y^T W y in the norm P: by columns of D's bound, by the inequality of Cauchy and Schwarz."""
        p = self.tick.p
        sizes = [
            sum(
                Fraction(abs(P.rows[a][b]), ONE) * curvature[a][j] * curvature[b][j]
                for a in range(p)
                for b in range(p)
            )
            for j in range(p + 1)
        ]
        tiny = Fraction(1, 1 << 160)
        many = max(sum(v > tiny for v in sizes), 1)
        shares = [many * (1 + Fraction(1, 1 << 40)) if v > tiny else Fraction(1 << 60) for v in sizes]
        W = [[sizes[i] * shares[i] * (i == j) for j in range(p + 1)] for i in range(p + 1)]
        return Ball.of(W)


def minus(A: Ball, B: Ball) -> Ball:
    """A less B, made symmetric."""
    n = len(A.rows)
    rows = [[A.rows[i][j] - B.rows[i][j] for j in range(n)] for i in range(n)]
    even = tuple(tuple((rows[i][j] + rows[j][i]) // 2 for j in range(n)) for i in range(n))
    return Ball(even, A.error + B.error + 1)


def spans(edges: list[Real], low: Real, high: Real) -> list[tuple[Real, Real]]:
    """Intervals between neighbouring edges within low ... high."""
    if low == high:
        return [(low, high)]
    inside = sorted({low, high, *(e for e in edges if low < e < high)})
    return list(pairwise(inside))


def statement(loop: ExactLoop, claim: dict[str, Any]) -> str:
    """A claim in words."""
    kind, (young, old), (lowest, highest) = claim["kind"], claim["ages"], map(float, claim["shares"])
    any_ = kind == "adapting" and not loop.torque
    surfaces = "any" if any_ else f"{float(claim['low']):.4g} to {float(claim['high']):.4g}"
    unit = (
        f"{float(loop.gain):.4g} m/(s N)" if kind != "adapting" else "alpha/(theta K_eff), redrawn every tick"
    )
    lost = ", contact lost and found" if kind == "one-sided" else ""
    return (
        f"{kind}: K + B/theta {surfaces} N/m, B/K {float(claim['least']):g} to {float(claim['most']):.4g} s, "
        f"gain {lowest:g} to {highest:g} times {unit}, readings {young} to {old} ticks old{lost}"
    )


def check(data: bytes | str) -> list[str]:
    """The statements that a certificate proves.

    Args:
        data: the file.

    Raises:
        RefusedError: it does not hold; its text says why.
    """
    try:
        return _check(json.loads(data))
    except RefusedError:
        raise
    except (
        ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError, ZeroDivisionError, RecursionError,
    ) as error:  # fmt: skip
        raise RefusedError(f"it is no certificate: {type(error).__name__} {error}") from None


def _check(file: dict[str, Any]) -> list[str]:
    if file["form"] != FORM or file["gains"].get("law", LAW) != LAW:
        raise RefusedError(f"it is not of the form {FORM!r} and the law {LAW!r}")
    if not file["claims"]:
        raise RefusedError("it claims nothing")
    loop, found = ExactLoop(file["gains"], file.get("measured")), []
    for claim in file["claims"]:
        own = Claims(loop, claim)
        own.check_tiles()
        for box, cell in zip(own.cells(), claim["cells"], strict=True):
            own.check_cell(box, cell["norm"])
        found.append(statement(loop, claim))
    return found


def main(path: str) -> int:
    """Check a file and print what it proves."""
    try:
        told, code = check(Path(path).read_bytes()), 0
    except RefusedError as error:
        told, code = [f"does not hold: {error}"], 1
    sys.stdout.write("".join(f"{line}\n" for line in told))
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
