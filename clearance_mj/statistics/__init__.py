"""Uncertainty of numbers: intervals over seeds, repeatability, bands of predicted FRFs."""

from .contact import contact_statistics
from .frf_bands import Band, frf_band, inside, paired_error
from .shares import share_interval

__all__ = ["Band", "contact_statistics", "frf_band", "inside", "paired_error", "share_interval"]
