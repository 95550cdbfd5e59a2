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

SMOOTHED = 0.05  # of a stroke, and s at most, over which motor's signals are means: friction remembers every peak
SPIKE = 2.0  # times as long a median of the torque leaves out jerks, which the motor's inertia keeps to itself


@dataclass(frozen=True)
class PreslidingFriction:
    """Friction that an angle must first build up, and the angle that the load loses meanwhile."""

    width: float
    """rad of the motor, after which it slides"""
    torque: float
    """N m at the motor"""
    lost_motion: float
    """rad of the motor, to either side: half of the play, if it were nothing but play"""


@dataclass(frozen=True)
class Strand:
    """A part of the transmission that carries a share of the torque, with friction of its own."""

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
    """share of the torque that passes besides"""
    torque_zero: float = 0.0
    """N m that the motor's sensor shows beside the torque into the transmission"""
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
    """1/rad, of the motor: by which compliance grows with its angle"""
    backlash: float = 0.0
    """rad, to either side: what the angle loses as the torque into the transmission turns its sign"""
    backlash_torque: float = 1.0
    """N m, at which three quarters of that are lost"""
    curvature: float = 0.0
    """1/rad, of the motor: by which the ratio changes with its angle"""

    def follow(self, record: DriveRecord) -> tuple[np.ndarray, np.ndarray]:
        """Return angle (n,), rad, and torque (n,), N m, of the load, from the motor's angle and torque alone.

        Parameters
        ----------
        record : DriveRecord
            A run; what it has of the load is not looked at.
        """
        window = SMOOTHED * min(1.0, record.motor_angle.size / record.fs / (1 + record.reversals))
        x, torque = (_smooth(each, window * record.fs) for each in (record.motor_angle, record.motor_torque))
        torque = scipy.ndimage.median_filter(torque, _odd(SPIKE * window * record.fs), mode="nearest")
        torque = torque - self.torque_zero - self.stiffness * x
        if self.damping or self.inertia:
            speed = _smooth(np.gradient(x) * record.fs, window * record.fs)
            faster = _smooth(np.gradient(speed) * record.fs, window * record.fs)
            torque = torque - self.damping * speed - self.inertia * faster
        angle = x + 0.5 * self.curvature * x**2
        share = presliding(x, self.friction.width)
        torque = torque - self.friction.torque * share
        angle = angle - self.friction.lost_motion * share
        eta = Efficiency.capstan(self.capstan)
        out = sum(s.share * carried(torque, s.coulomb, *eta) for s in self.strands)
        angle = angle - self._bent(np.asarray(out), torque) * (1 + self.compliance_growth * x)
        return self.zero + self.ratio * angle, self.efficiency / self.ratio * np.asarray(out)

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
            math.nan if channel is None else float(np.sqrt(np.mean((told - channel) ** 2)))
            for told, channel in zip(self.follow(record), measured)
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
        out = torque * np.sin(np.linspace(0, 2 * math.pi, points))
        eta = Efficiency.capstan(self.capstan)
        wanted = out * abs(self.ratio) / self.efficiency  # what the transmission carries
        coulomb = sum(s.share * s.coulomb for s in self.strands)
        return out, -abs(self.ratio) * self._bent(wanted, entering(wanted, coulomb, *eta))

    def _bent(self, carried: np.ndarray, entering: np.ndarray) -> np.ndarray:
        """Angle at the motor's end that elasticity and play take, rad."""
        play = self.backlash * np.tanh(entering / self.backlash_torque)
        return np.asarray(self.compliance * carried + self.entrance_compliance * entering + play)


def _smooth(x: np.ndarray, samples: float) -> np.ndarray:
    return np.asarray(scipy.ndimage.uniform_filter1d(x, _odd(samples), mode="nearest"))


def _odd(samples: float) -> int:
    """Odd number of samples, so that nothing is delayed."""
    return 2 * round(samples / 2) + 1
