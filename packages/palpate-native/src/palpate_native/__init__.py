"""Laws in C: a translator of the subset of Python that laws are written in, and packages of its output."""
