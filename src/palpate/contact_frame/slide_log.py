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
from typing import NamedTuple

import numpy as np

from palpate.arrays import Array, Indices, Mask
from palpate.contact_frame.free_motion import MIN_ROWS, rows_between
from palpate.contact_frame.load import fit_load, fit_load_robustly, load_with_payload, zero_load
from palpate.contact_frame.signals_in_base import BaseSignals, CompensatedForce, ContactFrame
from palpate.identification.options import USUAL_LAG, USUAL_LAG_STD
from palpate.signals.rotations import dot_rows, to_base

BLOCKS = 24
"""Parts of a slide that are left out in turn."""
LENGTHS = 3e-5 * 2.2 ** np.arange(9)
"""Relaxation lengths that are tried first [m]."""
RELAXATION_SPREAD = 1.5
"""Factor within which one length describes how friction relaxes: no contact is quite Dahl's. That of a sphere acts with
the share 1 - (1 - 2x/3)^1.5 after a way of x lengths (Cattaneo, Mindlin): by its integral Dahl's on 0.6 of the length,
and from 0.3 to 0.9 of the friction on 1.5 to 0.85 times that."""
WINDOW_PATH, WINDOW_NOISE_RATIO = 3e-4, 40.0
"""Shortest path of a window [m], and the shortest in standard deviations of the position's noise."""
MIN_SPEED_RATIO = 0.1
"""Fraction of the usual speed below which a direction is not trusted."""
RATE_WINDOW = 0.15
"""Window of the force's rate [s]: a dither is a hertz or two."""
MIN_SLIDE_SINE = 0.6
"""Sine of the angle between force and motion above which the tip may slide: that of a friction of 4/3."""
MIN_SLIDE = 2e-3
"""Shortest path of a slide [m]."""
MAX_WINDOWS = 1500
"""Maximum windows of a slide."""
MAX_MU = 5.0
"""Upper bound of the fitted friction coefficient. A larger tangential force means a press along the motion."""
MIN_SLIP_FRACTION = 0.98
"""Fraction of gross friction below which the contact sticks."""


@dataclass(frozen=True, eq=False)
class Smooth:
    """Signals on an even grid, smoothed over a window.

    Args:
        step: of the grid [s].
        rows, longer: in a window, and in one of a rate.
        time: [s], shape (n,).
        position, velocity: [m], [m/s], shape (n, 3).
        force, rate: in the base without the load, as the sensor shows it [N]; its derivative in the tool's axes,
            turned into the base's, since a sensor is late in its own axes; shape (n, 3).
        grain, noise: standard deviation of a reading of the position [m] and of the force [N], of an axis.
        inside: rows in contact, shape (n,).
    """

    step: float
    rows: int
    longer: int
    time: Array
    position: Array
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


def smooth(signals: BaseSignals, compensated: CompensatedForce) -> Smooth | None:
    """Signals over windows of a path of `WINDOW_PATH`; None if the log is too short or has no contact."""
    from scipy.signal import savgol_filter

    time = signals.time
    placed = np.isfinite(signals.position.sum(axis=1))
    finite = compensated.finite & np.isfinite(compensated.force.sum(axis=1))
    if placed.sum() < 50 or finite.sum() < 50 or compensated.inside.sum() < 50:
        return None
    step = float(np.median(np.diff(time[placed])))
    grid = np.arange(time[placed][0], time[placed][-1], step)
    position = np.column_stack([np.interp(grid, time[placed], axis) for axis in signals.position[placed].T])
    unbiased = signals.force - compensated.load.bias
    force = np.column_stack([np.interp(grid + USUAL_LAG, time[finite], axis) for axis in unbiased[finite].T])
    inside = np.interp(grid, time, compensated.inside.astype(float)) > 0.999
    grain = _noise(signals.position[placed])
    noise = _noise(unbiased[finite])
    tenth = max(round(0.1 / step), 1)
    far = np.linalg.norm(position[tenth:] - position[:-tenth], axis=1)[inside[tenth:]] / (tenth * step)
    usual = float(np.median(far[far > 0.1 * far.max()])) if far.size and far.max() > 0.0 else 0.0
    if not usual > 0.0:
        return None
    rows = max(round(min(max(WINDOW_PATH, WINDOW_NOISE_RATIO * grain) / usual, 0.4) / step) // 2 * 2 + 1, 5)
    if len(grid) < 10 * rows:
        return None

    def of(values: Array, order: int) -> Array:
        return savgol_filter(values, rows, 2, deriv=order, delta=step, axis=0)

    longer = max(rows, round(RATE_WINDOW / step) // 2 * 2 + 1)
    rate = savgol_filter(force, longer, 2, deriv=1, delta=step, axis=0)
    at = signals.rotations[nearest(time, grid)]
    level, rate = (to_base(at, values) for values in (of(force, 0), rate))
    level -= compensated.load.weight
    edge = np.convolve(inside, np.ones(rows), "same") > rows - 0.5
    return Smooth(step, rows, longer, grid, of(position, 0), of(position, 1), level, rate, grain, noise, edge)


def nearest(time: Array, at: Array) -> Indices:
    """Rows that are nearest to some times, shape (n,)."""
    later = np.searchsorted(time, at).clip(1, len(time) - 1)
    return later - (at - time[later - 1] < time[later] - at)


MIN_APPROACH_COSINE = np.sqrt(0.5)
"""Cosine of the angle between the approach and the force after it, at least: rather along it than across."""


class _MovingMeans(NamedTuple):
    """Moving means of the force over 0.05 s, in the tool's axes.

    `rows` of the log are their middles, shape (m,); `force` [N] and `position` [m] have shape (m, 3), `rotations`
    (m, 3, 3). `window` and `brief` are the rows of a mean and of 0.2 s, `step` is that of the log [s], and `noise` the
    largest difference of two means by noise, however coloured [N].
    """

    rows: Indices
    force: Array
    position: Array
    rotations: Array
    step: float
    window: int
    brief: int
    noise: float

    @classmethod
    def of(cls, signals: BaseSignals, finite: Mask) -> _MovingMeans:
        """The means over the rows that hold a force and a place."""
        step = float(np.median(np.diff(signals.time[finite])))
        window = max(round(0.05 / step), 3)
        kernel = np.ones(window) / window
        force = np.column_stack([np.convolve(axis, kernel, "valid") for axis in signals.force[finite].T])
        middle = slice(window // 2, window // 2 + len(force))
        return cls(
            np.flatnonzero(finite)[middle],
            force,
            signals.position[finite][middle],
            signals.rotations[finite][middle],
            step,
            window,
            max(round(0.2 / step), window),
            6.0 * _noise(force[::window]),
        )

    def reversed(self) -> _MovingMeans:
        """The means backwards in time, so that the end of a contact is its beginning."""
        return self._replace(
            rows=self.rows[::-1],
            force=self.force[::-1],
            position=self.position[::-1],
            rotations=self.rotations[::-1],
        )


def compensate_slide(
    signals: BaseSignals, frame: ContactFrame, touches: bool = True
) -> CompensatedForce | None:
    """Rows in free motion and in contact of a slide, and the load by the first; None if the force is always alike.

    A slide's force does not follow the position, so that a press' contact detection does not see it. Here free motion
    is where the force stays at its level before the tip came down, or after it left, along the force that it then met.
    """
    finite = np.isfinite(signals.force.sum(axis=1)) & np.isfinite(signals.position.sum(axis=1))
    if finite.sum() < 50:
        return None
    means = _MovingMeans.of(signals, finite)
    if np.linalg.norm(means.force - np.median(means.force, axis=0), axis=1).max() <= means.noise:
        return None
    free = np.zeros(len(means.rows), bool)
    if touches:
        free = _free_on_both_sides(means)
    weighs = not frame.gravity_compensated
    if frame.free is None:
        free_rows = _untouched_rows(signals, means, free, weighs)
    else:
        free_rows = rows_between(signals.time, frame.free) & finite
        free = free_rows[means.rows]
    force = signals.force[free_rows]
    rotations = signals.rotations[free_rows]
    if frame.payload is not None:
        load = load_with_payload(force, rotations, frame.payload)
    else:
        load = fit_load(force, rotations, weighs=weighs) if free_rows.any() else zero_load()
    size = np.linalg.norm(load.taken_off(means.force, means.rotations), axis=1)
    usual = float(np.median(size[~free])) if (~free).any() else 0.0
    is_zero_known = free_rows.any() or frame.payload is not None
    inside = np.zeros(len(signals.time), bool)
    inside[means.rows[~free & ((size > 0.3 * usual) | (not is_zero_known))]] = True
    return CompensatedForce(load.taken_off(signals.force, signals.rotations), finite, inside, free_rows, load)


def _free_on_both_sides(means: _MovingMeans) -> Mask:
    """Means before the first touch and after the last.

    Where one of them would be in contact by the other's level of the force, the steadier one is free: the other slides.
    """
    before, after = _free_before_touch(means), _free_before_touch(means.reversed())[::-1]
    if not (before.any() and after.any()):
        return before | after
    levels = [np.median(means.force[rows], axis=0) for rows in (before, after)]
    largest = np.linalg.norm(means.force - levels[0], axis=1).max()
    if np.linalg.norm(levels[1] - levels[0]) < 0.5 * largest:
        return before | after
    scatter = [
        np.abs(means.force[rows] - level).mean() for rows, level in zip((before, after), levels, strict=True)
    ]
    return before if scatter[0] < scatter[1] else after


def _free_before_touch(means: _MovingMeans) -> Mask:
    """Means before the first touch; none if the approach is not along the force that it meets.

    Of a tip that slides at once, up a slope or down, the approach is along the force less its part along the slide.
    """
    brief = means.brief
    none = np.zeros(len(means.rows), bool)
    level = np.median(means.force[:brief], axis=0)
    change = np.linalg.norm(means.force - level, axis=1)
    usual = np.sort(change)[-brief:][0]  # for so long, however brief a slide is in its log
    met = end = int(np.argmax(change > 0.5 * usual))
    while end and change[end] > means.noise:
        end -= 1
    if end < max(brief, MIN_ROWS):
        return none
    position = means.position
    later = met + max(round(0.5 / means.step), means.window)
    contact_force = means.rotations[met] @ (np.median(means.force[met:later], axis=0) - level)
    # Before its last part, the tip may come across from another touch.
    approach = position[end] - position[end - means.window]
    departure = position[min(met + brief, len(position) - 1)] - position[met]
    slide = position[min(later, len(position) - 1)] - position[met]
    across = contact_force - slide * (contact_force @ slide) / max(slide @ slide, 1e-300)
    leaves_across = np.linalg.norm(across) > MIN_SLIDE_SINE * np.linalg.norm(contact_force)
    is_along = _is_along(approach, contact_force)
    # The force comes on a shorter way than it stayed away on, and the tip does not turn back, as friction would.
    free_path = float(np.linalg.norm(position[: end + 1] - position[end], axis=1).max())
    is_sudden = free_path > max(MIN_SLIDE, float(np.linalg.norm(position[met] - position[end])))
    goes_on = approach @ departure > -0.5 * (approach @ approach)
    if not is_sudden or not ((is_along and goes_on) or (leaves_across and _is_along(approach, across))):
        return none
    return np.arange(len(means.rows)) < end - means.window


def _is_along(direction: Array, force: Array) -> bool:
    product = float(np.linalg.norm(direction) * np.linalg.norm(force))
    return abs(float(direction @ force)) > MIN_APPROACH_COSINE * product


def _untouched_rows(signals: BaseSignals, means: _MovingMeans, free: Mask, weighs: bool) -> Mask:
    """Rows of the log in free motion, shape (n,), without touches before the slide; none if they are few."""
    rows = np.zeros(len(signals.time), bool)
    rows[means.rows[free]] = True
    if rows.sum() < MIN_ROWS:
        return rows & False
    load = fit_load_robustly(signals.force[rows], signals.rotations[rows], weighs=weighs)
    size = np.linalg.norm(load.taken_off(means.force, means.rotations), axis=1)
    touched = free & (size > max(means.noise, 3.0 * float(np.median(size[free]))))
    near_touch = np.convolve(touched, np.ones(2 * means.window + 1), "same") > 0.5
    rows[means.rows[near_touch]] = False
    return rows


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
        position, direction: [m], direction of the motion, shape (m, 3).
        force, rate: as of `Smooth`, from the tip on the surface, shape (m, 3).
        tool_rotations: rotation of the tool, shape (m, 3, 3).
        rows: of the smooth signals.
        smooth, moves, slides: whence the windows are, and where the tip moves on, and across the force.
        load_known: True if free motion or a payload file gives the zero of the force.
        turns, reference_rotation: times and rotations of the log's rows, and the tool's rotation in free motion.
        sign: of the sensor's reading against the force on the surface.
        noise: standard deviation of psi times the force [N], shape (m,).
        path: [m].
    """

    speed: Array
    position: Array
    direction: Array
    force: Array
    rate: Array
    tool_rotations: Array
    rows: Indices
    smooth: Smooth
    moves: Mask
    slides: Mask
    load_known: bool
    turns: tuple[Array, Array]
    reference_rotation: Array
    sign: float
    noise: Array
    path: float

    def grid_fractions(self, length: float) -> tuple[Array, Mask]:
        """Fractions of friction on the grid, shape (n, 5), and where the whole window of a rate slips, shape (n,)."""
        s = self.smooth
        stuck_and_slipping = _friction_fractions(s, self.moves, length)
        return stuck_and_slipping, np.convolve(
            self.moves & (stuck_and_slipping[:, 0] > MIN_SLIP_FRACTION), np.ones(s.longer), "same"
        ) > s.longer - 0.5

    def fractions(self, length: float) -> tuple[Array, Mask]:
        """Fractions and slip in the windows, shape (m, 5) and (m,)."""
        fractions, slips = self.grid_fractions(length)
        return fractions[self.rows], slips[self.rows]

    def friction_angle(self, result: SlideFit, length: float) -> tuple[Array, Array, Mask]:
        """Force on the surface [N], shape (n, 3), residual of psi but for the spring [rad], and slip, on the grid."""
        s = self.smooth
        rotations = self.turns[1][nearest(self.turns[0], s.time)]
        F = self.sign * s.force - self.load_on(rotations, result.load)
        direction = s.velocity / np.maximum(np.linalg.norm(s.velocity, axis=1), 1e-12)[:, None]
        fractions, slips = self.grid_fractions(length)
        return F, lean(F, direction) - friction_that_acts(result.mu[0], fractions), slips

    def load_on(self, rotations: Array, load: Array) -> Array:
        """Force [N] of bias and weight as in `SlideFit`, on a tool turned by matrices (n, 3, 3), shape (n, 3)."""
        off: Array = rotations @ load[:3]
        return off if len(load) == 3 else off + load[3:] - rotations @ self.reference_rotation.T @ load[3:]


def lean(force: Array, direction: Array) -> Array:
    """Angle of forces from the planes across unit vectors [rad], shape (n,), of both in rows, shape (n, 3)."""
    along = dot_rows(force, direction)
    return np.arctan2(along, np.sqrt(np.maximum(dot_rows(force, force) - along**2, 1e-12)))


def friction_that_acts(mu: Array, fractions: Array) -> Array:
    """Angle of friction along the motion [rad], shape (n,), by the fractions of `SlideWindows.fractions`."""
    return np.arctan(mu * fractions[:, 0] / np.sqrt(1.0 + mu**2 * fractions[:, 1]))


def slide_windows(
    signals: BaseSignals, compensated: CompensatedForce, frame: ContactFrame
) -> SlideWindows | None:
    """The windows in which the tip slides; None if it does not."""
    s = smooth(signals, compensated)
    if s is None or not s.inside.any():
        return None
    speed = np.linalg.norm(s.velocity, axis=1)
    usual = float(np.median(speed[s.inside & (speed > 4.0 * s.blur)]))
    size = np.linalg.norm(s.force, axis=1)
    heavy = float(np.median(size[s.inside]))
    moves = s.inside & (speed > max(MIN_SPEED_RATIO * usual, 4.0 * s.blur)) & (size > 0.2 * heavy)
    if not usual > 0.0 or moves.sum() < 10 * s.rows or not heavy > 6.0 * s.noise:
        return None
    direction = s.velocity / np.maximum(speed, 1e-12)[:, None]
    # The tip loses work to the surface, whichever way it goes: that tells action from reaction.
    work = float(np.einsum("ij,ij->", s.force[moves], s.velocity[moves]))
    sign = {"action": 1.0, "reaction": -1.0, None: 1.0 if work >= 0.0 else -1.0}[frame.force_sign]
    across = np.linalg.norm(np.cross(s.force, direction), axis=1)
    load_known = bool(compensated.free.any()) or frame.payload is not None
    slides = moves & ((across > MIN_SLIDE_SINE * size) | (not load_known))
    path = float(speed[slides].sum() * s.step)
    if path < MIN_SLIDE or path < 0.5 * float(speed[moves].sum() * s.step):
        return None
    rows = np.flatnonzero(slides)
    rows = rows[:: max(s.rows // 2, len(rows) // MAX_WINDOWS, 1)]
    rotations = signals.rotations[nearest(signals.time, s.time[rows])]
    reference_rotation = (
        signals.rotations[compensated.free].mean(axis=0) if compensated.free.any() else rotations.mean(axis=0)
    )
    force = s.noise * np.sqrt(2.25 / s.rows)
    noise = np.hypot(force, size[rows] * s.blur / speed[rows])
    return SlideWindows(
        speed[rows], s.position[rows], direction[rows], sign * s.force[rows], sign * s.rate[rows],
        rotations, rows, s, moves, slides, load_known,
        (signals.time, signals.rotations), reference_rotation, sign, noise, path,
    )  # fmt: skip


def _friction_fractions(s: Smooth, moves: Mask, length: float) -> Array:
    """Friction along the motion, its square across, and its vector, as fractions of gross slip, shape (n, 5).

    The bristle bends by at most the length times the force over its median.
    """
    speed = np.linalg.norm(s.velocity, axis=1)
    direction = s.velocity / np.maximum(speed, 1e-12)[:, None]
    fractions = np.zeros((len(direction), 3))
    size = np.linalg.norm(s.force, axis=1)
    lengths = np.maximum(length * size / float(np.median(size[moves])), 1e-9)
    decay = np.where(moves, np.exp(-speed * s.step / lengths), 1.0)
    x = 0.0
    y = 0.0
    z = 0.0
    for k, (e, top, inside, (a, b, c)) in enumerate(
        zip(decay.tolist(), lengths.tolist(), s.inside.tolist(), direction.tolist(), strict=True)
    ):
        new = (1.0 - e) * top
        x, y, z = (e * x + new * a, e * y + new * b, e * z + new * c) if inside else (0.0, 0.0, 0.0)
        fractions[k] = x / top, y / top, z / top
    from scipy.signal import savgol_filter

    fractions = savgol_filter(fractions, s.rows, 2, axis=0)  # as the force
    along = dot_rows(fractions, direction)
    across = np.maximum(dot_rows(fractions, fractions) - along**2, 0.0)
    return np.column_stack([along, across, fractions])


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
class SlideProblem:
    """The least-squares problem of a slide.

    Args:
        windows: of the slide.
        classes: of its speeds, shape (m,), from 0.
        prior: standard deviation of lag and load, shape (4,) or (7,).
    """

    windows: SlideWindows
    classes: Array
    prior: Array

    def psi(self, lag: float, load: Array) -> tuple[Array, Array, Array]:
        """Angle of the force from the plane across the motion, spring's regressor, and force, shape (m,) and (m, 3)."""
        c = self.windows
        F = c.force + lag * c.rate - c.load_on(c.tool_rotations, load)
        rate = dot_rows(F, c.rate) / np.maximum(np.linalg.norm(F, axis=1), 1e-9)
        return lean(F, c.direction), rate / c.speed, F

    def residuals(self, x: Array, fractions: Array) -> Array:
        """Residuals of psi, over its noise, shape (m,)."""
        j = len(x) - 1 - len(self.prior)
        psi, spring, F = self.psi(x[j + 1], x[j + 2 :])
        mu = x[:j][self.classes]
        model = friction_that_acts(mu, fractions) + x[j] * spring / np.sqrt(1.0 + mu**2)
        return (psi - model) * np.linalg.norm(F, axis=1) / self.windows.noise

    def solve(self, fractions: Array, slips: Mask) -> SlideFit:
        """Minimise by Gauss-Newton with Huber's weights; all rows count where too few slip."""
        classes = int(self.classes.max()) + 1
        slips_enough = bool(np.bincount(self.classes[slips], minlength=classes).min() >= 2 * BLOCKS)
        rows = slips | (not slips_enough)
        x = self._start(rows, classes)
        inverse = np.r_[np.zeros(classes + 1), 1.0 / self.prior]
        step = np.r_[np.full(classes, 1e-4), 1e-7, 1e-4, np.full(len(self.prior) - 1, 1e-3)]
        correlation = 1.0
        for _ in range(15):
            r = self.residuals(x, fractions)[rows]
            shifted = [self.residuals(x + e, fractions)[rows] for e in np.diag(step)]
            J = (np.column_stack(shifted) - r[:, None]) / step
            scale = max(1.4826 * float(np.median(np.abs(r))), 1.0)
            w = np.minimum(1.0, 3.0 * scale / np.maximum(np.abs(r), 1e-12)) / scale**2
            correlation = max(0.5 * correlation + 0.5 * _block_correlation(w, r), 1.0)
            w = w / correlation  # residuals that go together count once against the priors
            A = J.T @ (w[:, None] * J) + np.diag(inverse**2)
            move = -np.linalg.solve(A, J.T @ (w * r) + inverse**2 * x)
            x = x + move
            x[:classes] = np.clip(x[:classes], -MAX_MU, MAX_MU)
            if np.all(np.abs(move) < 0.01 * step):
                break
        # Parts of the time, and of the place: what a path repeats on each lap is in every part of the time.
        position = self.windows.position[rows]
        along = position @ np.linalg.eigh(np.cov(position.T))[1][:, 2]
        orders = np.arange(len(r)), np.argsort(along, kind="stable")
        cov = max((_jackknife(J, w, r, A, inverse, order) for order in orders), key=lambda C: float(C[0, 0]))
        angle = np.zeros(len(fractions))
        angle[rows] = r
        return SlideFit(
            mu=x[:classes],
            compliance=float(x[classes]),
            lag=float(x[classes + 1]),
            load=x[classes + 2 :],
            covariance=cov,
            angle=angle,
            scale=scale * float(np.sqrt(correlation)),
            slips=slips_enough,
        )

    def _start(self, rows: Mask, classes: int) -> Array:
        """Parameters to start from: friction as it looks without any load, all else 0."""
        psi = self.psi(0.0, np.zeros(len(self.prior) - 1))[0]
        friction = np.clip(np.tan(np.median(psi[rows])), -MAX_MU, MAX_MU)
        return np.r_[np.full(classes, friction), np.zeros(1 + len(self.prior))]

    def cost(self, result: SlideFit, fractions: Array, scale: float) -> float:
        """Sum of squares over all rows, sticking ones included, and of the priors."""
        x = np.r_[result.mu, result.compliance, result.lag, result.load]
        r = self.residuals(x, fractions) / scale
        far = np.r_[result.lag, result.load] / self.prior
        return float(np.sum(np.minimum(r**2, 9.0)) + far @ far)


def _block_correlation(w: Array, r: Array) -> float:
    """Variance of the sums of weighted residuals over blocks, over what independent residuals would give."""
    sums = [float(np.sum(w[b] * r[b])) for b in np.array_split(np.arange(len(r)), BLOCKS)]
    return float(np.mean(np.square(sums)) * BLOCKS / np.sum((w * r) ** 2))


def _jackknife(J: Array, w: Array, r: Array, A: Array, inverse: Array, order: Indices) -> Array:
    """Covariance by leaving out blocks of rows of an order in turn, and the prior, shape (p, p)."""
    inner = np.linalg.inv(A)
    blocks = np.array_split(order, min(BLOCKS, max(len(r) // 4, 2)))
    meat = np.diag(inverse**2)
    for b in blocks:
        Jb = J[b]
        wb = w[b]
        reduced = A - Jb.T @ (wb[:, None] * Jb)
        score = Jb.T @ (wb * r[b])
        gone = A @ np.linalg.solve(reduced + 1e-12 * np.diag(np.diag(A)), score)
        meat = meat + np.outer(gone, gone) * (len(blocks) - 1) / len(blocks)
    return inner @ meat @ inner


def fit_relaxation(fit: SlideProblem) -> tuple[SlideFit, float, Array]:
    """The fit with the length of relaxation that the log shows [m]; lengths beside it with their mu, shape (k, 2)."""
    tried: dict[float, tuple[Array, SlideFit]] = {}

    def costs() -> tuple[Array, Array]:
        scale = min(result.scale for _, result in tried.values())
        lengths = np.array(sorted(tried))
        return lengths, np.array([fit.cost(tried[x][1], tried[x][0], scale) for x in lengths])

    def attempt(length: float) -> None:
        fractions, slips = fit.windows.fractions(length)
        tried[length] = fractions, fit.solve(fractions, slips)

    for length in LENGTHS:
        attempt(float(length))
    for ratio in (1.48, 1.22, 1.1):
        lengths, cost = costs()
        best = float(lengths[np.argmin(cost)])
        attempt(best * ratio)
        attempt(best / ratio)
    lengths, cost = costs()
    best = float(lengths[np.argmin(cost)])
    late = USUAL_LAG_STD * float(np.median(fit.windows.speed))  # a lag looks like a length
    ends = best * RELAXATION_SPREAD + late, max(best / RELAXATION_SPREAD - late, float(LENGTHS[0]))
    for length in ends:
        attempt(length)
    near = [x for x, c in zip(lengths, cost, strict=True) if c < cost.min() + 4.0]
    neighbours = sorted({*near, *ends})
    return tried[best][1], best, np.array([[x, tried[x][1].mu[0]] for x in neighbours])
