"""Restoring force of every bushing from the measured signals and the known structure.

The structure without grease and contact is linear and known, so every sensor reads y(ω) = G(ω) θ(ω), with θ the
forces at the bushings and the excitation. Ten sensors give two forces: weighted least squares at each frequency,
without any assumption on the origin of the forces, under random excitation as well as in decays.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import scipy.fft
import scipy.signal
from tqdm import tqdm

from ...clearance.along import forces_along
from ...clearance.law import Law
from ...clearance.record import clearance_records
from ...clearance.walls.slot import penetration
from ...core.errors import RecordError
from ...io.dataset import Dataset, Record
from ...linear import linear_model
from ...rig import Rig
from ..records.prepared import PreparedRecord, prepare, prepared
from .turning import turning_inputs

__all__ = ["RestoringForce", "possible_forces", "restoring_force", "restoring_forces"]

MODES = 16  # of the known structure, to which the static shapes are added
BAND = 0.4  # of fs: up to here the anti-alias filters of engines and rig are flat
TAPER = 0.1  # s, cosine flanks at both ends of a record
SETTLE = 0.3  # s at both ends of a record whose forces are not used
NOISE = 0.01  # of a channel's RMS: noise with which the weights start
QUIETEST = 1e-4  # of a channel's RMS: no channel is taken to be quieter
REWEIGHTINGS = 4
FREEDOM = 1e-6  # of a line, from which on a channel shows its noise
FINER = 4  # factor by which motions are interpolated for laws: contact begins and ends between samples
NO_PROBES_BAND = 4.0  # Hz: without probes, slower motion is not known.
AnyRecord = TypeVar("AnyRecord", Record, PreparedRecord)


@dataclass(frozen=True, eq=False)
class RestoringForce:
    """Force of grease and contact at every bushing, positive against positive displacement; see `restoring_force`.

    A round clearance has two rows where a planar one has one: along y and along z, clearance after clearance. All
    signals are band-limited to ``band`` and fade to zero where ``valid`` is False, at both ends of the record.
    """

    name: str  #: the record's
    rig: Rig  #: that the record was measured on
    fs: float  #: samples per second
    band: tuple[float, float]  #: Hz, in which the forces are known
    time: np.ndarray  #: (n_t,) s
    displacement: np.ndarray
    """(n_bushings, n_t) at the bushings' middles, relative, m: probes and accelerometers fused"""
    velocity: np.ndarray  #: (n_bushings, n_t) m/s
    force: np.ndarray  #: (n_bushings, n_t) N
    force_std: np.ndarray  #: (n_bushings,) standard deviation of the force at any instant, from the sensors' noise, N
    displacement_std: np.ndarray  #: (n_bushings,) the same of the displacement, m
    ends: np.ndarray  #: (n_bushings, 2, n_t) displacements at the bushings' ends, where contact happens, m
    valid: np.ndarray  #: (n_t,) bool
    noise_frequency: np.ndarray  #: (n_f,) Hz
    noise_density: np.ndarray  #: (n_bushings, n_f) one-sided density of the force's noise, N/sqrt(Hz)
    noise: np.ndarray
    """(n_sensors + n_bushings + 1,) estimated noise of accelerometers, probes and excitation, in their units; infinite
    for channels that were left out"""
    spin: np.ndarray | None = None
    """(n_t,) rad/s, of a shaft that turned"""

    @property
    def reach(self) -> np.ndarray:
        """(n_bushings,) largest displacement of a bushing's ends, m."""
        return np.abs(self.ends[:, :, self.valid]).max(axis=(1, 2))

    @property
    def touched(self) -> np.ndarray:
        """(n_bushings,) True where the shaft ever leaves the gap."""
        ends = self.ends[:, :, self.valid]
        return np.array([penetration(x, *b.walls).any() for x, b in zip(ends, self.rig.bushings)], dtype=bool)

    def force_of(self, law: Law) -> np.ndarray:
        """Return the force of filling and contact that a law gives along the measured motion, as ``force``, N.

        Parameters
        ----------
        law : Law
            Its filling acts or, if it has none, the rig's.
        """
        size, fs = self.time.size * FINER, self.fs * FINER
        points = np.concatenate((self.displacement[:, None], self.ends), axis=1)
        x = scipy.signal.resample(points, size, axis=2)
        v, spin = np.gradient(x, axis=2) * fs, 0.0 if self.spin is None else np.repeat(self.spin, FINER)
        records, fine = clearance_records(self.rig, law, 1 / fs), np.empty((len(x), size))
        for j, rows in enumerate(self.rig.clearance_rows):
            displacement, velocity = (np.ascontiguousarray(part[rows].T) for part in (x, v))
            fine[rows] = forces_along(records, j, displacement, velocity, spin).T
        return np.asarray(scipy.signal.resample(fine, self.time.size, axis=1))


def restoring_force(
    record: Record | PreparedRecord, high: float | None = None, low: float = 0.0, rig: Rig | None = None,
    probes: Mapping[str, float] | None = None,
) -> RestoringForce:  # fmt: skip
    """Reconstruct the force of every bushing on the shaft.

    Parameters
    ----------
    record : Record or PreparedRecord
        Accelerometers, excitation and, unless ``low`` is above 0, a displacement probe at every bushing.
    high : float, optional
        Hz, upper end of the band; by default 0.4 fs, where anti-alias filters begin.
    low : float
        Hz, lower end of the band. A band from 0 Hz on needs probes: accelerometers do not show slow motion.
    rig : Rig, optional
        An updated rig, instead of the record's.
    probes : mapping of str to float, optional
        Gains and places of the probes by the names of `priors`, if they are not 1 and the bushings' middles.

    Raises
    ------
    RecordError
        If the record is too short, lacks a channel or has one that cannot be used.
    """
    record = prepared(record)
    require_measurable(record, needs_probes=low <= 0)
    rig, fs, present = rig or record.rig, record.fs, record.present
    measured = np.compress(present, record.signals, axis=1)
    high = BAND * fs if high is None else float(high)
    if not low < high <= fs / 2:
        raise RecordError(f'record "{record.name}": band up to {high:g} Hz must end in 0..{fs / 2:g} Hz, half its rate')
    n, m = measured.shape[0], rig.n_rows
    size = scipy.fft.next_fast_len(n + int(TAPER * fs), real=True)
    frequency = np.fft.rfftfreq(size, 1 / fs)
    inside = (frequency >= low) & (frequency <= high)
    spectrum = np.fft.rfft(measured * flanks(n, fs)[:, None], size, axis=0)[inside]
    omega = 2 * np.pi * frequency[inside]
    model, spin = linear_model(rig, MODES).driven(record.tested)
    rows = model.at_probes(probes or {}) if record.probes else np.zeros((0, model.size))
    gains = np.compress(present, model.channel_gains(rows, record.kind, omega, spin=spin), axis=1)
    motion_gains = model.displacement_gains(model.at_points, record.kind, omega, spin=spin)
    whirl: np.ndarray | float = 0.0  # of the points, under turning loads alone
    if record.turning is not None and (rig.unbalances or rig.orders):
        loads, waves = turning_inputs(model, record.turning, flanks(n, fs), size)
        channel_gains = model.channel_gains(rows, record.kind, omega, -loads, spin)[:, present, :-1]
        spectrum = spectrum - np.einsum("fcu,fu->fc", channel_gains, waves[inside])
        whirl = np.einsum("fru,fu->fr", model.responses(model.at_points, loads.T, omega, spin), waves[inside])
    try:
        sigma, theta, covariance = _solve(gains, spectrum, np.sqrt(np.mean(measured**2, axis=0)), n)
    except np.linalg.LinAlgError:
        raise RecordError(
            f'record "{record.name}": its channels do not tell the forces in the clearances from each other and '
            "from the excitation at every frequency; needs more sensors, away from the shaker"
        ) from None

    def to_time(values: np.ndarray) -> np.ndarray:
        full = np.zeros((frequency.size, values.shape[1]), dtype=complex)
        full[inside] = values
        return np.fft.irfft(full, size, axis=0)[:n].T

    def density(rows: np.ndarray) -> np.ndarray:
        """One-sided density (n_f, n) of the noise of a quantity whose gains on θ are the rows (n_f, n, n_theta)."""
        return 2 / fs * np.einsum("fij,fjk,fik->fi", rows, covariance, rows.conj()).real

    def spread(power: np.ndarray) -> np.ndarray:
        return np.sqrt(power.sum(axis=0) * fs / size)

    all_noise = np.full(present.size, np.inf)  # channels that were left out are noise alone
    all_noise[present] = sigma
    motion = np.einsum("fij,fj->fi", motion_gains, theta) + whirl
    noise = density(np.broadcast_to(np.eye(m, m + 1), (omega.size, m, m + 1)))
    time = np.arange(n) / fs
    return RestoringForce(
        name=record.name, rig=rig, fs=fs, band=(float(low), high), time=time, displacement=to_time(motion[:, :m]),
        velocity=to_time(1j * omega[:, None] * motion[:, :m]), force=to_time(theta[:, :m]), force_std=spread(noise),
        displacement_std=spread(density(motion_gains[:, :m])), ends=to_time(motion[:, m:])[rig.end_rows],
        valid=(time >= SETTLE) & (time <= time[-1] - SETTLE), noise_frequency=frequency[inside],
        noise_density=np.sqrt(noise).T, noise=all_noise, spin=None if record.turning is None else record.turning.speed,
    )  # fmt: skip


def possible_forces(records: Sequence[AnyRecord], find: Callable[[AnyRecord], RestoringForce]) -> list[RestoringForce]:
    """Return the forces of the records that allow it.

    Parameters
    ----------
    records : sequence of Record or PreparedRecord
        Those to look at.
    find : callable
        Returns the forces of a record, or raises a RecordError.
    """
    forces = []
    for record in records:
        with contextlib.suppress(RecordError):
            forces.append(find(record))
    return forces


def restoring_forces(dataset: Dataset, progress: bool = False) -> list[RestoringForce]:
    """Reconstruct the forces in every record to identify."""
    records = tqdm(prepare(dataset), desc="forces", unit="record", disable=not progress)
    return [restoring_force(record) for record in records]


def require_measurable(record: PreparedRecord, needs_probes: bool = True) -> None:
    """Refuse a record from which restoring forces cannot be computed.

    Parameters
    ----------
    record : PreparedRecord
        The record.
    needs_probes : bool
        True if every clearance needs a displacement probe.

    Raises
    ------
    RecordError
        If the rig has no bushings, probes are missing, the record is too short or a channel cannot be used.
    """
    where = f'record "{record.name}"'
    if not record.rig.bushings:
        raise RecordError(f"{where}: its rig has no bushings, so there is no restoring force to find")
    if needs_probes and not record.probes:
        raise RecordError(
            f"{where}: has no displacement probe at every bushing, without which restoring forces are not known "
            "down to 0 Hz; methods bench, output-error and constant need none"
        )
    if record.duration <= 4 * SETTLE:
        raise RecordError(f"{where}: lasts {record.duration:g} s, force balance needs more than {4 * SETTLE:g} s")
    record.require_usable()


def _solve(
    gains: np.ndarray, spectrum: np.ndarray, rms: np.ndarray, rows: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weighted least squares at each frequency; the channels' noise follows from the residuals (white in each).

    Returns the noise (n_channels,), θ (n_f, n_theta) and its covariance (n_f, n_theta, n_theta) for white
    noise of a two-sided power of one per sample.
    """
    sigma = NOISE * rms
    for _ in range(REWEIGHTINGS):
        weighted = gains / sigma[None, :, None]
        adjoint = weighted.conj().swapaxes(1, 2)
        inverse = np.linalg.inv(adjoint @ weighted)
        theta = (inverse @ (adjoint @ (spectrum / sigma)[:, :, None]))[:, :, 0]
        squared_residual = np.abs(spectrum - (gains @ theta[:, :, None])[:, :, 0]) ** 2
        leverage = np.sum((weighted @ inverse) * weighted.conj(), axis=2).real
        free = np.maximum(1 - leverage, 0).sum(axis=0)
        # A channel without redundancy, such as an excitation at a clearance, has no residual and shows no noise.
        known = free > FREEDOM * len(leverage)
        sigma[known] = np.sqrt(squared_residual.sum(axis=0)[known] / (rows * free[known]))
        sigma = np.maximum(sigma, QUIETEST * rms)
    return sigma, theta, inverse


def flanks(n: int, fs: float) -> np.ndarray:
    """Return (n,) window of ones with cosine flanks."""
    ramp = 0.5 - 0.5 * np.cos(np.pi * (np.arange(int(TAPER * fs)) + 0.5) / int(TAPER * fs))
    window = np.ones(n)
    window[: ramp.size], window[n - ramp.size :] = ramp, ramp[::-1]
    return window
