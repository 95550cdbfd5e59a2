"""The linear rig out of whole records, whatever its clearances do: model updating by weighted Gauss-Newton with priors.

The structure without filling and contact is linear. Whatever acts in the clearances, a few forces enter it there, and
more sensors than forces were recorded: at every frequency the forces and the excitation are those that meet the
sensors best (`Projection`), and what the sensors then contradict each other in is the rig's error. So neither a law of
the clearance nor quiet records are needed. What `priors` leaves open varies until that is least, together with the
distance of every parameter from its prior (Friswell and Mottershead, Finite Element Model Updating in Structural
Dynamics, 1995, chapter 8).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.ndimage

from ...beam import ritz_model
from ...core.errors import RecordError
from ...estimate.estimates import Estimates
from ...estimate.parameter import Parameter
from ...io.dataset import Dataset
from ...rig import Rig
from ..records.prepared import EXCITATION, PreparedRecord, prepare
from .force_gains import Lines, displacement_at_ends, force_gains, gains_at, model_with
from .priors import RATIOS, priors, rig_with
from .projection import Projection
from .rig_update import RecordMisfit, RigUpdate
from .spectra import ChannelSpectra, rms

__all__ = ["channel_weights", "rig_file_misfit", "update_from", "update_rig"]

DAMPED_BAND = 1.3  # of the highest line: modes below have a damping ratio of their own
MODEL_ERROR = 0.01  # of a line's level: what the model misses
NOISE_START = 0.01  # of a channel's level: its noise, to start with
QUIETEST = 1e-4  # of a channel's level: no channel is taken to be quieter
ROUNDS = 3  # fits, each with the weights that the last one showed
MAX_STEPS = 8  # Gauss-Newton steps of a fit, and halvings of a step
STEP_TOLERANCE = 0.05  # prior standard deviations: a fit ends with a smaller step
NOISE_BANDS = (20.0, 60.0, 130.0)  # Hz, between bands in which the noise is found
DIFFERENCE = 1e-3  # prior standard deviations, for difference quotients
COUPLE = 0.5
"""Of a force, RMS: half the difference of what acts at both ends of a clearance, and of what acts at its ends and in
its middle, if these are independent and alike."""
CHANNELWISE = ("gain", "position")  # parameters of an instrument, on which its own channel alone depends


def update_rig(dataset: Dataset) -> RigUpdate:
    """Update a rig to its records to identify, with unknown forces in its clearances.

    Parameters
    ----------
    dataset : Dataset
        Rig and records; records with role "validate" are never opened.

    Returns
    -------
    RigUpdate
        The updated rig, all its open parameters with posterior and prior, and what the rig misses.

    Raises
    ------
    RecordError
        If there are no more sensors than clearances, or a channel cannot be used.
    """
    return update_from(dataset.rig, prepare(dataset))


def update_from(rig: Rig, records: Sequence[PreparedRecord]) -> RigUpdate:
    """Update a rig to prepared records, as `update_rig` does.

    Parameters
    ----------
    rig : Rig
        Where the fit begins, and the means of the priors.
    records : sequence of PreparedRecord
        Probes take part if all records have them.

    Raises
    ------
    RecordError
        As `update_rig`.
    """
    return _RigFit(rig, records).run()


def rig_file_misfit(rig: Rig, records: Sequence[PreparedRecord]) -> np.ndarray:
    """Return what a rig as it is misses of each channel over its level (n_channels,), RMS over the records.

    Under the forces in the clearances that meet all sensors best.

    Raises
    ------
    RecordError
        As `update_rig`.
    """
    fit = _RigFit(rig, records)
    found = fit.projected(fit.gains(np.zeros(fit.width.size)))
    residual = [rms(f.fitted(n) - s.measured) / rms(s.measured) for f, n, s in zip(found, fit.noise, fit.spectra)]
    return np.asarray(np.sqrt(np.mean(np.square(residual), axis=0)))


def channel_weights(level: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Return one over the standard deviation with which lines (n_f, n_channels) count at first."""
    return 1 / np.hypot(NOISE_START * level, 3 * MODEL_ERROR * np.abs(measured))


class _RigFit:
    """Weighted least squares of what is open, in prior standard deviations from where it starts."""

    def __init__(self, rig: Rig, records: Sequence[PreparedRecord]) -> None:
        for record in records:
            record.require_usable(EXCITATION)
        self.probes = all(record.probes for record in records) and bool(rig.bushings)
        sensors = len(rig.sensors) + len(rig.bushings) * self.probes
        if sensors <= len(rig.bushings):
            raise RecordError(
                f"{sensors} sensors cannot tell the rig from the unknown forces in {len(rig.bushings)} clearances; "
                "needs more sensors than clearances"
            )
        self.rig = rig
        self.records = tuple(record if self.probes else record.without_probes() for record in records)
        self.spectra = [ChannelSpectra(record) for record in self.records]
        highest = max(s.frequency[-1] for s in self.spectra)
        damped = int(np.sum(ritz_model(rig, 2 * RATIOS).omega < 2 * np.pi * DAMPED_BAND * highest)) + 1
        self.parameters = [p for p in priors(rig, damped, self.probes) if not _acts_in_clearance(p.name)]
        self.width = np.array([p.prior_std for p in self.parameters])
        self.origin = np.array([p.to_varied(p.start) for p in self.parameters])
        ends = np.array([[p.to_varied(p.low), p.to_varied(p.high)] for p in self.parameters]).reshape(-1, 2)
        self.low, self.high = ((ends - self.origin[:, None]) / self.width[:, None]).T
        self.noise = [1 / channel_weights(rms(s.measured), s.measured) for s in self.spectra]
        """(n_f, n_channels) of each record, as standard deviation"""
        self.whitening = [1 / noise[:, :, None] * np.eye(noise.shape[1]) for noise in self.noise]
        """(n_f, n_channels, n_channels) of each record: makes noise and what couples do of unit variance"""

    def run(self) -> RigUpdate:
        """Fit, find the noise, fit again."""
        at = self._inside(np.zeros(self.width.size))
        first = self.projected(self.gains(at))
        before = [f.fitted(noise) for f, noise in zip(first, self.noise)]
        self._whiten(at, first)
        at, found, covariance = self._solved(at)
        for _ in range(ROUNDS - 1):
            self._find_noise(found)
            self._whiten(at, found)
            at, found, covariance = self._solved(at)
        values = self.values(at)
        covariance = covariance * np.outer(self.width, self.width)
        misfit = tuple(
            RecordMisfit(s.name, s.kind, s.duration, s.frequency, s.measured.T, b.T, f.fitted(noise).T)
            for s, b, f, noise in zip(self.spectra, before, found, self.noise)
        )
        return RigUpdate(
            rig=rig_with(self.rig, values).replace(tolerances=self.rig.tolerances), start=self.rig,
            records=self.records,
            estimates=Estimates.of(self.parameters, list(values.values()), covariance), misfit=misfit,
            channels=self.records[0].channels, probes=self.probes,
        )  # fmt: skip

    def values(self, at: np.ndarray) -> dict[str, float]:
        """Values by name, SI units."""
        varied = self.origin + self.width * np.clip(at, self.low, self.high)
        return {p.name: float(p.from_varied(v)) for p, v in zip(self.parameters, varied)}

    def gains(self, at: np.ndarray) -> list[np.ndarray]:
        """Gains (n_f, n_channels, n_bushings + 1) of forces and excitation, for each record."""
        return force_gains(self.rig, self.values(at), self.probes, self._lines)

    @property
    def _lines(self) -> Lines:
        return [(s.kind, s.omega) for s in self.spectra]

    def projected(self, gains: Sequence[np.ndarray]) -> list[Projection]:
        """Forces that meet each record best."""
        return [Projection(g, s.measured, w) for g, s, w in zip(gains, self.spectra, self.whitening)]

    def _inside(self, at: np.ndarray) -> np.ndarray:
        return np.clip(at, self.low + DIFFERENCE, self.high - DIFFERENCE)

    def _solved(self, at: np.ndarray) -> tuple[np.ndarray, list[Projection], np.ndarray]:
        """Gauss-Newton steps, halved where they lead up: where it ends, the residuals there, covariance."""
        found = self.projected(self.gains(at))
        cost = self._cost(at, found)
        for _ in range(MAX_STEPS):
            precision, gradient = np.eye(at.size), at.copy()
            for f, slope, spectra in zip(found, self._slopes(at, found), self.spectra):
                weight = f.weight[:, None] / spectra.correlated_lines
                rows = slope.reshape(at.size, -1).conj() * np.broadcast_to(weight, f.residual.shape).ravel()
                precision += (rows @ slope.reshape(at.size, -1).T).real
                gradient += (rows @ f.residual.ravel()).real
            step = self._inside(at - np.linalg.solve(precision, gradient)) - at
            for _ in range(MAX_STEPS):
                there = self.projected(self.gains(at + step))
                if (new := self._cost(at + step, there)) <= cost:
                    break
                step = step / 2
            else:
                break
            at, found, cost = at + step, there, new
            if np.max(np.abs(step), initial=0.0) < STEP_TOLERANCE:
                break
        return at, found, np.linalg.inv(precision)

    def _cost(self, at: np.ndarray, found: Sequence[Projection]) -> float:
        return float(at @ at) + sum(f.cost / s.correlated_lines for f, s in zip(found, self.spectra))

    def _slopes(self, at: np.ndarray, found: Sequence[Projection]) -> list[np.ndarray]:
        """Derivatives (n, n_f, n_channels) of each record's residual; those of all instruments by one difference."""
        of_instruments: dict[int, int] = {}
        slopes = [np.empty((at.size, *f.residual.shape), dtype=complex) for f in found]
        for field in CHANNELWISE:
            group = {i: c for i, p in enumerate(self.parameters) if (c := self._channel(p, field)) is not None}
            steps = self._steps(at, list(group))
            for slope, f, moved in zip(slopes, found, self.gains(at + steps)):
                change = f.changed(moved)
                for i, channel in group.items():
                    slope[i] = 0.0
                    slope[i, :, channel] = change[:, channel] / steps[i]
            of_instruments |= group
        for i in sorted(set(range(at.size)) - set(of_instruments)):
            steps = self._steps(at, [i])
            for slope, f, moved in zip(slopes, found, self.gains(at + steps)):
                slope[i] = f.changed(moved) / steps[i]
        return [-f.without_forces(slope) for f, slope in zip(found, slopes)]

    def _steps(self, at: np.ndarray, which: list[int]) -> np.ndarray:
        """Steps (n,) of difference quotients, inwards from a bound."""
        steps = np.zeros(at.size)
        steps[which] = np.where(at[which] + 2 * DIFFERENCE > self.high[which], -DIFFERENCE, DIFFERENCE)
        return steps

    def _channel(self, parameter: Parameter, wanted: str) -> int | None:
        """Channel that alone depends on a parameter."""
        instrument, _, field = parameter.name.partition("].")
        where, _, number = instrument.partition("[")
        if field != wanted or where not in ("sensors", "probes"):
            return None
        sensor = where == "sensors"
        if sensor and wanted == "position" and self.rig.sensors[int(number)].mass:
            return None
        return int(number) + (0 if sensor else len(self.rig.sensors))

    def _find_noise(self, found: Sequence[Projection]) -> None:
        """Take the noise from the last fit's residuals: their median in every band of a channel."""
        for i, (s, f) in enumerate(zip(self.spectra, found)):
            squares = np.abs(s.measured - f.fitted(self.noise[i])) ** 2 / f.freedom(self.noise[i])
            noise, band = np.empty_like(squares), np.digitize(s.frequency, NOISE_BANDS)
            for b in np.unique(band):
                noise[band == b] = np.median(squares[band == b], axis=0) / np.log(2)
            noise = np.maximum(noise, (QUIETEST * rms(s.measured)) ** 2)
            self.noise[i] = np.sqrt(noise + (MODEL_ERROR * np.abs(s.measured)) ** 2)

    def _whiten(self, at: np.ndarray, found: Sequence[Projection]) -> None:
        """Whiten noise, and what depends on where in a clearance the last fit's forces acted, on the last fit's rig.

        That it is of the last fit matters: a fit that could make it grow would take it for its errors.
        """
        values = self.values(at)
        model = model_with(self.rig, values)
        middle, ends = model.at_bushings, displacement_at_ends(model)
        couples = np.vstack((ends[:, 1] - ends[:, 0], ends.mean(axis=1) - middle))
        gains = gains_at(model, values, self.probes, self._lines, couples)
        for i, (g, f, noise) in enumerate(zip(gains, found, self.noise)):
            power = np.abs(f.forces[:, :-1, 0]) ** 2
            power = scipy.ndimage.uniform_filter1d(power, self.spectra[i].force_bandwidth, axis=0)
            moved = g[:, :, :-1] * COUPLE * np.sqrt(np.tile(power, 2))[:, None, :] / noise[:, :, None]
            covariance = np.eye(noise.shape[1]) + moved @ moved.conj().transpose(0, 2, 1)
            self.whitening[i] = np.linalg.inv(np.linalg.cholesky(covariance)) / noise[:, None, :]


def _acts_in_clearance(name: str) -> bool:
    """Whether a parameter is what happens in a clearance, not where it is."""
    return name.startswith("bushings[") and not name.endswith((".position", ".to"))
