"""Backbones: frequency and damping of a nonlinear mode over its amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from tqdm import tqdm

from ..core.errors import ClearanceError
from ..core.kinds import checks_kinds
from ..model import Model
from ..rig.sensing import acceleration_mask, sensor_points
from .axes import level_axis
from .branch import Branch
from .condensed import condensed
from .continuation import EndOfBranch, NoConvergence, PeriodicMotion, until_closed
from .coverage import COVERED
from .excitation import steady_spin
from .nonlinear_mode import NonlinearMode
from .resolution import pair_of, require_whole, resolution
from .vibrations import UNITS, Vibrations, complex_amplitudes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Backbone", "follow_backbone"]

IN_GAPS = (0.1, 5.0)  # default first and last amplitude, in gaps


@dataclass(frozen=True, eq=False, repr=False)
class Backbone(Vibrations):
    """A nonlinear mode from small to large amplitudes.

    Harmonics are complex amplitudes, X_h in x(t) = Re Σ X_h exp(2πi h f t), from the mean, h = 0, on.
    """

    model: Model
    """rig and law of its clearances"""
    mode: int
    """the linear mode in the gap that it begins with, 1 the lowest"""
    clearance: int
    """row of the clearance that this one moves most, whose fundamental X_1 is real and positive"""
    frequency: np.ndarray
    """(n,) f, Hz"""
    damping: np.ndarray
    """(n,) damping ratio ζ"""
    level: np.ndarray
    """(n,) amplitude of the shaker's excitation that would hold the vibration in resonance, m/s² or N; inf if none"""
    acceleration: np.ndarray
    """(n, n_sensors, H + 1) harmonics of what the sensors read, the base at rest, m/s²"""
    displacement: np.ndarray
    """(n, n_sensors, H + 1) of the sensors' points, m"""
    clearance_displacement: np.ndarray
    """(n, n_bushings, H + 1) of the clearances' middles from rest, m"""
    contact_force: np.ndarray
    """(n, n_bushings, H + 1) of both ends, positive against positive displacement, N"""
    grease_force: np.ndarray
    """(n, n_bushings, H + 1) same sign, N"""
    ended: str
    """why the curve ends before the last amplitude: "" if it does not"""
    responses: tuple[str, ...]
    """degree of freedom of each sensor, such as "3:+Z" """
    clearances: tuple[str, ...]
    """name of each clearance, `Rig.clearance_labels`; where some are round of the coordinates, `Rig.probe_labels`"""

    @property
    def gap(self) -> float:
        """Gap of the clearance that the mode moves most, m."""
        rig = self.model.rig
        return rig.bushings[rig.bushing_of_row[self.clearance]].gap

    def plot(
        self, quantity: str = "clearance_displacement", row: int | None = None, branches: Sequence[Branch] = ()
    ) -> Figure:
        """Draw frequency and damping ratio over the amplitude.

        Parameters
        ----------
        quantity : str
            Quantity, as in `amplitude`.
        row : int, optional
            Which sensor or clearance; None: the one that moves most.
        branches : sequence of Branch, optional
            Forced vibrations of the same rig to draw as well: in resonance they meet the backbone.

        Raises
        ------
        ClearanceError
            For another quantity, or a row that is not there.
        """
        from ..core.drawing import canvas

        amplitudes = self.amplitude(quantity)
        row = int(amplitudes[-1].argmax()) if row is None else row
        name = self._names(quantity, [row])[row]
        figure = canvas(5, 8)
        above, below = figure.subplots(2, 1, sharex=True)
        for branch in branches:
            level = f"{abs(branch.level[0, 0]):g} {'m/s²' if branch.kind == 'base' else 'N'}"
            above.plot(branch.amplitude(quantity)[:, row], branch.frequency, lw=1, label=level)
        above.plot(amplitudes[:, row], self.frequency, "k", label=f"mode {self.mode}")
        below.plot(amplitudes[:, row], 100 * self.damping, "k")
        above.set_ylabel("frequency (Hz)")
        above.legend(frameon=False)
        below.set_ylabel("damping ratio (%)")
        below.set_xlabel(f"amplitude of the {quantity.replace('_', ' ')} of {name} ({UNITS[quantity]})")
        return figure

    def to_xarray(self) -> xr.Dataset:
        """Return all quantities with labels and units: harmonics over (point, response or clearance, harmonic)."""
        variables = {
            "frequency": ("point", self.frequency, "Hz"),
            "damping": ("point", self.damping, "1"),
            "level": ("point", self.level, level_axis(self.model.rig.shaker.kind).symbol),
            **self._variables(),
        }
        attributes = {"mode": self.mode, "of": self.clearances[self.clearance], "ended": self.ended}
        return self._dataset("backbone", variables, range(self.acceleration.shape[-1]), attributes)


@checks_kinds
def follow_backbone(
    model: Model, mode: int = 1, amplitude_range: tuple[float, float] | None = None, n_harmonics: int = 21,
    n_samples: int | None = None, n_modes: int = 8, progress: bool = False,
) -> Backbone:  # fmt: skip
    """Follow a mode of a rig from small to large amplitudes: its frequency, damping ratio and shape.

    The rig vibrates freely and periodically, because a negative damping ratio of the whole structure balances the
    dissipation: the extended periodic motion concept. Free vibrations that decay slowly, and forced ones in resonance,
    follow the curve. Unbalances and orders do not act.

    Parameters
    ----------
    model : Model
        Rig, with a shaft or a small system of `structure.Matrices`, and law, a `ConstantLaw` or a `ContactLaw`.
    mode : int
        Which of its linear modes in the gap it begins with; 1: the lowest.
    amplitude_range : tuple of float, optional
        First and last amplitude, m, of the displacement's fundamental at the clearance that this mode moves most; None:
        from 0.1 to 5 of its gaps.
    n_harmonics : int
        Number of harmonics of the motion, H.
    n_samples : int, optional
        Number of samples of a period, at least 4 H + 1; None: the power of two from 12 H on, and four times as many
        where vibrations end early with them.
    n_modes : int
        Number of modes in the Ritz basis, as in the modal engine.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Backbone
        If the continuation fails, the curve so far: ``ended`` says at which amplitude, or that it turned back.

    Raises
    ------
    ClearanceError
        For impossible modes, amplitudes, harmonics or samples, a mode that moves no clearance, or if not even the
        first point converges.
    ExcitationError
        If the rig has a shaker of force without a position.
    LawError
        For a law over time or amplitude, or one that does not fit the rig.
    RigError
        If the rig has no clearance, or in the gap moves without stiffness.

    Notes
    -----
    M. Krack, Nonlinear modal analysis of nonconservative systems, Computers & Structures 154 (2015) 59-71.
    """
    rig, (harmonics, (samples, *_)) = model.rig, resolution(n_harmonics, n_samples, 1, n_modes)
    require_whole(mode=mode)
    spin = steady_spin(rig.replace(unbalances=(), orders=()), rig.shaker.kind)
    system = condensed(model, rig.shaker.kind, (), harmonics, n_modes, speed=spin)
    most = min(n_modes, system.driven.model.size)
    if not 1 <= mode <= most:
        raise ClearanceError(f"mode must be between 1 and {most}, as many as the Ritz basis has, got {mode}")
    follower = NonlinearMode(system, int(mode) - 1, harmonics, samples, spin)
    start, stop = _amplitudes(amplitude_range, rig.bushings[rig.bushing_of_row[follower.row]].gap)
    motions: list[PeriodicMotion] = []
    ended, branch = "", until_closed(follower, follower.branch(start, stop))
    try:
        for motion in tqdm(branch, desc="backbone", unit="point", disable=not progress):
            motions.append(motion)
        if motion.parameter < stop * (1 - COVERED):
            ended = f"it turns back and leaves the amplitudes at {motion.parameter:.6g} m, where it began"
    except EndOfBranch as end:
        ended = str(end)
    except NoConvergence as end:
        at = f"an amplitude of {end.args[0]:.6g} m"
        if not motions:
            raise ClearanceError(
                f"rig {rig.name!r}: mode {mode} was not found at {at}; begin at a smaller one, or with more harmonics "
                "and samples"
            ) from None
        ended = f"no further periodic vibration was found beyond {at}"
    return _backbone(follower, int(mode), motions, ended)


def _amplitudes(amplitudes: tuple[float, float] | None, gap: float) -> tuple[float, float]:
    start, stop = pair_of(np.multiply(IN_GAPS, gap) if amplitudes is None else amplitudes, "amplitude_range", " in m")
    if not 0 < start < stop < np.inf:
        raise ClearanceError(f"amplitude_range must be > 0 m and the second one larger, got {start:g} and {stop:g}")
    return start, stop


def _backbone(follower: NonlinearMode, mode: int, motions: list[PeriodicMotion], ended: str) -> Backbone:
    """Expand motions of the modes to the quantities of a backbone."""
    system = follower.system
    rig, model, n = system.rig, system.driven.model, system.rig.n_rows
    omega, damping, harmonics = map(np.array, zip(*(follower.unscaled(each.parameter, each.z) for each in motions)))
    modes = complex_amplitudes(follower.vectors @ harmonics)
    force = complex_amplitudes(np.array([motion.force for motion in motions]))
    i_omega, x = 1j * np.arange(follower.harmonics + 1) * omega[:, None, None], system.driven.points @ modes
    directions = np.array([sensor.unit_direction for sensor in rig.sensors]).reshape(-1, 3)
    first, second = n + rig.end_rows.T
    power = 2 * damping * omega**2 * np.sum(np.abs(modes[:, :, 1]) ** 2, axis=1)
    with np.errstate(divide="ignore"):
        level = power / np.abs(modes[:, :, 1] @ model.input(system.kind))
    return Backbone(
        system.model, mode, follower.row, omega / (2 * np.pi), damping, level,
        acceleration_mask(rig)[:, None] * (model.at_sensors @ modes * i_omega**2),
        model.directed(sensor_points(rig), directions) @ modes, x[:, :n], force[:, first] + force[:, second],
        system.fillings(omega, x, force), ended, tuple(rig.sensor_labels),
        tuple(rig.probe_labels if rig.moves_across else rig.clearance_labels),
    )  # fmt: skip
