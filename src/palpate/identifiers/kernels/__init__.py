"""Kernels of the estimators: compiled laws and parts on flat arrays."""
