"""The linear part of a rig, q̈ + (C + Ω G) q̇ + (K + Ω H) q = b(t) - Pᵀ f, as receptances at its clearances; compiled.

At constant spin, receptances come from poles and residues, computed once; where the spin changes along a branch, from
the dynamic stiffness of every harmonic; at constant frequency and spin, they are constant.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.jit import STRICT, jit
from ..linear import LinearModel
from .harmonic_balance import real_harmonics

__all__ = ["DrivenModel", "LinearDynamics", "at_one_frequency", "by_poles", "by_stiffness", "receptances"]

BY_POLES, BY_STIFFNESS, KNOWN = 0, 1, 2


class DrivenModel(NamedTuple):
    """A structure with the fillings' stiffness and damping, and its excitation."""

    model: LinearModel
    points: np.ndarray  # (n_rows, n) displacements of the clearances' rows
    weight: np.ndarray  # (n,) constant force on the modes
    drive: np.ndarray  # (H + 1, n) complex amplitudes of the excitation's force
    unbalance: np.ndarray  # (H + 1, n) the same per Ω², of unbalances

    @property
    def turns(self) -> bool:
        """True if the structure's receptance depends on the spin."""
        return bool(self.model.gyroscopic.any() or self.model.circulatory.any() or self.model.bearings)

    def force(self, spin: float, load: float, level: float) -> np.ndarray:
        """Return forces (H + 1, n) on the modes at factors of constant loads and of the level."""
        force = level * (self.drive + spin**2 * self.unbalance)
        force[0] += load * self.weight
        return np.asarray(force)

    def modes(self, omega: float, spin: float, force: np.ndarray) -> np.ndarray:
        """Return complex amplitudes (H + 1, n) of the modes under forces on them (H + 1, n)."""
        turning = 1j * omega * np.arange(len(force))[:, None, None]
        dynamic = self.model.stiff(spin) + turning * self.model.viscous(spin) + turning**2 * np.eye(self.model.size)
        return np.asarray(np.linalg.solve(dynamic, force[:, :, None])[:, :, 0])


class LinearDynamics(NamedTuple):
    """A driven model for compiled functions in one of three forms; fields of the other two are empty."""

    way: int
    compliance: np.ndarray  # KNOWN: (H + 1, n_rows, n_rows) receptances
    sagging: np.ndarray  # (n_rows, K) displacements by constant loads, of BY_POLES (n_rows, 1)
    shaken: np.ndarray  # KNOWN: (n_rows, K) by the excitation
    pairs: np.ndarray  # BY_POLES: (J,) poles of which each stands for its conjugate, too, 1/s
    real: np.ndarray  # (J, n_rows²) their residues
    imaginary: np.ndarray
    values: np.ndarray  # (2 n,) all poles, 1/s
    motions: np.ndarray  # (n_rows, 2 n) of the rows
    harmonics: np.ndarray  # (m,) of the excitation
    constant: np.ndarray  # (m, 2 n) modal excitation of the poles
    growing: np.ndarray  # (m, 2 n) modal excitation per Ω²
    knots: np.ndarray  # BY_STIFFNESS: (m,) speeds, rad/s, at which the pieces of the polynomial begin
    stiffness: np.ndarray  # (m, 4, n, n) K by powers of Ω - knot
    viscous: np.ndarray  # (m, 4, n, n) C
    points: np.ndarray  # (n_rows, n) displacements of the rows
    weight: np.ndarray  # (n,) constant force on the modes
    drive: np.ndarray  # (H + 1, n) amplitudes of the excitation's force
    unbalance: np.ndarray  # (H + 1, n) the same per Ω²


def _make_linear(way: int, **parts: np.ndarray) -> LinearDynamics:
    rank = {"compliance": 3, "sagging": 2, "shaken": 2, "real": 2, "imaginary": 2, "motions": 2, "constant": 2,
            "growing": 2, "stiffness": 4, "viscous": 4, "points": 2, "drive": 2, "unbalance": 2}  # fmt: skip
    complex_fields = {"compliance", "pairs", "values", "motions", "constant", "growing", "drive", "unbalance"}
    fields = {}
    for name in LinearDynamics._fields[1:]:
        kind = complex if name in complex_fields else int if name == "harmonics" else float
        fields[name] = np.ascontiguousarray(parts.get(name, np.zeros((0,) * rank.get(name, 1))), dtype=kind)
    return LinearDynamics(way, **fields)


def by_poles(driven: DrivenModel, spin: float) -> LinearDynamics:
    """Return the pole-residue form at one spin, rad/s; a pair has conjugate residues, so real parts are summed."""
    model = driven.model
    (values, shapes), forced = model.poles(spin), model.drive(spin)
    motions = driven.points @ shapes
    residues = np.einsum("pj,jq->jpq", motions, forced @ driven.points.T).reshape(len(values), -1)
    upper, real = values.imag > 0, values.imag == 0
    both = np.concatenate((residues[upper], residues[real] / 2))  # a real pole stands as half of a pair
    acting = [h for h in range(len(driven.drive)) if driven.drive[h].any() or driven.unbalance[h].any()]
    sagging = driven.points @ np.linalg.solve(model.stiff(spin), driven.weight)
    return _make_linear(
        BY_POLES, pairs=np.concatenate((values[upper], values[real])), real=both.real, imaginary=both.imag,
        values=values, motions=motions, harmonics=np.array(acting), constant=driven.drive[acting] @ forced.T,
        growing=driven.unbalance[acting] @ forced.T, sagging=sagging[:, None], drive=driven.drive,
    )  # fmt: skip


def by_stiffness(driven: DrivenModel) -> LinearDynamics:
    """Return the form for any spin. Between the speeds of bearings' tables coefficients are cubic in the spin."""
    model = driven.model
    tables = sorted({speed for held in model.bearings for speed in held.bearing.spin})
    knots = np.array(tables[:-1] if len(tables) > 1 else [0.0])
    widths = np.diff(tables) if len(tables) > 1 else np.ones(1)
    places = np.array([0.1, 0.4, 0.6, 0.9])
    powers = np.linalg.inv(places[:, None] ** np.arange(4))
    of_knots = []
    for at, width in zip(knots, widths):
        spins = [at + place * width for place in places]
        parts = (np.array([of(spin) for spin in spins]) for of in (model.stiff, model.viscous))
        of_knots.append([np.einsum("qs,snm->qnm", powers, p) / width ** np.arange(4)[:, None, None] for p in parts])
    stiffness, viscous = np.array(of_knots).swapaxes(0, 1)
    return _make_linear(
        BY_STIFFNESS, knots=knots, stiffness=stiffness, viscous=viscous, points=driven.points, weight=driven.weight,
        drive=driven.drive, unbalance=driven.unbalance,
    )  # fmt: skip


def at_one_frequency(linear: LinearDynamics, omega: float, spin: float) -> LinearDynamics:
    """Return the form for one frequency, 1/s, and spin, rad/s."""
    compliance, sagging = receptances(linear, omega, spin, 1.0, 0.0)
    return _make_linear(
        KNOWN, compliance=compliance, sagging=sagging, shaken=receptances(linear, omega, spin, 0.0, 1.0)[1],
        drive=linear.drive,
    )  # fmt: skip


@jit(**STRICT)
def receptances(
    linear: LinearDynamics, omega: float, spin: float, load: float, level: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return receptances (H + 1, n_rows, n_rows) and harmonics (n_rows, K) of driven displacements.

    At factors of constant loads and of the excitation's level.
    """
    if linear.way == KNOWN:
        return linear.compliance, load * linear.sagging + level * linear.shaken
    if linear.way == BY_STIFFNESS:
        return _direct(linear, omega, spin, load, level)
    rows, harmonics = linear.motions.shape[0], linear.drive.shape[0]
    compliance = np.empty((harmonics, rows, rows), np.complex128)
    _sum_pairs(linear.pairs, linear.real, linear.imaginary, omega, compliance.reshape((harmonics, rows * rows)))
    driven = np.zeros((harmonics, rows), np.complex128)
    for i in range(linear.harmonics.size):
        h = linear.harmonics[i]
        for j in range(linear.values.size):
            acting = level * (linear.constant[i, j] + spin * spin * linear.growing[i, j])
            acting /= 1j * h * omega - linear.values[j]
            for p in range(rows):
                driven[h, p] += linear.motions[p, j] * acting
    for p in range(rows):
        driven[0, p] += load * linear.sagging[p, 0]
    return compliance, real_harmonics(driven)


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


@jit(**STRICT, inline="always")
def _direct(
    linear: LinearDynamics, omega: float, spin: float, load: float, level: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return receptances and driven displacements as `receptances` does, by the dynamic stiffness of every harmonic."""
    rows, n = linear.points.shape
    piece = 0
    while piece + 1 < linear.knots.size and spin >= linear.knots[piece + 1]:
        piece += 1
    offset = spin - linear.knots[piece]
    stiffness, viscous = linear.stiffness[piece], linear.viscous[piece]
    static, damping = np.zeros((n, n)), np.zeros((n, n))
    for q in range(3, -1, -1):
        for a in range(n):
            for b in range(n):
                static[a, b] = static[a, b] * offset + stiffness[q, a, b]
                damping[a, b] = damping[a, b] * offset + viscous[q, a, b]
    harmonics = linear.drive.shape[0]
    compliance, driven = np.empty((harmonics, rows, rows), np.complex128), np.empty((harmonics, rows), np.complex128)
    rhs, dynamic = np.zeros((n, rows + 1), np.complex128), np.empty((n, n), np.complex128)
    points = linear.points.astype(np.complex128)
    for h in range(harmonics):
        for a in range(n):
            for b in range(n):
                dynamic[a, b] = static[a, b] + 1j * h * omega * damping[a, b]
            dynamic[a, a] -= (h * omega) ** 2
            for p in range(rows):
                rhs[a, p] = linear.points[p, a]
            rhs[a, rows] = level * (linear.drive[h, a] + spin * spin * linear.unbalance[h, a])
            if h == 0:
                rhs[a, rows] += load * linear.weight[a]
        solution = np.dot(points, np.linalg.solve(dynamic, rhs))
        compliance[h], driven[h] = solution[:, :rows], solution[:, rows]
    return compliance, real_harmonics(driven)
