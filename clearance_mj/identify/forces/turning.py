"""Loads that turn with a shaft, fitted to its records at its turns and their multiples, whatever clearances do there.

With the forces in the clearances unknown, as everywhere else, a load that turns is the common part of the channels:
near once and twice the turns every channel reads y = G θ + U p, with θ the forces and the excitation, and p the cosine
and sine of each load, the same in all records and lines: linear least squares. A run-up passes a frequency once and
later twice per turn, so that both are fitted together. In a probe, the motion in the slow turning that was taken for
its run-out is missing in all records; the clearances' part of it is not known, so that each probe has a small remainder
over the shaft's angle among p.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.fft
import scipy.signal

from ...estimate.evidence import log_evidence
from ...linear import LinearModel, linear_model
from ...rig import Order, Rig, Unbalance
from ...rig.loads import order_forces
from ...signals.keyphasor import ShaftTurning
from ..records.prepared import PreparedRecord

__all__ = [
    "MODES", "TIMES", "TurningFit", "TurningLines", "TurningLoad", "fit_loads", "in_slow_roll", "lines_of", "times_of",
    "turning_inputs",
]  # fmt: skip

MODES = 16  # of each plane
FLANK = 2.0  # s, of the window: where it is flat, it passes through the structure as it is
TIMES = 1.0, 2.0  # multiples of the turns
LINES = 4  # either side of the turns' frequency
NOISE = 0.01  # of a channel's RMS
MODEL_ERROR = 0.01  # of a line's level: error of the model
RAMP_PARTS = 16  # of a ramp, each with one spin for once and one for twice per turn
QUIET = 1e-9  # m/s², of an excitation that was not driven
REMAINDER = 0.005  # of the gap, 1 σ per cosine and sine: a force in the clearance alone would have a larger one
TurningLoad = Unbalance | Order


def turning_inputs(
    model: LinearModel, turning: ShaftTurning, window: np.ndarray, size: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the forces (m, n) on the modes of all loads that turn with a rig's shaft, and their spectra (n_f, m).

    Parameters
    ----------
    model : LinearModel
        Of the rig.
    turning : ShaftTurning
        How the shaft turned.
    window : ndarray, shape (n_t,)
        The window.
    size : int
        Samples of the transform.
    """
    orders = model.rig.orders
    forces = np.vstack((model.unbalance, order_forces(orders, model.directed, model.size)))
    waves = [_unbalance_waves(turning), *(_waves(order.order * turning.angle) for order in orders)]
    return forces, np.hstack([_spectra(wave, window, size) for wave in waves])


def _waves(phase: np.ndarray) -> np.ndarray:
    return np.column_stack((np.cos(phase), np.sin(phase)))


def _unbalance_waves(turning: ShaftTurning) -> np.ndarray:
    """Ω² cos φ + Ω̇ sin φ and Ω² sin φ - Ω̇ cos φ (n_t, 2), the second derivatives of -cos φ and -sin φ."""
    step = (turning.angle[-1] - turning.angle[0]) / np.sum((turning.speed[1:] + turning.speed[:-1]) / 2)
    square, rate = turning.speed[:, None] ** 2, np.gradient(turning.speed, step)[:, None]
    return np.asarray(square * _waves(turning.angle) + rate * _waves(turning.angle - np.pi / 2))


def _spectra(waves: np.ndarray, window: np.ndarray, size: int) -> np.ndarray:
    return np.asarray(scipy.fft.rfft(waves * window[:, None], size, axis=0))


@dataclass(frozen=True, eq=False)
class TurningLines:
    """Lines of a record near once and twice its turns, over their expected errors."""

    record: PreparedRecord
    model: LinearModel
    probes: np.ndarray  #: (n_probes, n) rows
    parts: tuple[LinesPart, ...]
    unbalance_waves: np.ndarray  #: (n_f, 2) of an unbalance
    harmonics: Mapping[float, np.ndarray]
    """(n_f, 2) of cos kφ and sin kφ, by k"""
    noise: np.ndarray  #: (n_f, n_channels)
    basis: np.ndarray  #: (n_f, n_channels, m) orthonormal gains of forces in clearances and of the excitation
    target: np.ndarray  #: (n_f, n_channels) residual of these and of known loads

    def columns(self, loads: Sequence[TurningLoad]) -> np.ndarray:
        """Return the response (n_f, n_channels, 2 (n + 2 n_probes)) to loads and remainders per cosine and sine.

        Parameters
        ----------
        loads : sequence of Unbalance or Order
            Of once or twice the turns.
        """
        for load in loads:
            if load not in self._columns_by_load:
                responses = [self.response(load, forces) for forces in _per_unit(self.model, load)]
                self._columns_by_load[load] = self.without_clearance_forces(np.stack(responses, axis=2))
        return np.concatenate([*(self._columns_by_load[load] for load in loads), self._remainders], axis=2)

    @functools.cached_property
    def _columns_by_load(self) -> dict[TurningLoad, np.ndarray]:
        """Columns (n_f, n_channels, 2) of loads that were asked for."""
        return {}

    @functools.cached_property
    def _remainders(self) -> np.ndarray:
        """(n_f, n_channels, 4 n_probes) of each probe's, by multiples of the turns."""
        n_probes = len(self.probes)
        remainders = np.zeros((*self.noise.shape, len(TIMES), n_probes, 2), dtype=complex)
        for i in range(n_probes):
            remainders[:, i - n_probes - 1, :, i] = np.stack([*self.harmonics.values()], axis=1)
        return self.without_clearance_forces(remainders.reshape(*self.noise.shape, -1))

    def response(self, load: TurningLoad, forces: np.ndarray) -> np.ndarray:
        """Return the response of the channels (n_f, n_channels) to a load.

        Parameters
        ----------
        load : Unbalance or Order
            The load.
        forces : ndarray, shape (2, n)
            On the modes, per cos kφ and sin kφ.
        """
        model, record, spun, times = self.model, self.record, isinstance(load, Unbalance), times_of(load)
        waves = self.unbalance_waves if spun else self.harmonics[times]
        gains = [model.channel_gains(self.probes, record.kind, p.omega, -forces, p.spin[times]) for p in self.parts]
        response = np.einsum("fcu,fu->fc", np.concatenate(gains)[:, :, :-1], waves)
        if record.slow_roll and len(self.probes):
            speed = record.slow_roll
            slow = _roll_motion(model, self.probes, forces * (speed**2 if spun else 1.0), speed, times)
            response[:, -1 - len(self.probes) : -1] -= self.harmonics[times] @ slow
        return response

    def without_clearance_forces(self, shown: np.ndarray) -> np.ndarray:
        """Return rows (n_f, n_channels, n) over their errors, without the part that forces in the clearances explain.

        Parameters
        ----------
        shown : ndarray, shape (n_f, n_channels, n)
            Response of the channels.
        """
        shown = shown / self.noise[:, :, None]
        return np.asarray(shown - self.basis @ (self.basis.conj().transpose(0, 2, 1) @ shown))


class LinesPart(NamedTuple):
    """Neighbouring lines."""

    omega: np.ndarray  # rad/s
    spin: Mapping[float, float]  # rad/s, at which k turns come at their frequency, by k


def times_of(load: TurningLoad) -> float:
    """Return how many times in each turn a load comes, whichever way round."""
    return 1.0 if isinstance(load, Unbalance) else abs(load.order)


def lines_of(
    rig: Rig, record: PreparedRecord, probes: Mapping[str, float], known: Sequence[TurningLoad] = ()
) -> TurningLines:  # fmt: skip
    """Return the lines of a record near once and twice its turns.

    Parameters
    ----------
    rig : Rig
        As updated.
    record : PreparedRecord
        In which the shaft turns.
    probes : mapping of str to float
        Gains and places of the probes.
    known : sequence of Unbalance or Order
        Loads that are subtracted.
    """
    assert record.turning is not None
    n, fs, turning = len(record.signals), record.fs, record.turning
    window = scipy.signal.windows.tukey(n, min(1.0, 2 * FLANK * fs / n))
    omega = 2 * np.pi * scipy.fft.rfftfreq(n, 1 / fs)
    lines, parts = _select_lines(record, omega)
    model, _ = linear_model(rig, MODES).driven(record.tested)
    rows = model.at_probes(probes) if record.probes else np.zeros((0, model.size))
    measured = scipy.fft.rfft(record.signals * window[:, None], axis=0)[lines]
    white = NOISE * np.sqrt(np.mean(record.signals**2, axis=0) * np.sum(window**2)) + QUIET
    noise = np.where(record.present, np.hypot(white, MODEL_ERROR * np.abs(measured)), np.inf)
    gains = [model.channel_gains(rows, record.kind, part.omega, spin=part.spin[1]) for part in parts]
    waves = {times: _spectra(_waves(times * turning.angle), window, n)[lines] for times in TIMES}
    basis = np.linalg.qr(np.concatenate(gains) / noise[:, :, None])[0]
    spun = _spectra(_unbalance_waves(turning), window, n)[lines]
    lines_near = TurningLines(record, model, rows, parts, spun, waves, noise, basis, measured)
    for load in known:
        measured = measured - lines_near.response(load, _load_forces(model, load))
    return dataclasses.replace(lines_near, target=lines_near.without_clearance_forces(measured[:, :, None])[:, :, 0])


def _select_lines(record: PreparedRecord, omega: np.ndarray) -> tuple[np.ndarray, tuple[LinesPart, ...]]:
    """Return the indices of lines near once and twice the turns, and the lines with the spins that they come at.

    A ramp passes a line once. If it does in the window's flank, a structure that lags behind is seen turned: such lines
    are left out.
    """
    assert record.turning is not None
    n, speed, step = len(record.signals), np.abs(record.turning.speed), omega[1]
    sign, ramp = np.sign(record.turning.speed[0]), record.tested.spin is not None and bool(record.tested.spin.rate)
    flank = round(min(FLANK, n / record.fs / 4) * record.fs) if ramp else 0
    inner, outer = speed[flank : n - flank], speed
    margin = LINES * step
    near, lagging = np.zeros((2, omega.size), dtype=bool)
    for times in TIMES:
        low, high = times * inner.min() - margin, times * inner.max() + margin
        first, last = times * outer.min() - margin, times * outer.max() + margin
        near |= (omega >= max(low, step)) & (omega <= high)
        for start, end in ((first, low + 2 * margin), (high - 2 * margin, last)) if ramp else ():
            lagging |= (omega >= start) & (omega <= end)
    lines = np.flatnonzero(near & ~lagging)
    if not ramp:
        return lines, (LinesPart(omega[lines], dict.fromkeys(TIMES, float(sign * speed.mean()))),)
    parts = [part for part in np.array_split(omega[lines], RAMP_PARTS) if part.size]
    spins = [{k: float(sign * np.clip(part.mean() / k, speed.min(), speed.max())) for k in TIMES} for part in parts]
    return lines, tuple(LinesPart(part, spin) for part, spin in zip(parts, spins))


class TurningFit(NamedTuple):
    """Loads by least squares; n = 2 (n_loads + 2 n_probes) cosines and sines of each load and remainder."""

    value: np.ndarray  # (n,)
    covariance: np.ndarray  # (n, n)
    excess: float  # the misfit of one observation: 1 if it is as expected
    evidence: float  # logarithm, but for a constant of the lines


def fit_loads(
    lines: Sequence[TurningLines], loads: Sequence[TurningLoad], largest: Sequence[float], widening: float = 1.0
) -> TurningFit:
    """Return loads by least squares, with a covariance from the contradictions between records, and parts of ramps.

    Source: Liang and Zeger, Biometrika 73, 1986.

    Parameters
    ----------
    lines : sequence of Lines
        Of records.
    loads : sequence of Unbalance or Order
        Loads at their places; their sizes are ignored.
    largest : sequence of float
        Standard deviation of each before the fit, per cosine and sine, kg m or N.
    widening : float
        Factor on the expected errors of all lines.
    """
    gaps = [gap for b in lines[0].model.rig.bushings for gap in (b.gap, b.gap)][: len(lines[0].probes)]
    std = np.repeat([*largest, *(REMAINDER * gap for gap in gaps * len(TIMES))], 2)
    parts, count = [], 0
    for record_lines in lines:
        columns, target = record_lines.columns(loads) * (std / widening), record_lines.target / widening
        stops = np.cumsum([part.omega.size for part in record_lines.parts])[:-1]
        count += 2 * target.shape[0] * (target.shape[1] - record_lines.basis.shape[2])
        for a, b in zip(np.split(columns, stops), np.split(target, stops)):
            rows = a.reshape(-1, std.size)
            parts.append(((rows.conj().T @ rows).real, (rows.conj().T @ b.ravel()).real, float(np.sum(np.abs(b) ** 2))))
    normal, right, power = (np.array(of) for of in zip(*parts))
    information, pull, known = normal.sum(axis=0), right.sum(axis=0), np.eye(std.size)
    inverse = np.linalg.inv(information + known)
    at = inverse @ pull
    cost = float(power.sum() - 2 * pull @ at + at @ information @ at)
    scores = right - normal @ at
    spread = scores.T @ scores * len(parts) / max(len(parts) - 1, 1)
    # Few records may agree by chance: the misfit of single lines counts, too.
    covariance = inverse @ (spread + cost / count * information + known) @ inverse * np.outer(std, std)
    return TurningFit(std * at, covariance, cost / count, log_evidence(cost, at, information))


def in_slow_roll(model: LinearModel, rows: np.ndarray, speed: float, times: float) -> np.ndarray:
    """Return the motion (2, n_rows) under a rig's loads in slow turning per cos kφ and sin kφ, m.

    Parameters
    ----------
    model : LinearModel
        Of the rig.
    rows : ndarray, shape (n_rows, n)
        Displacements.
    speed : float
        rad/s.
    times : int
        k.
    """
    forces = speed**2 * model.unbalance if times == 1 else np.zeros((2, model.size))
    for order in model.rig.orders:
        if times_of(order) == times:
            forces = forces + _load_forces(model, order)
    return _roll_motion(model, rows, forces, speed, times)


def _roll_motion(model: LinearModel, rows: np.ndarray, forces: np.ndarray, speed: float, times: float) -> np.ndarray:
    rotating = (forces[:1] - 1j * forces[1:]).T  # the real part of this e^(ikφ)
    motion = model.responses(rows, rotating, np.array([times * speed]), speed)[0, :, 0]
    return np.array([motion.real, -motion.imag])


def _per_unit(model: LinearModel, load: TurningLoad) -> Iterator[np.ndarray]:
    """Forces (2, n) on the modes of 1 kg m or 1 N, with phases 0 and π/2."""
    order = 1.0 if isinstance(load, Unbalance) else load.order
    for phase in (0.0, math.pi / 2):
        yield _load_forces(model, Order(load.position, order, 1.0, phase=phase))


def _load_forces(model: LinearModel, load: TurningLoad) -> np.ndarray:
    """Forces (2, n) on the modes per cos kφ and sin kφ, with k > 0 though the load may turn against the shaft."""
    if isinstance(load, Unbalance):
        load = Order(load.position, 1.0, load.moment, phase=load.phase)
    return order_forces((load,), model.directed, model.size) * [[1.0], [math.copysign(1.0, load.order)]]
