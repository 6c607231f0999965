"""What is true of a press: parameters, dynamic stiffness at any frequency, and the stiffness at a working point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foreign.surfaces import Surface, touch

Array = NDArray[np.float64]
Range = tuple[float, float]


@dataclass(frozen=True)
class Dense:
    """A press without sensors.

    Args:
        dt: step [s].
        depth, force: of the surface [m], [N]; contact: whether it is touched; shape (n,) each.
    """

    dt: float
    depth: Array
    force: Array
    contact: NDArray[np.bool_]

    def thinned(self, rate: float) -> Dense:
        """Every so many samples, for slow questions."""
        every = max(int(1 / (rate * self.dt)), 1)
        return Dense(
            self.dt * every, self.depth[::every], self.force[::every], self.contact[::every]
        )  # fmt: skip


def dynamic_stiffness(surface: Surface, frequency: float, depth: float, amplitude: float) -> complex:
    """Force over depth of a small sine about a depth, storage + 1j loss [N/m].

    Linear surfaces by their formula; others by integrating the law until the arms have relaxed. One that yields has
    then yielded: it is its elastic stiffness.

    Args:
        surface: what is pressed on.
        frequency: of the sine [Hz].
        depth: about which [m].
        amplitude: of the sine [m].
    """
    omega = 2 * np.pi * frequency
    if surface.linear:
        arms = sum(k * 1j * omega * tau / (1 + 1j * omega * tau) for k, tau in surface.arms)
        return surface["K"] + 1j * omega * surface["B"] - omega**2 * surface["M"] + arms
    points = 4000
    dt = 1 / (frequency * points)
    periods = 5 + int(8 * frequency * max((tau for _, tau in surface.arms), default=0.0))
    t = np.arange(periods * points) * dt
    rise = np.clip(t * frequency, 0, 1)
    swing = amplitude * np.sin(omega * t)
    x = depth * rise**2 * (3 - 2 * rise) + np.where(t * frequency >= 1, swing, 0.0)
    v = np.gradient(x, dt)
    glued = Surface(surface.name, surface.elements, surface.arms, glued=True)
    force = touch(glued, x, v, np.gradient(v, dt), dt).force
    last = slice(-points, None)
    wave = np.exp(-1j * omega * t[last])
    return complex((force[last] * wave).sum() / (x[last] * wave).sum())


def octave_stiffness(dense: Dense, frequency: float) -> Range | None:
    """Lowest and highest best linear approximation of force by depth in the octave about a frequency [N/m], storage.

    Hann blocks, half overlapping, that lie in contact; one regression over all of them (Pintelon and Schoukens 2012,
    3.4). Blocks of two, four and eight periods that begin early or half a block later: on a surface that is not linear
    each gives another number, and none of them is truer. None where no block lies in contact.
    """
    short = dense.thinned(max(60 * frequency, 50.0))
    found = []
    for periods in (2, 4, 8):
        size = int(periods / (frequency * short.dt))
        for begin in (0, size // 2):
            blocks = [
                slice(i, i + size) for i in range(begin, len(short.depth) - size + 1, max(size // 2, 1))
            ]
            blocks = [block for block in blocks if short.contact[block].all()]
            own = _regressed(short, blocks, size, frequency) if blocks else None
            if own is not None:
                found.append(own.real)
    return (min(found), max(found)) if found else None


def _regressed(dense: Dense, blocks: list[slice], size: int, frequency: float) -> complex | None:
    bins = np.fft.rfftfreq(size, dense.dt)
    inside = (bins >= frequency / np.sqrt(2)) & (bins <= frequency * np.sqrt(2))
    line, window = np.arange(size), np.hanning(size)
    top = bottom = 0.0 + 0j
    for block in blocks:
        x, f = (
            np.fft.rfft(window * _level(line, signal[block]))[inside] for signal in (dense.depth, dense.force)
        )
        top += (f * x.conj()).sum()
        bottom += (np.abs(x) ** 2).sum()
    return complex(top / bottom) if abs(bottom) > 0 else None


def _level(line: Array, values: Array) -> Array:
    return values - np.polyval(np.polyfit(line, values, 1), line)


_RESTS = 0.01
"""Share of the fastest of a loading below which the probe rests."""
ABOUT = 0.05
"""Half of the share of the largest force about a force at which the slope is taken."""


def press_stiffness(surface: Surface, dense: Dense, force: float | None = None) -> Range | None:
    """Lowest and highest slope of force over depth of the loadings [N/m]: about a force, or from 40 to 95 % of theirs.

    A loading is a contact's first advance to its peak force, without rests and ways back: at rest the force goes on by
    itself, and has no slope over the depth. A log without a loading has the slope of its unloading. Two
    slopes are as true as each other: of the force as it was, and of the force without what is no spring (damper, mass,
    friction), on the same way. Of a surface that yields so are those of each contact alone: its second is stiffer.
    """
    short, low, high, largest = dense.thinned(1000.0), 0.4, 0.95, None
    if force is not None:
        largest = float(short.force.max() or 1.0)
        share = min(force / largest, 1 - ABOUT)
        low, high = max(share - ABOUT, 0.0), max(share + ABOUT, 2 * ABOUT)
    v = np.gradient(short.depth, short.dt)
    slow = surface.scaled(B=0.0, D=0.0, M=0.0, Fc=0.0)
    calm = touch(slow, short.depth, v, np.gradient(v, short.dt), short.dt).force
    edges = np.flatnonzero(np.diff(np.concatenate([[0], short.contact.view(np.int8), [0]])))
    forces = short.force, calm
    levels = low, high, largest
    told = [s for f in forces if (s := _slope_in(short.depth, f, edges, *levels)) is not None]
    if not told:
        back = len(short.depth) - edges[::-1]
        told = [s for f in forces if (s := _slope_in(short.depth[::-1], f[::-1], back, *levels)) is not None]
    if told and surface["Kp"]:
        alone = [_slope_in(short.depth, f, own, *levels) for f in forces for own in edges.reshape(-1, 2)]
        told += [s for s in alone if s is not None]
    return (min(told), max(told)) if told else None


def _slope_in(
    depth: Array, force: Array, edges: NDArray[np.intp], low: float, high: float, largest: float | None
) -> float | None:
    """Of one force over the depth, a level for each loading that goes half as deep as the deepest.

    Args:
        depth: shape (n,) [m].
        force: shape (n,) [N].
        edges: first row, and past the last, of one contact after the other, shape (2 c,).
        low: share of the largest force at which it begins.
        high: the same of its end.
        largest: that force [N]; None for each loading's own.
    """
    xx = xf = 0.0
    spans = list(zip(edges[::2], edges[1::2], strict=True))
    inside = np.concatenate([depth[a:b] for a, b in spans]) if spans else np.zeros(1)
    deepest = float(np.ptp(inside))
    for begin, end in spans:
        x, f = depth[begin:end], force[begin:end]
        if np.ptp(x) < 0.5 * deepest:
            continue
        most = largest or float(f.max())
        top = int(np.argmax(f >= high * most)) + 1
        x, f = x[:top], f[:top]
        if len(x) < 5:
            continue
        below = np.flatnonzero(f < low * most)
        first = int(below[-1]) + 1 if len(below) else 0
        step = np.diff(x[first:], prepend=x[first])
        advances = np.concatenate([[0], step > _RESTS * step.max(), [0]])
        for a, b in np.flatnonzero(np.diff(advances)).reshape(-1, 2):
            from_mean = x[first + a : first + b] - x[first + a : first + b].mean()
            xx += float(from_mean @ from_mean)
            xf += float(from_mean @ f[first + a : first + b])
    return xf / xx if xx > 0 else None


def parameters(surface: Surface, dense: Dense, payload: float) -> tuple[dict[str, Range], frozenset[str]]:
    """What K, B and M may be, and which of them the surface defines.

    One number where the surface has the parameter; for the others the range of what a linear model may call so: K what
    the storage comes to over the depths touched, B what the loss does over the frequency. A payload that is left in the
    force may count as mass or not.

    Returns:
        Lowest and highest, by name; names of those that are one parameter of the surface.
    """
    contact = dense.contact
    deep = np.linspace(0, float(np.percentile(dense.depth[contact], 99)), 60)[1:]
    slope = np.gradient(surface.static(deep), deep)
    slope = np.append(slope, surface.static(deep) / deep)
    steep = surface["n"] * float(deep[-1]) ** (surface["n"] - 1) if surface["Q"] else 1.0
    arm = steep * sum(k for k, _ in surface.arms)
    late = steep * sum(k * tau for k, tau in surface.arms)
    plain = not any(surface[name] for name in ("K2", "K3", "C", "Kp")) and not surface.arms
    k = (surface["K"],) * 2 if plain else (float(slope.min()), float(slope.max()) + arm)
    if surface["Kp"]:
        k = min(k[0], surface["H"] * surface["Kp"] / (surface["H"] + surface["Kp"])), max(k[1], surface["Kp"])
    rate = surface["C"] * surface["D"] * float(deep[-1]) ** surface["n"] if surface["C"] else 0.0
    b = (surface["B"], surface["B"] + late + rate)
    m = min(surface["M"], surface["M"] + payload), max(surface["M"], surface["M"] + payload)
    defined = {"M"} | ({"K"} if k[0] == k[1] else set()) | ({"B"} if b[0] == b[1] else set())
    return {"K": k, "B": b, "M": m}, frozenset(defined)


def of_model(
    surface: Surface, model: str, arm: float = np.inf, depth: float | None = None
) -> dict[str, Range]:
    """What the parameters that a model gives as its own may be where the surface is of its kind, by their names.

    A standard linear solid behind a spring k is one again: with Z = K + K1 s tau/(1 + s tau), the force k Z/(k + Z) has
    the pole s = -(k + K)/(tau (k + K + K1)).

    Args:
        surface: what is pressed on.
        model: name of the answer's.
        arm: stiffness in series that nobody told of [N/m]; the number may be the surface's or that of both.
        depth: that the answer's stiffnesses belong to [m].
    """
    if model == "quasi-linear-viscoelastic" and surface["Q"] and depth:
        return _tissue(surface, arm, depth)
    if model == "standard-linear-solid" and len(surface.arms) == 1 and not surface["Q"]:
        (branch, tau), *_ = surface.arms
        low, high = (z / (1 + z / arm) for z in (surface["K"], surface["K"] + branch))
        slower = tau * (1 + branch / (surface["K"] + arm))
        return {"K": (low, surface["K"]), "K1": (high - low, branch), "tau": (tau, slower)}
    if model == "hunt-crossley" and surface["C"] and not surface.arms:
        return _power(surface, arm, depth or 0.0)
    if surface["Fc"] and model.startswith("kelvin-voigt"):
        return {"Fc": (surface["Fc"],) * 2}
    return {}


def _power(surface: Surface, arm: float, depth: float) -> dict[str, Range]:
    """The same of Hunt and Crossley's contact: F = C s^n, or the power law that has its force and slope at a depth [m].

    Behind a spring k the depth is d = s + F/k, and with r = F/(k s) the exponent d ln F/d ln d is n (1 + r)/(1 + n r).
    """
    c, n = surface["C"], surface["n"]
    share = c * depth ** (n - 1) / arm
    bent = n * (1 + share) / (1 + n * share)
    stiffness = c * depth**n / (depth * (1 + share)) ** bent if depth else c
    return {
        "K": (min(c, stiffness), max(c, stiffness)), "n": (bent, n), "B": (c * surface["D"],) * 2,
    }  # fmt: skip


def _tissue(surface: Surface, arm: float, depth: float) -> dict[str, Range]:
    """The same of tissue at a depth [m], its branch as that of a standard linear solid of the tangents there.

    Behind a spring k the exponent d ln F / d ln d of F = C s^n, d = s + F/k, falls towards 1.
    """
    (branch, tau), *_ = surface.arms
    n = surface["n"]
    steep = n * depth ** (n - 1)
    own = Surface("standard-linear", {"K": steep * surface["C"]}, ((steep * branch, tau),))
    give = steep * (surface["C"] + branch) / (n * arm)
    bent = (1 + give) / (1 / n + give)
    return {**of_model(own, "standard-linear-solid", arm), "n": (bent, n), "B": (0.0, 0.0)}
