"""Tune these controllers and those of the package; options are those of ``python -m clearance_mj.vehicle.tune``."""

from clearance_mj.vehicle.tune import main

main()
