"""An experiment: a TOML file, its tables, and what is said when one is refused."""
