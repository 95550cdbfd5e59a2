"""Forces in the clearances of a turning shaft from its probes, with derivatives by the uncertain parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.ndimage

from ...estimate.parameter import Parameter
from ...rig import Rig
from ..structure.priors import rig_with
from .gains import ORDERS, ProbeGains, probe_gains
from .windows import CERTAIN, BandLimits, LowFrequencyMotion, RecordWindow, WindowSpectra, hann, slow_motion

__all__ = ["ForceReconstruction", "Forces", "forces_in"]

DIFFERENCE = 0.3  # prior standard deviations, steps by which the linear rig's numbers are varied
SAME_SPEED = 0.5  # rad/s, within which a shaft's gains are taken to be the same
ERROR, SPREAD = 0.03, 0.01
"""Expected errors of a force over the static force of the same deflection: of each line, and common to all"""
LAW_ERROR, LAW_SPREAD = 0.05, 0.05
"""The same over the force itself: of each line, and common to all, for its law is fed with a motion that has noise"""
SLOPE = 0.5  # of the change of H⁻¹ from one line to the next
MIDDLE = 0.3  # of the window: forces over time are computed where it is larger
NEIGHBOURS = 5  # lines over which the expected error is the same


@dataclass(frozen=True, eq=False)
class Forces:
    """Spectra of forces and motion in windows, under Hann's window."""

    windows: tuple[RecordWindow, ...]
    parameters: tuple[Parameter, ...]
    at: np.ndarray  #: (n,) values about which is linearised
    displacement: np.ndarray
    """(n_windows, n_f, m) probes' displacement without unbalance and run-out, over its expected error"""
    displacement_by: np.ndarray  #: (n_windows, n_f, m, n) per unit of each parameter
    per_force: np.ndarray  #: (n_windows, n_f, m, m) displacement at probes per clearance force, over the same error
    per_force_by: np.ndarray  #: (n, n_windows, n_f, m, m) per unit of each parameter
    unit_force: np.ndarray  #: (n_windows, n_f) of a constant force of 1 N
    slow: LowFrequencyMotion
    tilt: np.ndarray  #: (n_t, 2, m) displacement of both ends beyond that of the middle, m
    tilt_speed: np.ndarray  #: (n_t, 2, m) m/s
    stiffness: np.ndarray  #: (n_bushings,) N/m, of the shaft at rest
    over_error: np.ndarray  #: (n_windows, n_f, m, m) H⁻¹ over the forces' expected errors, weight of `shown`
    clear: np.ndarray  #: (n_windows, n_f, m) N, the forces as probes show them, where they are above their errors

    def over_time(self) -> np.ndarray:
        """Return the forces (n_windows, n, m), N, at the times of the slow motion, 0 where a window is small."""
        n = self.slow.size
        taper = hann(n)[:, None]
        force = n / self.windows[0].size * np.fft.irfft(self.clear, n, axis=1)
        return np.asarray(np.where(taper > MIDDLE, force / np.maximum(taper, MIDDLE), 0.0))

    def of_laws(self, force: np.ndarray) -> np.ndarray:
        """Return spectra (n_windows, n_f, m) of forces (n_t, m) of laws, N.

        Parameters
        ----------
        force : ndarray, shape (n_t, m)
            At the times of the slow motion.
        """
        count, n = len(self.windows), self.slow.size
        rows = force.reshape(count, n, -1) * hann(n)[:, None]
        step = self.windows[0].size / n
        return np.asarray(step * np.fft.rfft(rows, axis=1)[:, : self.displacement.shape[1]])


def forces_in(
    rig: Rig, windows: Sequence[RecordWindow], parameters: Sequence[Parameter], at: Mapping[str, float],
    bands: BandLimits, weighed: Forces | None = None, maker: ForceReconstruction | None = None,
) -> Forces:  # fmt: skip
    """Return the forces in windows at values of the uncertain parameters, with their derivatives.

    Parameters
    ----------
    rig : Rig
        The rig.
    windows : sequence of Window
        Of one length and rate.
    parameters : sequence of Parameter
        As `uncertain` returns them.
    at : mapping of str to float
        Their values; those not given are at their starts.
    bands : Bands
        As `bands_of` returns them.
    weighed : Forces, optional
        Whose expected errors are taken, so that misfits compare.
    maker : ForceMaker, optional
        One of earlier windows; nothing is then derived.
    """
    values = {p.name: at.get(p.name, p.start) for p in parameters}
    slow = slow_motion(windows, bands)
    varied = parameters if maker is None else ()
    maker = maker or ForceReconstruction(rig, parameters, windows[0], bands)
    static = np.abs(np.diag(maker.gains(values, 0.0).inverse[0].real)).reshape(-1, 2).mean(axis=1)
    spectra = [w.spectra(maker.omega.size) for w in windows]
    size, parts = windows[0].size, []
    for i, (window, lines) in enumerate(zip(windows, spectra)):
        gains = maker.gains(values, window.mean_speed)
        inverse = gains.inverse
        motion = maker.displacement(values, window, lines)
        of_noise, leakage = _errors(inverse, lines, window.noise)
        weight = _weight(inverse, lines, motion, static, of_noise, leakage)
        scaled = weight[:, :, None] * inverse if weighed is None else weighed.over_error[i]
        motion_by, per_force_by = maker.derivatives(values, window, lines, motion, varied)
        force = np.einsum("fij,fj->fi", inverse, motion)
        gate = _gate(lines, weight, window.noise, of_noise, leakage)
        over_error = np.einsum("fij,fj->fi", scaled, motion), np.einsum("fij,fjk->fik", scaled, motion_by)
        tilts = maker.tilt(values, gains, lines, force, gate, slow, size)
        parts.append((*over_error, scaled @ gains.per_force, scaled @ per_force_by, scaled, gate * force, *tilts))
    *spectral, tilt, tilt_speed = zip(*parts)
    shown, shown_by, per_force, by, over, clear = map(np.array, spectral)
    return Forces(
        tuple(windows), tuple(parameters), np.array(list(values.values())), shown, shown_by, per_force,
        np.swapaxes(by, 0, 1), np.array([s.one[:, 0] for s in spectra]), slow, np.concatenate(tilt),
        np.concatenate(tilt_speed), static, over, clear,
    )  # fmt: skip


class ForceReconstruction:
    """Forces of one rig, whose gains at every speed are computed once.

    Parameters
    ----------
    rig : Rig
        The rig.
    parameters : sequence of Parameter
        Uncertain parameters.
    window : Window
        One of those whose spectra it takes, all of one length and rate.
    bands : Bands
        Up to which forces are known.
    """

    def __init__(self, rig: Rig, parameters: Sequence[Parameter], window: RecordWindow, bands: BandLimits) -> None:
        self.rig, self.parameters = rig, tuple(parameters)
        frequency = np.fft.rfftfreq(window.size, 1 / window.fs)
        self.omega = 2 * np.pi * frequency[frequency <= bands.force]
        """(n_f,) rad/s, of the lines"""
        self.known: dict[tuple[object, ...], ProbeGains] = {}
        self.rigs: dict[tuple[tuple[str, float], ...], Rig] = {}

    def gains(self, values: Mapping[str, float], spin: float) -> ProbeGains:
        """Return the gains of the probes at values of the uncertain parameters and a spin, rad/s.

        Parameters
        ----------
        values : mapping of str to float
            By name.
        spin : float
            rad/s.
        """
        numbers = tuple((n, v) for n, v in values.items() if not n.startswith("unbalances[") and "run-out" not in n)
        key = (numbers, round(spin / SAME_SPEED))
        if key not in self.known:
            if numbers not in self.rigs:
                self.rigs[numbers] = rig_with(self.rig, dict(numbers))
            self.known[key] = probe_gains(self.rigs[numbers], dict(numbers), spin, self.omega)
        return self.known[key]

    def displacement(self, values: Mapping[str, float], window: RecordWindow, spectra: WindowSpectra) -> np.ndarray:
        """(n_f, m) displacement at the probes without unbalance and run-out, m."""
        gains = self.gains(values, window.mean_speed)
        surface = spectra.waves @ run_out(values, spectra.displacement.shape[1])
        whirl = np.einsum("fiu,fu->fi", gains.per_unbalance, unbalance_forces(values, spectra))
        return spectra.displacement - surface - whirl

    def derivatives(
        self, values: Mapping[str, float], window: RecordWindow, spectra: WindowSpectra, motion: np.ndarray,
        varied: Sequence[Parameter],
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """(n_f, m, n) of the displacement, (n, n_f, m, m) of that per force, per unit of each varied one, else 0."""
        shown = np.zeros((*motion.shape, len(self.parameters)), dtype=complex)
        per_force = np.zeros((len(self.parameters), *motion.shape, motion.shape[1]), dtype=complex)
        gains = self.gains(values, window.mean_speed)
        for k, p in enumerate(varied):
            std = p.prior_std if math.isfinite(p.prior_std) else 0.03
            step = DIFFERENCE * std * (1.0 if p.transform == "linear" else values[p.name])
            if p.transform == "log":
                step = min(step, 0.1 * values[p.name])
            step = -step if values[p.name] + step > p.high else step
            stepped = {**values, p.name: values[p.name] + step}
            shown[:, :, k] = (self.displacement(stepped, window, spectra) - motion) / step
            if (other := self.gains(stepped, window.mean_speed)) is not gains:
                per_force[k] = (other.per_force - gains.per_force) / step
        return shown, per_force

    def tilt(
        self, values: Mapping[str, float], gain: ProbeGains, lines: WindowSpectra, force: np.ndarray, gate: np.ndarray,
        slow: LowFrequencyMotion, size: int,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Motion (n, 2, m) of both ends beyond the middle and its speed, where the window is not small."""
        m = force.shape[1]
        whirl = np.einsum("fiu,fu->fi", gain.points_per_unbalance, unbalance_forces(values, lines))
        points = np.einsum("fij,fj->fi", gain.points, force) + whirl
        middle, ends = points[:, :m].reshape(-1, m // 2, 1, 2), points[:, m:].reshape(-1, m // 2, 2, 2)
        tilt = (ends - middle).transpose(0, 2, 1, 3).reshape(len(points), 2, m) * gate[:, None, :]
        taper, both = np.maximum(hann(slow.size), 0.05)[:, None, None], (tilt, 1j * self.omega[:, None, None] * tilt)
        x, v = (slow.size / size * np.fft.irfft(part, slow.size, axis=0) / taper for part in both)
        return x, v


def run_out(values: Mapping[str, float], m: int) -> np.ndarray:
    """Return the run-out (2 n_orders, m) of each probe per cosine and sine, m."""
    names = [f"{order}x {wave}" for order in ORDERS for wave in ("cos", "sin")]
    return np.array([[values.get(f"probes[{i}] run-out {name}", 0.0) for i in range(m)] for name in names])


def unbalance_forces(values: Mapping[str, float], spectra: WindowSpectra) -> np.ndarray:
    """Return the forces (n_f, 2 n_unbalances) along y and z of every unbalance."""
    forces: list[np.ndarray] = []
    while (name := f"unbalances[{len(forces)}]") + " along the mark" in values:
        forces.append(spectra.unbalance @ np.array([values[f"{name} {part} the mark"] for part in ("along", "across")]))
    return np.hstack(forces) if forces else np.zeros((len(spectra.one), 0), dtype=complex)


def _errors(inverse: np.ndarray, spectra: WindowSpectra, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Errors (n_f, m) of forces: power of the probes' noise, and amplitude of the leakage between lines.

    The window's slope mixes neighbouring lines, between which H⁻¹ changes: near antiresonances by much.
    """
    of_noise = np.einsum("fij,j->fi", np.abs(inverse) ** 2, noise**2 * energy_of(spectra))
    leakage = np.einsum("fij,fj->fi", np.abs(np.gradient(inverse, axis=0)), _neighbour_motion(spectra)) * SLOPE
    return of_noise, leakage


def _neighbour_motion(spectra: WindowSpectra) -> np.ndarray:
    """Largest motion (n_f, m) of neighbouring lines."""
    return np.asarray(scipy.ndimage.maximum_filter1d(np.abs(spectra.displacement), NEIGHBOURS, axis=0))


def _gate(
    lines: WindowSpectra, weight: np.ndarray, noise: np.ndarray, of_noise: np.ndarray, leaks: np.ndarray
) -> np.ndarray:
    """(n_f, m) 1 where probes show forces, 0 where they show noise or antiresonances only."""
    energy = energy_of(lines)
    by_error = np.clip(2.0 - 2.0 * (of_noise + leaks**2) * weight**2, 0.0, 1.0)
    clear = np.clip(1 - CERTAIN * energy * noise**2 / np.maximum(np.abs(lines.displacement) ** 2, 1e-300), 0.0, 1.0)
    return np.asarray(clear * by_error)


def _weight(
    inverse: np.ndarray, spectra: WindowSpectra, shown: np.ndarray, stiffness: np.ndarray, of_noise: np.ndarray,
    leakage: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """(n_f, m) one over the expected error: of rig and law, of the window's slope, and of the probes."""
    force = np.sqrt(np.maximum(np.abs(np.einsum("fij,fj->fi", inverse, shown)) ** 2 - CERTAIN * of_noise, 0.0))
    peaks = scipy.ndimage.maximum_filter1d(force, NEIGHBOURS, axis=0)
    bend = np.repeat(stiffness, 2) * _neighbour_motion(spectra)
    rig = _larger(ERROR * bend) ** 2 + _larger(SPREAD * np.sqrt(np.mean(bend[2:] ** 2, axis=0, keepdims=True))) ** 2
    law = _larger(LAW_ERROR * peaks) ** 2 + _larger(LAW_SPREAD * np.sqrt(np.mean(force**2, axis=0, keepdims=True))) ** 2
    return np.asarray(1 / np.sqrt(rig + law + _larger(leakage) ** 2 + of_noise))


def _larger(values: np.ndarray) -> np.ndarray:
    """Return the larger value of both directions of each clearance."""
    pairs = values.reshape(len(values), -1, 2).max(axis=2)
    return np.repeat(pairs, 2, axis=1)


def energy_of(spectra: WindowSpectra) -> float:
    """Return the sum of the squares of Hann's window, ¾ of its sum's half: of white noise per line."""
    return 0.75 * float(np.abs(spectra.one[0, 0]))
