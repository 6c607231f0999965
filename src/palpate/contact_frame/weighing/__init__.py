"""A tool weighed by a log of free motion."""
