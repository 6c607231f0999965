"""The results of one run: tables, figures, and the page of both."""
