"""A test of force control that others enter by one file, and public data with their official splits."""
