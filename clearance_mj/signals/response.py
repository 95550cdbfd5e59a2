"""What a simulation or a test leaves: time histories that know their units and where they come from."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..errors import RecordError
from .arrays import ArrayData, read_only

__all__ = ["Response"]


@dataclass(frozen=True, eq=False, repr=False)
class Response(ArrayData):
    """Time histories of one run, sampled at ``fs``; time is the last axis.

    Simulations fill every field; a test record has no forces, and no displacement where no probe was fitted.

    Raises
    ------
    RecordError
        If the histories differ in length.
    """

    fs: float
    """samples per second"""
    excitation: np.ndarray
    """(n_t,) base acceleration in m/s² or shaker force in N, see ``kind``"""
    acceleration: np.ndarray
    """(n_sensors, n_t) absolute acceleration, m/s²"""
    displacement: np.ndarray | None = None
    """(n_bushings, n_t) relative to the bushing, m"""
    contact_force: np.ndarray | None = None
    """(n_bushings, n_t) force of the bushing on the shaft's motion, positive against positive displacement, N"""
    grease_force: np.ndarray | None = None
    """(n_bushings, n_t) same sign, N"""
    kind: str = "base"
    """"base" or "force": what the excitation is"""
    band: tuple[float, float] | None = None
    """Hz, band of the excitation where known"""
    responses: tuple[str, ...] = ()
    """degree of freedom of each row of the acceleration, such as "3:+Z" """
    reference: str = "100:+Z"
    """degree of freedom of the excitation"""
    provenance: dict = field(default_factory=dict)
    """inputs that made it: rig, law, engine, excitation, seed, versions; plain data"""

    def __post_init__(self):
        self._set(excitation=read_only(self.excitation))
        for name in ("acceleration", "displacement", "contact_force", "grease_force"):
            value = getattr(self, name)
            if value is None:
                continue
            value = read_only(value)
            if value.ndim != 2 or value.shape[1:] != self.excitation.shape:
                rows = "n_sensors" if name == "acceleration" else "n_bushings"
                raise RecordError(
                    f"{name} must be ({rows}, n_t) with n_t samples of excitation, got {value.shape} and "
                    f"{self.excitation.shape}"
                )
            self._set(**{name: value})

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return np.arange(self.excitation.size) / self.fs

    @property
    def duration(self) -> float:
        """S"""
        return self.excitation.size / self.fs
