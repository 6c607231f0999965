"""A simulated surface with lumps, which a simulated arm maps by presses at places that it chooses itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from palpate.arrays import Array
from palpate.environments.models import KelvinVoigt
from palpate.errors import InputError
from palpate.files import read_table, read_text
from palpate.maps.presses import Presses
from palpate.maps.result import MapRequest, MapResult, map_of
from palpate.press.prepare import PreparedPress, PressSpec, prepare_press
from palpate.press.setting import GAP, place_of
from palpate.press.summary import summarise

FIRST = 4
"""Rows and columns of the presses before the first map: with fewer than sixteen no length scale shows."""
AT_ONCE = 3
"""Presses that are chosen from one map."""


class PhantomLump(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An ellipse of another stiffness.

    Args:
        at: its centre [m].
        radius: its two semi-axes [m].
        stiffness: in its middle [N/m].
        edge: width over which it turns into its surroundings [m].
    """

    at: tuple[float, float]
    radius: tuple[float, float]
    stiffness: float
    edge: float = 1e-3


class Phantom(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A flat surface whose stiffness depends on the place.

    Args:
        size: along both axes [m]; the arm's home is over the middle.
        stiffness: of the background [N/m].
        damping: everywhere [N s/m].
        lumps: in it.
    """

    size: tuple[float, float]
    stiffness: float
    damping: float = 0.0
    lumps: tuple[PhantomLump, ...] = ()

    def stiffness_at(self, places: Array) -> Array:
        """The stiffness at places (n, 2) [m] (n,) [N/m]: a lump turns into its surroundings on a logistic curve."""
        value = np.full(len(places), np.log(self.stiffness))
        for lump in self.lumps:
            radius = np.asarray(lump.radius)
            outside = (np.linalg.norm((places - lump.at) / radius, axis=1) - 1.0) * radius.min()
            fraction = 0.5 * (1.0 - np.tanh(2.0 * outside / lump.edge))
            value += fraction * (np.log(lump.stiffness) - value)
        return np.exp(value)


def load_phantom(path: Path) -> Phantom:
    """A phantom from a TOML file, or one that comes with palpate by its name.

    Raises:
        InputError: it cannot be read, or a number is not above zero.
    """
    advice = "; a phantom has size, stiffness, damping and [[lumps]] with at, radius, stiffness, edge"
    shipped = Path(__file__).with_name("phantoms") / f"{path.name}.toml"
    source = shipped if shipped.is_file() and not path.exists() else path
    phantom = read_table(read_text(source, "a phantom"), str(path), Phantom, lambda _: advice)
    numbers = [*phantom.size, phantom.stiffness]
    for lump in phantom.lumps:
        numbers += [*lump.radius, lump.stiffness, lump.edge]
    if not all(np.isfinite(n) and n > 0.0 for n in numbers) or not 0.0 <= phantom.damping < np.inf:
        raise InputError(f"{path}: sizes, radii, edges and stiffnesses must be finite and above 0")
    return phantom


def palpate_phantom(
    spec: PressSpec,
    phantom: Phantom,
    count: int,
    request: MapRequest,
    show: Callable[[int, str], bool],
    grow: Callable[[MapResult], None],
) -> MapResult:
    """Press a grid, then where the map is worst known for what is asked.

    Args:
        spec: of one press; its surface and its place are set here.
        phantom: the surface.
        count: of presses.
        request: of the map.
        show: is called after each press, with the number of presses and a line about the last; it returns whether to
            go on.
        grow: is called with each map.

    Raises:
        InputError: an arm that cannot reach the phantom, or too few presses.
    """
    if count < FIRST * FIRST:
        raise InputError(
            f"a map of a phantom begins with {FIRST * FIRST} presses; ask for as many, got {count}"
        )
    presser = prepare_press(replace(spec, surface=KelvinVoigt(phantom.stiffness, phantom.damping, 0.0)))
    steps = [(np.arange(FIRST) / (FIRST - 1.0)) * side for side in phantom.size]
    waiting = list(np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 2))
    size = np.asarray(phantom.size)
    presses = Presses(np.empty((0, 2)), np.empty(0), np.empty(0), [])
    done = 0
    while True:
        for place in waiting:
            stiffness, half = _press(presser, phantom, place, done)
            done += 1
            presses = _with(presses, place, stiffness, half, f"press {done}")
            if not show(done, f"{stiffness:.4g} N/m" if half else "not identified"):
                return map_of(presses, request)
        result = map_of(presses, request)
        grow(result)
        if done >= count:
            return result
        grid = np.stack(np.meshgrid(*(np.linspace(0.0, side, 25) for side in size)), axis=-1).reshape(-1, 2)
        waiting = list(result.choose(min(AT_ONCE, count - done), grid).places)


def _press(presser: PreparedPress, phantom: Phantom, position: Array, seed: int) -> tuple[float, float]:
    """Stiffness and half-width of a press at a place of the phantom; a half-width of 0 if it is not identified."""
    request = presser.request
    home = request.arm.forward_kinematics(request.arm.home)
    _, *along = request.place.axes
    point = home[:3, 3] + GAP * request.place.normal
    point = point + sum(
        (c - 0.5 * side) * axis for c, side, axis in zip(position, phantom.size, along, strict=True)
    )
    surface = KelvinVoigt(float(phantom.stiffness_at(position[None])[0]), phantom.damping, 0.0)
    where = place_of(request.arm, point, request.place.normal)
    local = replace(request, place=where, surface=surface, seed=request.seed + seed)
    summary = summarise(replace(presser, request=local).run(), local)
    K = ((summary["identified"] or {}).get("parameters") or {}).get("K")
    if not K or K["value"] is None or not K["ci95"]:
        return float("nan"), 0.0
    return float(K["value"]), 0.5 * float(K["ci95"][1] - K["ci95"][0])


def _with(presses: Presses, position: Array, stiffness: float, half: float, name: str) -> Presses:
    """The presses with one more, which is refused if its half-width is 0."""
    if not half:
        return replace(presses, refused=presses.refused | {name: "its stiffness is not identified"})
    return replace(
        presses, places=np.vstack([presses.places, position]), stiffness=np.append(presses.stiffness, stiffness),
        half=np.append(presses.half, half), names=[*presses.names, name],
    )  # fmt: skip
