"""Identification methods, one file each; importing it registers them."""

# In the order in which lists name them.
from . import nominal, constant, ridge, force_balance, amplitude, physical, bench  # noqa: F401, I001

__all__: list[str] = []
