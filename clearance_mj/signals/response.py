"""What a simulation or a test leaves: time histories that know their units and where they come from."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

__all__ = ["Response"]


@dataclass(frozen=True)
class Response:
    """Time histories of one run, sampled at ``fs``.

    Simulations fill every field; a test record has no forces, and no displacement where no probe was fitted.
    """

    fs: float
    """samples per second"""
    excitation: np.ndarray
    """(n_t,) base acceleration in m/s² or shaker force in N, see ``kind``"""
    acceleration: np.ndarray
    """(n_t, n_sensors) absolute acceleration, m/s²"""
    displacement: np.ndarray | None = None
    """(n_t, n_bushings) relative to the bushing, m"""
    contact_force: np.ndarray | None = None
    """(n_t, n_bushings) force of the bushing on the shaft's motion, positive against positive displacement, N"""
    grease_force: np.ndarray | None = None
    """(n_t, n_bushings) same sign, N"""
    kind: str = "base"
    """"base" or "force": what the excitation is"""
    band: tuple[float, float] | None = None
    """Hz, band of the excitation where known"""
    responses: tuple[str, ...] = ()
    """degree of freedom of each acceleration column, such as "3:+Z" """
    reference: str = "100:+Z"
    """degree of freedom of the excitation"""
    provenance: dict = field(default_factory=dict)
    """inputs that made it: rig, law, engine, excitation, seed, versions; plain data"""

    @property
    def time(self) -> np.ndarray:
        """(n_t,) s"""
        return np.arange(self.excitation.shape[0]) / self.fs

    @property
    def duration(self) -> float:
        """S"""
        return self.excitation.shape[0] / self.fs
