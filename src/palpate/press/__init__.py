"""Pressing with any serial arm: in simulation, behind the protocol of a real one."""
