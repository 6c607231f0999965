"""Which laboratory makes the thesis' own numbers true at once: from a laboratory to its verdicts, and back."""
