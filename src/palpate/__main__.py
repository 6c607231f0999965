"""`python -m palpate` is the program `palpate`."""

from __future__ import annotations

import sys

from palpate.cli import main

if __name__ == "__main__":
    sys.exit(main())
