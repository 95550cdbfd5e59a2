"""Calibration: a rig out of the article's Table 1, and the rigs that fit as well."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("calibrate_table1", starts=32, step=0.01, seed=1)
