"""Robots: arms with their kinematics and dynamics."""

from palpate.robots.arm3 import MOTOR_TORQUE, Arm3, ArmModel
from palpate.robots.planar3r import Planar3R
from palpate.robots.serial import SerialArm

__all__ = ["MOTOR_TORQUE", "Arm3", "ArmModel", "Planar3R", "SerialArm"]
