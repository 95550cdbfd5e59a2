"""Quiet beginnings of records: from rest to where the shaft comes near a wall, and the linear rig's response to them.

Until then the rig is nearly linear. A record begins at rest, so the model's response to the measured excitation is
compared with the record line by line, without leakage and however short the piece is: at complex frequencies
ω - iσ, where the response has died away by the end of the transform (Wilcox, Int. J. Control 27, 1978), cut to the
piece and faded out as the record is.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from ..beam import ModalModel
from ..io.dataset import Record
from ..rig import Rig
from ..signals.response import Response

__all__ = ["Piece", "Reading", "motion", "quiet_pieces"]

NEAR = 0.75
"""of the way to a wall: so far a record is quiet"""
SHORTEST, LONGEST = 1.0, 16.0
"""s, of a piece"""
FADE = 0.3
"""s, the end of a piece that is faded out"""
WIDER = 1.1
"""upper end of the simulated band over that of the compared one"""
WRAPPED = 1e-4
"""what is left, by the damping of the complex frequency, of a response at the end of its transform"""


@dataclass(frozen=True, eq=False)
class Reading:
    """The linear rig as instruments see it."""

    model: ModalModel
    """its modes, without grease; rows of sensors and bushings are those of ``model.rig``"""
    stiffness: np.ndarray
    """(n_bushings,) of the grease, N/m"""
    damping: np.ndarray
    """(n_bushings,) of the grease, N s/m"""
    loss: np.ndarray
    """(n_bushings,) share of the stiffness that friction in the grease loses up to ``lowest``; beyond, it falls as
    1/ω"""
    lowest: float
    """1/s, of the lowest mode: its motion is large and slides, the small quick motion on top of it hardly does"""
    probes: np.ndarray
    """(n_probes, n) displacement that the probes read; (0, n) without probes"""


def motion(reading: Reading, kind: str, omega: np.ndarray) -> np.ndarray:
    """Modes' displacement (n_f, n) per unit of excitation at complex frequencies ω - iσ (n_f,), 1/s.

    The grease is a spring with friction and a dashpot at each bushing: q = R g - R Bᵀ (1 + κ B R Bᵀ)⁻¹ κ B R g, with
    the receptance R of the structure (Woodbury).
    """
    model = reading.model
    at, load = model.at_bushings, model.input(kind)
    receptance = model.receptance(omega)
    if receptance.ndim == 2:
        free, through = receptance * load, receptance[:, :, None] * at.T
    else:
        free, through = receptance @ load, receptance @ at.T
    if not len(at):
        return free
    friction = 1j * reading.loss / np.maximum(np.abs(omega.real) / reading.lowest, 1.0)[:, None]
    kappa = reading.stiffness * (1 + friction) + 1j * omega[:, None] * reading.damping
    inner = kappa[:, :, None] * (at @ through)
    inner[:, range(len(at)), range(len(at))] += 1.0
    force = np.linalg.solve(inner, (kappa * (free @ at.T))[:, :, None])
    return free - (through @ force)[:, :, 0]


class Piece:
    """The quiet beginning of a record: spectra of its channels, and those that a linear rig would have."""

    def __init__(self, name: str, response: Response, size: int) -> None:
        self.name, self.kind, fs = name, response.kind, response.fs
        low, high = response.band or (0.0, 0.1 * fs)
        step = max(1, int(fs / (2 * WIDER * high)))
        self.size = size // step * step
        """samples"""
        self.duration = self.size / fs
        """s"""
        fade = int(min(FADE * fs, self.size / 4))
        self._window = np.ones(self.size)
        self._window[-fade:] = 0.5 + 0.5 * np.cos(np.pi * (np.arange(fade) + 0.5) / fade)
        frequency = np.fft.rfftfreq(self.size, 1 / fs)
        self._kept = np.flatnonzero((frequency >= max(low, 1 / self.duration)) & (frequency <= high))
        self.frequency = frequency[self._kept]
        """(n_f,) Hz, lines of the spectra"""
        count = scipy.fft.next_fast_len(2 * self.size // step, real=True)  # coarse samples of the simulated time
        self._shift = -np.log(WRAPPED) * fs / (count * step)
        time = np.arange(self.size) / fs
        excitation = response.excitation[: self.size] * np.exp(-self._shift * time)
        self._input = np.fft.rfft(excitation, count * step)[: count // 2 + 1] / step
        self.omega = 2 * np.pi * np.fft.rfftfreq(count, step / fs) - 1j * self._shift
        """(n_s,) complex frequencies at which the rig is simulated, 1/s"""
        self._count, self._step = count, step
        self._coarse = self._window[::step] * np.exp(self._shift * time[::step])
        channels = [response.acceleration, *([] if response.displacement is None else [response.displacement])]
        measured = np.vstack(channels)[:, : self.size] * self._window
        self.measured = np.fft.rfft(measured, axis=1)[:, self._kept] / step
        """(n_channels, n_f) accelerometers, then probes"""

    def predicted(self, reading: Reading, moved: np.ndarray) -> np.ndarray:
        """Spectra (n_channels, n_f), as ``measured``, of the `motion` (n_s, n) of a rig under this excitation."""
        model = reading.model
        accelerations = -(self.omega**2) * (model.at_sensors @ moved.T)
        if self.kind == "base":
            accelerations += model.sensors_on_base[:, None]
        signals = np.vstack((accelerations, reading.probes @ moved.T)) * self._input
        coarse = np.fft.irfft(signals, self._count, axis=1)[:, : self._coarse.size] * self._coarse
        return np.fft.rfft(coarse, axis=1)[:, self._kept]


def quiet_pieces(records: Sequence[Record], reading: Reading) -> list[Piece]:
    """Quiet beginnings of 1 s or more; where there are no probes, ``reading`` says where the shaft is."""
    found = []
    for record in records:
        response = record.response()
        rig: Rig = record.rig
        most = min(response.excitation.size, int(LONGEST * response.fs))
        size = min(most, _first_near_a_wall(rig, _displacement(response, reading, most)))
        if size >= SHORTEST * response.fs:
            found.append(Piece(record.name, response, size))
    return found


def _first_near_a_wall(rig: Rig, displacement: np.ndarray) -> int:
    lower, upper = np.array([b.walls for b in rig.bushings]).reshape(-1, 2).T[:, :, None]
    near = np.any((displacement > NEAR * upper) | (displacement < NEAR * lower), axis=0)
    return int(np.argmax(near)) if near.any() else near.size


def _displacement(response: Response, reading: Reading, size: int) -> np.ndarray:
    """(n_bushings, size) measured, or else that of the linear rig."""
    if response.displacement is not None:
        return response.displacement[:, :size]
    count = scipy.fft.next_fast_len(2 * size, real=True)
    shift = -np.log(WRAPPED) * response.fs / count
    grow = np.exp(shift * np.arange(size) / response.fs)
    omega = 2 * np.pi * np.fft.rfftfreq(count, 1 / response.fs) - 1j * shift
    moved = motion(reading, response.kind, omega) @ reading.model.at_bushings.T
    spectrum = np.fft.rfft(response.excitation[:size] / grow, count)
    return np.fft.irfft(moved.T * spectrum, count, axis=1)[:, :size] * grow


def with_rows(model: ModalModel, rig: Rig, damping: np.ndarray) -> ModalModel:
    """The same modes with other damping (n,), 1/s, and the places and gains of another rig's instruments."""
    return dataclasses.replace(model, rig=rig, damping=damping)
