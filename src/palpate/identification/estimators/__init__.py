"""Estimators: from a problem and a model to a fit."""
