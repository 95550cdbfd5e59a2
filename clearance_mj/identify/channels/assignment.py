"""Assignment of channels to places of a rig, by the likeness of transfer functions to those of drawn rigs.

The drawn rigs have springs in their clearances, between the filling's and the walls', for whatever acts there.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from ...io.channels import UNKNOWN
from ...rig import Rig
from .linear_models import draw_rigs, transfer_functions
from .raw_signals import RawSignals

__all__ = ["Assignment", "MeasurementPoint", "Search"]

DRAWS = 120  # of the rig
KEPT = 12  # draws that fit an assignment best


@dataclass(frozen=True)
class MeasurementPoint:
    """Measurement point of a channel: a sensor, a probe or the excitation of a rig."""

    label: str  #: degree of freedom, "3:+Z"
    quantity: str


@dataclass(frozen=True, eq=False)
class Assignment:
    """The channel at each place."""

    channel: tuple[int, ...]  #: (n_places,) index of the channel; -1: none
    sign: tuple[float, ...]  #: (n_places,) 1, or -1 of a channel that is wired the other way round
    gain: tuple[float, ...]  #: (n_places,) reading over that of the drawn rig, for one reading of the excitation
    draws: tuple[int, ...]  #: drawn rigs whose transfer functions are most like the measured ones, best first
    delay: tuple[float, ...]  #: (n_places,) s, by which the reading comes after that of the drawn rig
    likeness: float  #: to the best of them where lines are coherent, mean over the channels; 1: the same

    @property
    def places(self) -> tuple[int, ...]:
        """Indices of the places that have a channel."""
        return tuple(i for i, channel in enumerate(self.channel) if channel >= 0)


class Search:
    """Assignments of a bench's channels to the places of its rig.

    Parameters
    ----------
    rig : Rig
        The rig.
    signals : RawSignals
        The channels.
    kind : str
        Kind of excitation: "base" or "force".
    band : (float, float)
        Hz.
    """

    def __init__(self, rig: Rig, signals: RawSignals, kind: str, band: tuple[float, float]) -> None:
        self.rig, self.signals, self.kind, self.band = rig, signals, kind, band
        driven = MeasurementPoint(rig.shaker.label(kind), "acceleration" if kind == "base" else "force")
        sensors = (MeasurementPoint(sensor.label, sensor.quantity) for sensor in rig.sensors)
        probes = (MeasurementPoint(label, "displacement") for label in rig.probe_labels)
        self.places = (*sensors, *probes, driven)
        self.frequency, self.cross_spectra = signals.cross_spectra(*band)
        self.drawn = draw_rigs(rig, band[1], DRAWS)

    def may_be(self, channel: int, place: int) -> bool:
        """Return True if the file allows a channel at a place."""
        return self.signals.quantities[channel] in (UNKNOWN, self.places[place].quantity)

    def closest_assignments(self, stretch: float = 1.0, delays: Iterable[float] = (0.0,)) -> list[Assignment]:
        """Return for each channel that may be the excitation the assignment most like the rig, the likeliest first.

        Parameters
        ----------
        stretch : float
            Factor of all frequencies, as of a wrong sampling rate.
        delays : iterable of float
            s, of which each channel has the likeliest.
        """
        models = [transfer_functions(self.rig, d, self.kind, stretch * self.frequency) for d in self.drawn]
        tried, last = np.array([*delays]), len(self.places) - 1
        drivers = (channel for channel in range(len(self.signals.names)) if self.may_be(channel, last))
        assignments = [self._closest(driven, np.array(models), tried) for driven in drivers]
        return sorted(assignments, key=lambda assignment: -assignment.likeness)

    def _closest(self, driven: int, models: np.ndarray, delays: np.ndarray) -> Assignment:
        """Return the best assignment of transfer functions to one channel, over all models (n_draws, n_f, n)."""
        n, last = len(self.signals.names), len(self.places) - 1
        power, coherence = np.einsum("fii->fi", self.cross_spectra).real, self._coherence(driven)
        measured = self.cross_spectra[:, :, driven] / power[:, [driven]]
        likeness, gain, sign, late = np.zeros((4, len(models), n, last))
        undone = np.exp(2j * np.pi * np.outer(self.frequency, delays)) / self.frequency.size
        for i, place in itertools.product(range(n), range(last)):
            if i != driven and self.may_be(i, place):
                ratio = np.abs(measured[:, i]) / np.abs(models[:, :, place])
                gain[:, i, place] = np.exp(np.median(np.log(ratio), axis=1))
                relative = ratio / gain[:, i, place, None]
                phase = np.exp(1j * (np.angle(measured[:, i]) - np.angle(models[:, :, place])))
                similarity = ((coherence[:, i] * np.minimum(relative, 1 / relative) * phase) @ undone).real
                best_at = np.argmax(np.abs(similarity), axis=1)
                peak, late[:, i, place] = similarity[np.arange(len(similarity)), best_at], delays[best_at]
                likeness[:, i, place], sign[:, i, place] = np.abs(peak), np.sign(peak)
        pairs = [scipy.optimize.linear_sum_assignment(-one) for one in likeness]
        best = int(np.argmax([one[pair].sum() for one, pair in zip(likeness, pairs)]))
        assigned = [(i, place) for i, place in zip(*pairs[best]) if likeness[best, i, place] > 0]
        draws = np.argsort([-sum(one[pair] for pair in assigned) for one in likeness], kind="stable")[:KEPT]
        channel, signs, gains, delayed = [-1] * (last + 1), [1.0] * (last + 1), [1.0] * (last + 1), [0.0] * (last + 1)
        for i, place in assigned:
            channel[place], signs[place] = int(i), float(sign[best, i, place])
            gains[place], delayed[place] = float(gain[best, i, place]), float(late[best, i, place])
        channel[last] = driven
        incoherent = [likeness[best][pair] / coherence[:, pair[0]].mean() for pair in assigned]
        mean = float(np.mean(incoherent)) if assigned else 0.0
        return Assignment(tuple(channel), tuple(signs), tuple(gains), tuple(draws.tolist()), tuple(delayed), mean)

    def coherence(self, assignment: Assignment) -> float:
        """Return the mean coherence of the assigned channels with the excitation over the band."""
        *others, driven = (c for c in assignment.channel if c >= 0)
        return float(self._coherence(driven)[:, others].mean())

    def _coherence(self, driven: int) -> np.ndarray:
        """Coherence (n_f, n) of all channels with one."""
        power = np.einsum("fii->fi", self.cross_spectra).real
        return np.asarray(np.abs(self.cross_spectra[:, :, driven]) ** 2 / (power * power[:, [driven]]))
