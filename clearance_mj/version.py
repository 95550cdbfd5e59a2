"""The version of clearance_mj, in one place."""

__version__ = "0.2.0"
