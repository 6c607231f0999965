"""A tuned force loop: its table, its page, its looks in Python."""
