"""``python -m clearance_mj`` is ``clearance-mj``."""

import sys

from .cli import main

sys.exit(main())
