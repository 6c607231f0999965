"""Many identifications on paper: one table, one page, one forest plot of what is pooled."""
