"""One file for each figure that the thesis' text describes: ``fig_6_11.py`` for figure 6.11."""
