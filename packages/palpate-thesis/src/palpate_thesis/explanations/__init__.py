"""Why the figures look as they do: each file toggles one cause. Numbered in the order to be read."""
