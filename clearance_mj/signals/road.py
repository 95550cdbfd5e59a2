"""Roads of ISO 8608 under a quarter-car: the acceleration that a wheel's hub or the body gives to what it carries.

ISO 8608:2016 states a road's profile as the power spectral density of its height over spatial frequency n,
G_d(n) = G_d(n₀) (n/n₀)^-w with n₀ = 0.1 cycles/m and w = 2, in eight classes of G_d(n₀), each four times as rough as
the one before. At a speed v it is G_d(n)/v over f = v n. The quarter-car is linear: its acceleration has the PSD
|H(f)|² (2πf)⁴ G_d(f)/v.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import ExcitationError
from ..core.validation import NotNegative, Positive, checked
from .excitation_data import Band, require
from .psd import PSD

__all__ = ["ROAD_CLASSES", "SPATIAL_BAND", "QuarterCar", "Road", "road_psd"]

REFERENCE = 0.1  # cycles/m, n₀
SPATIAL_BAND: Band = (0.011, 2.83)
"""cycles/m, for which ISO 8608 classifies roads"""
ROAD_CLASSES: dict[str, tuple[float, float, float]] = {
    name: (0.0 if name == "A" else 8e-6 * 4**i, 16e-6 * 4**i, np.inf if name == "H" else 32e-6 * 4**i)
    for i, name in enumerate("ABCDEFGH")
}
"""G_d(n₀) in m³ by class: lower limit, geometric mean, upper limit; A has no lower one, H no upper one"""
LINES = 600  # of a road's PSD: 1 % apart over three decades, much finer than a quarter-car's resonances
PLACES = ("hub", "body")


@checked(ExcitationError)
class Road:
    """The profile of a road, as its displacement's power spectral density over spatial frequency."""

    roughness: Positive
    """G_d(n₀) at n₀ = 0.1 cycles/m, m³"""
    waviness: Positive = 2.0
    """exponent w"""

    @classmethod
    def of_class(cls, name: str) -> Road:
        """Return the geometric mean of a class of ISO 8608.

        Parameters
        ----------
        name : str
            "A" (very good) to "H" (hardly passable).

        Raises
        ------
        ExcitationError
            For another letter.
        """
        ExcitationError.require_known("road class", name, ROAD_CLASSES)
        return cls(ROAD_CLASSES[name][1])

    def displacement(self, spatial_frequency: ArrayLike) -> np.ndarray:
        """Return G_d(n), m³.

        Parameters
        ----------
        spatial_frequency : array_like
            n, cycles/m.
        """
        return self.roughness * (np.asarray(spatial_frequency, dtype=float) / REFERENCE) ** -self.waviness


@checked(ExcitationError)
class QuarterCar:
    """A quarter of a car: body on suspension on wheel on tyre.

    The defaults are the passenger car of J.-S. Lin and I. Kanellakopoulos, Nonlinear design of active suspensions, IEEE
    Control Systems 17(3), 1997, whose tyre has no damper.
    """

    sprung_mass: Positive = 290.0
    """kg, body"""
    unsprung_mass: Positive = 59.0
    """kg, wheel and hub"""
    suspension_stiffness: Positive = 16812.0
    """N/m"""
    suspension_damping: NotNegative = 1000.0
    """N s/m"""
    tyre_stiffness: Positive = 190e3
    """N/m"""
    tyre_damping: NotNegative = 0.0
    """N s/m"""

    def transfer(self, frequency: ArrayLike, at: str = "hub") -> np.ndarray:
        """Return displacement of hub or body per displacement of the road, (n,) complex.

        Parameters
        ----------
        frequency : array_like
            Frequencies, Hz.
        at : str
            "hub" or "body".

        Raises
        ------
        ExcitationError
            If ``at`` is neither.
        """
        require(at in PLACES, "at", at, 'must be "hub" or "body"')
        s = 2j * np.pi * np.asarray(frequency, dtype=float)
        suspension = self.suspension_stiffness + s * self.suspension_damping
        tyre = self.tyre_stiffness + s * self.tyre_damping
        body = self.sprung_mass * s**2 + suspension
        hub = tyre * body / (body * (self.unsprung_mass * s**2 + suspension + tyre) - suspension**2)
        return hub if at == "hub" else hub * suspension / body


def road_psd(
    road: Road | str, speed: float, car: QuarterCar | None = None, at: str = "hub", band: Band | None = None
) -> PSD:
    """Return the acceleration PSD that a car's hub or body has on a road.

    Parameters
    ----------
    road : Road or str
        A road, or the letter of its class in ISO 8608.
    speed : float
        m/s.
    car : QuarterCar, optional
        Default: `QuarterCar` with its defaults.
    at : str
        "hub" (what is fixed to the wheel) or "body".
    band : (float, float), optional
        Hz. Default: the speed times 0.011 to 2.83 cycles/m, for which ISO 8608 classifies roads; beyond it the road's
        power law is extrapolated.

    Returns
    -------
    PSD
        Of kind "base", (m/s²)²/Hz.

    Raises
    ------
    ExcitationError
        If the class, the speed, ``at`` or the band is impossible.
    """
    require(0 < speed < np.inf, "speed", speed, "must be > 0 m/s")
    words = f"class {road}" if isinstance(road, str) else f"G_d(n0) = {road.roughness:g} m³, w = {road.waviness:g}"
    road, car = Road.of_class(road) if isinstance(road, str) else road, car or QuarterCar()
    low, high = band or (speed * SPATIAL_BAND[0], speed * SPATIAL_BAND[1])
    require(0 < low < high < np.inf, "band", (low, high), "must be two rising frequencies above 0 Hz")
    frequency = np.geomspace(low, high, LINES)
    height = road.displacement(frequency / speed) / speed
    value = np.abs(car.transfer(frequency, at) * (2 * np.pi * frequency) ** 2) ** 2 * height
    return PSD(frequency, value, "base", {"road": words, "speed": float(speed), "at": at})
