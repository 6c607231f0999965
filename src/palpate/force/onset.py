"""Since when there is contact: lines fitted to the force from several starts back, the likeliest of which is taken.

In free motion the tip moves evenly, so that a touch is a step (damping, times the speed) and a ramp (stiffness) from
some place on, and nothing before. For each of six starts, every one about twice as far back as the one before, the
line through the force since then is fitted; the rest of the past counts as free motion. That is the profile likelihood
of the start (generalised likelihood ratio), with starts so dense that at most an eighth of the evidence is lost.
"""

from typing import NamedTuple

from palpate._jit import law, part


@part
class Line(NamedTuple):
    """Sums over the readings since a start: number, way from there [m], way squared, force [N], their product."""

    x: float
    n: float
    u: float
    uu: float
    f: float
    uf: float

    def with_reading(self, x, force):
        """With one more reading."""
        u = x - self.x
        return Line(self.x, self.n + 1.0, self.u + u, self.uu + u * u, self.f + force, self.uf + u * force)

    def solution(self):
        """Slope [N/m], force at the start [N] and what both explain of the sum of squares [N^2]; neither negative."""
        spread = self.n * self.uu - self.u * self.u
        if not (spread > 1e-9 * self.n * self.uu):  # the tip stands: there is no slope
            level = max(self.f / max(self.n, 1.0), 0.0)
            return 0.0, level, level * self.f
        slope = (self.n * self.uf - self.u * self.f) / spread
        level = (self.f - slope * self.u) / self.n
        if level < 0.0:
            slope, level = max(self.uf / self.uu, 0.0), 0.0
        elif slope < 0.0:
            slope, level = 0.0, max(self.f / self.n, 0.0)
        return slope, level, slope * self.uf + level * self.f

    def shown(self, behind):
        """Explained variance beside a rest that is the mean of so many readings, whose own error explains as much."""
        return self.solution()[2] / (1.0 + self.n / behind)


EMPTY = Line(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@part
class Starts(NamedTuple):
    """Lines from six starts; the newest is not asked until it has become the second."""

    readings: float
    newest: Line
    a: Line
    b: Line
    c: Line
    d: Line
    oldest: Line


NO_STARTS = Starts(0.0, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY)


@law
def later(starts, every, x, force):
    """With one more reading; each `every` readings there is a new start, and every second of them moves one back."""
    n, new, a, b, c, d, old = starts
    if n % every == 0.0:
        if n % (32.0 * every) == 0.0:
            old = d
        if n % (16.0 * every) == 0.0:
            d = c
        if n % (8.0 * every) == 0.0:
            c = b
        if n % (4.0 * every) == 0.0:
            b = a
        if n % (2.0 * every) == 0.0:
            a = new
        new = Line(x, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Starts(
        n + 1.0, new.with_reading(x, force), a.with_reading(x, force), b.with_reading(x, force),
        c.with_reading(x, force), d.with_reading(x, force), old.with_reading(x, force),
    )  # fmt: skip


@law
def explained_variance(starts, behind):
    """Sum of squares that the likeliest line explains [N^2], see `Line.shown`."""
    _, _, a, b, c, d, old = starts
    return max(a.shown(behind), b.shown(behind), c.shown(behind), d.shown(behind), old.shown(behind))


@law
def latest(starts, behind, least):
    """The line of the latest start that explains so much [N^2]; an earlier one includes free motion, and is flat."""
    if starts.a.shown(behind) >= least:
        return starts.a
    if starts.b.shown(behind) >= least:
        return starts.b
    if starts.c.shown(behind) >= least:
        return starts.c
    return starts.d if starts.d.shown(behind) >= least else starts.oldest
