"""Gains that several tests share."""

from functools import cache

import msgspec

from palpate.force.arm import Arm, Limits, Sensor, ServoLoop, load_arm
from palpate.force.gains import gains_for


@cache
def gains_of(name="ur5e", force=20.0, cap=1e6, noise=0.1, resolution=None):
    arm = load_arm(name)
    sensor = msgspec.structs.replace(arm.sensor, noise=noise, resolution=resolution)
    arm = msgspec.structs.replace(arm, sensor=sensor)
    return gains_for(arm, force, cap=cap, limit=60.0)


def servo_gains(mass=6.6, stiffness=4800.0, damping=480.0):
    """Gains of a servo that yields, as the iiwa14's are in MuJoCo menagerie, for 15 N."""
    arm = Arm(
        title="a servo", rate=500.0, limits=Limits(speed=0.25, stiffness=2e5),
        inner=ServoLoop(mass=mass, stiffness=stiffness, damping=damping, delay=0.008),
        sensor=Sensor(low_pass="butterworth3:120", sampling=480.0, noise=0.1, full_scale=100.0),
    )  # fmt: skip
    return gains_for(arm, 15.0)
