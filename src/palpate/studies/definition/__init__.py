"""Definition of a study: its file, its parameters, and the plan of its runs."""
