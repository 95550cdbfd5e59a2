"""Nonlinear modes: periodic motions of the free rig, sustained by an artificial damping ratio.

The extended periodic motion concept: M. Krack, Nonlinear modal analysis of nonconservative systems, Computers &
Structures 154 (2015) 59-71. In M x'' + C x' + K x + f(x, x') = 2ζω M x' the damping ratio ζ makes the motion periodic:
it returns the dissipated energy. Here it acts on the fundamental of x' alone. Acting on all harmonics it also removes
the damping of modes in internal resonance, and the curve runs off into one after the other, which neither forced
vibrations nor decays do.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..core.errors import ClearanceError
from ..engines.equilibrium import rest_of
from .condensed import Condensed, grid, slopes
from .continuation import Continuation, NoConvergence, PeriodicMotion
from .forces import Sampled, fill_forces
from .harmonic_balance import blocks

__all__ = ["NonlinearMode"]

WITHIN = 0.5  # fraction of the distance to the nearest wall at which a mode begins, linear but for the grease
STILL = 1e-9  # fraction of a mode's largest displacement below which a clearance does not move


class NonlinearMode(Continuation):
    """Harmonic balance of one nonlinear mode, in the coordinates of the linear modes in the gap.

    Unknown are, in metres, the coordinates' harmonics, such that the mode itself has the displacement at the clearance
    that it moves most, and A ω/ω_0 and A ζ; the parameter is A, the amplitude of that displacement's fundamental. In
    the gap all grow alike.
    """

    def __init__(self, system: Condensed, mode: int, harmonics: int, samples: int, spin: float):
        model, laws, rig = system.driven.model, system.laws, system.rig
        stiffness = model.stiff(spin)
        if not np.allclose(stiffness, stiffness.T):
            raise ClearanceError(f"rig {rig.name!r}: a stiffness that is not symmetric has no nonlinear modes")
        squares, vectors = np.linalg.eigh(stiffness)
        self.system, self.harmonics, self.samples, self.mode, self.spin = system, harmonics, samples, mode, spin
        at_rows = system.driven.points @ vectors
        moved = np.abs(at_rows[: rig.n_rows, mode])
        self.row = int(moved.argmax())
        if moved.max() <= STILL * np.abs(at_rows).max():
            raise ClearanceError(
                f"rig {rig.name!r}: mode {mode + 1} moves no clearance, so it is linear; take another mode"
            )
        self.grid, self.slopes = grid(harmonics, samples), slopes(laws, samples, harmonics)
        self.vectors = self._coupled_modes(vectors)
        self.mode = int(np.flatnonzero((self.vectors == vectors[:, [mode]]).all(axis=0))[0])
        self.at_points = np.ascontiguousarray(system.driven.points @ self.vectors)
        self.stiffness = np.sum(self.vectors * (stiffness @ self.vectors), axis=0)
        self.metres, self.own = self.at_points[self.row, self.mode], float(np.sqrt(squares[mode]))
        self.damping = self.vectors.T @ model.viscous(spin) @ self.vectors
        self.constant = self.vectors.T @ system.driven.weight
        self.order = np.append(0, np.repeat(np.arange(1, harmonics + 1), 2))
        self.given = np.where(self.order == 1, 2.0, 0.0)
        self.weight = 1 / (self.stiffness[:, None] + (self.order * self.own) ** 2)
        self.size, self.least = self.stiffness.size * self.order.size + 2, 0.0
        self.jacobian = np.zeros((self.size + 1, self.size + 1))

    def _coupled_modes(self, vectors: np.ndarray) -> np.ndarray:
        """Return the modes (n, m) that this one couples to: one of two equal planes is left out.

        With both, a line along any direction is a solution, and the Jacobian would be singular.
        """
        model, size = self.system.driven.model, self.system.size
        for plane in model.planes:
            if plane is None:
                continue
            in_plane = np.flatnonzero(np.linalg.norm(vectors[plane.span], axis=0) > 1 - STILL)
            if self.mode not in in_plane or in_plane.size == vectors.shape[1]:
                continue
            others = np.delete(vectors, in_plane, axis=1)
            at_rows = self.system.driven.points @ vectors[:, in_plane]
            angle = 2 * np.pi * np.arange(self.samples) / self.samples
            orbit = np.outer(at_rows @ np.cos(np.arange(in_plane.size)), 3 * size * np.cos(angle))
            orbit *= 1 / np.abs(at_rows @ np.cos(np.arange(in_plane.size))).max()
            speed, force = np.gradient(orbit, axis=1), np.empty_like(orbit)
            self._fill_forces(orbit, speed, self.samples / (2 * np.pi), False, force)
            across = [others.T @ self.system.driven.points.T @ force, others.T @ self.system.driven.weight]
            coupled = others.T @ (model.stiff(self.spin) + model.viscous(self.spin)) @ vectors[:, in_plane]
            if all(np.abs(each).max(initial=0.0) <= STILL * np.abs(force).max() for each in across) and not np.any(
                np.abs(coupled) > STILL * np.abs(model.stiff(self.spin)).max()
            ):
                return vectors[:, in_plane]
        return vectors

    def branch(self, start: float, stop: float) -> Iterator[PeriodicMotion]:
        """Yield motions from an amplitude, m, on until they leave the range between that and a larger one.

        Raises
        ------
        NoConvergence
            Where Newton's method fails; the motions yielded before stay valid.
        """
        within = min(start, WITHIN * self.system.size)
        z = np.zeros(self.size)
        z[self.mode * self.order.size + 1] = within
        rest = rest_of(self.system.rig, self.system.model.law, self.system.modes) if self.constant.any() else None
        if rest is not None:
            z[: -2 : self.order.size] = self.metres * self.vectors.T @ rest.coordinates
        z[-2:] = within, within * self.damping[self.mode, self.mode] / (2 * self.own)
        first = self.solved_at(within, z, np.zeros(0), within)
        if within < start:
            *_, first = self.within(first, within, start)
            if first.parameter != start:
                raise NoConvergence(first.parameter)
        yield from self.within(first, start, stop)

    def unscaled(self, amplitude: float, z: np.ndarray) -> tuple[float, float, np.ndarray]:
        """Return frequency, 1/s, damping ratio, and harmonics (n, K) of the modes, of unit mass, m sqrt(kg)."""
        q_h = z[:-2].reshape(self.stiffness.size, self.order.size) / self.metres
        return self.own * z[-2] / amplitude, z[-1] / amplitude, q_h

    def _residual(self, parameter: float, z: np.ndarray, y: np.ndarray, diff: bool) -> tuple[np.ndarray, ...]:
        omega, zeta, q = self.unscaled(parameter, z)
        if not omega > 0:
            return np.full(self.size, np.inf), y, y
        x = self.at_points @ q
        place, rate = x @ self.grid.basis.T, x @ self.grid.rate.T
        samples = np.empty_like(place)
        self._fill_forces(place, rate, omega, diff, samples)
        force = samples @ self.grid.project.T
        spring = self.stiffness[:, None] - (self.order * omega) ** 2
        q_angle = self._angle_derivative(q)
        damped = self.damping @ q_angle - zeta * omega * self.given * q_angle
        imbalance = spring * q + omega * damped + self.at_points.T @ force
        imbalance[:, 0] -= self.constant
        if diff:
            self._fill_square(omega, zeta, spring)
            shift = 1e-6 * omega
            shifted = np.empty_like(samples)
            self._fill_forces(place, rate, omega + shift, False, shifted)  # leaves no slopes
            change = (shifted - samples) @ self.grid.project.T / shift
            returned = self.given * q_angle
            by_omega = damped - 2 * self.order**2 * omega * q - zeta * omega * returned + self.at_points.T @ change
            self._fill_border(parameter, omega, zeta, by_omega, -(omega**2) * returned)
        return np.append(imbalance * self.weight * self.metres, x[self.row, 1:3] - (parameter, 0.0)), force, y

    def _fill_forces(self, place: np.ndarray, rate: np.ndarray, omega: float, diff: bool, force: np.ndarray) -> None:
        motion = Sampled(place, omega * rate, omega, self.spin)
        fill_forces(self.system.laws, motion, *self.grid[:3], diff, force, self.slopes)

    def _angle_derivative(self, q: np.ndarray) -> np.ndarray:
        """Return the harmonics of the derivatives by the angle."""
        derivative = np.zeros_like(q)
        derivative[:, 1::2] = self.order[2::2] * q[:, 2::2]
        derivative[:, 2::2] = -self.order[1::2] * q[:, 1::2]
        return derivative

    def _fill_square(self, omega: float, zeta: float, spring: np.ndarray) -> None:
        """Fill the Jacobian's corner with the derivatives of the balance by the harmonics."""
        n, harmonics = spring.shape
        derivatives = blocks(self.system.laws, self.at_points, np.zeros(n, dtype=int), self.grid, omega, self.slopes)
        square = np.ascontiguousarray(derivatives.transpose(0, 2, 1, 3))
        square.reshape(n * harmonics, -1)[np.diag_indices(n * harmonics)] += spring.ravel()
        for h in range(1, self.harmonics + 1):
            damping = omega * (self.damping - zeta * omega * self.given[2 * h] * np.eye(n))
            square[:, 2 * h - 1, :, 2 * h] += h * damping
            square[:, 2 * h, :, 2 * h - 1] -= h * damping
        square *= self.weight[:, :, None, None]
        self.jacobian[: n * harmonics, : n * harmonics] = square.reshape(n * harmonics, -1)

    def _fill_border(
        self, amplitude: float, omega: float, zeta: float, by_omega: np.ndarray, by_zeta: np.ndarray
    ) -> None:
        """Fill the Jacobian's columns of frequency, damping and amplitude, and the rows of amplitude and phase."""
        inner, harmonics, full = self.size - 2, self.order.size, self.jacobian
        weight = self.weight * self.metres
        of_omega, of_zeta = (weight * by_omega).ravel(), (weight * by_zeta).ravel()
        full[:inner, inner], full[:inner, inner + 1] = self.own / amplitude * of_omega, of_zeta / amplitude
        full[:inner, -1] = -(omega * of_omega + zeta * of_zeta) / amplitude
        full[inner:] = 0.0
        full[inner, 1:inner:harmonics] = self.at_points[self.row] / self.metres
        full[inner + 1, 2:inner:harmonics] = self.at_points[self.row] / self.metres
        full[inner, -1] = -1.0
