"""What a study came to: its best settings, its comparisons, its figures and its page."""
