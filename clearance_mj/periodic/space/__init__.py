"""Periodic motions of rigs in space: round clearances, shafts that turn, unbalance, gravity, friction, oil."""
