"""Search for the laboratory in which the thesis' sentences hold."""
