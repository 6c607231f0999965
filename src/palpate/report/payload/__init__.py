"""A weighed tool: its table and page, its looks in Python."""
