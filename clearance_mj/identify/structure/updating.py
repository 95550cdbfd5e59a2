"""The linear rig out of whole records, whatever its clearances do: model updating by weighted Gauss-Newton with priors.

The structure without grease and contact is linear. Whatever acts in the clearances, a few forces enter it there, and
more sensors than forces were recorded: at every frequency the forces and the excitation are those that meet the
sensors best (variable projection; Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973), and what the sensors then
contradict each other in is the rig's error. So neither a law of the clearance nor quiet records are needed. What
`priors` leaves open varies until that is least, together with the distance of every parameter from its prior
(Friswell and Mottershead, Finite Element Model Updating in Structural Dynamics, 1995, chapter 8).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.fft
import scipy.ndimage

from ...beam import ModalModel, ritz_model
from ...core.errors import RecordError
from ...estimate.estimates import Estimates
from ...estimate.parameter import Parameter
from ...io.dataset import Dataset, Record
from ...rig import Rig
from ...structure import Beam, Shaft
from ...structure.base import ratios_of_modes
from ..forces.restoring import channel_gains, probe_rows
from ..records.channels import check_channel
from .priors import RATIOS, prepared, priors, rig_with

__all__ = ["Misfit", "RigUpdate", "update_rig"]

MODES = 16
"""of the structure, to which the static shapes are added"""
BEYOND = 1.3
"""of the highest line: modes below have a damping ratio of their own"""
WIDER = 1.35
"""upper end of the band over that of the excitation: impacts reach beyond it"""
HIGHEST = 0.15
"""of fs: upper end of the band where that of the excitation is not known"""
LOWEST = 4
"""whole periods in a record, of the slowest line"""
FADE = 0.5
"""s, cosine flanks at both ends of a record; longer ones pass for damping of modes that ring for seconds"""
LEFT = 0.25
"""of a signal at the record's end, by the damping of the complex frequencies (Wilcox, Int. J. Control 27, 1978)"""
LINES = 3000
"""of a record, at most"""
ALIKE = 10.0
"""of the record's own lines that count as one: errors of neighbours are alike"""
MODEL = 0.01
"""of a line's level: what the model misses"""
FLOOR = 0.01
"""of a channel's level: its noise, to start with"""
QUIETEST = 1e-4
"""of a channel's level: no channel is taken to be quieter"""
ROUNDS, STEPS = 3, 8
"""fits, each with the weights that the last one showed, and Gauss-Newton steps of each"""
NEAR = 0.05
"""prior standard deviations: a fit ends with a smaller step"""
OUTLYING = 2.0
"""standard deviations from which on a line counts less"""
EDGES = (20.0, 60.0, 130.0)
"""Hz, between bands in which the noise is found"""
STEP = 1e-3
"""prior standard deviations, for differences"""
APART = 0.5
"""of a force, RMS: half the difference of what acts at both ends of a clearance, and of what acts at its ends and in
its middle, if these are independent and alike"""
BROAD = 50.0
"""Hz, over which the size of a force is a mean: what impacts do is broad, and follows no single resonance"""
CHANNELWISE = ("gain", "position")
EXCITATION = "excitation"
SUSPECT = 0.1
"""of a channel: a larger misfit is said"""


@dataclass(frozen=True, eq=False)
class Misfit:
    """One record: spectra as measured, and as rigs under the forces that meet all sensors best have them."""

    record: str
    """its name"""
    kind: str
    """of excitation"""
    duration: float
    """s"""
    frequency: np.ndarray
    """(n_f,) Hz"""
    measured: np.ndarray
    """(n_channels, n_f) complex, accelerometers, then probes, then the excitation"""
    before: np.ndarray
    """the same of the rig file"""
    fitted: np.ndarray
    """the same of the updated rig"""

    @property
    def omega(self) -> np.ndarray:
        """(n_f,) rad/s, the complex frequencies at which the spectra were taken."""
        return _complex(self.frequency, self.duration)

    @property
    def share(self) -> np.ndarray:
        """(n_channels,) RMS of what is left over that of the channel."""
        return _rms((self.fitted - self.measured).T) / _rms(self.measured.T)


@dataclass(frozen=True, eq=False)
class RigUpdate:
    """A rig updated to its records, and how well it is known."""

    rig: Rig
    """updated; gaps, offsets and grease are those of the rig file"""
    start: Rig
    """the rig file"""
    estimates: Estimates
    """of all that varied, with what was known before as priors; those of probes are no part of the rig"""
    misfit: tuple[Misfit, ...]
    """of each record"""
    channels: tuple[str, ...]
    """names of the misfits' channels"""
    probes: bool
    """whether displacement probes took part"""

    @property
    def only_prior(self) -> tuple[str, ...]:
        """Parameters of which the records add hardly anything to the prior, as `Estimates.only_prior`."""
        return self.estimates.only_prior

    @property
    def share(self) -> np.ndarray:
        """(n_channels,) what is left of each channel over its level, RMS over the records."""
        return np.sqrt(np.mean([m.share**2 for m in self.misfit], axis=0))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on what not to rely on."""
        words = []
        if not self.probes:
            words.append("without probes: the motion in the clearances is known by the accelerometers alone")
        if self.only_prior:
            words.append(f"only the prior holds {', '.join(self.only_prior)}")
        worst = int(np.argmax(self.share))
        if self.share[worst] > SUSPECT:
            words.append(
                f"the updated rig misses {self.channels[worst]} by {100 * self.share[worst]:.0f} % of its level: the "
                "rig file is wrong in something that it takes for exact, or a sensor is"
            )
        return tuple(words)

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name, SI units."""
        return dict(zip(self.estimates.names, self.estimates.value.tolist()))

    def draw(self, n: int, seed: int = 0) -> list[Rig]:
        """Draw rigs from the covariance, gaps and offsets those of the rig file.

        Parameters
        ----------
        n : int
            How many.
        seed : int
            Of the random numbers.
        """
        names = self.estimates.names
        return [rig_with(self.start, dict(zip(names, row))) for row in self.estimates.draw(n, seed).tolist()]

    def to_dict(self) -> dict[str, Any]:
        """Return parameters, covariance, misfit and warnings as plain data."""
        return {
            "parameters": self.estimates.beside_priors(),
            "covariance": self.estimates.covariance.tolist(),
            "records": [
                {"record": m.record, "duration": m.duration, "misfit": dict(zip(self.channels, m.share.tolist()))}
                for m in self.misfit
            ],
            "only_prior": list(self.only_prior),
            "warnings": list(self.warnings),
        }


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
    records, rig = dataset.to_identify(), dataset.rig
    for record in records:
        check_channel(f'record "{record.name}": excitation', record.excitation().value, record.fs)
    probes = all(record.response().displacement is not None for record in records) and bool(rig.bushings)
    sensors = len(rig.sensors) + len(rig.bushings) * probes
    if sensors <= len(rig.bushings):
        raise RecordError(
            f"{sensors} sensors cannot tell the rig from the unknown forces in {len(rig.bushings)} clearances; needs "
            "more sensors than clearances"
        )
    return _Fit(rig, [_Spectra(record, probes) for record in records], probes).run()


class _Spectra:
    """Channels of a record at complex frequencies."""

    def __init__(self, record: Record, probes: bool) -> None:
        response, fs = record.response(), record.fs
        self.name, self.kind, self.duration = record.name, response.kind, response.duration
        displacement = [] if response.displacement is None or not probes else [response.displacement]
        signals = np.vstack([response.acceleration, *displacement, response.excitation])
        n = signals.shape[1]
        count, time = scipy.fft.next_fast_len(2 * n, real=True), np.arange(n) / fs
        fade = int(min(FADE * fs, n / 4))
        window = np.exp(np.log(LEFT) * time / self.duration)
        flank = 0.5 - 0.5 * np.cos(np.pi * (np.arange(fade) + 0.5) / fade)
        window[:fade] *= flank
        window[n - fade :] *= flank[::-1]
        low, high = response.band or (0.0, HIGHEST * fs / WIDER)
        frequency = np.fft.rfftfreq(count, 1 / fs)
        inside = np.flatnonzero(
            (frequency >= max(low, LOWEST / self.duration)) & (frequency <= min(WIDER * high, 0.4 * fs))
        )
        kept = inside[:: -(-inside.size // LINES)]
        self.frequency = frequency[kept]
        """(n_f,) Hz"""
        self.omega = _complex(self.frequency, self.duration)
        self.measured = scipy.fft.rfft(signals * window, count, axis=1)[:, kept].T
        """(n_f, n_channels) accelerometers, probes, excitation"""
        self.broad = 1 + int(BROAD * self.frequency.size / np.ptp(self.frequency))
        """lines"""
        self.alike = max(1.0, ALIKE * self.frequency.size / (self.duration * np.ptp(self.frequency)))


class _Fit:
    """Weighted least squares of what is open, in prior standard deviations from where it starts."""

    def __init__(self, rig: Rig, spectra: Sequence[_Spectra], probes: bool) -> None:
        self.rig, self.spectra, self.probes = rig, spectra, probes
        highest = max(s.frequency[-1] for s in spectra)
        damped = int(np.sum(ritz_model(rig, 2 * RATIOS).omega < 2 * np.pi * BEYOND * highest)) + 1
        self.parameters = [p for p in priors(rig, damped, probes) if not _clearance(p.name)]
        self.width = np.array([p.prior_std for p in self.parameters])
        self.origin = np.array([p.to_varied(p.start) for p in self.parameters])
        ends = np.array([[p.to_varied(p.low), p.to_varied(p.high)] for p in self.parameters]).reshape(-1, 2)
        self.low, self.high = ((ends - self.origin[:, None]) / self.width[:, None]).T
        self.noise = [np.hypot(FLOOR * _rms(s.measured), 3 * MODEL * np.abs(s.measured)) for s in spectra]
        """(n_f, n_channels) of each record, as standard deviation"""
        self.whitening = [1 / noise[:, :, None] * np.eye(noise.shape[1]) for noise in self.noise]
        """(n_f, n_channels, n_channels) of each record: makes noise and what couples do of unit variance"""

    def values(self, at: np.ndarray) -> dict[str, float]:
        """By name, SI units."""
        varied = self.origin + self.width * np.clip(at, self.low, self.high)
        return {p.name: float(p.from_varied(v)) for p, v in zip(self.parameters, varied)}

    def gains(self, at: np.ndarray) -> list[np.ndarray]:
        """Of forces in the clearances and of the excitation: (n_f, n_channels, n_bushings + 1) for each record."""
        return gains_of(self.rig, self.values(at), self.probes, self._lines)

    @property
    def _lines(self) -> list[tuple[str, np.ndarray]]:
        return [(s.kind, s.omega) for s in self.spectra]

    def run(self) -> RigUpdate:
        """Fit, find the noise, fit again."""
        at = self._inside(np.zeros(self.width.size))
        first = self._projected(self.gains(at))
        before = [f.fitted(noise) for f, noise in zip(first, self.noise)]
        self._whiten(at, first)
        at, found, covariance = self._solved(at)
        for _ in range(ROUNDS - 1):
            self._find_noise(found)
            self._whiten(at, found)
            at, found, covariance = self._solved(at)
        covariance = covariance * np.outer(self.width, self.width)
        values = self.values(at)
        channels = [f"accelerometer {label}" for label in self.rig.sensor_labels]
        channels += [f"probe {label}" for label in self.rig.probe_labels] if self.probes else []
        channels.append(EXCITATION)
        estimates = Estimates.of(self.parameters, list(values.values()), covariance)
        whole = rig_with(self.rig, values).replace(tolerances=self.rig.tolerances)
        misfit = [
            Misfit(s.name, s.kind, s.duration, s.frequency, s.measured.T, b.T, f.fitted(noise).T)
            for s, b, f, noise in zip(self.spectra, before, found, self.noise)
        ]
        return RigUpdate(whole, self.rig, estimates, tuple(misfit), tuple(channels), self.probes)

    def _inside(self, at: np.ndarray) -> np.ndarray:
        return np.clip(at, self.low + STEP, self.high - STEP)

    def _solved(self, at: np.ndarray) -> tuple[np.ndarray, list[_Projection], np.ndarray]:
        """Gauss-Newton steps, halved where they lead up: where it ends, what is left there, covariance."""
        found = self._projected(self.gains(at))
        cost = self._cost(at, found)
        for _ in range(STEPS):
            slopes = self._slopes(at, found)
            precision, gradient = np.eye(at.size), at.copy()
            for f, s, spectra in zip(found, slopes, self.spectra):
                counts = f.counts[:, None] / spectra.alike
                rows = s.reshape(at.size, -1).conj() * np.broadcast_to(counts, f.left.shape).ravel()
                precision += (rows @ s.reshape(at.size, -1).T).real
                gradient += (rows @ f.left.ravel()).real
            step = self._inside(at - np.linalg.solve(precision, gradient)) - at
            for _ in range(STEPS):
                there = self._projected(self.gains(at + step))
                if (new := self._cost(at + step, there)) <= cost:
                    break
                step = step / 2
            else:
                break
            at, found, cost = at + step, there, new
            if np.max(np.abs(step), initial=0.0) < NEAR:
                break
        return at, found, np.linalg.inv(precision)

    def _cost(self, at: np.ndarray, found: Sequence[_Projection]) -> float:
        return float(at @ at) + sum(f.cost / s.alike for f, s in zip(found, self.spectra))

    def _projected(self, gains: Sequence[np.ndarray]) -> list[_Projection]:
        return [_Projection(g, s.measured, w) for g, s, w in zip(gains, self.spectra, self.whitening)]

    def _slopes(self, at: np.ndarray, found: Sequence[_Projection]) -> list[np.ndarray]:
        """Of what is left, (n, n_f, n_channels) for each record (Kaufman, BIT 15, 1975); instruments move together."""
        own: dict[int, int] = {}
        slopes = [np.empty((at.size, *f.left.shape), dtype=complex) for f in found]
        for kind in CHANNELWISE:
            group = {i: c for i, p in enumerate(self.parameters) if (c := self._channel(p, kind)) is not None}
            steps = self._steps(at, list(group))
            for slope, f, moved in zip(slopes, found, self.gains(at + steps)):
                change = f.changed(moved)
                for i, channel in group.items():
                    slope[i] = 0.0
                    slope[i, :, channel] = change[:, channel] / steps[i]
            own |= group
        for i in sorted(set(range(at.size)) - set(own)):
            steps = self._steps(at, [i])
            for slope, f, moved in zip(slopes, found, self.gains(at + steps)):
                slope[i] = f.changed(moved) / steps[i]
        return [-f.without_forces(slope) for f, slope in zip(found, slopes)]

    def _steps(self, at: np.ndarray, which: list[int]) -> np.ndarray:
        """(n,) inwards from a bound."""
        steps = np.zeros(at.size)
        steps[which] = np.where(at[which] + 2 * STEP > self.high[which], -STEP, STEP)
        return steps

    def _channel(self, parameter: Parameter, kind: str) -> int | None:
        """Channel that alone depends on a parameter."""
        instrument, _, field = parameter.name.partition("].")
        where, _, number = instrument.partition("[")
        if field != kind or where not in ("sensors", "probes"):
            return None
        sensor = where == "sensors"
        if sensor and kind == "position" and self.rig.sensors[int(number)].mass:
            return None
        return int(number) + (0 if sensor else len(self.rig.sensors))

    def _find_noise(self, found: Sequence[_Projection]) -> None:
        """What the last fit left: its median in every band of a channel."""
        for i, (s, f) in enumerate(zip(self.spectra, found)):
            left = np.abs(s.measured - f.fitted(self.noise[i])) ** 2 / f.freedom(self.noise[i])
            noise, band = np.empty_like(left), np.digitize(s.frequency, EDGES)
            for b in np.unique(band):
                noise[band == b] = np.median(left[band == b], axis=0) / np.log(2)
            noise = np.maximum(noise, (QUIETEST * _rms(s.measured)) ** 2)
            self.noise[i] = np.sqrt(noise + (MODEL * np.abs(s.measured)) ** 2)

    def _whiten(self, at: np.ndarray, found: Sequence[_Projection]) -> None:
        """Noise, and what depends on where in a clearance the last fit's forces acted, on the last fit's rig.

        That it is of the last fit matters: a fit that could make it grow would take it for its errors.
        """
        values = self.values(at)
        model = _model(self.rig, values)
        middle, ends = model.at_bushings, _ends(model)
        shifts = np.vstack((ends[:, 1] - ends[:, 0], ends.mean(axis=1) - middle))
        gains = _gains(model, values, self.probes, self._lines, shifts)
        for i, (g, f, noise) in enumerate(zip(gains, found, self.noise)):
            power = scipy.ndimage.uniform_filter1d(np.abs(f.forces[:, :-1, 0]) ** 2, self.spectra[i].broad, axis=0)
            moved = g[:, :, :-1] * APART * np.sqrt(np.tile(power, 2))[:, None, :] / noise[:, :, None]
            covariance = np.eye(noise.shape[1]) + moved @ moved.conj().transpose(0, 2, 1)
            self.whitening[i] = np.linalg.inv(np.linalg.cholesky(covariance)) / noise[:, None, :]


class _Projection:
    """Forces that meet whitened channels best, and what is left."""

    def __init__(self, gains: np.ndarray, measured: np.ndarray, whitening: np.ndarray) -> None:
        self.whitening, self._gains, self._measured = whitening, gains, measured
        self._basis, upper = np.linalg.qr(whitening @ gains)
        target = whitening @ measured[:, :, None]
        along = self._basis.conj().transpose(0, 2, 1) @ target
        self.forces = np.linalg.solve(upper, along)
        """(n_f, n_bushings + 1, 1)"""
        self.left = (target - self._basis @ along)[:, :, 0]
        """(n_f, n_channels) whitened"""
        free = gains.shape[1] - gains.shape[2]
        size = np.sqrt(np.sum(np.abs(self.left) ** 2, axis=1) / free) / OUTLYING
        self.counts = 1 / np.maximum(size, 1.0)
        """(n_f,) less than 1 for a line that stands out"""
        self.cost = float(np.sum(np.where(size > 1, 2 * size - 1, size**2)) * OUTLYING**2 * free)

    def fitted(self, noise: np.ndarray) -> np.ndarray:
        """(n_f, n_channels) what forces and couples explain, for noise of a standard deviation (n_f, n_channels)."""
        return self._measured - noise**2 * (self.left[:, None, :] @ self.whitening.conj())[:, 0]

    def freedom(self, noise: np.ndarray) -> float:
        """Share of the noise, of a standard deviation (n_f, n_channels), that neither forces nor couples explain."""
        own = self.whitening * noise[:, None, :]
        taken = self._basis.conj().transpose(0, 2, 1) @ own
        return float(np.sum(np.abs(own) ** 2) - np.sum(np.abs(taken) ** 2)) / noise.size

    def changed(self, gains: np.ndarray) -> np.ndarray:
        """(n_f, n_channels) change of what the same forces do."""
        return ((gains - self._gains) @ self.forces)[:, :, 0]

    def without_forces(self, values: np.ndarray) -> np.ndarray:
        """Part of values (n, n_f, n_channels) that no forces explain, whitened."""
        columns = self.whitening @ values.transpose(1, 2, 0)
        return (columns - self._basis @ (self._basis.conj().transpose(0, 2, 1) @ columns)).transpose(2, 0, 1)


def gains_of(
    rig: Rig, values: dict[str, float], probes: bool, lines: Sequence[tuple[str, np.ndarray]]
) -> list[np.ndarray]:
    """Of forces in the clearances and of the excitation: (n_f, n_channels, n_bushings + 1) for each kind and omega.

    A force acts half in the clearance's middle, where grease does, and half at its ends, where contact does.
    """
    model = _model(rig, values)
    middle, ends = model.at_bushings, _ends(model)
    return _gains(model, values, probes, lines, (middle + ends.mean(axis=1)) / 2)


def _gains(
    model: ModalModel, values: dict[str, float], probes: bool, lines: Sequence[tuple[str, np.ndarray]], at: np.ndarray
) -> list[np.ndarray]:
    rows = probe_rows(model, values) if probes else np.zeros((0, model.size))
    return [channel_gains(model, rows, kind, omega, at) for kind, omega in lines]


def _ends(model: ModalModel) -> np.ndarray:
    """(n_bushings, 2, n_modes) displacement at both ends of each clearance."""
    return model.at_ends.reshape(-1, 2, model.size)


def _complex(frequency: np.ndarray, duration: float) -> np.ndarray:
    return 2 * np.pi * frequency + 1j * np.log(LEFT) / duration


def _clearance(name: str) -> bool:
    """Whether a parameter is what happens in a clearance, not where it is."""
    return name.startswith("bushings[") and not name.endswith((".position", ".to"))


def _model(rig: Rig, values: dict[str, float]) -> ModalModel:
    """Modes of the structure with values by name, without grease; few different ones are reduced to modes."""
    whole, structural = rig_with(rig, values), {n: v for n, v in values.items() if _structural(n)}
    linear, base = whole.linear, prepared(rig)
    ratios = linear.damping_ratios or () if isinstance(linear, Beam | Shaft) else ()
    if isinstance(linear, Beam | Shaft):
        field = "beam" if base.beam else "structure"
        structural |= {f"{field}.damping_ratios[{i}]": 0.0 for i in range(len(ratios))}
    model = ritz_model(rig_with(rig, structural), MODES)
    damping = model.damping + 2 * model.omega * ratios_of_modes(ratios, model.size)
    return dataclasses.replace(model, rig=whole, damping=damping)


def _structural(name: str) -> bool:
    return name.startswith(("beam", "1/", "structure", "masses")) and "damping_ratios" not in name


def _rms(spectra: np.ndarray) -> np.ndarray:
    """(n_channels,) over the lines (n_f, n_channels)."""
    return np.sqrt(np.mean(np.abs(spectra) ** 2, axis=0))
