"""A network that learns the force and is asked for M, B and K: sections 5.2 and 6.2 of the thesis."""
