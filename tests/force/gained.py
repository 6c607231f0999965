"""Gains that several tests share."""

from functools import cache

import msgspec

from palpate.force.arm import load_arm
from palpate.force.gains import gains_for


@cache
def gains_of(name="ur5e", force=20.0, cap=1e6, noise=0.1, resolution=None):
    arm = load_arm(name)
    sensor = msgspec.structs.replace(arm.sensor, noise=noise, resolution=resolution)
    arm = msgspec.structs.replace(arm, sensor=sensor)
    return gains_for(arm, force, cap=cap, limit=60.0)
