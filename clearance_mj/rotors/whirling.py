"""How a shaft whirls in its round clearances: its places in them, orbits, full spectra, of simulated responses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.errors import RecordError
from ..core.kinds import checks_kinds
from ..rig import Rig, one_kind
from ..signals.full_spectra import FullSpectrum, SpeedCascade, full_spectrum, speed_cascade
from ..signals.orbits import Orbits, orbits_by_turn, shaft_angle
from ..signals.response import Response

__all__ = ["Whirl", "require_round", "whirl"]

STEADY = 5e-3  # change of the spin that still counts as one speed


@dataclass(frozen=True, eq=False)
class Whirl:
    """The motion of a shaft in its bushings, and how it turns. Made by `whirl`."""

    rig: Rig
    """whose bushings they are"""
    fs: float
    """samples per second"""
    time: np.ndarray
    """(n_t,) s, of the response"""
    position: np.ndarray
    """(n_bushings, 2, n_t) m, y and z of the shaft's line from the bushing's middle; the wall is a circle about it"""
    spin: np.ndarray | None
    """(n_t,) rad/s; None of a shaft that does not turn"""
    angle: np.ndarray | None
    """(n_t,) rad, of the shaft, whose whole turns are the once-per-turn marks"""

    @property
    def names(self) -> list[str]:
        """Each bushing in words, such as "bushing 1, x = 0.5 m"."""
        return [f"bushing {j + 1}, {b.where}" for j, b in enumerate(self.rig.bushings)]

    @property
    def is_steady(self) -> bool:
        """Whether it turns at one speed throughout, or not at all."""
        return self.spin is None or bool(np.ptp(self.spin) <= STEADY * np.abs(self.spin).max())

    def between(self, first: float, last: float = np.inf) -> Whirl:
        """Return the part between two times.

        Parameters
        ----------
        first, last : float
            s from the start of the response.

        Raises
        ------
        RecordError
            If no two samples are left.
        """
        begin, end = np.searchsorted(self.time, (first - 1e-9, last + 1e-9))
        if end - begin < 2:
            ends = self.time[[0, -1]]
            raise RecordError(f"{first:g} to {last:g} s: no samples; there are some from {ends[0]:g} to {ends[1]:g} s")
        spin, angle = (None if values is None else values[begin:end] for values in (self.spin, self.angle))
        return Whirl(self.rig, self.fs, self.time[begin:end], self.position[:, :, begin:end], spin, angle)

    @property
    def changing(self) -> Whirl:
        """The part in which the spin changes, from its first to its last change; all of it, if it never does."""
        changes = np.flatnonzero(np.diff(self.spin)) if self.spin is not None else np.empty(0, dtype=int)
        return self.between(*self.time[[changes[0], changes[-1] + 1]]) if changes.size else self

    def ending(self, seconds: float, turns: int = 0) -> Whirl:
        """Return the part at the end in which the shaft turns at one speed, or where that is short, more of the end.

        Parameters
        ----------
        seconds : float
            Time that it has at least, if there is so much.
        turns : int
            Turns from mark to mark that it has at least, if there are so many.
        """
        if self.spin is None or self.angle is None:
            return self
        off = np.abs(self.spin - self.spin[-1]) > STEADY * np.abs(self.spin[-1])
        steady = self.time[np.flatnonzero(off)[-1]] + 1 / self.fs if off.any() else self.time[0]
        lacking = np.abs(self.angle - self.angle[-1]) > 2 * np.pi * (turns + 1)
        turned = self.time[np.flatnonzero(lacking)[-1]] if lacking.any() else self.time[0]
        return self.between(min(steady, turned, max(self.time[-1] - seconds, self.time[0])))

    def _path(self, bushing: int) -> tuple[np.ndarray, np.ndarray]:
        y, z = self.position[bushing]
        return y, z

    def orbits(self, bushing: int, n_points: int = 128) -> Orbits:
        """Return the orbits in a bushing, turn by turn.

        Parameters
        ----------
        bushing : int
            Its number, from 0 on.
        n_points : int
            Points of a turn.
        """
        if self.angle is None:
            raise RecordError(f"rig {self.rig.name!r} does not turn, and has no orbits by turn; give [spin]")
        found = orbits_by_turn(*self._path(bushing), self.fs, self.angle, n_points)
        return replace(found, time=found.time + self.time[0])

    def full_spectrum(self, bushing: int, resolution: float = 1.0, window: str = "flattop") -> FullSpectrum:
        """Return the full spectrum of the motion in a bushing.

        Parameters
        ----------
        bushing : int
            Its number, from 0 on.
        resolution : float
            Distance of the lines, Hz.
        window : str
            As of `signals.full_spectrum`.
        """
        return full_spectrum(*self._path(bushing), self.fs, resolution, window)

    def cascade(self, bushing: int, resolution: float = 2.0, window: str = "hann", n_windows: int = 80) -> SpeedCascade:
        """Return full spectra over the speed, of the motion in a bushing.

        Parameters
        ----------
        bushing : int
            Its number, from 0 on.
        resolution : float
            Distance of the lines, Hz.
        window : str
            As of `signals.full_spectrum`.
        n_windows : int
            Number of windows.
        """
        if self.spin is None:
            raise RecordError(f"rig {self.rig.name!r} does not turn, and has no spectra over speed")
        return speed_cascade(*self._path(bushing), self.fs, self.spin, resolution, window, n_windows)


def require_round(rig: Rig) -> None:
    """Refuse a rig that has no round clearances.

    Parameters
    ----------
    rig : Rig
        The rig.

    Raises
    ------
    RecordError
        If it is planar or has no bushings.
    ClearanceError
        If it has slots, too.
    """
    if not rig.moves_across:
        raise RecordError(f'rig {rig.name!r} moves along z alone and has no orbits; give its bushings shape = "round"')
    if not rig.bushings:
        raise RecordError(f"rig {rig.name!r} has no bushings in which its shaft could whirl")
    one_kind(rig, "an orbit")


@checks_kinds
def whirl(rig: Rig, response: Response) -> Whirl:
    """Return where a shaft is in its round clearances, out of a response of its rig.

    Displacements of a response are counted from the line of the unloaded shaft, and of probes that are turned by
    ``probe_angle`` along these; the offsets of the bushings and the probes' angles are those of the rig.

    Parameters
    ----------
    rig : Rig
        With round bushings.
    response : Response
        Simulated, or a record with both probes of each bushing.

    Raises
    ------
    RecordError
        If the rig is planar or has no bushings, or the response lacks displacements along y and z.
    """
    require_round(rig)
    moved, n = response.displacement, len(rig.bushings)
    if moved is None or len(moved) != 2 * n:
        had = "none" if moved is None else f"{len(moved)} rows"
        raise RecordError(
            f"the response has {had} of displacements; orbits in {n} bushings need {', '.join(rig.probe_labels)}"
        )
    one, other = moved.reshape(n, 2, -1).transpose(1, 0, 2)
    turned = np.array([b.probe_angle for b in rig.bushings])[:, None]
    y = np.cos(turned) * one - np.sin(turned) * other
    z = np.sin(turned) * one + np.cos(turned) * other
    offset = np.array([[b.offset_y, b.offset] for b in rig.bushings])[:, :, None]
    spin = response.spin if response.spin is not None and response.spin.any() else None
    angle = None if spin is None else shaft_angle(spin, response.fs, rig.spin.angle if rig.spin else 0.0)
    return Whirl(rig, response.fs, response.time, np.stack((y, z), axis=1) + offset, spin, angle)
