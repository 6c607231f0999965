"""Hybrid and neural force control: sections 4.4, 4.5 and 6.3 of the thesis."""
