"""Measured records of other groups; the folder that CLEARANCE_REAL_DATA names holds them."""
