"""A loop brought to rest under force, with instruments so fine that all of it may be differentiated."""

from __future__ import annotations

from typing import Any

from palpate._vector import ZERO3, Vec3
from palpate.bench.sequence import CONTACT, SequenceState
from palpate.bench.tick import Loop, LoopState, start_at
from palpate.errors import InputError

FINE_BITS = 50
"""Of every converter: the rounding of `signals.quantise` is exact up to 2^51 steps."""
FINE_COUNTS = 1e17
"""Of every encoder, a turn; around its offset, so that the count stays below 2^51 for some milliradians."""
STRONGER = 10.0
NONE = 0.0 * ZERO3


def exact(loop: Loop) -> Loop:
    """The same loop with instruments that round nothing away; its angles are to stay near the encoders' offset."""
    sensor = loop.force.sensor
    return loop._replace(
        encoder=loop.encoder._replace(counts=NONE + FINE_COUNTS),
        force=loop.force._replace(
            sensor=sensor._replace(converter=_fine(sensor.converter)), converter=_fine(loop.force.converter)
        ),
        output=_fine(loop.output)._replace(full_scale=2.0 * loop.conditioning.arm.limits),
    )


def at_equilibrium(loop: Loop, force: float, *, friction: bool) -> Loop:
    """The same loop, exact, with a constant desired force [N] and, unless wanted, without friction of joints.

    Friction that is left in acts as it does at rest, before anything slips: as a spring and a damper. The motors are
    given `STRONGER` limits, so that a search for the state of rest may go beyond them on its way.
    """
    arm = loop.conditioning.arm
    loop = loop._replace(
        conditioning=loop.conditioning._replace(arm=arm._replace(limits=STRONGER * arm.limits))
    )
    plant = loop.plant
    if not friction:
        plant = plant._replace(friction=plant.friction._replace(sigma0=NONE, sigma1=NONE, sigma2=NONE))
    schedule = loop.schedule
    constant = schedule._replace(first=force, second=force, amplitude=0.0, wave=schedule.wave[:0])
    return exact(loop)._replace(plant=plant, schedule=constant)


def _fine(converter: Any) -> Any:
    return converter._replace(bits=FINE_BITS)


def pressing(loop: Loop, force: float, elbow: float, x: float | None = None) -> tuple[Loop, LoopState]:
    """The loop and its state at rest in the desired pose, pressing with the desired force [N].

    Where the controller is at rest elsewhere (an impedance, say) this is where the search for that begins.

    Args:
        loop: as `still` leaves it.
        force: on the surface [N].
        elbow: +1 or -1, the side to which joint 2 bends.
        x: of the pressed tip [m]; the wall is put where it has to be. Left out, the wall stays where it is.

    Raises:
        InputError: a surface that lies out of reach.
    """
    depth = penetration(loop.plant.surface, force)
    wall = loop.plant.wall if x is None else x - depth
    loop = loop._replace(plant=loop.plant._replace(wall=wall))
    pose = Vec3(wall + depth, loop.start.y, loop.start.z)
    arm: Any = loop.plant.arm
    beyond = arm.beyond_reach(pose)
    if beyond > 0.0:
        raise InputError(
            f"the surface under {force:g} N is out of reach by {1e3 * beyond:.1f} mm; move the wall"
        )
    q = arm.inverse(pose, elbow)
    loop = loop._replace(encoder=loop.encoder._replace(offset=q))
    free = start_at(loop, q)  # type: ignore[no-untyped-call]
    touched = free.plant.surface._replace(deflection=depth, contact=1.0)
    sensor: Any = loop.force
    smooth: Any = loop.conditioning.force
    return loop, free._replace(
        plant=free.plant._replace(surface=touched),
        force=sensor.settled_at(force, 0.0, 0.0),
        conditioning=free.conditioning._replace(force=smooth.start_at(force)),
        sequence=SequenceState(CONTACT, 0.0, 0.0, pose.x, pose.x, 1.0),
    )


def penetration(surface: Any, force: float) -> float:
    """How deep the surface gives way to a lasting force [m]: Newton's iteration on its own law."""
    rest, depth = surface.start(), 1e-3
    for _ in range(100):
        step = 1e-6 * depth
        here, beyond = (surface.force(rest._replace(deflection=p), p, 0.0) for p in (depth, depth + step))
        slope = (beyond - here) / step
        if not slope > 0.0:
            break
        nearer = max(depth - (here - force) / slope, 0.1 * depth)
        if abs(nearer - depth) <= 1e-12 * depth:
            return float(nearer)
        depth = nearer
    raise InputError(
        f"the surface holds no force of {force:g} N at any depth; a linear model needs an equilibrium"
    )
