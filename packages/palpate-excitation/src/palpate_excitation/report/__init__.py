"""A force to ask for: its figure, its table, its files."""
