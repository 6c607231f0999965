"""Stability of force loops: certificates of tuned gains, and their independent check."""
