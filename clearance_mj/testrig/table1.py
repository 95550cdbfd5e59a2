"""What the virtual rig of the article's Table 1 hides, and which records it gives.

Nothing here is written into the dataset, and nothing outside this package may read it.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Truth"]


@dataclass(frozen=True)
class Truth:
    """The real bushings, where the rig file holds datasheet values; the same in every bushing."""

    contact_stiffness: float = 3e5
    """K of a whole bushing, N/m^1.5; each end has half"""
    contact_exponent: float = 1.5
    """Hertz"""
    contact_dissipation: float = 1.5
    """α, s/m"""
    grease_stiffness: float = 4369.0
    """k, N/m"""
    elastic_ratio: float = 0.8
    """λ"""
    amplitude: float = 1.0
    """A"""
    beta: float = 1e7
    """1/m²"""
    gamma: float = 1e7
    """1/m²"""
    exponent: int = 2
    """n"""
    film_damping: float = 4.0
    """c, N s/m"""
    film_height: float = 7.5e-4
    """h, m"""
    film_limit: float = 0.2
    drift: float = 0.005
    """largest relative change of the grease stiffness, by temperature"""
    drift_interval: float = 8.0
    """s between independent values of it"""
    noise: float = 0.01
    """RMS of a sensor's noise over the RMS of its signal"""
