"""Engines: MuJoCo flexible links, compiled modes, links in JAX; every file in this folder is imported."""

import importlib
import pkgutil

from .base import Engine, default_engine, get_engine, register
from .batch import simulate_batch, simulate_each
from .equilibrium import Equilibrium, static_equilibrium
from .links import Links, build_links
from .mjx import Mjx
from .modal import Modal
from .simulation import simulate, simulate_blocks
from .together import simulate_and_keep, simulate_together

__all__ = [
    "Engine", "Equilibrium", "Links", "Mjx", "Modal", "build_links", "default_engine", "get_engine", "register",
    "simulate", "simulate_and_keep", "simulate_batch", "simulate_blocks", "simulate_each", "simulate_together",
    "static_equilibrium",
]  # fmt: skip

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")
