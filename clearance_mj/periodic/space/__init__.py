"""Periodic motions of rigs in space: round clearances, shafts that turn, unbalance, gravity, friction, oil."""

from . import in_gap as in_gap  # its functions register themselves for solvers of round clearances
