"""A stiffness map on a terminal and on a page."""
