"""A network that learns the force and gives M, B and K by probing: sections 5.2 and 6.2 of the thesis."""
