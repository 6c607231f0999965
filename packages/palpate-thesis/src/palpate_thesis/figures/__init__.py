"""Figures that the thesis describes: ``fig_6_10.py`` for figure 6.10; foam and rubber are a pair in one file."""
