"""The linear part of a rig in space, q̈ + (C + Ω G) q̇ + (K + Ω H) q = b(t) - Pᵀ f, seen from its clearances.

At a spin that stays, receptances come from poles and residues, found once; where the spin changes along a branch, from
the dynamic stiffness of every harmonic.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from ...core.jit import STRICT, jit
from ...linear import LinearModel

__all__ = ["DrivenModel", "Dynamics", "SteadySpin", "VaryingSpin"]


class DrivenModel(NamedTuple):
    """A filled structure and what drives it."""

    model: LinearModel
    drive: np.ndarray  # (H + 1, n) complex amplitudes of the excitation's force; of an unbalance per Ω²
    unbalance: bool  # whether the excitation grows with Ω²

    def force(self, spin: float, weight: float, level: float) -> np.ndarray:
        """Return forces (H + 1, n) on the modes at shares of weight and level."""
        force = self.drive * (level * spin**2 if self.unbalance else level)
        force[0] = weight * self.model.weight
        return force

    def modes(self, omega: float, spin: float, force: np.ndarray) -> np.ndarray:
        """Return complex amplitudes (H + 1, n) of the modes under forces on them (H + 1, n)."""
        dynamic = [self.model.dynamic(h * omega, spin) for h in range(len(force))]
        return np.asarray(np.linalg.solve(dynamic, force[:, :, None])[:, :, 0])


class SteadySpin:
    """At one spin: by poles. Those of a pair have conjugate residues, so that real matrices are summed."""

    def __init__(self, driven: DrivenModel, spin: float):
        self.driven, model = driven, driven.model
        (self.values, self.shapes), self.forced = model.poles(spin), model.drive(spin)
        self.points = model.at_points @ self.shapes
        residues = np.einsum("pj,jq->jpq", self.points, self.forced @ model.at_points.T)
        residues = residues.reshape(len(self.values), -1)
        upper, real = self.values.imag > 0, self.values.imag == 0
        # A real pole stands as half of a pair.
        self.pairs = np.concatenate((self.values[upper], self.values[real]))
        both = np.concatenate((residues[upper], residues[real] / 2))
        self.parts = np.ascontiguousarray(both.real), np.ascontiguousarray(both.imag)
        self.driving = [(h, self.forced @ each) for h, each in enumerate(driven.drive) if each.any()]
        self.sagging = model.at_points @ np.linalg.solve(model.stiff(spin), model.weight)

    def seen(self, omega: float, spin: float, weight: float, level: float) -> tuple[np.ndarray, np.ndarray]:
        """Return receptances (H + 1, 2 n_points, 2 n_points) and driven displacements (H + 1, 2 n_points)."""
        rows, harmonics = len(self.points), len(self.driven.drive)
        compliance = np.empty((harmonics, rows, rows), dtype=complex)
        _sum_pairs(self.pairs, *self.parts, omega, compliance.reshape(harmonics, -1))
        driven = np.zeros((harmonics, rows), dtype=complex)
        factor = level * spin**2 if self.driven.unbalance else level
        for h, of_poles in self.driving:
            driven[h] = self.points @ (factor * of_poles / (1j * h * omega - self.values))
        driven[0] = weight * self.sagging
        return compliance, driven


@jit(**STRICT)
def _sum_pairs(pairs: np.ndarray, real: np.ndarray, imaginary: np.ndarray, omega: float, out: np.ndarray) -> None:
    """Fill out (H + 1, n) with the sum of residues/(ihω - pole) over poles and their conjugates."""
    n = out.shape[1]
    re, im = np.empty(n), np.empty(n)
    for h in range(out.shape[0]):
        re[:] = 0.0
        im[:] = 0.0
        for j in range(pairs.size):
            near, mirrored = 1.0 / (1j * h * omega - pairs[j]), 1.0 / (1j * h * omega - np.conj(pairs[j]))
            total, apart = near + mirrored, 1j * (near - mirrored)
            a, b, c, d = total.real, apart.real, total.imag, apart.imag
            for k in range(n):
                re[k] += a * real[j, k] + b * imaginary[j, k]
                im[k] += c * real[j, k] + d * imaginary[j, k]
        for k in range(n):
            out[h, k] = complex(re[k], im[k])


class VaryingSpin:
    """At any spin: by the dynamic stiffness of every harmonic."""

    def __init__(self, driven: DrivenModel):
        self.driven = driven

    def seen(self, omega: float, spin: float, weight: float, level: float) -> tuple[np.ndarray, np.ndarray]:
        """Return receptances (H + 1, 2 n_points, 2 n_points) and driven displacements (H + 1, 2 n_points)."""
        model, force = self.driven.model, self.driven.force(spin, weight, level)
        return _solved(model.stiff(spin), model.viscous(spin), model.at_points, force, omega)


Dynamics: TypeAlias = SteadySpin | VaryingSpin
"""How a linear system moves under harmonic forces."""


@jit(**STRICT)
def _solved(
    stiffness: np.ndarray, viscous: np.ndarray, points: np.ndarray, force: np.ndarray, omega: float
) -> tuple[np.ndarray, np.ndarray]:
    """Receptances (H + 1, 2 n_points, 2 n_points) and driven displacements (H + 1, 2 n_points)."""
    rows, n = points.shape
    compliance, driven = np.empty((len(force), rows, rows), np.complex128), np.empty((len(force), rows), np.complex128)
    right, dynamic = np.zeros((n, rows + 1), np.complex128), np.empty((n, n), np.complex128)
    seen = points.astype(np.complex128)
    for h in range(len(force)):
        for a in range(n):
            for b in range(n):
                dynamic[a, b] = stiffness[a, b] + 1j * h * omega * viscous[a, b]
            dynamic[a, a] -= (h * omega) ** 2
            for p in range(rows):
                right[a, p] = points[p, a]
            right[a, rows] = force[h, a]
        found = np.dot(seen, np.linalg.solve(dynamic, right))
        compliance[h], driven[h] = found[:, :rows], found[:, rows]
    return compliance, driven
