"""A figure of matplotlib as the panels of a page: charts that can be zoomed where it is lines, pictures where not."""
