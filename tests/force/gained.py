"""Gains that several tests share."""

from functools import cache

import msgspec

from palpate.force.arm import load_arm
from palpate.force.gains import ALPHA, Gains, approach_speed
from palpate.force.lag import lag_of
from palpate.force.sensitivity import relief_of


@cache
def lag(name):
    return lag_of(load_arm(name))


@cache
def relief(name):
    return relief_of(load_arm(name), lag(name), ALPHA)


def gains_of(name="ur5e", force=20.0, cap=1e6, noise=0.1):
    arm = load_arm(name)
    arm = msgspec.structs.replace(arm, sensor=msgspec.structs.replace(arm.sensor, noise=noise))
    theta = lag(name)
    return Gains(
        arm=arm, force=force, theta=theta, cap=cap, force_limit=60.0,
        approach=approach_speed(arm, force, theta, cap), relief=relief(name),
    )  # fmt: skip
