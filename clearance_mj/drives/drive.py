"""A drive as a chain: friction at its motor, a transmission with friction and elasticity, its load's end."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.ndimage

from ..core.errors import RecordError
from ..physical.transmission import Efficiency
from .friction import carried, entering, presliding
from .record import DriveRecord

__all__ = ["Drive", "PreslidingFriction", "Strand"]

SMOOTHED = 0.05  # of a stroke, and s at most, averaging window of the motor's signals: friction remembers peaks
SPIKE = 2.0  # times that window, median filter of the torque: the motor's inertia absorbs spikes


@dataclass(frozen=True)
class PreslidingFriction:
    """Friction that builds up over an angle, and the angle that the load loses meanwhile."""

    width: float
    """rad of the motor, after which it slides"""
    torque: float
    """N m at the motor"""
    lost_motion: float
    """rad of the motor, to either side: half of the play, if it were nothing but play"""


@dataclass(frozen=True)
class Strand:
    """A parallel part of the transmission: it carries a fraction of the torque, with friction."""

    share: float
    """of the torque"""
    coulomb: float
    """friction without load, N m at the motor"""


@dataclass(frozen=True)
class Drive:
    """A drive whose load's angle and torque follow from those of its motor; SI units, at the motor unless said."""

    ratio: float
    """the load's angle over the motor's, without load; negative where they turn against each other"""
    zero: float
    """rad of the load at angle 0 of the motor"""
    compliance: float
    """rad per N m that the transmission carries at its load's end"""
    strands: tuple[Strand, ...]
    """of the transmission; their shares make 1"""
    capstan: float = 0.0
    """friction that grows with the torque carried: what passes is between T e^{-capstan} and T e^{capstan}"""
    efficiency: float = 1.0
    """fraction of the torque that passes, apart from friction"""
    torque_zero: float = 0.0
    """N m, offset of the motor's torque sensor"""
    stiffness: float = 0.0
    """N m/rad, of a spring or weight at the motor"""
    damping: float = 0.0
    """N m s/rad at the motor"""
    inertia: float = 0.0
    """kg m² at the motor"""
    friction: PreslidingFriction = PreslidingFriction(1.0, 0.0, 0.0)
    """at the motor"""
    entrance_compliance: float = 0.0
    """rad per N m that goes into the transmission"""
    compliance_growth: float = 0.0
    """1/rad of the motor, relative growth of the compliance with its angle"""
    backlash: float = 0.0
    """rad, to either side, lost as the torque into the transmission changes its sign"""
    backlash_torque: float = 1.0
    """N m, at which three quarters of the backlash are taken up"""
    curvature: float = 0.0
    """1/rad of the motor, relative change of the ratio with its angle"""

    def follow(self, record: DriveRecord) -> tuple[np.ndarray, np.ndarray]:
        """Return angle (n,), rad, and torque (n,), N m, of the load, from the motor's angle and torque alone.

        Parameters
        ----------
        record : DriveRecord
            A run; its load's channels are not used.
        """
        window = SMOOTHED * min(1.0, record.motor_angle.size / record.fs / (1 + record.reversals))
        x, torque = (_smooth(signal, window * record.fs) for signal in (record.motor_angle, record.motor_torque))
        torque = scipy.ndimage.median_filter(torque, _odd_window(SPIKE * window * record.fs), mode="nearest")
        torque = torque - self.torque_zero - self.stiffness * x
        if self.damping or self.inertia:
            speed = _smooth(np.gradient(x) * record.fs, window * record.fs)
            acceleration = _smooth(np.gradient(speed) * record.fs, window * record.fs)
            torque = torque - self.damping * speed - self.inertia * acceleration
        angle = x + 0.5 * self.curvature * x**2
        engagement = presliding(x, self.friction.width)
        torque = torque - self.friction.torque * engagement
        angle = angle - self.friction.lost_motion * engagement
        eta = Efficiency.capstan(self.capstan)
        carried_torque = sum(s.share * carried(torque, s.coulomb, *eta) for s in self.strands)
        angle = angle - self._deflection(np.asarray(carried_torque), torque) * (1 + self.compliance_growth * x)
        return self.zero + self.ratio * angle, self.efficiency / self.ratio * np.asarray(carried_torque)

    def errors(self, record: DriveRecord) -> tuple[float, float]:
        """Return the RMS errors of the load's angle, rad, and torque, N m; nan of one that was not measured.

        Parameters
        ----------
        record : DriveRecord
            With the load's end, or one channel of it.

        Raises
        ------
        RecordError
            For a run of the motor's end alone.
        """
        measured = record.load_angle, record.load_torque
        if all(channel is None for channel in measured):
            raise RecordError(f'run "{record.name}" has no angle or torque of the load to compare with')
        angle, torque = (
            math.nan if channel is None else float(np.sqrt(np.mean((model - channel) ** 2)))
            for model, channel in zip(self.follow(record), measured)
        )
        return angle, torque

    def hysteresis(self, torque: float, points: int = 2000) -> tuple[np.ndarray, np.ndarray]:
        """Return torque, N m, and angle, rad, of the load (points,) whose torque goes to and fro, with the motor held.

        One cycle, as gear makers measure stiffness and lost motion; strands share their friction in it.

        Parameters
        ----------
        torque : float
            Largest torque of the load, N m.
        points : int
            Number of points.
        """
        load = torque * np.sin(np.linspace(0, 2 * math.pi, points))
        eta = Efficiency.capstan(self.capstan)
        transmitted = load * abs(self.ratio) / self.efficiency
        coulomb = sum(s.share * s.coulomb for s in self.strands)
        return load, -abs(self.ratio) * self._deflection(transmitted, entering(transmitted, coulomb, *eta))

    def _deflection(self, carried: np.ndarray, entering: np.ndarray) -> np.ndarray:
        """Return the angle at the motor's end that elasticity and play take up, rad."""
        play = self.backlash * np.tanh(entering / self.backlash_torque)
        return np.asarray(self.compliance * carried + self.entrance_compliance * entering + play)


def _smooth(x: np.ndarray, samples: float) -> np.ndarray:
    return np.asarray(scipy.ndimage.uniform_filter1d(x, _odd_window(samples), mode="nearest"))


def _odd_window(samples: float) -> int:
    """Return an odd number of samples, so that the filter has no delay."""
    return 2 * round(samples / 2) + 1
