"""A test of force control by metrics over a range of stiffness, for palpate's law and for controllers of others."""
