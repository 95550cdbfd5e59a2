"""The linear rig out of the quiet beginnings of records: model updating by weighted Gauss-Newton with priors.

What `priors` leaves open varies until the spectra of all accelerometers and probes fit, in the sense of least squares
with the distance of every parameter from its prior. A line weighs by the noise found in its channel and band and by
5 % of its level, which stands for what a spring and a dashpot miss of the grease. Friswell and Mottershead, Finite
Element Model Updating in Structural Dynamics, 1995, chapter 8.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize

from ..beam import natural_frequencies, ritz_model
from ..errors import RecordError
from ..io.dataset import Dataset
from ..parameters import Estimates, Parameter
from ..rig import Rig
from ..structure import Beam, Shaft
from ..structure.base import parse_place, ratios_of_modes
from .channels import check_channel
from .priors import LOSS, RATIOS, prepared, priors, rig_with
from .quiet import Piece, Reading, motion, quiet_pieces, with_rows

__all__ = ["Misfit", "QuietError", "RigUpdate", "update_rig"]

MODES = 10
"""of the structure, to which the static shapes are added"""
BEYOND = 1.3
"""of the highest line: modes below have a damping ratio of their own"""
MODEL = 0.05
"""of a line's level: what a linear grease misses"""
LOCAL = 9
"""lines over which the level is taken"""
FLOOR = 0.01
"""of a channel's level: its noise, to start with"""
ROUNDS = 3
"""fits, each with the weights that the last one showed"""
OUTLYING = 3.0
"""standard deviations from which on a line counts less"""
EDGES = (0.0, 20.0, 60.0, 130.0, np.inf)
"""Hz, bands in which the noise is found"""
ALIKE = 5.0
"""Hz, bands in which residuals may be alike"""
STEP = 1e-3
"""prior standard deviations, for differences"""
REUSED = 0.02
"""prior standard deviations, within which slopes are those of another point"""
CHANNELWISE = ("gain", "position")


class QuietError(RecordError):
    """No record has a quiet piece."""


@dataclass(frozen=True, eq=False)
class Misfit:
    """One record's quiet piece: spectra as measured and as the updated rig has them."""

    record: str
    """its name"""
    duration: float
    """s, of the quiet piece"""
    frequency: np.ndarray
    """(n_f,) Hz"""
    measured: np.ndarray
    """(n_channels, n_f) complex, accelerometers, then probes"""
    before: np.ndarray
    """the same of the rig file"""
    fitted: np.ndarray
    """the same of the updated rig"""

    @property
    def share(self) -> np.ndarray:
        """(n_channels,) RMS of what is left over that of the channel."""
        return _rms(self.fitted - self.measured) / _rms(self.measured)


@dataclass(frozen=True, eq=False)
class RigUpdate:
    """A rig updated to the quiet part of its records, and how well it is known."""

    rig: Rig
    """updated; gaps and offsets are those of the rig file"""
    start: Rig
    """the rig file"""
    estimates: Estimates
    """of all that varied, with what was known before as priors; those of probes are no part of the rig"""
    misfit: tuple[Misfit, ...]
    """of each record with a quiet piece"""
    channels: tuple[str, ...]
    """names of the misfits' channels"""
    scale: float
    """residuals over their weights, RMS; the covariance is widened by it where it exceeds 1"""
    probes: bool
    """whether displacement probes took part"""

    @property
    def told(self) -> np.ndarray:
        """(n,) posterior over prior standard deviation: 1 where the records told nothing."""
        return self.estimates.varied_std / np.array([p.prior_std for p in self.estimates.parameters])

    @property
    def only_prior(self) -> tuple[str, ...]:
        """Parameters that the records hardly told: their standard deviation is over 0.9 of the prior's."""
        return tuple(name for name, told in zip(self.estimates.names, self.told) if told > 0.9)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on what not to rely on."""
        words = []
        if not self.probes:
            words.append(
                "without probes: the quiet part was found by the model, and what the grease does is known by the "
                "accelerometers alone"
            )
        if self.only_prior:
            words.append(f"only the prior holds {', '.join(self.only_prior)}")
        return tuple(words)

    def draw(self, n: int, seed: int = 0) -> list[Rig]:
        """Draw n rigs from the covariance, gaps and offsets those of the rig file; ``seed``: of the random numbers."""
        names = self.estimates.names
        return [rig_with(self.start, dict(zip(names, row))) for row in self.estimates.draw(n, seed).tolist()]

    def rows(self) -> list[dict[str, Any]]:
        """Return one row of plain data for each parameter: value, before, standard deviations, what records told."""
        found = self.estimates
        return [
            {"name": p.name, "unit": p.unit, "value": float(v), "std": float(s), "before": p.start,
             "varies": p.transform, "prior_std": p.prior_std, "posterior_std": float(w), "told": float(t)}
            for p, v, s, w, t in zip(found.parameters, found.value, found.std, found.varied_std, self.told)
        ]  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """Return parameters, covariance, misfit and warnings as plain data."""
        return {
            "parameters": self.rows(),
            "covariance": self.estimates.covariance.tolist(),
            "scale": self.scale,
            "pieces": [
                {"record": m.record, "duration": m.duration, "misfit": dict(zip(self.channels, m.share.tolist()))}
                for m in self.misfit
            ],
            "only_prior": list(self.only_prior),
            "warnings": list(self.warnings),
        }


def update_rig(dataset: Dataset) -> RigUpdate:
    """Update a rig to the part of its records in which the shaft stays clear of the walls.

    Each record to identify from counts from its beginning, at which the rig must be at rest, to where a probe first
    comes to three quarters of the way to a wall of the rig file; 16 s at most.

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
        If no record has a quiet piece of 1 s or more, or a channel cannot be used.
    """
    records, rig = dataset.to_identify(), dataset.rig
    for record in records:
        check_channel(f'record "{record.name}": excitation', record.excitation().value, record.fs)
    probes = all(record.response().displacement is not None for record in records) and bool(rig.bushings)
    pieces = quiet_pieces(records, linear_reading(rig, prepared(rig), probes, {}))
    fit = _Fit(rig, _some(pieces), probes)
    if not probes:  # the updated model knows better where the shaft was
        fit.run(1)
        fit = _Fit(rig, _some(quiet_pieces(records, fit.reading(fit.at))), probes)
    return fit.run(ROUNDS)


def _some(pieces: Sequence[Piece]) -> Sequence[Piece]:
    if not pieces:
        raise QuietError(
            "no record to identify from begins with 1 s or more in which the shaft stays clear of its bushings; "
            "record a level that rises from rest, or a low one"
        )
    return pieces


def linear_reading(rig: Rig, whole: Rig, probes: bool, values: dict[str, float]) -> Reading:
    """The linear rig of values by name; ``whole`` is the rig that has them."""
    linear = whole.linear
    ratios = linear.damping_ratios or () if isinstance(linear, Beam | Shaft) else ()
    model = ritz_model(_undamped(rig, values), MODES)
    model = with_rows(model, whole, model.damping + 2 * model.omega * ratios_of_modes(ratios, model.size))
    small = np.array(
        [b.grease.elastic_ratio + (1 - b.grease.elastic_ratio) * b.grease.amplitude for b in whole.bushings]
    )
    stiffness, damping = np.array([(b.grease.stiffness, b.grease.damping) for b in whole.bushings]).reshape(-1, 2).T
    loss = np.array([values.get(f"bushings[{j}].grease.{LOSS}", 0.0) for j in range(small.size)])
    lowest = float(2 * np.pi * natural_frequencies(rig, 1)[0])
    rows = model.at_bushings.copy() if probes else np.zeros((0, model.size))
    for j in range(len(rows)):
        if f"probes[{j}].position" in values:
            name = (parse_place(rig.bushings[j].position) or ("", 0.0))[0]
            at = values[f"probes[{j}].position"]
            rows[j] = model.shapes([f"{name}@{at!r}" if name else at])[0]
        rows[j] *= values.get(f"probes[{j}].gain", 1.0)
    return Reading(model, stiffness * small, damping, loss, lowest, rows)


def _undamped(rig: Rig, values: dict[str, float]) -> Rig:
    """The rig with what its modes depend on alone, and no damping ratios: few different ones are reduced to modes."""
    structural = {n: v for n, v in values.items() if _structural(n)}
    base = prepared(rig)
    if isinstance(base.linear, Beam | Shaft):
        field = "beam" if base.beam else "structure"
        structural |= {f"{field}.damping_ratios[{i}]": 0.0 for i in range(len(base.linear.damping_ratios or ()))}
    return rig_with(rig, structural)


def _structural(name: str) -> bool:
    return name.startswith(("beam", "1/", "structure", "masses")) and "damping_ratios" not in name


class _Fit:
    """Weighted least squares of what is open, in prior standard deviations from where it starts."""

    def __init__(self, rig: Rig, pieces: Sequence[Piece], probes: bool) -> None:
        self.rig, self.pieces, self.probes = rig, pieces, probes
        highest = max(p.frequency[-1] for p in pieces)
        damped = int(np.sum(ritz_model(rig, 2 * RATIOS).omega < 2 * np.pi * BEYOND * highest)) + 1
        self.parameters = [p for p in priors(rig, damped, probes) if not p.name.endswith((".gap", ".offset"))]
        self._model = functools.lru_cache(maxsize=2)(self._evaluated)
        self._slopes: tuple[np.ndarray, list[list[np.ndarray]]] | None = None
        self.width = np.array([p.prior_std for p in self.parameters])
        self.origin = np.array([p._forward(p.start) for p in self.parameters])
        ends = np.array([[p._forward(p.low), p._forward(p.high)] for p in self.parameters])
        self.bounds = (ends - self.origin[:, None]) / self.width[:, None]
        self.at = np.clip(np.zeros(self.width.size), self.bounds[:, 0] + STEP, self.bounds[:, 1] - STEP)
        self.weights = [
            1 / np.hypot(FLOOR * _rms(p.measured)[:, None], MODEL * local_level(p.measured)) for p in pieces
        ]

    def values(self, at: np.ndarray) -> dict[str, float]:
        """By name, SI units."""
        inside = np.clip(at, *self.bounds.T)
        varied = self.origin + self.width * inside
        return {p.name: float(p._inverse(v)) for p, v in zip(self.parameters, varied)}

    def reading(self, at: np.ndarray) -> Reading:
        """The linear rig at a point."""
        values = self.values(at)
        return linear_reading(self.rig, rig_with(self.rig, values), self.probes, values)

    def _evaluated(self, at: tuple[float, ...]) -> tuple[list[np.ndarray], list[np.ndarray]]:
        reading = self.reading(np.array(at))
        moved = [motion(reading, p.kind, p.omega) for p in self.pieces]
        return [p.predicted(reading, q) for p, q in zip(self.pieces, moved)], moved

    def spectra(self, at: np.ndarray) -> list[np.ndarray]:
        """(n_channels, n_f) of each piece."""
        return self._model(tuple(at))[0]

    def residual(self, at: np.ndarray) -> np.ndarray:
        """Of the data over their standard deviations, then the priors'."""
        left = [(y - p.measured) * w for y, p, w in zip(self.spectra(at), self.pieces, self.weights)]
        return np.concatenate((_real(left), at))

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        """Of the residuals; the spectra's slopes are those of the last point, if that is near."""
        if self._slopes is None or np.max(np.abs(at - self._slopes[0])) > REUSED:
            self._slopes = at.copy(), self._differences(at)
        data = [_real([slope * w for slope, w in zip(of, self.weights)]) for of in self._slopes[1]]
        return np.vstack((np.array(data).T, np.eye(at.size)))

    def _differences(self, at: np.ndarray) -> list[list[np.ndarray]]:
        """Slopes of every piece's spectra for each parameter; instruments, each in its own channel, move together."""
        here, moved = self._model(tuple(at))
        found: dict[int, list[np.ndarray]] = {}
        for kind in CHANNELWISE:
            group = {i: c for i, p in enumerate(self.parameters) if (c := self._channel(p, kind)) is not None}
            steps = self._steps(at, list(group))
            reading = self.reading(at + steps)
            there = [p.predicted(reading, q) for p, q in zip(self.pieces, moved)]
            for i, channel in group.items():
                found[i] = [np.zeros_like(y) for y in here]
                for slope, y, z in zip(found[i], there, here):
                    slope[channel] = (y[channel] - z[channel]) / steps[i]
        for i in range(at.size):
            if i not in found:
                step = self._steps(at, [i])
                there = self._evaluated(tuple(at + step))[0]
                found[i] = [(y - z) / step[i] for y, z in zip(there, here)]
        return [found[i] for i in range(at.size)]

    def _steps(self, at: np.ndarray, which: list[int]) -> np.ndarray:
        """(n,) inwards from a bound."""
        steps = np.zeros(at.size)
        steps[which] = np.where(at[which] + STEP > self.bounds[which, 1], -STEP, STEP)
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

    def run(self, rounds: int) -> RigUpdate:
        """Fit, find the noise, fit again."""
        before = self.spectra(np.clip(np.zeros(self.at.size), *self.bounds.T))
        for i in range(rounds):
            if i:
                self._reweigh()
            found = scipy.optimize.least_squares(
                self.residual, self.at, self.jacobian, self.bounds.T, xtol=1e-4, ftol=1e-4, max_nfev=20
            )
            self.at = found.x
        data = found.fun[: -self.at.size]
        scale = float(np.sqrt(np.mean(data**2)))
        wider = max(1.0, scale) * np.sqrt(self._alike())
        rows = found.jac / np.where(np.arange(found.fun.size) < data.size, wider, 1.0)[:, None]
        covariance = np.linalg.inv(rows.T @ rows) * np.outer(self.width, self.width)
        values = self.values(self.at)
        after = self.spectra(self.at)
        misfit = [
            Misfit(p.name, p.duration, p.frequency, p.measured, b, y) for p, b, y in zip(self.pieces, before, after)
        ]
        channels = [f"accelerometer {label}" for label in self.rig.sensor_labels]
        channels += [f"probe {label}" for label in self.rig.probe_labels] if self.probes else []
        estimates = Estimates.of(self.parameters, list(values.values()), covariance)
        whole = rig_with(self.rig, values).replace(tolerances=self.rig.tolerances)
        return RigUpdate(whole, self.rig, estimates, tuple(misfit), tuple(channels), scale, self.probes)

    def _alike(self) -> float:
        """How many lines count as one for the covariance: a rig that misses a mode misses it on many of them.

        Residuals over the phases of what was measured: the variance of their sums in bands of all channels, over that
        of sums of independent ones (the design effect of cluster sampling, Kish 1965).
        """
        sums, squares = 0.0, 0.0
        for piece, y, weight in zip(self.pieces, self.spectra(self.at), self.weights):
            left = (y - piece.measured) * weight * np.exp(-1j * np.angle(piece.measured))
            band = (piece.frequency / ALIKE).astype(int)
            sums += float(sum(abs(left[:, band == b].sum()) ** 2 for b in np.unique(band)))
            squares += float(np.sum(np.abs(left) ** 2))
        return max(1.0, sums / squares)

    def _reweigh(self) -> None:
        """Weights from what the last fit left: its median in every band of a channel, and less for what stands out."""
        for i, (piece, y) in enumerate(zip(self.pieces, self.spectra(self.at))):
            left = np.abs(y - piece.measured)
            noise = np.empty_like(left)
            band = np.digitize(piece.frequency, EDGES)
            for b in np.unique(band):
                noise[:, band == b] = np.sqrt(np.median(left[:, band == b] ** 2, axis=1, keepdims=True) / np.log(2))
            spread = np.hypot(noise, MODEL * local_level(piece.measured))
            self.weights[i] = 1 / (spread * np.sqrt(np.maximum(left / (OUTLYING * spread), 1.0)))


def _real(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Real, then imaginary parts, in one row; each has half of the variance."""
    whole = np.concatenate([part.ravel() for part in parts]) * np.sqrt(2)
    return np.concatenate((whole.real, whole.imag))


def _rms(spectra: np.ndarray) -> np.ndarray:
    """(n_channels,) over the lines."""
    return np.sqrt(np.mean(np.abs(spectra) ** 2, axis=1))


def local_level(spectra: np.ndarray) -> np.ndarray:
    """(n_channels, n_f) local RMS."""
    box = np.ones(LOCAL) / LOCAL
    return np.sqrt(np.array([np.convolve(np.abs(y) ** 2, box, "same") for y in spectra]))
