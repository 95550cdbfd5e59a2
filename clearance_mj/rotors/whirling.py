"""Whirl of a shaft in its round clearances, from simulated responses: positions, orbits, full spectra."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.errors import RecordError
from ..core.kinds import checks_kinds
from ..rig import Bushing, Rig
from ..signals.full_spectra import FullSpectrum, SpeedCascade, full_spectrum, speed_cascade
from ..signals.orbits import Orbits, orbits_by_turn, shaft_angle
from ..signals.response import Response

__all__ = ["Whirl", "clearance_places", "require_round", "spin_and_angle", "whirl"]

STEADY = 5e-3  # relative change of the spin that counts as constant speed


@dataclass(frozen=True, eq=False)
class Whirl:
    """Motion of a shaft in its bushings, with its spin and angle. Made by `whirl`."""

    rig: Rig
    """rig of the bushings"""
    fs: float
    """samples per second"""
    time: np.ndarray
    """(n_t,) s, of the response"""
    position: np.ndarray
    """(n, 2, n_t) m, y and z of the shaft's line from the middle of each of ``bushings``; the wall is a circle about
    it"""
    spin: np.ndarray | None
    """(n_t,) rad/s; None for a shaft that does not turn"""
    angle: np.ndarray | None
    """(n_t,) rad, of the shaft, whose whole turns are the once-per-turn marks"""

    @property
    def bushings(self) -> list[Bushing]:
        """The round clearances of the rig."""
        return [b for b in self.rig.bushings if b.is_round]

    @property
    def names(self) -> list[str]:
        """Name of each of ``bushings``, such as "bushing 1, x = 0.5 m"."""
        return [f"bushing {j + 1}, {b.where}" for j, b in enumerate(self.rig.bushings) if b.is_round]

    @property
    def is_steady(self) -> bool:
        """True if it turns at constant speed throughout, or not at all."""
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
        """The part in which the spin changes, from its first to its last change; the whole, if it never does."""
        changes = np.flatnonzero(np.diff(self.spin)) if self.spin is not None else np.empty(0, dtype=int)
        return self.between(*self.time[[changes[0], changes[-1] + 1]]) if changes.size else self

    def ending(self, seconds: float, turns: int = 0) -> Whirl:
        """Return the part at the end with constant speed, or a longer one where that is short.

        Parameters
        ----------
        seconds : float
            Its least duration, s, as far as available.
        turns : int
            Its least number of turns from mark to mark, as far as available.
        """
        if self.spin is None or self.angle is None:
            return self
        unsteady = np.abs(self.spin - self.spin[-1]) > STEADY * np.abs(self.spin[-1])
        steady = self.time[np.flatnonzero(unsteady)[-1]] + 1 / self.fs if unsteady.any() else self.time[0]
        before_turns = np.abs(self.angle - self.angle[-1]) > 2 * np.pi * (turns + 1)
        last_turns = self.time[np.flatnonzero(before_turns)[-1]] if before_turns.any() else self.time[0]
        return self.between(min(steady, last_turns, max(self.time[-1] - seconds, self.time[0])))

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
        orbits_of_turns = orbits_by_turn(*self._path(bushing), self.fs, self.angle, n_points)
        return replace(orbits_of_turns, time=orbits_of_turns.time + self.time[0])

    def full_spectrum(self, bushing: int, resolution: float = 1.0, window: str = "flattop") -> FullSpectrum:
        """Return the full spectrum of the motion in a bushing.

        Parameters
        ----------
        bushing : int
            Its number, from 0 on.
        resolution : float
            Distance of the lines, Hz.
        window : str
            As in `signals.full_spectrum`.
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
            As in `signals.full_spectrum`.
        n_windows : int
            Number of windows.
        """
        if self.spin is None:
            raise RecordError(f"rig {self.rig.name!r} does not turn, and has no spectra over speed")
        return speed_cascade(*self._path(bushing), self.fs, self.spin, resolution, window, n_windows)


def require_round(rig: Rig) -> None:
    """Raise a RecordError for a rig without round clearances.

    Parameters
    ----------
    rig : Rig
        The rig.

    Raises
    ------
    RecordError
        If it has none.
    """
    if not rig.moves_across:
        raise RecordError(f'rig {rig.name!r} moves along z alone and has no orbits; give its bushings shape = "round"')
    if not any(b.is_round for b in rig.bushings):
        raise RecordError(f"rig {rig.name!r} has no round bushings in which its shaft could whirl")


def clearance_places(rig: Rig, response: Response) -> np.ndarray:
    """Return the positions of a shaft in its clearances, (n_rows, n_t) m; see `Rig.clearance_rows`.

    In round ones along y and z from their middles, whatever the angle of their probes; in others as in the response.

    Parameters
    ----------
    rig : Rig
        The rig.
    response : Response
        Simulated, or a record with every probe.

    Raises
    ------
    RecordError
        If the response lacks displacements.
    """
    displacement = response.displacement
    if displacement is None or len(displacement) != rig.n_rows:
        had = "none" if displacement is None else f"{len(displacement)} rows"
        raise RecordError(
            f"the response has {had} of displacements; {len(rig.bushings)} bushings need {', '.join(rig.probe_labels)}"
        )
    places = displacement + rig.row_offsets[:, None]
    for bushing, rows in zip(rig.bushings, rig.clearance_rows):
        if bushing.probe_angle:
            cos, sin = np.cos(bushing.probe_angle), np.sin(bushing.probe_angle)
            places[rows] += np.array([[cos - 1, -sin], [sin, cos - 1]]) @ displacement[rows]
    return places


def spin_and_angle(rig: Rig, response: Response) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the shaft's spin (n_t,), rad/s, and its angle (n_t,), rad; None for a shaft that does not turn.

    Parameters
    ----------
    rig : Rig
        The rig.
    response : Response
        Response of the rig.
    """
    if response.spin is None or not response.spin.any():
        return None, None
    return response.spin, shaft_angle(response.spin, response.fs, rig.spin.angle if rig.spin else 0.0)


@checks_kinds
def whirl(rig: Rig, response: Response) -> Whirl:
    """Return the motion of a shaft in its round clearances, from a response of its rig.

    Displacements of a response are relative to the unloaded shaft, and along probes rotated by
    ``probe_angle``; the offsets of the bushings and the probes' angles are those of the rig.

    Parameters
    ----------
    rig : Rig
        Rig with round bushings.
    response : Response
        Simulated, or a record with both probes of each bushing.

    Raises
    ------
    RecordError
        If the rig has no round bushings, or the response lacks displacements.
    """
    require_round(rig)
    places = clearance_places(rig, response)
    position = np.array([places[rows] for b, rows in zip(rig.bushings, rig.clearance_rows) if b.is_round])
    return Whirl(rig, response.fs, response.time, position, *spin_and_angle(rig, response))
