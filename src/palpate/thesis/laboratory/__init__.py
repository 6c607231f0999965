"""What the thesis does not tell of its laboratory, as one value; the hand-chosen one and the inferred one."""
