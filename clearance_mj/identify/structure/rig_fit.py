"""One fit of a rig to spectra, with unknown forces in its clearances: variable projection and its derivatives."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import scipy.ndimage

from ...core.errors import RecordError
from ...estimate.loss import GroupedHuber
from ...estimate.parameter import Parameter
from ...estimate.problem import LinearisedResiduals, Problem
from ...estimate.solver import StoppingCriteria, solve
from ...rig import Rig
from ..records.prepared import EXCITATION, PreparedRecord
from .couples import WhiteLines, likeliest_end_moment_ratio
from .force_gains import SpectralLines, end_gains, force_gains, gains_at, model_with
from .misfit import RecordMisfit
from .priors import priors, rig_with, with_exact_supports
from .projection import Projection
from .rig_update import RigUpdate
from .spectra import ChannelSpectra, rms

__all__ = ["RigFit", "channel_deviation"]

MODEL_ERROR = 0.01  # of a line's level: error of the model
NOISE_START = 0.01  # of a channel's level: its noise, to start with
ABSENT = 1e6  # times the loudest channel's level: the noise of one that was left out, so that it says nothing
QUIETEST = 1e-4  # of a channel's level: no channel is taken to be quieter
ROUNDS = 3  # fits, each with the weights that the last one showed
STOP = StoppingCriteria(steps=8, decrease=0.0, move=0.05)
"""Of a fit: a step below 0.05 prior standard deviations ends it."""
OUTLYING = 2.0  # standard deviations from which on a line counts less
NOISE_BANDS = (20.0, 60.0, 130.0)  # Hz, between bands in which the noise is estimated
DIFFERENCE = 1e-3  # prior standard deviations, for difference quotients
WORKERS = 2  # threads
END_MOMENT_RATIO = 0.5
"""Of a force, RMS, at most: half the difference of the forces at both ends of a clearance, and of those at its ends and
in its middle, if these are independent and of one size."""
END_MOMENT_RATIOS = END_MOMENT_RATIO * np.array([0.0, 0.03, 0.1, 0.2, 0.4, 0.7, 1.0])
"""That are compared for round clearances."""
COMPARED_LINES = 300  # of each record, by which they are compared
CHANNELWISE = "gain", "position", "delay", "probe_delay", "direction[1]", "direction[2]"
"""Fields on which only the instrument's channel depends."""


def channel_deviation(level: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Return the standard deviation with which lines (n_f, n_channels) count at first."""
    return np.hypot(NOISE_START * level, 3 * MODEL_ERROR * np.abs(measured))


class RigFit:
    """Weighted least squares of a rig's open parameters, with weights that are estimated between the fits.

    Parameters
    ----------
    rig : Rig
        Whose open parameters vary, from where they are.
    records : sequence of PreparedRecord
        Probes take part if all records have them.
    thin : int
        Every so many-th spectral line alone takes part.
    like : RigFit, optional
        A fit of the same records, whose spectra, noise and whitening are taken.
    held : mapping of str to float, optional
        Values by name that stay as they are.

    Raises
    ------
    RecordError
        If there are no more sensors than clearances, or a channel cannot be used.
    """

    def __init__(
        self, rig: Rig, records: Sequence[PreparedRecord], thin: int = 1, like: RigFit | None = None,
        held: Mapping[str, float] | None = None,
    ) -> None:  # fmt: skip
        for record in records:
            record.require_usable(EXCITATION)
        self.probes = all(record.probes for record in records) and bool(rig.bushings)
        n_forces = rig.n_rows
        sensors = min(int(r.present[: len(rig.sensors)].sum()) for r in records) + n_forces * self.probes
        if sensors <= n_forces:
            needed = "clearances" if n_forces == len(rig.bushings) else f"these {n_forces} forces"
            raise RecordError(
                f"{sensors} sensors cannot tell the rig from the unknown forces in {len(rig.bushings)} clearances; "
                f"needs more sensors than {needed}"
            )
        self.rig = rig
        self.records = tuple(record if self.probes else record.without_probes() for record in records)
        self.spectra: list[ChannelSpectra] = like.spectra if like else [ChannelSpectra(r, thin) for r in self.records]
        self.lines = [SpectralLines(s.kind, s.omega, s.tested) for s in self.spectra]
        starts, ends = ([float(s.frequency[i]) for s in self.spectra] for i in (0, -1))
        self.band = min(starts), max(ends)
        """Hz, of all spectral lines"""
        open_parameters = [_limit_to_band(p, self.band) for p in priors(rig, self.band[1], self.probes)]
        self.in_clearances = tuple(p for p in open_parameters if _acts_in_clearance(p.name))
        self.held = dict(held or {})
        parameters = [p for p in open_parameters if p not in self.in_clearances and p.name not in self.held]
        # Free of each line, of which the excitation is a channel and an unknown.
        free = [int(s.present.sum()) - n_forces - 1 for s in self.spectra]
        radius = [OUTLYING * np.sqrt(n / s.correlated_lines) for n, s in zip(free, self.spectra)]
        loss = GroupedHuber(np.repeat(radius, [s.frequency.size for s in self.spectra]))
        self.problem = Problem(parameters, self._residuals, loss=loss, linearise=self._linearised, lanes=False)
        if not like:
            self.noise = [_without_absent(s, channel_deviation(rms(s.measured), s.measured)) for s in self.spectra]
            """(n_f, n_channels) of each record, as standard deviation"""
            self.whitening = [1 / noise[:, :, None] * np.eye(noise.shape[1]) for noise in self.noise]
            """(n_f, n_channels, n_channels) of each record: gives noise and the effect of couples unit variance"""
            return
        self.noise, self.whitening = like.noise, like.whitening

    def run(self, start: Mapping[str, float] | None = None, before: Rig | None = None) -> RigUpdate:
        """Fit, estimate the noise, fit again.

        Parameters
        ----------
        start : mapping of str to float, optional
            Values by name where the fit begins; by default those of the rig.
        before : Rig, optional
            Rig that the update is compared with: the rig file, where this rig is one with more in it.
        """
        at = self.problem.at(start or {})
        projections = self.projected(at)
        first = RigFit(with_exact_supports(before or self.rig), self.records, like=self).projected(None)
        before_fit = [f.fitted(noise) for f, noise in zip(first, self.noise)]
        for round_ in range(ROUNDS):
            if round_:
                self._estimate_noise(projections)
            self._whiten(at, projections)
            solution = solve(self.problem, [at], stop=STOP)
            at = solution.at
            projections = self.projected(at)
        misfit = []
        for s, start_fit, f, noise in zip(self.spectra, before_fit, projections, self.noise):
            spectra = ((part * s.present).T for part in (s.measured, start_fit, f.fitted(noise)))
            misfit.append(RecordMisfit(s.name, s.tested, s.kind, s.duration, s.frequency, s.level, *spectra))
        rig = rig_with(self.rig, self.named(solution.values)).replace(tolerances=self.rig.tolerances)
        return RigUpdate(
            rig, self.rig, self.records, solution.estimates(solution.covariance), tuple(misfit),
            self.records[0].channels, self.probes, self.in_clearances,
        )  # fmt: skip

    def named(self, values: np.ndarray) -> dict[str, float]:
        """Return values (n,) of the open parameters by their names, and those that are held."""
        return self.held | dict(zip((p.name for p in self.problem.parameters), values.tolist()))

    def _gains(self, at: np.ndarray) -> list[np.ndarray]:
        """Gains (n_f, n_channels, n_bushings + 1) of forces and excitation, for each record."""
        return force_gains(self.rig, self.named(self.problem.values(at)), self.probes, self.lines)

    def adapt(self, values: Mapping[str, float]) -> None:
        """Take noise and whitening from the residuals of values by name, as a fit does that ends there."""
        at = self.problem.at(values)
        self._estimate_noise(self.projected(at))
        self._whiten(at, self.projected(at))

    def residuals_of(self, rig: Rig, values: Mapping[str, float]) -> np.ndarray:
        """Return the residuals (n_residuals,) of a rig with values by name, with this fit's weights."""
        gains = force_gains(rig, values, self.probes, self.lines)
        projections = [Projection(g, s.measured, w) for g, s, w in zip(gains, self.spectra, self.whitening)]
        return self._stack([f.residual for f in projections])

    def projected(self, at: np.ndarray | None) -> list[Projection]:
        """Return the projections with the forces that meet each record best; by default on the rig as it is."""
        at = np.zeros(self.problem.size) if at is None else at
        return [Projection(g, s.measured, w) for g, s, w in zip(self._gains(at), self.spectra, self.whitening)]

    def _residuals(self, values: np.ndarray) -> np.ndarray:
        """Residuals (n_points, n_residuals) of all channels, line by line, of values (n_points, n)."""
        return np.array([self._stack([f.residual for f in self.projected(self.problem.at(v))]) for v in values])

    def _stack(self, parts: Sequence[np.ndarray]) -> np.ndarray:
        """Residuals or derivatives (..., n_residuals) of each record's (..., n_f, n_channels)."""
        scaled = [part / np.sqrt(s.correlated_lines) for part, s in zip(parts, self.spectra)]
        return np.concatenate([part.reshape(*part.shape[:-2], -1) for part in scaled], axis=-1)

    def _linearised(self, at: np.ndarray) -> LinearisedResiduals:
        """Residuals and their derivatives (Kaufman); those of all instruments by one difference."""
        fits, changes = self.projected(at), dict[int, list[np.ndarray]]()
        for field in CHANNELWISE:
            parameters = enumerate(self.problem.parameters)
            channels = {i: c for i, p in parameters if (c := self._channel_of(p, field)) is not None}
            steps = self._steps(at, list(channels))
            changes_of_gains = [f.changed(gains) for f, gains in zip(fits, self._gains(at + steps))]
            for i, channel in channels.items():
                is_channel = np.arange(changes_of_gains[0].shape[1]) == channel
                changes[i] = [change * is_channel / steps[i] for change in changes_of_gains]

        def changed(i: int) -> list[np.ndarray]:
            steps = self._steps(at, [i])
            return [f.changed(gains) / steps[i] for f, gains in zip(fits, self._gains(at + steps))]

        others = sorted(set(range(self.problem.size)) - set(changes))
        with ThreadPoolExecutor(WORKERS) as pool:
            changes |= dict(zip(others, pool.map(changed, others)))
        slopes = [-f.without_forces(np.array(c)) for f, c in zip(fits, zip(*(changes[i] for i in sorted(changes))))]
        return LinearisedResiduals(self._stack([f.residual for f in fits]), self._stack(slopes).T)

    def _steps(self, at: np.ndarray, which: list[int]) -> np.ndarray:
        """Steps (n,) of difference quotients, inwards from a bound."""
        steps = np.zeros(at.size)
        steps[which] = np.where(at[which] + 2 * DIFFERENCE > self.problem.high[which], -DIFFERENCE, DIFFERENCE)
        return steps

    def _channel_of(self, parameter: Parameter, wanted: str) -> int | None:
        """Return the channel that alone depends on a parameter; None if there is none."""
        instrument, _, field = parameter.name.partition("].")
        where, _, number = instrument.partition("[")
        if field != wanted or (where not in ("sensors", "probes") and wanted != "probe_delay"):
            return None
        if self.rig.moves_across and where != "sensors" and wanted != "gain":
            return None  # of both probes of a bushing
        sensor = where == "sensors"
        if sensor and wanted == "position" and self.rig.sensors[int(number)].mass:
            return None
        return int(number) + (0 if sensor else len(self.rig.sensors))

    def _estimate_noise(self, projections: Sequence[Projection]) -> None:
        """Take the noise from the last fit's residuals: their median in every band of a channel."""
        for i, (s, f) in enumerate(zip(self.spectra, projections)):
            squares = np.abs(s.measured - f.fitted(self.noise[i])) ** 2 / f.freedom(self.noise[i] * s.present)
            noise, band = np.empty_like(squares), np.digitize(s.frequency, NOISE_BANDS)
            for b in np.unique(band):
                noise[band == b] = np.median(squares[band == b], axis=0) / np.log(2)
            noise = np.maximum(noise, (QUIETEST * rms(s.measured)) ** 2)
            self.noise[i] = _without_absent(s, np.sqrt(noise + (MODEL_ERROR * np.abs(s.measured)) ** 2))

    def _whiten(self, at: np.ndarray, projections: Sequence[Projection]) -> None:
        """Whiten noise, and the effect of where in a clearance the last fit's forces acted, on the last fit's rig.

        That it is of the last fit matters: a fit that could make it grow would take it for its errors.
        """
        values = self.named(self.problem.values(at))
        model = model_with(self.rig, values)
        middle, ends = model.at_bushings, model.ends_by_row
        couples = np.vstack((ends[:, 1] - ends[:, 0], ends.mean(axis=1) - middle))
        gains, coupled = gains_at(model, values, self.probes, self.lines, couples), []
        for g, f, noise, s in zip(gains, projections, self.noise, self.spectra):
            power = scipy.ndimage.uniform_filter1d(np.abs(f.forces[:, :-1, 0]) ** 2, s.force_bandwidth, axis=0)
            coupled.append(g[:, :, :-1] * np.sqrt(np.tile(power, 2))[:, None, :] / noise[:, :, None])
        fraction = self._fraction_of_couples(at, coupled) if self.rig.moves_across else END_MOMENT_RATIO
        for i, (coupled_lines, noise, s) in enumerate(zip(coupled, self.noise, self.spectra)):
            ends = end_gains(model, values, self.probes, self.lines[i], s.in_flanks) / noise[:, :, None]
            coupled_lines = np.concatenate((fraction * coupled_lines, ends), axis=2)
            covariance = np.eye(noise.shape[1]) + coupled_lines @ coupled_lines.conj().transpose(0, 2, 1)
            self.whitening[i] = np.linalg.inv(np.linalg.cholesky(covariance)) / noise[:, None, :]

    def _fraction_of_couples(self, at: np.ndarray, coupled: Sequence[np.ndarray]) -> float:
        parts = zip(self._gains(at), self.noise, self.spectra, coupled)
        lines = [WhiteLines(g / n[:, :, None], s.measured / n, pairs, s.correlated_lines) for g, n, s, pairs in parts]
        compared = [record_lines.thinned(COMPARED_LINES) for record_lines in lines]
        return likeliest_end_moment_ratio(compared, END_MOMENT_RATIOS, OUTLYING)


def _without_absent(spectra: ChannelSpectra, noise: np.ndarray) -> np.ndarray:
    """Noise (n_f, n_channels) with which channels that were left out say nothing."""
    return np.where(spectra.present, noise, ABSENT * rms(spectra.measured).max())


def _limit_to_band(parameter: Parameter, band: tuple[float, float]) -> Parameter:
    """Return a parameter; the frequency of a mode stays in the band, or no farther from it than it began."""
    if not parameter.name.endswith(".frequency"):
        return parameter
    low, high = min(band[0], parameter.start), max(band[1], parameter.start)
    return dataclasses.replace(parameter, low=max(parameter.low, low), high=min(parameter.high, high))


def _acts_in_clearance(name: str) -> bool:
    """Return True if a parameter describes the behaviour of a clearance, not its place."""
    elsewhere = (".position", ".to", ".probe_delay", ".probe_angle")
    return name.startswith("bushings[") and not name.endswith(elsewhere) and ".housing." not in name
