"""Lateral disturbances of a vehicle: crosswind with gusts, a crowned and uneven road.

Loads are those at constant speed along the path, in steps of `STEP`, and depend on a seed.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import k1

from .commonroad import GRAVITY
from .plant import STEP

__all__ = ["Crosswind", "CrownedRoad", "Disturbance", "coloured_noise"]

AIR_DENSITY = 1.2  # kg/m³, of air at 20 °C
NOISE_STEPS = 1 << 16  # period of the noise: 65.5 s
REFERENCE_WAVENUMBER = 0.1  # 1/m, at which ISO 8608 states a road's roughness


class Disturbance(ABC):
    """Lateral load of a vehicle along its path."""

    @abstractmethod
    def load(self, speed: float, steps: int, seed: int) -> np.ndarray:
        """Return the load in each step, (steps, 3), for `Plant.advance`, at a speed in m/s.

        Columns: side force, N; yaw moment about the centre of gravity, N m; lateral component of gravity, m/s².
        """


def coloured_noise(density: Callable[[np.ndarray], np.ndarray], steps: int, seed: int) -> np.ndarray:
    """Return Gaussian noise with a one-sided spectral density S(f), f in Hz > 0, without its mean, (steps,).

    Fourier coefficients are independent with variance S(f) df/2 for cosine and sine each; steps are of `STEP`, and
    beyond `NOISE_STEPS` they repeat.
    """
    frequency = np.fft.rfftfreq(NOISE_STEPS, STEP)[1:]
    real, imaginary = np.random.default_rng([seed, 3]).standard_normal((2, frequency.size))
    lines = np.sqrt(density(frequency) * frequency[0] / 4) * (real + 1j * imaginary)
    return np.fft.irfft(np.concatenate(([0.0], lines)), norm="forward").take(np.arange(steps), mode="wrap")


def _cosine_ramp(distance: np.ndarray, begin: float, length: float) -> np.ndarray:
    """Return half a cosine wave from 0 at a distance, m, to 1 a length further, m."""
    return (1 - np.cos(np.pi * np.clip((distance - begin) / length, 0, 1))) / 2


@dataclass(frozen=True)
class Crosswind(Disturbance):
    """Wind from the right, across the path: a mean that rises out of shelter, and turbulence about it.

    Turbulence has the lateral Dryden spectrum, σ² L/π (1 + 3 (L Ω)²)/(1 + (L Ω)²)² over Ω in rad/m, frozen while the
    vehicle drives through it; by MIL-F-8785C at its least height, 3 m, L is 23 m and σ 0.196 of the mean. The side
    force is ½ ϱ A c (V² + w²) atan(w/V), w the wind. Its slope c and centre of pressure are typical of notchback cars
    (cf. Hucho, Aerodynamics of Road Vehicles, on directional stability).
    """

    mean: float = 10.0  # m/s
    turbulence: float = 1.96  # σ, m/s
    length_scale: float = 23.0  # L, m
    begin: float = 60.0  # m along the path
    rise: float = 10.0  # m, length of the onset
    area: float = 1.9  # A, m², of the vehicle's front
    side_slope: float = 2.3  # c, side force coefficient per rad
    centre_of_pressure: float = 0.5  # m ahead of the centre of gravity

    def gusts(self, speed: float, steps: int, seed: int) -> np.ndarray:
        """Return the turbulence about the mean, m/s, (steps,), at a speed in m/s."""

        def density(frequency: np.ndarray) -> np.ndarray:
            x2 = (2 * np.pi * self.length_scale / speed * frequency) ** 2
            return self.turbulence**2 * 2 * self.length_scale / speed * (1 + 3 * x2) / (1 + x2) ** 2

        return coloured_noise(density, steps, seed)

    def side_force(self, wind: np.ndarray, speed: float) -> np.ndarray:
        """Return the side force, N, of a wind from the right, m/s, at a speed in m/s."""
        pressure = AIR_DENSITY / 2 * (speed**2 + wind**2)
        return pressure * self.area * self.side_slope * np.arctan2(wind, speed)

    def load(self, speed: float, steps: int, seed: int) -> np.ndarray:
        """Return the side force and its moment."""
        onset = _cosine_ramp(speed * STEP * np.arange(steps), self.begin, self.rise)
        force = self.side_force(onset * (self.mean + self.gusts(speed, steps, seed)), speed)
        return np.column_stack((force, self.centre_of_pressure * force, np.zeros(steps)))


@dataclass(frozen=True)
class CrownedRoad(Disturbance):
    """Road that falls to the right, as right-hand lanes do for drainage, and is uneven across.

    Unevenness follows ISO 8608, G(n) = G₀ (n/0.1)⁻² in m³ over n in 1/m, class B by default. Between the wheels of a
    track B apart an isotropic surface has the coherence x K₁(x), x = 2πBn (Kamash and Robson, J. Sound Vib. 57, 1978),
    hence a cross slope of density 2 G (1 - x K₁(x))/B² and an RMS of 0.1 π √(2 G₀/B).
    """

    crown: float = 0.025  # cross slope
    begin: float = 30.0  # m along the path
    rise: float = 20.0  # m, length of the onset
    roughness: float = 64e-6  # G₀, m³
    track: float = 1.4  # B, m

    def unevenness(self, speed: float, steps: int, seed: int) -> np.ndarray:
        """Return the cross slope in addition to the crown, (steps,), at a speed in m/s."""

        def density(frequency: np.ndarray) -> np.ndarray:
            n = frequency / speed
            x = 2 * math.pi * self.track * n
            return 2 * self.roughness * (REFERENCE_WAVENUMBER / n) ** 2 * (1 - x * k1(x)) / self.track**2 / speed

        return coloured_noise(density, steps, seed)

    def load(self, speed: float, steps: int, seed: int) -> np.ndarray:
        """Return the lateral component of gravity."""
        slope = self.crown * _cosine_ramp(speed * STEP * np.arange(steps), self.begin, self.rise)
        return np.column_stack((np.zeros((steps, 2)), -GRAVITY * (slope + self.unevenness(speed, steps, seed))))
