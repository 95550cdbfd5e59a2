"""Estimation that knows nothing of rigs: parameters, problems and their solution, estimates, evidence, beliefs."""

from .beliefs import Belief, Refinement, refine
from .covariance import coloured, correlated_observations, correlation_time, jackknife, sandwich
from .estimates import Combination, Estimates, principal_deviations, unidentified_combinations
from .evidence import log_evidence, rival_weights
from .loss import GroupedHuber, Loss, SoftL1, Squares, UnknownScale
from .parameter import Parameter
from .problem import LinearisedResiduals, Problem, one_by_one
from .solver import Solution, StoppingCriteria, solve

__all__ = [
    "Belief", "Combination", "Estimates", "GroupedHuber", "LinearisedResiduals", "Loss", "Parameter", "Problem",
    "Refinement", "SoftL1", "Solution", "Squares", "StoppingCriteria", "UnknownScale", "coloured",
    "correlated_observations", "correlation_time", "jackknife", "log_evidence", "one_by_one", "principal_deviations",
    "refine", "rival_weights", "sandwich", "solve", "unidentified_combinations",
]  # fmt: skip
