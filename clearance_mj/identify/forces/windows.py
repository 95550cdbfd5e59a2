"""Restoring forces of a record window by window, all windows of one length: the structure is inverted once."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping

import numpy as np
import scipy.fft

from ...linear import linear_model
from ...rig import Rig
from ..records.prepared import PreparedRecord
from .restoring import BAND, MODES, SETTLE, TAPER, RestoringForce, flanks, require_measurable

__all__ = ["WindowForces"]


class WindowForces:
    """Forces of the clearances, and the motion in them, in every window of a record.

    As `restoring_force`, with the sensors' noise given: a window's forces are the record's, as they can be known by
    `SETTLE` seconds after its end.

    Parameters
    ----------
    record : PreparedRecord
        With a displacement probe at every clearance.
    rig : Rig
        The linear rig.
    probes : mapping of str to float
        Their gains and places, by the names of `priors`.
    noise : ndarray
        Noise (n_channels,) as in `RestoringForce.noise`.
    window : float
        Length of a window, s.
    """

    def __init__(self, record: PreparedRecord, rig: Rig, probes: Mapping[str, float], noise: np.ndarray, window: float):
        require_measurable(record)
        self.name, self.kind, self.fs, self.noise = record.name, record.kind, record.fs, noise
        self.measured = record.signals
        self.step, self.margin = round(window * record.fs), round(SETTLE * record.fs)
        self.seconds, self.size = self.step / self.fs, self.step + 2 * self.margin
        self.padded = scipy.fft.next_fast_len(self.size + int(TAPER * self.fs), real=True)
        frequency = np.fft.rfftfreq(self.padded, 1 / self.fs)
        self.frequency = frequency[frequency <= BAND * self.fs]
        self._invert(rig, probes)

    def on(self, rig: Rig, probes: Mapping[str, float]) -> WindowForces:
        """Return the same record's forces on another rig."""
        other = copy.copy(self)
        other._invert(rig, probes)
        return other

    def _invert(self, rig: Rig, probes: Mapping[str, float]) -> None:
        """Compute the gains from channels to forces and motion at every line, and their noise from the sensors'."""
        self.rig, omega, model = rig, 2 * np.pi * self.frequency, linear_model(rig, MODES)
        gains = model.channel_gains(model.at_probes(probes), self.kind, omega)
        moved = model.displacement_gains(model.at_points, self.kind, omega)
        weighted = gains / self.noise[None, :, None]
        adjoint = weighted.conj().transpose(0, 2, 1)
        covariance = np.linalg.inv(adjoint @ weighted)
        self.theta = covariance @ adjoint / self.noise
        self.motion = moved @ self.theta
        m = len(rig.bushings)
        of_force, of_motion = covariance[:, :m, :m], moved[:, :m] @ covariance @ moved[:, :m].conj().transpose(0, 2, 1)
        power, of_motion = (2 / self.fs * np.einsum("fii->fi", part).real for part in (of_force, of_motion))
        self.density = np.sqrt(power).T
        self.spread, self.motion_spread = (np.sqrt(p.sum(axis=0) * self.fs / self.padded) for p in (power, of_motion))

    def __len__(self) -> int:
        return max(0, (self.measured.shape[0] - 2 * self.margin) // self.step)

    def __iter__(self) -> Iterator[RestoringForce]:
        return map(self.window, range(len(self)))

    def window(self, i: int) -> RestoringForce:
        """Forces of a window, with `SETTLE` seconds before and after it, which are not valid; time from there."""
        first, m = i * self.step, len(self.rig.bushings)
        piece = self.measured[first : first + self.size] * flanks(self.size, self.fs)[:, None]
        spectrum = scipy.fft.rfft(piece, self.padded, axis=0)[: self.frequency.size, :, None]
        theta, motion = (self.theta @ spectrum)[:, :, 0], (self.motion @ spectrum)[:, :, 0]
        velocity = 2j * np.pi * self.frequency[:, None] * motion[:, :m]
        full = np.zeros((self.padded // 2 + 1, 5 * m), dtype=complex)
        full[: self.frequency.size] = np.hstack((theta[:, :m], motion, velocity))
        in_time = scipy.fft.irfft(full, self.padded, axis=0)[: self.size].T
        force, middle, ends, speed = np.split(in_time, [m, 2 * m, 4 * m])
        sample = np.arange(self.size)
        return RestoringForce(
            name=self.name, rig=self.rig, fs=self.fs, band=(0.0, float(self.frequency[-1])),
            time=sample / self.fs, displacement=middle, velocity=speed, force=force,
            force_std=self.spread, displacement_std=self.motion_spread, ends=ends.reshape(m, 2, self.size),
            valid=(sample >= self.margin) & (sample < self.margin + self.step), noise_frequency=self.frequency,
            noise_density=self.density, noise=self.noise,
        )  # fmt: skip
