"""The clamped shaft: cantilever modes, modal matrices and the Ritz model that engines reduce it to.

Equations 1-8 of the article with their misprints corrected: the shaft is clamped at x = 0 and free at x = l, so
cos λ cosh λ = -1 (Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1).

A truncated set of modes is too stiff under a point force: fourteen modes miss 5 % of the static displacement at a
bushing near the clamp. `ritz_model` therefore adds the static deflection under a unit force at each bushing, point mass
and force shaker. They carry the residual flexibility of the modes left out (MacNeal 1971; Rubin 1975) as further
degrees of freedom, so the displacement at a contact needs no algebraic correction.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .rig import Beam, Rig

if TYPE_CHECKING:
    import control

__all__ = ["ModalModel", "linear_frf", "mode_shapes", "natural_frequencies", "ritz_model", "state_space"]

MOST_MODES = 60
"""Modes in a Ritz basis beyond which nothing is gained"""


@functools.cache
def cantilever_roots(n: int) -> np.ndarray:
    """First n roots λ of cos λ cosh λ = -1 (Eq. 8 corrected)."""
    roots = (2 * np.arange(1, n + 1) - 1) * np.pi / 2
    for _ in range(20):  # Newton on cos λ + 1/cosh λ, which does not overflow
        sech = 1 / np.cosh(np.minimum(roots, 700))
        roots -= (np.cos(roots) + sech) / (-np.sin(roots) - sech * np.tanh(roots))
    roots.flags.writeable = False
    return roots


def cantilever_mode(x: ArrayLike, n: int, length: float = 1.0) -> np.ndarray:
    """Shapes Y_i (n_x, n) of the bare cantilever at x (n_x,) (Eq. 7 corrected), with ∫Y² dx = length.

    Y_i = cosh βx - cos βx - σ (sinh βx - sin βx), in exponential form so that high modes keep their digits.
    """
    return _shape(x, n, length, -1.0)


def cantilever_curvature(x: ArrayLike, n: int, length: float = 1.0) -> np.ndarray:
    """Second derivatives Y_i'' (n_x, n) of `cantilever_mode`, 1/m²."""
    return (cantilever_roots(n) / length) ** 2 * _shape(x, n, length, 1.0)


def _shape(x: ArrayLike, n: int, length: float, sign: float) -> np.ndarray:
    """Cosh βx - σ sinh βx + sign (cos βx - σ sin βx), without cancellation of the growing exponentials."""
    root = cantilever_roots(n)
    bx = np.asarray(x, dtype=float)[:, None] * root / length
    decay = np.exp(-root)
    difference = 2 * (np.sin(root) - np.cos(root) - decay) / (1 - decay**2 + 2 * np.sin(root) * decay)
    sigma = 1 - difference * decay  # 1 - σ = difference e^(-λ)
    hyperbolic = (difference * np.exp(bx - root) + (1 + sigma) * np.exp(-bx)) / 2
    return hyperbolic + sign * (np.cos(bx) - sigma * np.sin(bx))


def static_deflection(beam: Beam, x: ArrayLike, a: ArrayLike) -> np.ndarray:
    """Deflection (n_x, n_a) in m/N at x of the clamped beam under a unit force at a (Roark, table 8.1, case 1a)."""
    x, a = np.asarray(x, dtype=float)[:, None], np.asarray(a, dtype=float)[None]
    near, far = np.minimum(x, a), np.maximum(x, a)
    return near**2 * (3 * far - near) / (6 * beam.bending_stiffness)


@dataclass(frozen=True)
class ModalModel:
    """A shaft reduced to uncoupled modes of unit mass: q̈ + 2ζω q̇ + ω² q = Y(x)ᵀ f - Γ a_base (Eq. 3).

    Made by `ritz_model`.
    """

    beam: Beam
    """the shaft"""
    omega: np.ndarray
    """(n,) natural circular frequencies, 1/s"""
    participation: np.ndarray
    """(n,) Γ, sqrt(kg)"""
    stiffness_included: bool
    """whether the grease stiffness is part of ω"""
    _modes: int
    _forces: np.ndarray
    _transform: np.ndarray

    @property
    def size(self) -> int:
        """Number of degrees of freedom."""
        return self.omega.size

    @property
    def damping(self) -> np.ndarray:
        """(n,) 2ζω of the shaft's own Rayleigh damping η1 + η2 ω² (Eq. 6), 1/s."""
        eta1, eta2 = self.beam.rayleigh
        return eta1 + eta2 * self.omega**2

    def shapes(self, x: ArrayLike) -> np.ndarray:
        """Return the mode shapes, of unit modal mass and positive at the tip.

        Parameters
        ----------
        x : array_like, shape (n_x,)
            Positions, m.

        Returns
        -------
        ndarray, shape (n_x, n)
            1/sqrt(kg).
        """
        return _functions(self.beam, np.asarray(x, dtype=float), self._modes, self._forces) @ self._transform


@functools.lru_cache(maxsize=64)
def ritz_model(rig: Rig, modes: int = 8, grease: bool = False) -> ModalModel:
    """Reduce the rig's shaft, with its point masses, to modes and static shapes (Eqs 1-6).

    Parameters
    ----------
    rig : Rig
        The rig.
    modes : int
        Number of cantilever modes in the Ritz basis; one static shape for every bushing, point mass and force
        shaker is added to them.
    grease : bool
        Count the in-gap stiffness of the grease to the shaft's. Without it the grease is left to the force side.
    """
    beam = rig.beam
    positions = {b.position for b in rig.bushings} | {m.position for m in rig.point_masses}
    if rig.shaker.kind == "force" and rig.shaker.position is not None:
        positions.add(rig.shaker.position)
    forces = np.array(sorted(positions))
    x, weight = _quadrature(beam.length, forces, modes)
    y = _functions(beam, x, modes, forces)
    curvature = _curvatures(beam, x, modes, forces)
    mass = beam.mass_per_length * (y.T * weight) @ y
    stiffness = beam.bending_stiffness * (curvature.T * weight) @ curvature
    participation = beam.mass_per_length * weight @ y
    for point in rig.point_masses:
        at = _functions(beam, np.array([point.position]), modes, forces)[0]
        mass += point.mass * np.outer(at, at)
        participation += point.mass * at
    if grease:
        for bushing in rig.bushings:
            at = _functions(beam, np.array([bushing.position]), modes, forces)[0]
            stiffness += bushing.grease.stiffness * np.outer(at, at)
    value, vector = np.linalg.eigh(stiffness / np.sqrt(np.outer(stiffness.diagonal(), stiffness.diagonal())))
    basis = vector / np.sqrt(value) / np.sqrt(stiffness.diagonal())[:, None]
    inverse_omega2, rotation = np.linalg.eigh(basis.T @ mass @ basis)  # so that the lowest modes are the most exact
    inverse_omega2, rotation = inverse_omega2[::-1], rotation[:, ::-1]
    transform = basis @ rotation / np.sqrt(inverse_omega2)
    tip = _functions(beam, np.array([beam.length]), modes, forces)[0] @ transform
    transform = transform * np.where(tip < 0, -1.0, 1.0)
    omega = 1 / np.sqrt(inverse_omega2)
    return ModalModel(beam, omega, participation @ transform, grease, modes, forces, transform)


def natural_frequencies(rig: Rig, n: int) -> np.ndarray:
    """Natural frequencies of the rig in its in-gap linear state: grease stiffness on, no contact.

    Parameters
    ----------
    rig : Rig
        The rig.
    n : int
        How many.

    Returns
    -------
    ndarray, shape (n,)
        Hz.
    """
    return ritz_model(rig, n + 16, grease=True).omega[:n] / (2 * np.pi)


def mode_shapes(rig: Rig, x: ArrayLike, n: int) -> np.ndarray:
    """Mode shapes of the rig in its in-gap linear state, of unit modal mass and positive at the tip.

    Parameters
    ----------
    rig : Rig
        The rig.
    x : array_like, shape (n_x,)
        Positions, m.
    n : int
        How many.

    Returns
    -------
    ndarray, shape (n_x, n)
        1/sqrt(kg).
    """
    return ritz_model(rig, n + 16, grease=True).shapes(x)[:, :n]


def state_space(rig: Rig, modes: int = 16) -> control.StateSpace:
    """Linear model of the rig in the gap, the grease a spring and damper at each bushing.

    Parameters
    ----------
    rig : Rig
        The rig.
    modes : int
        Cantilever modes in the Ritz basis.

    Returns
    -------
    control.StateSpace
        Input: base acceleration (m/s²) or shaker force (N), as ``rig.shaker`` says. Outputs: absolute accelerations
        of the sensors (m/s²), then displacements at the bushings (m).
    """
    import control  # it brings pyplot, a second of every start

    model = ritz_model(rig, modes)
    at_bushing = model.shapes([b.position for b in rig.bushings])
    grease_k = np.array([b.grease.stiffness for b in rig.bushings])
    grease_c = np.array([b.grease.damping for b in rig.bushings])
    k = np.diag(model.omega**2) + (at_bushing.T * grease_k) @ at_bushing
    c = np.diag(model.damping) + (at_bushing.T * grease_c) @ at_bushing
    base = rig.shaker.kind == "base"
    b = -model.participation if base else model.shapes(np.array([rig.shaker.position], dtype=float))[0]
    n, at_sensor = model.size, model.shapes([s.position for s in rig.sensors])
    zero, one = np.zeros((n, n)), np.eye(n)
    a_matrix = np.block([[zero, one], [-k, -c]])
    b_matrix = np.concatenate((np.zeros(n), b))[:, None]
    c_matrix = np.block([[-at_sensor @ k, -at_sensor @ c], [at_bushing, np.zeros_like(at_bushing)]])
    direct = np.concatenate((at_sensor @ b + base, np.zeros(len(rig.bushings))))[:, None]
    return control.ss(a_matrix, b_matrix, c_matrix, direct)


def linear_frf(rig: Rig, frequency: ArrayLike, modes: int = 16) -> np.ndarray:
    """Accelerance (or transmissibility, for a shaken base) of the sensors in the gap, through python-control.

    Parameters
    ----------
    rig : Rig
        The rig.
    frequency : array_like, shape (n_f,)
        Hz.
    modes : int
        Cantilever modes in the Ritz basis.

    Returns
    -------
    ndarray, shape (n_sensors, n_f), complex
    """
    import control

    response = control.frequency_response(state_space(rig, modes), 2 * np.pi * np.asarray(frequency, dtype=float))
    return np.asarray(response.frdata)[: len(rig.sensors), 0]


def _functions(beam: Beam, x: ArrayLike, modes: int, forces: np.ndarray) -> np.ndarray:
    """Ritz functions at x: cantilever modes, then what they leave of the static shapes, scaled to their size."""
    shapes = cantilever_mode(x, modes, beam.length)
    rest = static_deflection(beam, x, forces) - shapes @ _static_shares(beam, modes, forces)
    return np.hstack((shapes, rest * _scale(beam)))


def _curvatures(beam: Beam, x: ArrayLike, modes: int, forces: np.ndarray) -> np.ndarray:
    shapes = cantilever_curvature(x, modes, beam.length)
    moment = np.maximum(forces[None] - np.asarray(x)[:, None], 0) / beam.bending_stiffness
    return np.hstack((shapes, (moment - shapes @ _static_shares(beam, modes, forces)) * _scale(beam)))


def _static_shares(beam: Beam, modes: int, forces: np.ndarray) -> np.ndarray:
    """(modes, n_forces) shares Y_i(a)/K_i of the modes in the static deflection under a unit force at a."""
    stiffness = beam.bending_stiffness * (cantilever_roots(modes) / beam.length) ** 4 * beam.length
    return (cantilever_mode(forces, modes, beam.length) / stiffness).T


def _scale(beam: Beam) -> float:
    return 3 * beam.bending_stiffness / beam.length**3


def _quadrature(length: float, breaks: np.ndarray, modes: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre points and weights, enough for products of the modes, between the points of force."""
    node, weight = np.polynomial.legendre.leggauss(16)
    edges = np.unique(np.concatenate((np.linspace(0, length, modes + 3), breaks)))
    half, middle = np.diff(edges)[:, None] / 2, (edges[1:] + edges[:-1])[:, None] / 2
    return (middle + half * node).ravel(), (half * weight).ravel()
