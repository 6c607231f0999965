"""Conditions that end a press over a wire early, each with its sentence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.wires.at_rest import AtRest
from palpate.wires.lateness import CLOCKS
from palpate.wires.order import Order
from palpate.wires.protocol import Sense, unreadable


class Moment(NamedTuple):
    """A reading along the press.

    Args:
        sense: as it came.
        force: along the direction, without the bias [N].
        depth: likewise, from the start [m].
        speed: measured, since the reading before [m/s].
        missed: readings that never came, since the one before.
        age: beyond the least that was seen [s].
        since_start: by the arm's clock [s].
        since_touch: likewise [s]; None before it.
    """

    sense: Sense
    force: float
    depth: float
    speed: float
    missed: int
    age: float
    since_start: float
    since_touch: float | None


def spoiled(sense: Sense, last: Sense, rest: AtRest, theta: float) -> str | None:
    """Why a reading is none, in words; None if it is one.

    Args:
        sense: as it came.
        last: the one before.
        rest: the arm before the press, by whose readings the two clocks are compared.
        theta: the loop's lag [s]: no reading that counts is later than that, so that none catches up by more.
    """
    reason = unreadable(sense)
    if reason is not None:
        return reason
    if not sense.stamp > last.stamp:
        return f"the arm's clock went back, from {last.stamp:.6g} to {sense.stamp:.6g} s; has its controller restarted?"
    apart = CLOCKS * (sense.received - rest.last.received)
    ahead = rest.offset - (sense.received - sense.stamp) - apart
    if ahead > theta:
        return (
            f"the arm's clock is {ahead:.3g} s ahead of this computer's since the arm was at rest; does it run too"
            " fast, has it been set, or do two arms speak?"
        )
    return None


def reason_to_stop(now: Moment, order: Order, rest: AtRest) -> str | None:
    """The first limit that is passed, in words; None if none is."""
    reasons = (_time(now, order), _force(now, order, rest), _place(now, order, rest), _speed(now, order))
    return next((reason for reason in reasons if reason is not None), _age(now, order))


def _time(now: Moment, order: Order) -> str | None:
    if now.since_start <= order.limits.seconds:
        return None
    what = "" if now.since_touch is not None else ", and nothing was touched"
    return f"the time limit of {order.limits.seconds:g} s is over{what}"


def _force(now: Moment, order: Order, rest: AtRest) -> str | None:
    largest = float(np.abs(np.array(now.sense.force) - rest.bias).max())
    if not largest <= order.limits.force:
        return f"the force is {largest:.3g} N, above the limit of {order.limits.force:g} N"
    if now.force < -max(order.task.force, 8.0 * rest.noise) / 2.0:
        return f"the force is {now.force:.3g} N against the press: is its sign, or --normal, right?"
    return None


def _place(now: Moment, order: Order, rest: AtRest) -> str | None:
    travel = order.limits.travel
    if not abs(now.depth) <= travel:
        return f"the tool is {1e3 * now.depth:.3g} mm from the start, beyond the limit of {1e3 * travel:g} mm"
    aside = np.array(now.sense.position) - rest.position - now.depth * np.array(order.task.direction)
    if not float(np.linalg.norm(aside)) <= travel:
        return "the tool left the line of the press by more than the limit of travel"
    return None


def _speed(now: Moment, order: Order) -> str | None:
    # A quantised position shows speeds that are none from tick to tick: twice the limit over one tick is let pass.
    if abs(now.speed) <= 2.0 * order.limits.speed + 2e-5 / order.loop.gains.arm.tick:
        return None
    return f"the tool moves at {1e3 * now.speed:.3g} mm/s, above the limit of {1e3 * order.limits.speed:g}"


def _age(now: Moment, order: Order) -> str | None:
    theta = order.loop.gains.theta
    if now.age <= theta:
        return None
    return f"a reading came {1e3 * now.age:.3g} ms late, more than the loop's lag of {1e3 * theta:.3g} ms"
