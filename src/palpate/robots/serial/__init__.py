"""Serial arms of any number of joints."""

from palpate.robots.serial.serial_arm import Scene, SerialArm

__all__ = ["Scene", "SerialArm"]
