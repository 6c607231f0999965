"""The page in the browser: an arm that moves, or a log that is played again; offline, and for this machine alone."""
