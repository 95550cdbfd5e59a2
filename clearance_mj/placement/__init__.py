"""Sensor placement: which positions identify the modes best, by Fisher information.

Sensors read y = Φ q + e: the modal coordinates q through the mode shapes at the positions, and noise of covariance R,
to which modes that are not wanted add their motion. The Fisher information of a layout S is Q = Φ_Sᵀ R_SS⁻¹ Φ_S; its
inverse is the smallest covariance that an unbiased estimate of q can have. Its determinant falls with the volume of
the ellipsoid of the error, its trace is a sum over modes and cares for no mode in particular.

One sensor less or more changes Q by a matrix of rank one, ±v vᵀ, also where the noise is correlated. Effective
independence is built on the contribution of a sensor, E = vᵀ Q⁻¹ v: without it the determinant falls to its (1 - E)
fold, so that deleting the least E deletes the sensor that the determinant misses least.

Kammer, Sensor placement for on-orbit modal identification and correlation of large space structures, Journal of
Guidance, Control, and Dynamics 14, 1991; Kammer, Effects of noise on sensor placement for on-orbit modal identification
of large space structures, Journal of Dynamic Systems, Measurement, and Control 114, 1992; exchange: Fedorov, Theory of
Optimal Experiments, 1972.
"""

from .layout import Placement, evaluate
from .readings import Candidates, candidates, grid
from .search import place_sensors

__all__ = ["Candidates", "Placement", "candidates", "evaluate", "grid", "place_sensors"]
