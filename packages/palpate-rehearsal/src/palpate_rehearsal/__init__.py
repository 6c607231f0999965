"""Simulated arms in processes of their own, in real time, that speak as their controllers do: to rehearse a press."""
