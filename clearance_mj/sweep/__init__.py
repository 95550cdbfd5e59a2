"""Sweeps: many rigs, laws, levels and seeds, on one machine or a Dask cluster; resumable; global sensitivities."""

from ..core.runner import Runner
from .case import Outputs
from .design import Design, Vary
from .plan import Plan, load_plan
from .run import run_sweep

__all__ = ["Design", "Outputs", "Plan", "Runner", "Vary", "load_plan", "run_sweep"]
