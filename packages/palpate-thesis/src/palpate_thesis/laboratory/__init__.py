"""Unstated parameters of the thesis' laboratory, as one value; the hand-chosen one and the inferred one."""
