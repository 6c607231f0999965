"""A log while nothing is touched: in which rows, at what level, with what inertia."""
