"""The thesis, measured again: one file per figure, one row per claim, and explanations."""
