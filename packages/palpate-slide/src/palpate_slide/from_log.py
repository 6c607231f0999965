"""Friction, normal and stiffness from the log of a tip that slides, whoever moved it.

A tip that moves with the velocity v on a surface with the normal n (into it) exerts F = N (n + mu t), with t the
direction of v along the surface. So the angle of F from the plane across v is that of friction and that by which v
dips below the surface, whatever the surface's shape, and whatever the tip's path:

    psi = atan2(F.v/|v|, |F - (F.v) v/|v|^2|) = atan(mu c) + d|F|/dt cos(atan mu) / (K |v|)

c is the share of friction that acts: after a stop or a turn the contact sticks first, on a length that the log shows
(Dahl). The second term is the surface's spring. Beside mu and 1/K, the sensor's bias and weight, as far as free motion
leaves them unknown, and the lag of the force are parameters, with what is known of them as priors. Intervals come from
leaving parts of the log out (jackknife of blocks, CR3), since what is left is as slow as the path.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.contact_frame.free_motion import FEWEST
from palpate.contact_frame.load import known_load, load_of, no_load, robust_load
from palpate.contact_frame.signals_in_base import BaseSignals, ContactFrame, Unloaded
from palpate.identification.options import USUAL_LAG, USUAL_LAG_STD

BLOCKS = 24
"""Parts of a slide that are left out in turn."""
LENGTHS = 3e-5 * 2.2 ** np.arange(9)
"""Of relaxation, that are tried first [m]."""
SHAPE = 1.5
"""Factor within which one length describes how friction relaxes: no contact is quite Dahl's. That of a sphere acts with
the share 1 - (1 - 2x/3)^1.5 after a way of x lengths (Cattaneo, Mindlin): by its integral Dahl's on 0.6 of the length,
and from 0.3 to 0.9 of the friction on 1.5 to 0.85 times that."""
CHORD, GRAINS = 3e-4, 40.0
"""Path in a window: at least so long [m], and so many deviations of the position's noise."""
MOVES = 0.1
"""Share of the usual speed below which a direction is not trusted."""
RATE = 0.15
"""Window of the force's rate [s]: a dither is a hertz or two."""
SLIDES = 0.6
"""Sine of the angle between force and motion, above which the tip may slide: the friction of 4/3 leans so far."""
SHORTEST = 2e-3
"""Slide that is one [m]."""
MOST = 1500
"""Windows that are looked at."""
MOST_MU = 5.0
"""Friction of a fit, at most: a force along the motion is a press' and its angle no friction's."""
STUCK = 0.98
"""Share of friction below which a row is of a contact that sticks."""


@dataclass(frozen=True, eq=False)
class Smooth:
    """Signals on an even grid, smoothed over a window.

    Args:
        step: of the grid [s].
        rows, longer: in a window, and in one of a rate.
        time: [s], shape (n,).
        place, velocity: [m], [m/s], shape (n, 3).
        force, rate: in the base without the load, as the sensor shows it [N]; its derivative in the tool's axes,
            turned into the base's, since a sensor is late in its own axes; shape (n, 3).
        grain, noise: standard deviation of a reading of the position [m] and of the force [N], of an axis.
        inside: rows in contact, shape (n,).
    """

    step: float
    rows: int
    longer: int
    time: Array
    place: Array
    velocity: Array
    force: Array
    rate: Array
    grain: float
    noise: float
    inside: Mask

    @property
    def blur(self) -> float:
        """Standard deviation of the velocity of an axis [m/s]."""
        return float(self.grain * np.sqrt(12.0 / self.rows**3) / self.step)


def smooth(signals: BaseSignals, freed: Unloaded) -> Smooth | None:
    """Signals over windows in which the tip goes on by `CHORD`; None of a log that is too short, or without contact."""
    from scipy.signal import savgol_filter

    time, placed = signals.time, np.isfinite(signals.place.sum(axis=1))
    there = freed.there & np.isfinite(freed.force.sum(axis=1))
    if placed.sum() < 50 or there.sum() < 50 or freed.inside.sum() < 50:
        return None
    step = float(np.median(np.diff(time[placed])))
    grid = np.arange(time[placed][0], time[placed][-1], step)
    place = np.column_stack([np.interp(grid, time[placed], axis) for axis in signals.place[placed].T])
    own = signals.force - freed.load.bias
    force = np.column_stack([np.interp(grid + USUAL_LAG, time[there], axis) for axis in own[there].T])
    inside = np.interp(grid, time, freed.inside.astype(float)) > 0.999
    grain, noise = _noise(signals.place[placed]), _noise(own[there])
    tenth = max(round(0.1 / step), 1)
    far = np.linalg.norm(place[tenth:] - place[:-tenth], axis=1)[inside[tenth:]] / (tenth * step)
    usual = float(np.median(far[far > 0.1 * far.max()])) if far.size and far.max() > 0.0 else 0.0
    if not usual > 0.0:
        return None
    rows = max(round(min(max(CHORD, GRAINS * grain) / usual, 0.4) / step) // 2 * 2 + 1, 5)
    if len(grid) < 10 * rows:
        return None

    def of(values: Array, order: int) -> Array:
        return savgol_filter(values, rows, 2, deriv=order, delta=step, axis=0)

    longer = max(rows, round(RATE / step) // 2 * 2 + 1)
    rate = savgol_filter(force, longer, 2, deriv=1, delta=step, axis=0)
    at = signals.rotations[nearest(time, grid)]
    level, rate = (np.einsum("nij,nj->ni", at, values) for values in (of(force, 0), rate))
    level -= freed.load.weight
    edge = np.convolve(inside, np.ones(rows), "same") > rows - 0.5
    return Smooth(step, rows, longer, grid, of(place, 0), of(place, 1), level, rate, grain, noise, edge)


def nearest(time: Array, at: Array) -> Indices:
    """Rows that are nearest to some times, shape (n,)."""
    later = np.searchsorted(time, at).clip(1, len(time) - 1)
    return later - (at - time[later - 1] < time[later] - at)


ALONG = np.sqrt(0.5)
"""Cosine of the angle between the approach and the force after it, at least: rather along it than across."""


def freed_of(signals: BaseSignals, frame: ContactFrame, touches: bool = True) -> Unloaded | None:
    """Rows in free motion and in contact of a slide, and the load by the first; None if the force is always alike.

    A slide's force does not follow the position, so that a press' contact detection does not see it. Here free motion
    is where the force stays at its level before the tip came down, or after it left, along the force that it then met.
    """
    there = np.isfinite(signals.force.sum(axis=1)) & np.isfinite(signals.place.sum(axis=1))
    time, raw = signals.time, signals.force
    if there.sum() < 50:
        return None
    step = float(np.median(np.diff(time[there])))
    n = max(round(0.05 / step), 3)
    kernel = np.ones(n) / n
    mean = np.column_stack([np.convolve(axis, kernel, "valid") for axis in raw[there].T])
    chance = 6.0 * _noise(mean[::n])  # of means, however the noise is coloured
    if np.linalg.norm(mean - np.median(mean, axis=0), axis=1).max() <= chance:
        return None
    place = signals.place[there][n // 2 :][: len(mean)]
    rotations = signals.rotations[there][n // 2 :][: len(mean)]
    free = np.zeros(len(mean), bool)
    brief = max(round(0.2 / step), n)
    for turned in (1, -1) if touches else ():
        own, at, R = mean[::turned], place[::turned], rotations[::turned]
        level = np.median(own[:brief], axis=0)
        far = np.linalg.norm(own - level, axis=1)
        usual = np.sort(far)[-brief:][0]  # for so long, however brief a slide is in its log
        met = end = int(np.argmax(far > 0.5 * usual))
        while end and far[end] > chance:
            end -= 1
        if end < max(brief, FEWEST):
            continue
        after = R[met] @ (np.median(own[met : met + max(round(0.5 / step), n)], axis=0) - level)
        came, went = at[end] - at[end - brief], at[min(met + brief, len(at) - 1)] - at[met]
        along = abs(came @ after) > ALONG * float(np.linalg.norm(came) * np.linalg.norm(after))
        # The force comes on a shorter way than it stayed away on, and the tip does not turn back, as friction would.
        away = float(np.linalg.norm(at[: end + 1] - at[end], axis=1).max())
        if (
            along
            and away > max(SHORTEST, float(np.linalg.norm(at[met] - at[end])))
            and came @ went > -0.5 * (came @ came)
        ):
            free[::turned] |= np.arange(len(own)) < end - n
    rows = np.flatnonzero(there)[n // 2 :][: len(mean)]
    whole = np.zeros(len(time), bool)
    whole[rows[free]] = True
    whole &= whole.sum() >= FEWEST
    weighs = not frame.gravity_compensated
    if whole.any():  # what touches before the slide is not free
        load = robust_load(raw[whole], signals.rotations[whole], weighs=weighs)
        far = np.linalg.norm(load.taken_off(mean, rotations), axis=1)
        touched = free & (far > max(chance, 3.0 * float(np.median(far[free]))))
        whole[rows[np.convolve(touched, np.ones(2 * n + 1), "same") > 0.5]] = False
    read, at_rest = raw[whole], signals.rotations[whole]
    if frame.payload is not None:
        load = known_load(read, at_rest, frame.payload)
    else:
        load = load_of(read, at_rest, weighs=weighs) if whole.any() else no_load()
    force = load.taken_off(raw, signals.rotations)
    size = np.linalg.norm(load.taken_off(mean, rotations), axis=1)
    usual = float(np.median(size[~free])) if (~free).any() else 0.0
    inside = np.zeros(len(time), bool)
    known = whole.any() or frame.payload is not None
    inside[rows[~free & ((size > 0.3 * usual) | (not known))]] = True
    return Unloaded(force, there, inside, whole, load)


def _noise(values: Array) -> float:
    """Standard deviation of a reading, by third differences of the rows and axes that change; rounding at least."""
    changes = np.diff(values, axis=0) != 0.0
    fresh = values[np.ix_(np.r_[True, changes.any(axis=1)], changes.any(axis=0))]
    if len(fresh) < 8:
        return 0.0
    third = np.diff(fresh, 3, axis=0)
    noise = np.median(np.abs(third - np.median(third))) * 1.4826 / np.sqrt(20.0)
    return float(max(noise, np.finfo(float).eps * np.abs(fresh).max()))


@dataclass(frozen=True, eq=False)
class SlideWindows:
    """Windows of a slide, every second half of one.

    Args:
        speed: [m/s], shape (m,).
        place, way: [m], direction of the motion, shape (m, 3).
        force, rate: as of `Smooth`, from the tip on the surface, shape (m, 3).
        turned: rotation of the tool, shape (m, 3, 3).
        rows: of the smooth signals.
        smooth, moves, slides: whence the windows are, and where the tip moves on, and across the force.
        known: whether the zero of the force is, by free motion or a payload file.
        turns, rest: times and rotations of the log's rows, and the tool's rotation in free motion.
        sign: of the sensor's reading against the force on the surface.
        noise: standard deviation of psi times the force [N], shape (m,).
        path: [m].
    """

    speed: Array
    place: Array
    way: Array
    force: Array
    rate: Array
    turned: Array
    rows: Indices
    smooth: Smooth
    moves: Mask
    slides: Mask
    known: bool
    turns: tuple[Array, Array]
    rest: Array
    sign: float
    noise: Array
    path: float

    def shares(self, length: float) -> tuple[Array, Mask]:
        """Friction's shares on the grid, shape (n, 5), and whether it slips in all that a rate is of, shape (n,)."""
        s = self.smooth
        found = _share(s, self.moves, length)
        return found, np.convolve(
            self.moves & (found[:, 0] > STUCK), np.ones(s.longer), "same"
        ) > s.longer - 0.5

    def share(self, length: float) -> tuple[Array, Mask]:
        """The same in the windows, shape (m, 5) and (m,)."""
        found, slips = self.shares(length)
        return found[self.rows], slips[self.rows]

    def friction_angle(self, found: SlideFit, length: float) -> tuple[Array, Array, Mask]:
        """On the grid: force on the surface [N], shape (n, 3); residual of psi but for the spring [rad]; slip."""
        s = self.smooth
        turned = self.turns[1][nearest(self.turns[0], s.time)]
        F = self.sign * s.force - self.load_on(turned, found.load)
        way = s.velocity / np.maximum(np.linalg.norm(s.velocity, axis=1), 1e-12)[:, None]
        share, slips = self.shares(length)
        return F, lean(F, way) - friction_that_acts(found.mu[0], share), slips

    def load_on(self, turned: Array, load: Array) -> Array:
        """Force [N] of bias and weight as in `SlideFit`, on a tool turned by matrices (n, 3, 3), shape (n, 3)."""
        off: Array = turned @ load[:3]
        return off if len(load) == 3 else off + load[3:] - turned @ self.rest.T @ load[3:]


def lean(force: Array, way: Array) -> Array:
    """Angle of forces from the planes across unit vectors [rad], shape (n,), of both in rows, shape (n, 3)."""
    along = np.einsum("ij,ij->i", force, way)
    return np.arctan2(along, np.sqrt(np.maximum(np.einsum("ij,ij->i", force, force) - along**2, 1e-12)))


def friction_that_acts(mu: Array, share: Array) -> Array:
    """Angle of friction along the motion [rad], shape (n,), by its shares as of `SlideWindows.shares`."""
    return np.arctan(mu * share[:, 0] / np.sqrt(1.0 + mu**2 * share[:, 1]))


def course_of(signals: BaseSignals, freed: Unloaded, frame: ContactFrame) -> SlideWindows | None:
    """The windows in which the tip slides; None if it does not."""
    s = smooth(signals, freed)
    if s is None or not s.inside.any():
        return None
    speed = np.linalg.norm(s.velocity, axis=1)
    usual = float(np.median(speed[s.inside & (speed > 4.0 * s.blur)]))
    size = np.linalg.norm(s.force, axis=1)
    heavy = float(np.median(size[s.inside]))
    moves = s.inside & (speed > max(MOVES * usual, 4.0 * s.blur)) & (size > 0.2 * heavy)
    if not usual > 0.0 or moves.sum() < 10 * s.rows or not heavy > 6.0 * s.noise:
        return None
    way = s.velocity / np.maximum(speed, 1e-12)[:, None]
    # The tip loses work to the surface, whichever way it goes: that tells action from reaction.
    work = float(np.einsum("ij,ij->", s.force[moves], s.velocity[moves]))
    sign = {"action": 1.0, "reaction": -1.0, None: 1.0 if work >= 0.0 else -1.0}[frame.force_sign]
    across = np.linalg.norm(np.cross(s.force, way), axis=1)
    known = bool(freed.free.any()) or frame.payload is not None
    slides = moves & ((across > SLIDES * size) | (not known))
    path = float(speed[slides].sum() * s.step)
    if path < SHORTEST or path < 0.5 * float(speed[moves].sum() * s.step):
        return None
    rows = np.flatnonzero(slides)
    rows = rows[:: max(s.rows // 2, len(rows) // MOST, 1)]
    rotations = signals.rotations[nearest(signals.time, s.time[rows])]
    rest = signals.rotations[freed.free].mean(axis=0) if freed.free.any() else rotations.mean(axis=0)
    force = s.noise * np.sqrt(2.25 / s.rows)
    noise = np.hypot(force, size[rows] * s.blur / speed[rows])
    return SlideWindows(
        speed[rows], s.place[rows], way[rows], sign * s.force[rows], sign * s.rate[rows],
        rotations, rows, s, moves, slides, known,
        (signals.time, signals.rotations), rest, sign, noise, path,
    )  # fmt: skip


def _share(s: Smooth, moves: Mask, length: float) -> Array:
    """Friction along the motion, the square of that across it, and its vector, shares of gross slip, shape (n, 5).

    The bristle bends by at most the length times the force over its median.
    """
    speed = np.linalg.norm(s.velocity, axis=1)
    way = s.velocity / np.maximum(speed, 1e-12)[:, None]
    found = np.zeros((len(way), 3))
    size = np.linalg.norm(s.force, axis=1)
    most = np.maximum(length * size / float(np.median(size[moves])), 1e-9)
    decay = np.where(moves, np.exp(-speed * s.step / most), 1.0)
    x, y, z = 0.0, 0.0, 0.0
    for k, (e, top, inside, (a, b, c)) in enumerate(
        zip(decay.tolist(), most.tolist(), s.inside.tolist(), way.tolist(), strict=True)
    ):
        new = (1.0 - e) * top
        x, y, z = (e * x + new * a, e * y + new * b, e * z + new * c) if inside else (0.0, 0.0, 0.0)
        found[k] = x / top, y / top, z / top
    from scipy.signal import savgol_filter

    found = savgol_filter(found, s.rows, 2, axis=0)  # as the force
    along = np.einsum("ij,ij->i", found, way)
    across = np.maximum(np.einsum("ij,ij->i", found, found) - along**2, 0.0)
    return np.column_stack([along, across, found])


@dataclass(frozen=True, eq=False)
class SlideFit:
    """Parameters of a slide, and their covariance.

    Args:
        mu: friction of each class of speeds, shape (j,).
        compliance: 1/K [m/N].
        lag: of the force [s].
        load: what is left of the sensor's bias, and of a weight where the tool turns [N], shape (3,) or (6,).
        covariance: of all these in turn, from the blocks.
        angle: residual of psi [rad], shape (m,).
        scale: of the residuals, by which a row counts once though its neighbours are like it.
    """

    mu: Array
    compliance: float
    lag: float
    load: Array
    covariance: Array
    angle: Array
    scale: float
    slips: bool


@dataclass(frozen=True, eq=False)
class Fit:
    """The least-squares problem of a slide.

    Args:
        course: its windows.
        classes: of its speeds, shape (m,), from 0.
        prior: standard deviation of lag and load, shape (4,) or (7,).
    """

    course: SlideWindows
    classes: Array
    prior: Array

    def psi(self, lag: float, load: Array) -> tuple[Array, Array, Array]:
        """Angle of the force from the plane across the motion, spring's regressor, and force, shape (m,) and (m, 3)."""
        c = self.course
        F = c.force + lag * c.rate - c.load_on(c.turned, load)
        rate = np.einsum("ij,ij->i", F, c.rate) / np.maximum(np.linalg.norm(F, axis=1), 1e-9)
        return lean(F, c.way), rate / c.speed, F

    def residuals(self, x: Array, share: Array) -> Array:
        """Of psi, over its noise."""
        j = len(x) - 1 - len(self.prior)
        psi, spring, F = self.psi(x[j + 1], x[j + 2 :])
        mu = x[:j][self.classes]
        model = friction_that_acts(mu, share) + x[j] * spring / np.sqrt(1.0 + mu**2)
        return (psi - model) * np.linalg.norm(F, axis=1) / self.course.noise

    def solve(self, share: Array, slips: Mask) -> SlideFit:
        """By Gauss-Newton with Huber's weights, from friction as it looks without any load."""
        classes = int(self.classes.max()) + 1
        enough = bool(np.bincount(self.classes[slips], minlength=classes).min() >= 2 * BLOCKS)
        rows = slips | (not enough)
        psi = self.psi(0.0, np.zeros(len(self.prior) - 1))[0]
        friction = np.clip(np.tan(np.median(psi[rows])), -MOST_MU, MOST_MU)
        x = np.r_[np.full(classes, friction), np.zeros(1 + len(self.prior))]
        inverse = np.r_[np.zeros(classes + 1), 1.0 / self.prior]
        step = np.r_[np.full(classes, 1e-4), 1e-7, 1e-4, np.full(len(self.prior) - 1, 1e-3)]
        alike = 1.0
        for _ in range(15):
            r = self.residuals(x, share)[rows]
            beside = [self.residuals(x + e, share)[rows] for e in np.diag(step)]
            J = (np.column_stack(beside) - r[:, None]) / step
            scale = max(1.4826 * float(np.median(np.abs(r))), 1.0)
            w = np.minimum(1.0, 3.0 * scale / np.maximum(np.abs(r), 1e-12)) / scale**2
            sums = [float(np.sum(w[b] * r[b])) for b in np.array_split(np.arange(len(r)), BLOCKS)]
            alike = max(
                0.5 * alike + 0.5 * float(np.mean(np.square(sums)) * BLOCKS / np.sum((w * r) ** 2)), 1.0
            )
            w = w / alike  # residuals that go together count once against the priors
            A = J.T @ (w[:, None] * J) + np.diag(inverse**2)
            move = -np.linalg.solve(A, J.T @ (w * r) + inverse**2 * x)
            x = x + move
            x[:classes] = np.clip(x[:classes], -MOST_MU, MOST_MU)
            if np.all(np.abs(move) < 0.01 * step):
                break
        # Parts of the time, and of the place: what a path repeats on each lap is in every part of the time.
        place = self.course.place[rows]
        along = place @ np.linalg.eigh(np.cov(place.T))[1][:, 2]
        orders = np.arange(len(r)), np.argsort(along, kind="stable")
        cov = max((_jackknife(J, w, r, A, inverse, order) for order in orders), key=lambda C: float(C[0, 0]))
        angle = np.zeros(len(share))
        angle[rows] = r
        return SlideFit(
            x[:classes], float(x[classes]), float(x[classes + 1]), x[classes + 2 :], cov, angle,
            scale * float(np.sqrt(alike)), enough,
        )  # fmt: skip

    def cost(self, found: SlideFit, share: Array, scale: float) -> float:
        """Sum of squares over all rows, those that stick among them, and of the priors."""
        x = np.r_[found.mu, found.compliance, found.lag, found.load]
        r = self.residuals(x, share) / scale
        far = np.r_[found.lag, found.load] / self.prior
        return float(np.sum(np.minimum(r**2, 9.0)) + far @ far)


def _jackknife(J: Array, w: Array, r: Array, A: Array, inverse: Array, order: Indices) -> Array:
    """Covariance by leaving out blocks of rows of an order in turn, and the prior, shape (p, p)."""
    inner = np.linalg.inv(A)
    blocks = np.array_split(order, min(BLOCKS, max(len(r) // 4, 2)))
    meat = np.diag(inverse**2)
    for b in blocks:
        Jb, wb = J[b], w[b]
        rest = A - Jb.T @ (wb[:, None] * Jb)
        score = Jb.T @ (wb * r[b])
        gone = A @ np.linalg.solve(rest + 1e-12 * np.diag(np.diag(A)), score)
        meat = meat + np.outer(gone, gone) * (len(blocks) - 1) / len(blocks)
    return inner @ meat @ inner


def with_length(fit: Fit) -> tuple[SlideFit, float, Array]:
    """The fit with the length of relaxation that the log shows [m]; lengths beside it with their mu, shape (k, 2)."""
    tried: dict[float, tuple[Array, SlideFit]] = {}

    def costs() -> tuple[Array, Array]:
        scale = min(found.scale for _, found in tried.values())
        lengths = np.array(sorted(tried))
        return lengths, np.array([fit.cost(tried[x][1], tried[x][0], scale) for x in lengths])

    def attempt(length: float) -> None:
        share, slips = fit.course.share(length)
        tried[length] = share, fit.solve(share, slips)

    for length in LENGTHS:
        attempt(float(length))
    for ratio in (1.48, 1.22, 1.1):
        lengths, cost = costs()
        best = float(lengths[np.argmin(cost)])
        attempt(best * ratio)
        attempt(best / ratio)
    lengths, cost = costs()
    best = float(lengths[np.argmin(cost)])
    late = USUAL_LAG_STD * float(np.median(fit.course.speed))  # a lag looks like a length
    ends = best * SHAPE + late, max(best / SHAPE - late, float(LENGTHS[0]))
    for length in ends:
        attempt(length)
    near = [x for x, c in zip(lengths, cost, strict=True) if c < cost.min() + 4.0]
    beside = sorted({*near, *ends})
    return tried[best][1], best, np.array([[x, tried[x][1].mu[0]] for x in beside])
