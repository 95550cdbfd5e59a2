"""Distance of an updated rig from what noise and priors explain: the measure that compares causes of a misfit."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....core.errors import ClearanceError
from ....rig import Rig
from ...records.prepared import PreparedRecord
from ..force_gains import SpectralLines, force_gains
from ..misfit import RecordMisfit
from ..rig_fit import channel_deviation
from ..rig_update import RigUpdate
from ..spectra import rms
from ..updating import update_from

__all__ = ["Assessment", "Fault", "assess", "channel_of", "distance", "predicted_spectra"]

SUSPECT_MISFIT = 4.0  # % of a channel's level, from which on it is suspicious; of sound benches 0.6 to 1.5
SUSPECT_SHIFT = 4.0  # prior standard deviations, from which on a parameter is suspicious; of sound benches up to 2.1
CORRELATED_LINES = 20.0  # lines that count as one
COMPARED_LINES = 1500  # of all records, by which corrections are compared before the rig is updated with them
SOUND_SHARE = 0.7  # of the channels must fit for the rig to be sound


@dataclass(frozen=True)
class Fault:
    """A cause of a dataset's misfit, in words."""

    cause: str  #: the fault and its place
    evidence: str  #: the correction, and how much it explains
    factor: float | None = None  #: by which the number in question is to be multiplied, if it is one

    def __str__(self) -> str:
        return f"{self.cause}: {self.evidence}"


@dataclass(frozen=True, eq=False)
class Assessment:
    """Misfit of an updated rig, with the channels and parameters that stand out."""

    update: RigUpdate  #: of the records as they are, or with one cause put right

    @property
    def rig(self) -> Rig:
        """The rig that was updated."""
        return self.update.start

    @functools.cached_property
    def misfit(self) -> np.ndarray:
        """(n_channels,) % of each channel's level that is missed."""
        return 100 * self.update.relative_error

    @functools.cached_property
    def measured(self) -> list[np.ndarray]:
        """(n_f, n_channels) some lines of each record that has all channels; none if no record has."""
        return [m.measured.T[:: self._step] for m in self._whole]

    @property
    def lines(self) -> list[tuple[str, np.ndarray]]:
        """Of each of these records its name and (n_f,) Hz of these lines."""
        return [(m.record, m.frequency[:: self._step]) for m in self._whole]

    @property
    def frequency(self) -> np.ndarray:
        """(n,) Hz, of these lines."""
        return np.concatenate([frequency for _, frequency in self.lines])

    @property
    def _step(self) -> int:
        return -(-sum(m.frequency.size for m in self._whole) // COMPARED_LINES)

    @functools.cached_property
    def _whole(self) -> list[RecordMisfit]:
        return [m for m in self.update.misfit if m.is_whole]

    def gains(self, rig: Rig, values: Mapping[str, float]) -> list[np.ndarray]:
        """Return gains of unknown forces and the excitation on these lines, of a rig with values of its parameters."""
        lines = [SpectralLines(m.kind, m.omega[:: self._step], m.tested) for m in self._whole]
        return force_gains(rig, values, self.update.probes, lines)

    @functools.cached_property
    def shift(self) -> dict[str, float]:
        """Of each parameter of the rig as drawn, from its prior's mean in prior standard deviations."""
        estimates = self.update.estimates
        drawn = self.update.structure.parameters or estimates.names
        fitted = [(p, v) for p, v in zip(estimates.parameters, estimates.value) if p.name in drawn]
        return {p.name: (p.to_varied(v) - p.to_varied(p.start)) / p.prior_std for p, v in fitted}

    @functools.cached_property
    def cost(self) -> float:
        """-2 ln of the posterior at its maximum, the noise of each channel being open: Σ n ln(1 + misfit²) + Σ z²."""
        lines = 2 * max(m.frequency.size for m in self.update.misfit) / CORRELATED_LINES
        return float(lines * np.sum(np.log1p(self.misfit**2)) + sum(z**2 for z in self.shift.values()))

    @functools.cached_property
    def suspects(self) -> tuple[int, ...]:
        """Channels that stand out, by themselves or by their place or gain."""
        shifted = {channel_of(name, self.rig) for name, z in self.shift.items() if abs(z) > SUSPECT_SHIFT}
        return tuple(i for i, misfit in enumerate(self.misfit) if misfit > SUSPECT_MISFIT or i in shifted)

    @functools.cached_property
    def wrong(self) -> tuple[str, ...]:
        """Parameters of the rig itself that stand out."""
        return tuple(n for n, z in self.shift.items() if abs(z) > SUSPECT_SHIFT and channel_of(n, self.rig) is None)

    @property
    def sound(self) -> bool:
        """True if most channels fit and the rig itself is near its file."""
        return float(np.quantile(self.misfit, SOUND_SHARE)) <= SUSPECT_MISFIT and not self.wrong

    @property
    def unexplained(self) -> str:
        """Channels and parameters that stand out, in words; "" if none do."""
        parts = []
        if self.suspects:
            names = ", ".join(self.update.channels[i] for i in self.suspects)
            parts.append(f"{names}, by up to {self.misfit[list(self.suspects)].max():.0f} % of the level")
        if self.wrong:
            shifts = ", ".join(f"{name} by {abs(self.shift[name]):.1f}" for name in self.wrong)
            parts.append(f"prior standard deviations from the rig file: {shifts}")
        return "; ".join(parts)


def assess(rig: Rig, records: Sequence[PreparedRecord]) -> Assessment | None:
    """Update a rig to records and assess it; None if that cannot be."""
    try:
        return Assessment(update_from(rig, records))
    except ClearanceError:
        return None


def predicted_spectra(
    gains: list[np.ndarray], measured: list[np.ndarray], without: tuple[int, ...] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Return weights (n, n_channels) of all records' lines, and spectra by the forces that meet the channels best.

    Channels ``without`` do not count for the forces.
    """
    stacked_gains, spectra = np.vstack(gains), np.vstack(measured)
    level = [np.broadcast_to(rms(m), m.shape) for m in measured]
    weights = 1 / channel_deviation(np.vstack(level), spectra)
    used = np.setdiff1d(np.arange(spectra.shape[1]), without)
    white, target = stacked_gains[:, used] * weights[:, used, None], (spectra * weights)[:, used, None]
    if white.shape[1] < white.shape[2]:  # fewer channels than forces: the smallest that meet all of them
        return weights, (stacked_gains @ (np.linalg.pinv(white) @ target))[:, :, 0]
    basis, upper = np.linalg.qr(white)
    return weights, (stacked_gains @ np.linalg.solve(upper, basis.conj().transpose(0, 2, 1) @ target))[:, :, 0]


def distance(gains: list[np.ndarray], measured: list[np.ndarray], without: tuple[int, ...] = ()) -> float:
    """Return the sum over the channels, but for some, of the logarithm of their weighted errors."""
    weights, predicted = predicted_spectra(gains, measured, without)
    squares = np.delete(np.abs((predicted - np.vstack(measured)) * weights) ** 2, without, axis=1)
    return float(np.sum(np.log1p(np.mean(squares, axis=0))))


def channel_of(name: str, rig: Rig) -> int | None:
    """Return the channel, accelerometers and then probes, that a parameter of an instrument belongs to."""
    where, _, suffix = name.partition("[")
    number, _, field = suffix.partition("].")
    if where not in ("sensors", "probes") or field not in ("gain", "position"):
        return None
    return int(number) + (len(rig.sensors) if where == "probes" else 0)
