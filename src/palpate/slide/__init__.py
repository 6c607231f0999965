"""Slides of an arm along curved surfaces with friction: simulated, judged, shown, and measured."""
