"""Options that several commands have, or too many for a command's own file; a dataclass is a group of the help."""
