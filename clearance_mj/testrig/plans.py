"""Which records a virtual rig gives."""

from __future__ import annotations

from dataclasses import dataclass

from ..signals import excitation
from ..signals.excitation import Excitation

__all__ = ["Plan", "plans"]

FS = 2048.0
"""Hz"""
BAND = (5.0, 220.0)
"""Hz"""


@dataclass(frozen=True)
class Plan:
    """A record to take."""

    name: str
    """the record's"""
    role: str
    """ "identify" or "validate" """
    excitation: Excitation
    """of the base"""
    description: str
    """the excitation in words"""
    seed: int
    """of excitation and noise"""
    level: float | None = None
    """RMS of a stationary excitation, m/s²"""


def _ramp() -> Plan:
    shake = excitation.level_ramp(32.0, FS, BAND, start_rms=0.3, end_rms=9.0, seed=1, kind="base")
    return Plan("ramp", "identify", shake, "random 5-220 Hz, level rising from 0.3 to 9 m/s² RMS", 1)


def _hammer() -> Plan:
    # The first pulse leaves the shaft inside the gap, the last drives it far into the bushings.
    peaks, times = (8.0, 25.0, 60.0, 140.0), (0.5, 4.5, 8.5, 12.5)
    shake = excitation.hammer(16.0, FS, peak=peaks, width=0.006, times=times, kind="base")
    words = "free decays after half-sine base pulses of 6 ms and 8, 25, 60, 140 m/s² at 0.5, 4.5, 8.5, 12.5 s"
    return Plan("hammer", "identify", shake, words, 2)


def _stationary(level, letter, seed) -> Plan:
    shake = excitation.random(24.0, FS, BAND, rms=level, seed=seed, kind="base")
    return Plan(f"level_{level:g}_{letter}", "validate", shake, "stationary random 5-220 Hz", seed, level)


def plans() -> tuple[Plan, ...]:
    """Return the records of the dataset; the second seed of a level gives the repeat floor."""
    levels = (0.5, 1.0, 2.0, 5.0, 8.0)
    stationary = (_stationary(v, c, 10 * i + j) for i, v in enumerate(levels, 1) for j, c in enumerate("ab", 1))
    return (_ramp(), _hammer(), *stationary)
