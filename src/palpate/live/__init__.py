"""The page in the browser with an arm that presses or slides; it works offline, and steers on this machine alone."""
