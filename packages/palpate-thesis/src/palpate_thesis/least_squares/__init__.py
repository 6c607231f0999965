"""Least squares on the first touch: sections 5.1 and 6.1 of the thesis."""
