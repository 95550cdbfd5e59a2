"""Steering with clearance: all controllers compared, sensors as in a car, the twin of a steering."""
