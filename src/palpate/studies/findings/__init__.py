"""Findings of a study: its best settings, its comparisons, its figures and its page."""
