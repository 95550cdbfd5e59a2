"""Orbits of a point of a turning shaft, one for each of its turns, and their part at a multiple of its spin.

Turns begin where the shaft's angle passes a whole number of turns: the once-per-turn mark of a test rig. A motion that
goes with the n-th multiple of the shaft's angle θ is an ellipse,

    w = y + i z = F e^(i n θ) + B e^(-i n θ),

with semi-axes |F| + |B| and ||F| - |B||: forward, with the spin, where |F| > |B|.

Source: Bently & Hatch, Fundamentals of Rotating Machinery Diagnostics, 2002, chapters 4 to 8.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.integrate
from scipy.interpolate import CubicSpline

from ..core.errors import RecordError
from .arrays import ArrayData

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FilteredOrbit", "Orbits", "orbits_by_turn", "shaft_angle"]

MIN_SAMPLES = 4.0  # of a turn: a spline through fewer does not follow its first multiple


@dataclass(frozen=True, eq=False, repr=False)
class FilteredOrbit(ArrayData):
    """The ellipse of a motion that goes with a multiple of the shaft's angle."""

    order: int
    """n, the multiple"""
    forward: complex
    """F, m: amplitude and phase of the circle that goes round with the spin"""
    backward: complex
    """B, m: of the one against it"""
    centre: complex
    """mean position, y + i z, m"""

    @property
    def y(self) -> complex:
        """Motion along y, m: Re(y e^(i n θ)); its argument, negative, is the phase lag behind the mark."""
        return self.forward + self.backward.conjugate()

    @property
    def z(self) -> complex:
        """Motion along z, m, likewise."""
        return -1j * (self.forward - self.backward.conjugate())

    @property
    def major(self) -> float:
        """Larger semi-axis, m."""
        return abs(self.forward) + abs(self.backward)

    @property
    def minor(self) -> float:
        """Smaller semi-axis, m."""
        return abs(abs(self.forward) - abs(self.backward))

    @property
    def inclination(self) -> float:
        """Angle of the larger semi-axis from y, rad, > 0 towards z, in -π/2 to π/2."""
        doubled = self.forward * self.backward
        return float(np.angle(doubled) / 2) if doubled else 0.0

    @property
    def sense(self) -> float:
        """1 of a forward circle, -1 of a backward one, 0 of a motion on a line: ±2ab/(a² + b²) of semi-axes a, b."""
        forward, backward = abs(self.forward) ** 2, abs(self.backward) ** 2
        return (forward - backward) / (forward + backward) if forward + backward else 0.0

    def path(self, n_points: int = 181) -> np.ndarray:
        """Return the ellipse (2, n_points), y and z in m, from the once-per-turn mark on, for a rising angle.

        Parameters
        ----------
        n_points : int
            Number of points; the last one is the first again.
        """
        phase = np.exp(2j * np.pi * np.linspace(0.0, 1.0, n_points))
        w = self.centre + self.forward * phase + self.backward / phase
        return np.array((w.real, w.imag))


@dataclass(frozen=True, eq=False, repr=False)
class Orbits(ArrayData):
    """Orbits of a point, turn by turn at equal angles of the shaft. Made by `orbits_by_turn`."""

    time: np.ndarray
    """(n_turns,) s, of the marks at which turns begin"""
    speed: np.ndarray
    """(n_turns,) rad/s, mean spin of each turn"""
    position: np.ndarray
    """(n_turns, 2, n_points) m, along y and z; a turn's first point is at its mark, its end is the next one's first"""

    @property
    def marks(self) -> np.ndarray:
        """(2, n_turns) m, where the point is at the once-per-turn marks."""
        return self.position[:, :, 0].T

    def last(self, n_turns: int) -> Orbits:
        """Return the last turns alone.

        Parameters
        ----------
        n_turns : int
            Number of turns; all, if there are fewer.
        """
        part = slice(max(self.time.size - n_turns, 0), None)
        return Orbits(self.time[part], self.speed[part], self.position[part])

    def harmonic(self, order: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """Return F and B (n_turns,) complex, m, of every turn: over speed, a Bode plot of forward and backward whirl.

        Parameters
        ----------
        order : int
            Multiple of the shaft's angle.
        """
        w = self.position[:, 0] + 1j * self.position[:, 1]
        sense = np.sign(self.speed[0])  # the shaft's angle falls where it turns from z to y
        turn = np.exp(-2j * np.pi * sense * order * np.arange(w.shape[1]) / w.shape[1])
        return (w * turn).mean(axis=1), (w / turn).mean(axis=1)

    def filtered(self, order: int = 1) -> FilteredOrbit:
        """Return the mean ellipse over the turns at a multiple of the shaft's angle.

        Parameters
        ----------
        order : int
            The multiple, up to half the number of points of a turn.

        Raises
        ------
        RecordError
            If the order is not among these.
        """
        if not 1 <= order < self.position.shape[2] / 2:
            raise RecordError(f"order {order}: must be 1 to {(self.position.shape[2] - 1) // 2}, for these points")
        forward, backward = (complex(part.mean()) for part in self.harmonic(order))
        y, z = self.position.mean(axis=(0, 2))
        return FilteredOrbit(order, forward, backward, complex(y, z))

    def plot(self, gap: float | None = None) -> Figure:
        """Draw the orbits with their marks, and the mean ellipse at the shaft's spin.

        Parameters
        ----------
        gap : float, optional
            Radius of the round wall about (0, 0), m; None: it is not drawn.
        """
        from .orbit_figures import orbit_figure

        return orbit_figure({"": self}, {} if gap is None else {"": gap})


def shaft_angle(spin: np.ndarray, fs: float, start: float = 0.0) -> np.ndarray:
    """Return the angle (n_t,) rad of a shaft, integrated from its spin: exact for ramps.

    Parameters
    ----------
    spin : ndarray, shape (n_t,)
        rad/s, > 0 from y to z.
    fs : float
        Samples per second.
    start : float
        Angle of the first sample, rad.
    """
    return np.asarray(start + scipy.integrate.cumulative_trapezoid(spin, dx=1 / fs, initial=0.0))


def orbits_by_turn(y: np.ndarray, z: np.ndarray, fs: float, angle: np.ndarray, n_points: int = 128) -> Orbits:
    """Cut a motion along y and z into whole turns of the shaft, each at equal angles (order tracking).

    Parameters
    ----------
    y, z : ndarray, shape (n_t,)
        Displacements, m.
    fs : float
        Samples per second.
    angle : ndarray, shape (n_t,)
        Angle of the shaft, rad, > 0 from y to z; `shaft_angle` returns it of a spin.
    n_points : int
        Points of a turn. Positions between samples are those of a cubic spline.

    Raises
    ------
    RecordError
        If the histories differ in length, the shaft does not turn in one sense, or makes no whole turn.
    """
    y, z, angle = (np.asarray(values, dtype=float) for values in (y, z, angle))
    if y.ndim != 1 or not y.shape == z.shape == angle.shape:
        raise RecordError(
            f"y, z and angle must have one value for each sample, got shapes {y.shape}, {z.shape} and {angle.shape}"
        )
    steps = np.diff(angle)
    if not steps.size or not (np.all(steps > 0) or np.all(steps < 0)):
        raise RecordError("the shaft does not turn in one sense all the time; give a part in which it does")
    if np.abs(steps).max() > 2 * np.pi / MIN_SAMPLES:
        raise RecordError(
            f"a turn has less than {MIN_SAMPLES:g} samples where the shaft turns fastest; give more samples per second"
        )
    sense = float(np.sign(steps[0]))
    turns = sense * angle / (2 * np.pi)  # rising in either sense of the spin
    first, last = np.ceil(turns[0] - 1e-9), np.floor(turns[-1] + 1e-9)
    if last < first + 1:
        raise RecordError(f"the shaft makes no whole turn from mark to mark in {y.size / fs:g} s")
    time = np.arange(y.size) / fs
    instants = np.interp(np.append(first + np.arange((last - first) * n_points) / n_points, last), turns, time)
    position = CubicSpline(time, np.array((y, z)), axis=1)(instants[:-1])
    marks = instants[::n_points]
    speed = sense * 2 * np.pi / np.diff(marks)
    return Orbits(marks[:-1], speed, position.reshape(2, -1, n_points).transpose(1, 0, 2))
