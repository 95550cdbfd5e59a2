"""Predict how a shaft that runs through bushings with clearance vibrates."""
