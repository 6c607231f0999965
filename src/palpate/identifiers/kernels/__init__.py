"""What the estimators run on: laws and parts that are compiled, on flat arrays."""
