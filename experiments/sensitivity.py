"""Sensitivities: which of the rig's parameters its modes, the FRF's peaks and the RMSE against a record depend on.

The plan beside this file says what varies; the options are those of ``clearance-mj sweep``.
"""

import sys
from pathlib import Path

from clearance_mj.cli import main

if __name__ == "__main__":
    plan = Path(__file__).with_suffix(".toml")
    sys.exit(main(["sweep", str(plan), "--out", "results/sensitivity", *sys.argv[1:]]))
