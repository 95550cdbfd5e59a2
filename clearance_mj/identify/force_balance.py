"""Force balance: the restoring force of every bushing from what was measured and the known beam.

The shaft without grease and contact is linear and known, so every sensor reads y(ω) = G(ω) θ(ω), with θ the forces at
the bushings and the excitation. Ten sensors tell two forces: weighted least squares at each frequency, without any
assumption on what makes the forces. The gap function and the grease are then regressed on them (physics of Eqs 9-11),
so contact stiffness and damping come out without a describing function, under random excitation as well as in decays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np
import scipy.fft
import scipy.linalg
import scipy.optimize
from tqdm import tqdm

from ..beam import ritz_model
from ..clearance.gap import describing_function, gap
from ..clearance.grease import bouc_wen_step, film_damping
from ..clearance.law import AmplitudeLaw, ConstantLaw, TimeLaw
from ..errors import RecordError
from ..io.dataset import Dataset, Record
from ..rig import Grease, Rig
from .channels import check_channel
from .oscillator import CORRECTIONS, DAMPINGS
from .wavelet import scalogram

__all__ = [
    "ContactParameters",
    "GreaseFit",
    "RestoringForce",
    "amplitude_law",
    "contact_parameters",
    "envelope",
    "force_balance_law",
    "grease_parameters",
    "restoring_force",
    "restoring_forces",
    "ridge_law",
]

MODES = 16
"""cantilever modes of the known beam, to which the static shapes are added"""
BAND = 0.4
"""of fs: up to here the anti-alias filters of engines and rig are flat"""
TAPER = 0.1
"""s, cosine flanks at both ends of a record"""
SETTLE = 0.3
"""s at both ends of a record whose forces are not used"""
NOISE = 0.01
"""of a channel's RMS: noise with which the weights start"""
QUIETEST = 1e-4
"""of a channel's RMS: no channel is taken to be quieter"""
REWEIGHTINGS = 4
MODEL_ERROR = 0.03
"""share of the force's local RMS that a regression takes for error of its model, besides the noise"""
LOCAL = 0.5
"""s over which that RMS is taken, and length of a block of errors that hang together"""
MARGIN = 4
"""samples on either side of a contact that the fit of the grease leaves out"""
FINER = 4
"""factor by which motions are interpolated before the gap function sharpens them"""
WAVELET_CENTRE = 5.0
"""ω0 of the Morlet wavelets"""
PER_OCTAVE = 3
"""wavelets"""
LOWEST = 5.0
"""Hz, lowest of them"""
OVERLAP = 8
"""values of k(t) and c(t) within the length of a window"""
HANN = np.hanning(OVERLAP + 2)[1:-1]
UNSURE = 0.5
"""relative standard deviation of k from which no value is given"""
RELEASES = 3
"""times that the instants of release, where the contact would pull, are found again from k and c"""
RELEASE = 0.03
"""s, of the envelope that an amplitude law follows"""
NODES = 10
"""amplitudes at which an amplitude law holds k and c"""
SMOOTH = 1e-3
"""weight of the change of k and c between amplitudes, so that those the motion never reached hold their neighbours'"""
RIDGE_STEP = 0.05
"""s between the rows of a ridge law"""
RIDGE_WINDOW = 0.3
"""s over which a ridge under random excitation is smoothed"""
LEAST_SHARE = 0.1
"""describing function of the gap below which a ridge does not tell the contact"""
SURE = 3.0
"""standard deviations by which sliding and squeeze film must show, or the grease is taken to have none"""
SLIDE = 0.2
"""of the yield displacement: longest step in which the Bouc-Wen state is advanced"""
FILM_LIMIT = 0.2
"""smallest relative film thickness, as in `Grease`"""


@dataclass(frozen=True, eq=False)
class RestoringForce:
    """Force of grease and contact at every bushing, positive against positive displacement, as `restoring_force` finds.

    All signals are band-limited to ``band`` and fade to zero where ``valid`` is False, at both ends of the record.
    """

    name: str
    """the record's"""
    rig: Rig
    """that the record was measured on"""
    fs: float
    """samples per second"""
    band: tuple[float, float]
    """Hz, in which the forces are known"""
    time: np.ndarray
    """(n_t,) s"""
    displacement: np.ndarray
    """(n_t, n_bushings) at the bushings' middles, relative, m: probes and accelerometers fused"""
    velocity: np.ndarray
    """(n_t, n_bushings) m/s"""
    force: np.ndarray
    """(n_t, n_bushings) N"""
    force_std: np.ndarray
    """(n_bushings,) standard deviation of the force at any instant, from the sensors' noise, N"""
    displacement_std: np.ndarray
    """(n_bushings,) the same of the displacement, m"""
    ends: np.ndarray
    """(n_t, n_bushings, 2) displacements at the bushings' ends, where contact happens, m"""
    valid: np.ndarray
    """(n_t,) bool"""
    noise_frequency: np.ndarray
    """(n_f,) Hz"""
    noise_density: np.ndarray
    """(n_f, n_bushings) one-sided density of the force's noise, N/sqrt(Hz)"""
    noise: np.ndarray
    """(n_sensors + n_bushings + 1,) noise found in the accelerometers, probes and excitation, in their units"""


def restoring_force(record: Record, high: float | None = None) -> RestoringForce:
    """Reconstruct the force of every bushing on the shaft.

    Parameters
    ----------
    record : Record
        With a displacement probe at every bushing.
    high : float, optional
        Hz, upper end of the band in which forces are reconstructed, from 0 Hz on. Default: 0.4 fs, where anti-alias
        filters begin.

    Returns
    -------
    RestoringForce

    Raises
    ------
    RecordError
        If the rig has no bushings, a probe is missing, or a channel is constant, clipped or too short.
    """
    rig, fs = record.rig, record.fs
    measured = _measured(record)
    high = BAND * fs if high is None else float(high)
    if not 0 < high <= fs / 2:
        raise RecordError(f'record "{record.name}": band up to {high:g} Hz must end in 0..{fs / 2:g} Hz, half its rate')
    n = measured.shape[0]
    size = scipy.fft.next_fast_len(n + int(TAPER * fs), real=True)
    frequency = np.fft.rfftfreq(size, 1 / fs)
    inside = frequency <= high
    spectrum = np.fft.rfft(measured * _flanks(n, fs)[:, None], size, axis=0)[inside]
    omega = 2 * np.pi * frequency[inside]
    bushings = rig.bushings
    places = [b.position for b in bushings] + [end for b in bushings for end in b.ends]
    seen, moved = _gains(rig, record.excitation_kind, omega, places)
    sigma, theta, covariance = _solve(seen, spectrum, np.sqrt(np.mean(measured**2, axis=0)), n)

    def back(values):
        full = np.zeros((frequency.size, values.shape[1]), dtype=complex)
        full[inside] = values
        return np.fft.irfft(full, size, axis=0)[:n]

    def density(rows):
        """One-sided density (n_f, n) of the noise of a quantity whose gains on θ are the rows (n_f, n, n_theta)."""
        return 2 / fs * np.einsum("fij,fjk,fik->fi", rows, covariance, rows.conj()).real

    def spread(power):
        return np.sqrt(power.sum(axis=0) * fs / size)

    m = len(bushings)
    motion = np.einsum("fij,fj->fi", moved, theta)
    noise = density(np.broadcast_to(np.eye(m, m + 1), (omega.size, m, m + 1)))
    time = np.arange(n) / fs
    return RestoringForce(
        name=record.name,
        rig=rig,
        fs=fs,
        band=(0.0, high),
        time=time,
        displacement=back(motion[:, :m]),
        velocity=back(1j * omega[:, None] * motion[:, :m]),
        force=back(theta[:, :m]),
        force_std=spread(noise),
        displacement_std=spread(density(moved[:, :m])),
        ends=back(motion[:, m:]).reshape(n, m, 2),
        valid=(time >= SETTLE) & (time <= time[-1] - SETTLE),
        noise_frequency=frequency[inside],
        noise_density=np.sqrt(noise),
        noise=sigma,
    )


def _gains(rig, kind, omega, places):
    """Gains on θ = (forces at the bushings, excitation): of the sensors, probes and excitation; of displacements.

    Returns arrays (n_f, n_channels, n_bushings + 1) and (n_f, n_places, n_bushings + 1).
    """
    model = ritz_model(rig, MODES)
    receptance = 1 / (model.omega**2 - omega[:, None] ** 2 + 1j * omega[:, None] * model.damping)
    at_bushing = model.shapes([b.position for b in rig.bushings])
    base = kind == "base"
    drive = -model.participation if base else model.shapes([rig.shaker.position])[0]
    inputs = np.vstack((-at_bushing, drive)).T  # (n_modes, n_bushings + 1)

    def displacement(positions):
        at = model.shapes(positions)
        products = at[:, None, :] * inputs.T[None]
        return (receptance @ products.reshape(-1, model.size).T).reshape(omega.size, len(at), -1)

    accelerations = -(omega[:, None, None] ** 2) * displacement([s.position for s in rig.sensors])
    accelerations[:, :, -1] += base
    moved = displacement(places)
    excitation = np.zeros((omega.size, 1, inputs.shape[1]))
    excitation[:, :, -1] = 1.0
    return np.concatenate((accelerations, moved[:, : len(rig.bushings)], excitation), axis=1), moved


def _solve(gains, spectrum, rms, rows):
    """Weighted least squares at each frequency; the channels' noise follows from what is left (white in each).

    Returns the noise (n_channels,), θ (n_f, n_theta) and its covariance (n_f, n_theta, n_theta) for white
    noise of a two-sided power of one per sample.
    """
    sigma = NOISE * rms
    for _ in range(REWEIGHTINGS):
        weighted = gains / sigma[None, :, None]
        normal = np.einsum("fci,fcj->fij", weighted.conj(), weighted)
        inverse = np.linalg.inv(normal)
        right = np.einsum("fci,fc->fi", weighted.conj(), spectrum / sigma)
        theta = np.einsum("fij,fj->fi", inverse, right)
        left = np.abs(spectrum - np.einsum("fci,fi->fc", gains, theta)) ** 2
        leverage = np.einsum("fci,fij,fcj->fc", weighted, inverse, weighted.conj()).real
        variance = left.sum(axis=0) / (rows * np.maximum(1 - leverage, 0).sum(axis=0) + 1e-300)
        sigma = np.maximum(np.sqrt(variance), QUIETEST * rms)
    return sigma, theta, inverse


def _measured(record: Record) -> np.ndarray:
    """(n_t, n_sensors + n_bushings + 1) accelerations, probes and the excitation, checked."""
    where = f'record "{record.name}"'
    if not record.rig.bushings:
        raise RecordError(f"{where}: its rig has no bushings, so there is no restoring force to find")
    response = record.response()
    if response.displacement is None:
        raise RecordError(
            f"{where}: has no displacement probe at every bushing; without them neither gap nor grease can be told. "
            "Output error on the accelerometers alone still can be used"
        )
    if response.duration <= 4 * SETTLE:
        raise RecordError(f"{where}: lasts {response.duration:g} s, force balance needs more than {4 * SETTLE:g} s")
    labels = [f"accelerometer {name}" for name in response.responses]
    labels += [f"probe at bushings[{j}]" for j in range(response.displacement.shape[1])] + ["excitation"]
    measured = np.column_stack((response.acceleration, response.displacement, response.excitation))
    for label, signal in zip(labels, measured.T, strict=True):
        check_channel(f"{where}: {label}", signal, response.fs)
    return measured


def _flanks(n, fs):
    """(n,) window of ones with cosine flanks."""
    ramp = 0.5 - 0.5 * np.cos(np.pi * (np.arange(int(TAPER * fs)) + 0.5) / int(TAPER * fs))
    window = np.ones(n)
    window[: ramp.size], window[n - ramp.size :] = ramp, ramp[::-1]
    return window


@dataclass(frozen=True, eq=False)
class GreaseFit:
    """Grease of every bushing, from the forces while the shaft is inside the gap."""

    grease: tuple[Grease, ...]
    """(n_bushings) fitted"""
    names: tuple[str, ...]
    """fitted parameters: k, λ, z (yield displacement), γ/β, c, d/h; without yield and film only k and c"""
    value: np.ndarray
    """(n_bushings, n) their values"""
    std: np.ndarray
    """(n_bushings, n) their standard deviations, from the scatter between blocks of half a second; infinite where
    the force does not depend on the parameter. Of what was left out (λ = 1, d/h = 0), that of the whole model"""
    residual: np.ndarray
    """(n_bushings,) RMS of force that the grease leaves unexplained, as a share of the force's, both weighted"""


def grease_parameters(forces: RestoringForce | Sequence[RestoringForce], kind: str = "bouc-wen") -> GreaseFit:
    """Fit the grease of every bushing to the restoring force while the shaft is not in contact.

    Bouc-Wen (Eq. 9, A = 1, n = 2) with squeeze film: yield, γ/β and film height are varied, the stiffnesses and the
    damping follow by non-negative linear least squares (variable projection, Golub & Pereyra 1973). Sliding or film
    that do not exceed three standard deviations are left out.

    Parameters
    ----------
    forces : RestoringForce or sequence of RestoringForce
        Of one rig. Contact is not needed.
    kind : {"bouc-wen", "linear"}
        "linear": a spring and damper.

    Returns
    -------
    GreaseFit

    Raises
    ------
    RecordError
        If the shaft is in contact nearly all the time.
    """
    forces = _several(forces)
    fits = [_fit_grease(forces, j, kind) for j in range(len(forces[0].rig.bushings))]
    grease, value, std, residual = zip(*fits)
    names = ("k", "c") if kind == "linear" else ("k", "λ", "z", "γ/β", "c", "d/h")
    return GreaseFit(grease, names, np.array(value), np.array(std), np.array(residual))


def _fit_grease(forces, bushing, kind):
    """Grease of one bushing, the values and standard deviations of its parameters, and the residual's share."""
    problem = _GreaseProblem(forces, bushing)
    sliding = film = kind == "bouc-wen"
    value, std, left = problem.fit(sliding, film)
    # What is not surely there would still act beyond the gap, where no sample of this fit lies.
    sliding = sliding and bool(1 - value[1] > SURE * std[1])
    film = film and bool(value[5] > SURE * std[5])
    if kind == "bouc-wen" and not (sliding and film):
        value, again, left = problem.fit(sliding, film)
        std = np.where(np.isfinite(again), again, std)
    beta = 1 / (value[2] ** 2 * (1 + value[3]))  # 0 for an infinite yield displacement
    height = float(problem.gap / value[5]) if film else None
    grease = Grease(*(float(v) for v in (value[0], value[4], value[1], 1.0, beta, value[3] * beta)), film_height=height)
    told = slice(None) if kind == "bouc-wen" else [0, 4]
    return grease, value[told], std[told], _share(left, problem.target)


class _GreaseProblem:
    """Force of one bushing while the shaft is in the gap, against grease of parameters k, λ, z, γ/β, c, d/h."""

    def __init__(self, forces, bushing):
        self.forces, self.bushing = forces, bushing
        self.gap = forces[0].rig.bushings[bushing].gap
        self.weight = [_weight(f, bushing) * _apart(f, bushing) for f in forces]
        self.used = np.concatenate(self.weight) > 0
        self.target = np.concatenate([w * f.force[:, bushing] for w, f in zip(self.weight, forces)])[self.used]
        if np.sum(self.used) < LOCAL * forces[0].fs:
            names = ", ".join(f'"{f.name}"' for f in forces)
            raise RecordError(
                f"record {names}: the shaft is in contact at bushings[{bushing}] nearly all the time, so the grease "
                "cannot be told; add a record of a lower level"
            )
        block = np.concatenate([i * 1e6 + f.time // LOCAL for i, f in enumerate(forces)])
        self.block = np.unique(block[self.used], return_inverse=True)[1]

    def fit(self, sliding, film):
        """Parameters (6,), their standard deviations, infinite for those not varied, and what is left of the force."""

        def shape(p):
            """Yield displacement, γ/β and d/h."""
            yields = (self.gap * np.exp(p[0]), p[1]) if sliding else (np.inf, 0.0)
            return (*yields, p[-1] if film else 0.0)

        def left(p):
            columns = self.columns(shape(p), sliding)
            return self.target - columns @ _non_negative(columns, self.target)

        found = self._search(left, sliding, film)
        yield_, ratio, thin = shape(found)
        share = _non_negative(self.columns((yield_, ratio, thin), sliding), self.target)
        k = share[:-1].sum()
        value = np.array([k, share[0] / k if k > 0 else 1.0, yield_, ratio, share[-1], thin])
        varied = [0, *([1, 2, 3] if sliding else []), 4, *([5] if film else [])]
        std = np.full(6, np.inf)
        std[varied] = _block_std(self._jacobian(value, varied, sliding), left(found), self.block)
        return value, std, left(found)

    def columns(self, shape, sliding):
        """(n, 2 or 3) weighted displacement, Bouc-Wen state if it slides, and film velocity."""
        parts = [w[:, None] * _grease_columns(f, self.bushing, *shape) for w, f in zip(self.weight, self.forces)]
        columns = np.concatenate(parts)[self.used]
        return columns if sliding else columns[:, [0, 2]]

    def _search(self, left, sliding, film):
        """Best yield (log of its share of the gap), γ/β and d/h, as far as they are varied."""
        yields = [(np.log(z), 0.5) for z in (0.3, 1.0)] if sliding else [()]
        starts = [(*y, *u) for y in yields for u in ([(0.0,), (0.4,)] if film else [()])]
        if not starts[0]:
            return np.empty(0)
        limits = [(np.log(0.03), np.log(10.0)), (-0.9, 1.0)] * sliding + [(0.0, 0.9)] * film
        best = starts[int(np.argmin([np.sum(left(p) ** 2) for p in starts]))]
        return scipy.optimize.least_squares(left, best, bounds=tuple(zip(*limits)), xtol=1e-5, ftol=1e-6).x

    def _jacobian(self, value, varied, sliding):
        def model(p):
            k = (p[0] * p[1], p[0] * (1 - p[1])) if sliding else (p[0],)
            return self.columns((p[2], p[3], p[5]), sliding) @ np.array([*k, p[4]])

        size = np.array([1.0, 1.0, self.gap, 1.0, 1.0, 1.0])[varied]
        steps = 1e-4 * np.maximum(np.abs(value[varied]), 1e-3 * size)
        difference = []
        for i, step in zip(varied, steps):
            up, down = value.copy(), value.copy()
            up[i], down[i] = up[i] + step, down[i] - step
            difference.append((model(up) - model(down)) / (2 * step))
        return np.column_stack(difference)


def _grease_columns(force, bushing, yield_, ratio, film):
    """(n_t, 3) displacement, Bouc-Wen state and film velocity of one bushing; ``film`` is d/h."""
    x, v = force.displacement[:, bushing], force.velocity[:, bushing]
    beta = 1 / (yield_**2 * (1 + ratio))
    z = _bouc_wen(x, 1.0, beta, ratio * beta, 2.0, SLIDE * yield_) if yield_ < np.inf else x
    return np.column_stack((x, z, v * _film(x, film / force.rig.bushings[bushing].gap, FILM_LIMIT)))


def _grease_force(force, bushing, grease):
    """(n_t,) force of a grease along the motion, N."""
    x, v = force.displacement[:, bushing], force.velocity[:, bushing]
    z = _bouc_wen(x, grease.amplitude, grease.beta, grease.gamma, grease.exponent, SLIDE * grease.yield_displacement)
    elastic = grease.stiffness * (grease.elastic_ratio * x + (1 - grease.elastic_ratio) * z)
    inverse_film = 1 / grease.film_height if grease.film_height else 0.0
    return elastic + grease.damping * v * _film(x, inverse_film, grease.film_limit)


@numba.njit(cache=True, nogil=True)
def _bouc_wen(x, a, beta, gamma, exponent, longest):
    """(n_t,) state z of Eq. 9 along a motion that starts at rest, in steps of at most ``longest`` m."""
    out = np.empty(x.size)
    z, before = 0.0, 0.0
    for i in range(x.size):
        steps = int(min(abs(x[i] - before) / longest, 200.0)) + 1
        for _ in range(steps):
            z = bouc_wen_step(z, (x[i] - before) / steps, a, beta, gamma, exponent)
        before = x[i]
        out[i] = z
    return out


@numba.njit(cache=True, nogil=True)
def _film(x, inverse_film, limit):
    """(n_t,) growth of the squeeze film's damping."""
    out = np.empty(x.size)
    for i in range(x.size):
        out[i] = film_damping(x[i], 1.0, inverse_film, limit)
    return out


@numba.njit(cache=True, nogil=True)
def envelope(x, fs, release=0.03):
    """Peak-hold with exponential release, A ← max(|x|, A e^(-dt/release)), as `AmplitudeLaw` and the engines define it.

    Parameters
    ----------
    x : ndarray, shape (n_t,)
        Displacement, m.
    fs : float
        Samples per second.
    release : float
        s.

    Returns
    -------
    ndarray, shape (n_t,)
        m.
    """
    out = np.empty(x.size)
    share, a = np.exp(-1.0 / (fs * release)), 0.0
    for i in range(x.size):
        a = max(abs(x[i]), a * share)
        out[i] = a
    return out


def _weight(force, bushing):
    """(n_t,) weights of a regression: noise and the model's error, which grows with the force; 0 at the ends."""
    size = max(1, int(LOCAL * force.fs))
    power = np.convolve(force.force[:, bushing] ** 2, np.full(size, 1 / size), "same")
    return force.valid / (force.force_std[bushing] + MODEL_ERROR * np.sqrt(np.maximum(power, 0)))


def _apart(force, bushing):
    """(n_t,) whether no end of the bushing is, or soon was or will be, in contact."""
    touching = np.any(np.abs(force.ends[:, bushing]) > force.rig.bushings[bushing].gap, axis=1)
    return np.convolve(touching, np.ones(2 * MARGIN + 1), "same") < 0.5


def _non_negative(matrix, target):
    """Least squares with no negative share; by Cholesky, as the rows are very many and the columns scaled."""
    scale = np.sqrt(np.sum(matrix**2, axis=0))
    scale = np.where(scale > 0, scale, 1.0)
    normal = (matrix.T @ matrix) / np.outer(scale, scale) + 1e-12 * np.eye(scale.size)
    r = np.linalg.cholesky(normal).T
    right = scipy.linalg.solve_triangular(r, (matrix.T @ target) / scale, trans="T")
    return scipy.optimize.nnls(r, right)[0] / scale


def _block_std(jacobian, left, block):
    """Standard deviations that hold for errors correlated within blocks (Liang & Zeger 1986, working independence)."""
    scale = np.sqrt(np.sum(jacobian**2, axis=0))
    told = scale > 0
    scale = np.where(told, scale, 1.0)
    scaled = jacobian / scale
    inverse = np.linalg.pinv(scaled.T @ scaled)
    scores = np.zeros((block.max() + 1, jacobian.shape[1]))
    np.add.at(scores, block, scaled * left[:, None])
    count = scores.shape[0]
    covariance = inverse @ scores.T @ scores @ inverse * count / max(count - jacobian.shape[1], 1)
    return np.where(told, np.sqrt(np.abs(np.diag(covariance))) / scale, np.inf)


def _share(left, target):
    return float(np.sqrt(np.sum(left**2) / np.sum(target**2)))


def _several(forces) -> list[RestoringForce]:
    return [forces] if isinstance(forces, RestoringForce) else list(forces)


@dataclass(frozen=True, eq=False)
class ContactParameters:
    """Contact stiffness and damping over time, as `contact_parameters` finds them; nan where there is no contact."""

    time: np.ndarray
    """(n,) middles of the windows, s"""
    k: np.ndarray
    """(n, n_bushings) N/m"""
    c: np.ndarray
    """(n, n_bushings) N s/m"""
    k_std: np.ndarray
    """(n, n_bushings) standard deviation, N/m, for the grease as given; its error and the beam's come on top"""
    c_std: np.ndarray
    """(n, n_bushings) N s/m"""
    contact: np.ndarray
    """(n, n_bushings) share of the time in contact"""
    amplitude: np.ndarray
    """(n, n_bushings) mean of the envelope during contact, m; nan without"""
    grease: tuple[Grease, ...]
    """what was subtracted"""


def contact_parameters(
    force: RestoringForce, grease: Sequence[Grease] | None = None, window: float = 0.5
) -> ContactParameters:
    """Contact stiffness and damping over time from W_f = k W_g + c W_ġ in the time-frequency plane.

    f is the restoring force without the grease's, g the gap function (Eq. 11) at the bushing's two ends, W their Morlet
    transforms with ω0 = 5, a third of an octave apart. In each window k and c are real least squares over all
    instants and bands, every band weighted by the force's noise in it. The contact does not pull: samples where
    k g + c ġ would are released, in a few rounds. Holds under any excitation.

    Parameters
    ----------
    force : RestoringForce
        From `restoring_force`.
    grease : sequence of Grease, optional
        One for each bushing. Default: `grease_parameters` of the same record.
    window : float
        s, length of the Hann windows; k and c may not change much within half of it.

    Returns
    -------
    ContactParameters

    Raises
    ------
    RecordError
        If the shaft nowhere leaves the gaps (the message says which grease the record still tells) or hardly ever is in
        them, or the window is too long.
    """
    _require_contact([force])
    if not 0 < window <= force.time[-1] / 2:
        raise RecordError(f'record "{force.name}": window {window:g} s must be > 0 and within half of the record')
    grease = grease_parameters(force).grease if grease is None else tuple(grease)
    hop = max(1, round(window * force.fs / OVERLAP))
    edges = np.arange(0, force.time.size - hop + 1, hop)
    parts = [_windowed(force, j, grease[j], edges, hop) for j in range(len(grease))]
    k, c, k_std, c_std, contact, amplitude = (np.column_stack(part) for part in zip(*parts))
    time = (edges + hop / 2) / force.fs
    return ContactParameters(time, k, c, k_std, c_std, contact, amplitude, grease)


def _windowed(force, bushing, grease, edges, hop):
    """Columns (n,) of `ContactParameters` for one bushing."""
    target = force.valid * (force.force[:, bushing] - _grease_force(force, bushing, grease))
    g, speed, touching = _contact_motion(force, bushing)
    a = envelope(force.displacement[:, bushing], force.fs)
    share, held = (_hann(np.add.reduceat(v * touching, edges)) for v in (force.valid, force.valid * a))
    sample, middle = np.arange(a.size), edges + hop / 2
    for _ in range(RELEASES):
        cells = _band_products(force, bushing, force.valid * g, force.valid * speed, target, edges)
        k, c, k_std, c_std = _solve_windows(*cells)
        known = (share > 0.5) & (k_std < UNSURE * k)
        if known.any():
            now = (np.interp(sample, middle[known], value[known]) for value in (k, c))
            g, speed, _ = _contact_motion(force, bushing, *now)
    amplitude = np.divide(held, share, out=np.full(share.size, np.nan), where=share > 0.5)
    k, c, k_std, c_std = (np.where(known, v, np.nan) for v in (k, c, k_std, c_std))
    return k, c, k_std, c_std, share / (hop * HANN.sum()), amplitude


def _contact_motion(force, bushing, k=None, c=None):
    """Gap function and its rate in the force's band, mean of both ends, and whether in contact; each (n_t,).

    With k and c (n_t,), samples that would pull are left out.
    """
    now = (None, None) if k is None else (np.repeat(k, FINER), np.repeat(c, FINER))
    g, speed, touching = _fine_contact(force, bushing, *now)
    return _coarse(force, g), _coarse(force, speed), touching[::FINER]


def _fine_contact(force, bushing, k, c):
    """The same at the finer rate, not yet limited to the band."""
    ends = _fine(force.ends[:, bushing])
    g = gap(ends, force.rig.bushings[bushing].gap)
    speed = np.gradient(ends, axis=0) * (force.fs * FINER)
    pushes = g != 0
    if k is not None:
        pushes &= (k[:, None] * g + c[:, None] * speed) * np.sign(g) > 0
    return (g * pushes).mean(axis=1), (speed * pushes).mean(axis=1), pushes.any(axis=1)


def _fine(signal):
    """Interpolate a signal (n_t, ...) that fades at its ends to FINER times its rate."""
    n = signal.shape[0]
    return FINER * np.fft.irfft(np.fft.rfft(signal, axis=0), n * FINER, axis=0)


def _coarse(force, signal):
    """Limit a fine signal (n_t * FINER, ...) to the force's band and bring it to the record's rate."""
    n = signal.shape[0] // FINER
    spectrum = np.fft.rfft(signal, axis=0)[: n // 2 + 1]
    spectrum[np.fft.rfftfreq(n, 1 / force.fs) > force.band[1]] = 0
    return np.fft.irfft(spectrum, n, axis=0) / FINER


def _band_products(force, bushing, g, speed, target, edges):
    """Whitened products of the wavelet transforms, summed over bands and over the cells that begin at the edges.

    Returns (n, 2, 2) normal matrices of (g, ġ) and (n, 2) their products with the force, so scaled that the inverse of
    a sum of the former is the covariance that the force's noise causes.
    """
    n, fs = g.size, force.fs
    frequency = np.fft.fftfreq(n, 1 / fs)
    centres = LOWEST * 2 ** np.arange(0, np.log2(force.band[1] / LOWEST), 1 / PER_OCTAVE)
    shapes = np.exp(-0.5 * (WAVELET_CENTRE * (frequency / centres[:, None] - 1)) ** 2) * (frequency > 0)
    inside = (frequency >= LOWEST) & (frequency <= force.band[1])
    shapes *= inside / np.sqrt(np.sum(shapes**2, axis=0) + 1e-30)  # bands that together keep the energy
    density = np.interp(centres, force.noise_frequency, force.noise_density[:, bushing])
    spectra = np.fft.fft((g, speed, target))
    sums = np.zeros((5, edges.size))
    for shape, noise in zip(shapes, density):
        # An analytic signal (twice the positive frequencies) has twice the power; a white noise has density² fs/2.
        wg, wv, wf = np.fft.ifft(spectra * shape) * (2 / (noise * np.sqrt(fs)))
        products = (abs(wg) ** 2, (wg.conj() * wv).real, abs(wv) ** 2, (wg.conj() * wf).real, (wv.conj() * wf).real)
        sums += np.add.reduceat(np.array(products), edges, axis=1)
    gg, gv, vv, gf, vf = sums
    return np.stack((gg, gv, gv, vv), axis=1).reshape(-1, 2, 2), np.column_stack((gf, vf))


def _solve_windows(cell_normal, cell_right):
    """K, c >= 0 and their standard deviations (n,), from the force's noise and the scatter between cells.

    The scatter also holds what the noise does not: errors of displacement and grease, k and c that vary in a window.
    """
    effective = HANN.sum() ** 2 / np.sum(HANN**2)
    normal, right = _hann(cell_normal), _hann(cell_right)
    normal += 1e-12 * np.eye(2) * np.einsum("nii->ni", normal)[:, None] + 1e-300 * np.eye(2)
    inverse = np.linalg.inv(normal)
    theta = np.einsum("nij,nj->ni", inverse, right)
    alone = right / np.einsum("nii->ni", normal)
    theta = np.where(theta[:, ::-1] < 0, alone, theta)  # where one is negative, the other is fitted without it
    theta = np.maximum(theta, 0)
    scatter = np.zeros_like(normal)
    for i, weight in enumerate(HANN):
        near, of = (np.roll(part, OVERLAP // 2 - 1 - i, axis=0) for part in (cell_normal, cell_right))
        scores = weight * (of - np.einsum("nij,nj->ni", near, theta))
        scatter += scores[:, :, None] * scores[:, None, :]
    robust = inverse @ scatter @ inverse * effective / (effective - 2)
    std = np.sqrt(np.einsum("nii->ni", inverse + robust))
    return *theta.T, *std.T


def _hann(cells):
    """Sums of cells (n, ...) under a Hann window of OVERLAP cells."""
    flat = cells.reshape(cells.shape[0], -1)
    return np.column_stack([np.convolve(column, HANN, "same") for column in flat.T]).reshape(cells.shape)


def _require_contact(forces):
    rig = forces[0].rig
    if any(_touched(f).any() for f in forces):
        return
    gaps = [b.gap for b in rig.bushings]
    reached = np.max([np.abs(f.ends[f.valid]).max(axis=(0, 2)) for f in forces], axis=0)
    fit = grease_parameters(forces, "linear")
    told = "; ".join(
        f"bushings[{j}]: moves up to {1e3 * r:.3g} mm in a gap of {1e3 * d:.3g} mm, grease {k:.4g} N/m, {c:.3g} N s/m"
        for j, (r, d, (k, c)) in enumerate(zip(reached, gaps, fit.value))
    )
    names = ", ".join(f'"{f.name}"' for f in forces)
    raise RecordError(
        f"record {names}: no contact, so its stiffness and damping cannot be told; only the grease: {told}"
    )


def amplitude_law(dataset: Dataset, progress: str | None = None) -> tuple[AmplitudeLaw, GreaseFit]:
    """Contact stiffness and damping over the envelope of the motion, k(A) and c(A), from the restoring forces.

    The Bouc-Wen grease is fitted inside the gap and subtracted; what is left is regressed on the gap function and its
    rate, each spread over the amplitudes as the law will interpolate between them, all records at once.

    Parameters
    ----------
    dataset : Dataset
        Only its rig and its records with role "identify" are used.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    AmplitudeLaw
        With the grease. A bushing that is never touched takes the others' mean.
    GreaseFit
        The grease with its uncertainty.

    Raises
    ------
    RecordError
        If nothing is to identify from, a record cannot be used, or there is no contact, or hardly anything else.
    """
    forces = restoring_forces(dataset, progress)
    _require_contact(forces)
    grease = grease_parameters(forces)
    nodes = _nodes(forces)
    k, c = zip(*(_over_amplitude(forces, j, g, nodes) for j, g in enumerate(grease.grease)))
    touched = np.any([_touched(f) for f in forces], axis=0)
    k, c = (_filled(np.column_stack(v), touched) for v in (k, c))
    return AmplitudeLaw(nodes, k, c, RELEASE, grease.grease), grease


def force_balance_law(dataset: Dataset, progress: str | None = None) -> ConstantLaw:
    """Constant contact stiffness and damping: the weighted means of `contact_parameters` over the records.

    Parameters
    ----------
    dataset : Dataset
        Only its rig and its records with role "identify" are used.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    ConstantLaw
        With the grease. A bushing that is never touched takes the others' mean.

    Raises
    ------
    RecordError
        As `amplitude_law`.
    """
    forces = restoring_forces(dataset, progress)
    _require_contact(forces)
    grease = grease_parameters(forces).grease
    found = [contact_parameters(f, grease) for f in forces if _touched(f).any()]
    k, c = (np.concatenate([getattr(p, name) for p in found]) for name in ("k", "c"))
    share = np.concatenate([p.contact for p in found]) * np.isfinite(k)
    k, c = (np.nansum(share * v, axis=0) / np.maximum(share.sum(axis=0), 1e-30) for v in (k, c))
    seen = share.sum(axis=0) > 0
    if not seen.any():
        raise RecordError("contact is too short in every record to tell its stiffness")
    return ConstantLaw(_filled(k, seen), _filled(c, seen), grease=grease)


def restoring_forces(dataset: Dataset, progress: str | None = None) -> list[RestoringForce]:
    """Restoring forces in every record to identify.

    Parameters
    ----------
    dataset : Dataset
        Only its rig and its records with role "identify" are used.
    progress : str, optional
        Show a progress bar with this name.

    Raises
    ------
    RecordError
        If nothing is to identify from, or a record cannot be used.
    """
    records = tqdm(dataset.to_identify(), desc=progress, unit="record", disable=progress is None)
    return [restoring_force(record) for record in records]


def _nodes(forces):
    """(NODES,) amplitudes from the smallest gap to the largest motion, denser near the gap.

    Spaced evenly in the root of the penetration, in which the stiffness of a Hertz contact is straight.
    """
    smallest = min(b.gap for b in forces[0].rig.bushings)
    largest = max(np.abs(f.displacement[f.valid]).max() for f in forces)
    return smallest + max(largest - smallest, 0.01 * smallest) * np.linspace(0, 1, NODES) ** 2


def _over_amplitude(forces, bushing, grease, nodes):
    """Stiffness and damping (n_nodes,) of one bushing."""
    weight = [_weight(f, bushing) for f in forces]
    target = [w * (f.force[:, bushing] - _grease_force(f, bushing, grease)) for w, f in zip(weight, forces)]
    target = np.concatenate((*target, np.zeros(2 * (nodes.size - 1))))
    k, c = None, None
    for _ in range(RELEASES):
        matrix = np.vstack([w[:, None] * _amplitude_columns(f, bushing, nodes, k, c) for w, f in zip(weight, forces)])
        matrix = np.vstack((matrix, _smoothness(matrix, nodes)))
        k, c = np.split(_non_negative(matrix, target), 2)
    return k, c


def _amplitude_columns(force, bushing, nodes, k, c):
    """(n_t, 2 n_nodes) gap function, then its rate, times the share that each amplitude has at the moment."""
    middle = _fine(force.displacement[:, bushing])
    a = envelope(middle, force.fs * FINER, RELEASE)
    shares = np.column_stack([np.interp(a, nodes, unit) for unit in np.eye(nodes.size)])
    now = (None, None) if k is None else (shares @ k, shares @ c)
    g, speed, _ = _fine_contact(force, bushing, *now)
    return _coarse(force, np.hstack((shares * g[:, None], shares * speed[:, None])))


def _smoothness(matrix, nodes):
    """Rows that hold neighbouring k, and neighbouring c, together a little."""
    n = nodes.size
    difference = np.diff(np.eye(n), axis=0)
    norm = np.sqrt(np.sum(matrix**2, axis=0))
    sizes = norm[:n].max(), norm[n:].max()
    return SMOOTH * np.block([[sizes[0] * difference, 0 * difference], [0 * difference, sizes[1] * difference]])


def _touched(force):
    """(n_bushings,) whether the shaft ever leaves the gap."""
    return np.any(np.abs(force.ends[force.valid]).max(axis=2) > [b.gap for b in force.rig.bushings], axis=0)


def _filled(values, seen):
    """Values (..., n_bushings), those of bushings not seen replaced by the others' mean."""
    return np.where(seen, values, values[..., seen].mean(axis=-1, keepdims=True))


def ridge_law(
    dataset: Dataset, correction: str = "adiabatic", damping: str = "viscous", progress: str | None = None
) -> TimeLaw:
    """The article's updated model: contact stiffness and damping over time from the wavelet ridge at each bushing.

    The ridge of the lowest mode in a probe's signal gives ω(t) and A(t), and Eqs 12-17 the decay, as if the record were
    a free decay, which it is not under random excitation: there `clearance_mj.identify.ridge` finds no ridge that it
    would vouch for, so the largest component is taken as it is. The contact stiffness follows from the frequency
    equation of the shaft on its grease (as the rig file has it) and on springs k N_j, N_j the gap's describing function
    at A: det(I + k √N R(ω) √N) = 0, R the receptance between the bushings. The damping is what the decay leaves after
    the shaft's and the grease's, shared out by N_j and the mode's shape.

    The law is a schedule over the time of the longest record to identify. It cannot predict another record, whose
    motion is another one at the same time; beyond the record its last values hold.

    Parameters
    ----------
    dataset : Dataset
        Only its rig and its longest record with role "identify" are used.
    correction : {"adiabatic", "none"}
        Decay 2ζω = -2A'/A - ω'/ω, for a frequency that varies, or -2A'/A (Eq. 12).
    damping : {"viscous", "as-printed"}
        c = 2mωζ, or the real part of Eq. 17 as printed, twice of it.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    TimeLaw
        With the rig's own grease. Where the ridge shows no contact, values are interpolated; negative ones are zero.

    Raises
    ------
    RecordError
        If nothing is to identify from, a channel cannot be used, an option is unknown, or a ridge nowhere reaches past
        the gap.
    """
    if correction not in CORRECTIONS or damping not in DAMPINGS:
        raise RecordError(
            f'correction "{correction}" or damping "{damping}" is unknown; '
            f"use {', '.join(CORRECTIONS)} and {', '.join(DAMPINGS)}"
        )
    record = max(dataset.to_identify(), key=lambda r: r.duration)
    probes = _measured(record)[:, len(record.rig.sensors) : -1]
    model = ritz_model(record.rig, MODES, grease=True)
    band = model.omega[0] / (4 * np.pi), (model.omega[0] + model.omega[1]) / (4 * np.pi)
    columns = tqdm(probes.T, desc=progress, unit="bushing", disable=progress is None)
    tracks = [_forced_ridge(signal, record.fs, band, correction, damping) for signal in columns]
    rows = np.arange(0, probes.shape[0], max(1, round(RIDGE_STEP * record.fs)))
    omega, amplitude, decay = (np.column_stack(column)[rows] for column in zip(*tracks))
    share = describing_function(amplitude, np.array([b.gap for b in record.rig.bushings]))
    time, at = rows / record.fs, share.max(axis=1) > LEAST_SHARE
    if not at.any():
        raise RecordError(
            f'record "{record.name}": the ridges between {band[0]:.3g} and {band[1]:.3g} Hz, up to '
            f"{1e3 * amplitude.max():.3g} mm, nowhere reach past a gap; they do not tell the contact, only the grease"
        )
    k, c = np.empty(share.shape), np.empty(share.shape)
    for j in range(share.shape[1]):
        k[:, j] = np.interp(time, time[at], _contact_stiffness(model, record.rig, omega[at, j], share[at]))
        c[:, j] = np.interp(time, time[at], _contact_damping(model, record.rig, decay[at, j], share[at]))
    return TimeLaw(time, k, c)


def _forced_ridge(signal, fs, band, correction, damping):
    """Circular frequency, amplitude and decay 2ζω, each (n_t,), of the largest component, smoothed."""
    plane = scalogram(signal, fs, band)
    rows, columns = np.argmax(np.abs(plane.value), axis=0), np.arange(signal.size)
    before, after = np.maximum(columns - 1, 0), np.minimum(columns + 1, signal.size - 1)
    turn = np.angle(plane.value[rows, after] * plane.value[rows, before].conj())
    amplitude = np.abs(plane.value[rows, columns])
    window = np.hanning(round(RIDGE_WINDOW * fs))

    def smooth(value):
        return np.convolve(amplitude**2 * value, window, "same") / np.convolve(amplitude**2, window, "same")

    omega = smooth(turn * fs / (after - before))
    level = smooth(np.log(amplitude))
    if correction == "adiabatic":
        level = level + np.log(omega) / 2
    decay = -2 * np.gradient(level) * fs
    return omega, np.exp(smooth(np.log(amplitude))), 2 * decay if damping == "as-printed" else decay


def _contact_stiffness(model, rig, omega, share):
    """K (n,) >= 0 with which the shaft on springs k N_j has the circular frequencies ω (n,)."""
    at = model.shapes([b.position for b in rig.bushings])
    receptance = np.einsum("jm,im,tm->tji", at, at, 1 / (model.omega**2 - omega[:, None] ** 2))
    root = np.sqrt(share)
    softest = np.linalg.eigvalsh(root[:, :, None] * receptance * root[:, None, :])[:, 0]
    return np.where(softest < 0, -1 / np.minimum(softest, -1e-12), 0.0)


def _contact_damping(model, rig, modal, share):
    """C (n,) >= 0 from the modal damping 2ζω (n,) of the lowest mode, the rig's own subtracted."""
    at = model.shapes([b.position for b in rig.bushings])[:, 0] ** 2
    own = model.damping[0] + at @ [b.grease.damping for b in rig.bushings]
    return np.maximum((modal - own) / (share @ at), 0.0)
