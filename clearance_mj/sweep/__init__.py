"""Sweeps: many rigs, laws, levels and seeds, on one machine or a Dask cluster; resumable; global sensitivities."""

from .case import Outputs
from .design import Design, Vary
from .plan import Plan, load_plan
from .run import run_sweep

__all__ = ["Design", "Outputs", "Plan", "Vary", "load_plan", "run_sweep"]
