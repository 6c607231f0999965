"""The thesis, measured again: one file a figure, one row a claim, and what explains them."""
