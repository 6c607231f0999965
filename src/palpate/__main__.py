"""`python -m palpate` is the program `palpate`."""

import sys

from palpate.cli import main

if __name__ == "__main__":
    sys.exit(main())
