"""The page in the browser with an arm that presses; it works offline, and steers on this machine alone."""
