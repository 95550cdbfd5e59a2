"""``python -m clearance_mj`` is ``clearance-mj``."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
