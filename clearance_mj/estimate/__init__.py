"""Estimation that knows nothing of rigs: parameters, problems and their solution, estimates, evidence, beliefs."""
