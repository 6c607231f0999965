"""An experiment: a TOML file, its tables, and the errors of a refused one."""
