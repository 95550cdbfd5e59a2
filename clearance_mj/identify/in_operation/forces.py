"""Forces in the clearances of a turning shaft as its probes show them, with how they depend on what is uncertain."""

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
from .windows import CERTAIN, Bands, Slow, Spectra, Window, hann, slow_motion

__all__ = ["ForceMaker", "Forces", "forces_in"]

DIFFERENCE = 0.3  # prior standard deviations, steps by which the linear rig's numbers are varied
SAME_SPEED = 0.5  # rad/s, within which a shaft's gains are taken to be the same
ERROR, SPREAD = 0.03, 0.01
"""Expected errors of a force over what bends the shaft at rest as far as it moves: of each line, and of all alike"""
LAW_ERROR, LAW_SPREAD = 0.05, 0.05
"""The same over the force itself: of each line, and of all alike, for its law is fed with a motion that has noise"""
SLOPE = 0.5  # of what H⁻¹ changes from one line to the next
MIDDLE = 0.3  # of the window: forces over time are told where it is larger
NEIGHBOURS = 5  # lines over which the expected error is the same


@dataclass(frozen=True, eq=False)
class Forces:
    """Spectra of the forces in windows under Hann's window, and the motion beside them."""

    windows: tuple[Window, ...]
    parameters: tuple[Parameter, ...]
    at: np.ndarray  #: (n,) values about which is linearised
    shown: np.ndarray
    """(n_windows, n_f, m) what probes show but for unbalance and run-out, over its expected error"""
    shown_by: np.ndarray  #: (n_windows, n_f, m, n) per unit of each parameter
    per_force: np.ndarray  #: (n_windows, n_f, m, m) what probes show of forces in the clearances, over the same error
    per_force_by: np.ndarray  #: (n, n_windows, n_f, m, m) per unit of each parameter
    one: np.ndarray  #: (n_windows, n_f) of a constant force of 1 N
    slow: Slow
    tilt: np.ndarray  #: (n_t, 2, m) displacement of both ends beyond that of the middle, m
    tilt_speed: np.ndarray  #: (n_t, 2, m) m/s
    stiffness: np.ndarray  #: (n_bushings,) N/m, of the shaft at rest
    over_error: np.ndarray  #: (n_windows, n_f, m, m) H⁻¹ over the forces' expected errors, which weighs what is shown
    clear: np.ndarray  #: (n_windows, n_f, m) N, the forces as probes show them, where they are above their errors

    def over_time(self) -> np.ndarray:
        """Return the forces (n_windows, n, m), N, at the times of the slow motion, 0 where a window is small."""
        n = self.slow.size
        taper = hann(n)[:, None]
        found = n / self.windows[0].size * np.fft.irfft(self.clear, n, axis=1)
        return np.asarray(np.where(taper > MIDDLE, found / np.maximum(taper, MIDDLE), 0.0))

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
        return np.asarray(step * np.fft.rfft(rows, axis=1)[:, : self.shown.shape[1]])


def forces_in(
    rig: Rig, windows: Sequence[Window], parameters: Sequence[Parameter], at: Mapping[str, float], bands: Bands,
    weighed: Forces | None = None, maker: ForceMaker | None = None,
) -> Forces:  # fmt: skip
    """Return the forces in windows at values of what is uncertain, with their derivatives.

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
    frequency = np.fft.rfftfreq(windows[0].size, 1 / windows[0].fs)
    frequency = frequency[frequency <= bands.force]
    slow = slow_motion(windows, bands)
    derived = maker is None
    maker = maker or ForceMaker(rig, parameters, 2 * np.pi * frequency)
    static = np.abs(np.diag(maker.gains(values, 0.0).inverse[0].real)).reshape(-1, 2).mean(axis=1)
    spectra = [w.spectra(frequency.size) for w in windows]
    size, parts = windows[0].size, []
    for i, (window, own) in enumerate(zip(windows, spectra)):
        gains = maker.gains(values, window.mean_speed)
        inverse = gains.inverse
        seen = maker.shown(values, window, own)
        of_noise, leaked = _errors(inverse, own, window.noise)
        weight = _weight(inverse, own, seen, static, of_noise, leaked)
        before = weight[:, :, None] * inverse if weighed is None else weighed.over_error[i]
        seen_by, per_force_by = maker.derivatives(values, window, own, seen) if derived else maker.none(seen)
        force = np.einsum("fij,fj->fi", inverse, seen)
        gate = _gate(own, weight, window.noise, of_noise, leaked)
        over_error = np.einsum("fij,fj->fi", before, seen), np.einsum("fij,fjk->fik", before, seen_by)
        tilts = maker.tilt(values, gains, own, force, gate, slow, size)
        parts.append((*over_error, before @ gains.shown, before @ per_force_by, before, gate * force, *tilts))
    *spectral, tilt, tilt_speed = zip(*parts)
    shown, shown_by, per_force, by, over, clear = map(np.array, spectral)
    return Forces(
        tuple(windows), tuple(parameters), np.array(list(values.values())), shown, shown_by, per_force,
        np.swapaxes(by, 0, 1), np.array([s.one[:, 0] for s in spectra]), slow, np.concatenate(tilt),
        np.concatenate(tilt_speed), static, over, clear,
    )  # fmt: skip


class ForceMaker:
    """Forces of one rig, whose gains at every speed are computed once.

    Parameters
    ----------
    rig : Rig
        The rig.
    parameters : sequence of Parameter
        What is uncertain.
    omega : ndarray, shape (n_f,)
        rad/s, of the lines.
    """

    def __init__(self, rig: Rig, parameters: Sequence[Parameter], omega: np.ndarray) -> None:
        self.rig, self.parameters, self.omega = rig, tuple(parameters), omega
        self.known: dict[tuple[object, ...], ProbeGains] = {}
        self.rigs: dict[tuple[tuple[str, float], ...], Rig] = {}

    def none(self, here: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return zeros in the place of derivatives."""
        count = len(self.parameters)
        return np.zeros((*here.shape, count)), np.zeros((count, *here.shape, here.shape[1]))

    def gains(self, values: Mapping[str, float], spin: float) -> ProbeGains:
        """Return what probes show at values of what is uncertain and a spin, rad/s.

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

    def shown(self, values: Mapping[str, float], window: Window, own: Spectra) -> np.ndarray:
        """(n_f, m) what probes show but for unbalance and run-out, m."""
        gains = self.gains(values, window.mean_speed)
        surface = own.waves @ run_out(values, own.displacement.shape[1])
        return own.displacement - surface - np.einsum("fiu,fu->fi", gains.seen, drive(values, own))

    def derivatives(
        self, values: Mapping[str, float], window: Window, own: Spectra, here: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(n_f, m, n) of what probes show, and (n, n_f, m, m) of that per force, per unit of each parameter."""
        shown = np.empty((*here.shape, len(self.parameters)), dtype=complex)
        per_force = np.zeros((len(self.parameters), *here.shape, here.shape[1]), dtype=complex)
        gains = self.gains(values, window.mean_speed)
        for k, p in enumerate(self.parameters):
            std = p.prior_std if math.isfinite(p.prior_std) else 0.03
            by = DIFFERENCE * std * (1.0 if p.transform == "linear" else values[p.name])
            if p.transform == "log":
                by = min(by, 0.1 * values[p.name])
            by = -by if values[p.name] + by > p.high else by
            moved = {**values, p.name: values[p.name] + by}
            shown[:, :, k] = (self.shown(moved, window, own) - here) / by
            if (other := self.gains(moved, window.mean_speed)) is not gains:
                per_force[k] = (other.shown - gains.shown) / by
        return shown, per_force

    def tilt(
        self, values: Mapping[str, float], gains: ProbeGains, own: Spectra, force: np.ndarray, gate: np.ndarray,
        slow: Slow, size: int,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Motion (n, 2, m) of both ends beyond the middle and its speed, where the window is not small."""
        m = force.shape[1]
        points = np.einsum("fij,fj->fi", gains.points, force) + np.einsum("fiu,fu->fi", gains.moved, drive(values, own))
        middle, ends = points[:, :m].reshape(-1, m // 2, 1, 2), points[:, m:].reshape(-1, m // 2, 2, 2)
        away = (ends - middle).transpose(0, 2, 1, 3).reshape(len(points), 2, m)
        away = away * gate[:, None, :]
        taper = np.maximum(hann(slow.size), 0.05)[:, None, None]
        found = [
            slow.size / size * np.fft.irfft(part, slow.size, axis=0) / taper
            for part in (away, 1j * self.omega[:, None, None] * away)
        ]
        return found[0], found[1]


def run_out(values: Mapping[str, float], m: int) -> np.ndarray:
    """Return what the surface adds (2 n_orders, m) per cosine and sine, m."""
    names = [f"{order}x {wave}" for order in ORDERS for wave in ("cos", "sin")]
    return np.array([[values.get(f"probes[{i}] run-out {name}", 0.0) for i in range(m)] for name in names])


def drive(values: Mapping[str, float], own: Spectra) -> np.ndarray:
    """Return the forces (n_f, 2 n_unbalances) along y and z of every unbalance."""
    found: list[np.ndarray] = []
    while (name := f"unbalances[{len(found)}]") + " along the mark" in values:
        found.append(own.turned @ np.array([values[f"{name} {part} the mark"] for part in ("along", "across")]))
    return np.hstack(found) if found else np.zeros((len(own.one), 0), dtype=complex)


def _errors(inverse: np.ndarray, own: Spectra, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Errors (n_f, m) of forces: power of the probes' noise, and what leaks between lines, as amplitude.

    The window's slope mixes neighbouring lines, between which H⁻¹ changes: near antiresonances by much.
    """
    of_noise = np.einsum("fij,j->fi", np.abs(inverse) ** 2, noise**2 * energy_of(own))
    leaked = np.einsum("fij,fj->fi", np.abs(np.gradient(inverse, axis=0)), _near(own)) * SLOPE
    return of_noise, leaked


def _near(own: Spectra) -> np.ndarray:
    """Largest motion (n_f, m) of neighbouring lines."""
    return np.asarray(scipy.ndimage.maximum_filter1d(np.abs(own.displacement), NEIGHBOURS, axis=0))


def _gate(own: Spectra, weight: np.ndarray, noise: np.ndarray, of_noise: np.ndarray, leaked: np.ndarray) -> np.ndarray:
    """(n_f, m) 1 where probes show forces, 0 where they show noise or antiresonances only."""
    energy = energy_of(own)
    blurred = np.clip(2.0 - 2.0 * (of_noise + leaked**2) * weight**2, 0.0, 1.0)
    moved = np.clip(1 - CERTAIN * energy * noise**2 / np.maximum(np.abs(own.displacement) ** 2, 1e-300), 0.0, 1.0)
    return np.asarray(moved * blurred)


def _weight(
    inverse: np.ndarray, own: Spectra, shown: np.ndarray, stiffness: np.ndarray, of_noise: np.ndarray,
    leaked: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """(n_f, m) one over the expected error: of rig and law, of the window's slope, and of the probes."""
    forces = np.sqrt(np.maximum(np.abs(np.einsum("fij,fj->fi", inverse, shown)) ** 2 - CERTAIN * of_noise, 0.0))
    acting = scipy.ndimage.maximum_filter1d(forces, NEIGHBOURS, axis=0)
    bent = np.repeat(stiffness, 2) * _near(own)
    rig = _round(ERROR * bent) ** 2 + _round(SPREAD * np.sqrt(np.mean(bent[2:] ** 2, axis=0, keepdims=True))) ** 2
    law = _round(LAW_ERROR * acting) ** 2 + _round(LAW_SPREAD * np.sqrt(np.mean(forces**2, axis=0, keepdims=True))) ** 2
    return np.asarray(1 / np.sqrt(rig + law + _round(leaked) ** 2 + of_noise))


def _round(values: np.ndarray) -> np.ndarray:
    """The larger of both directions of each clearance."""
    pairs = values.reshape(len(values), -1, 2).max(axis=2)
    return np.repeat(pairs, 2, axis=1)


def energy_of(own: Spectra) -> float:
    """Return the sum of the squares of Hann's window, ¾ of its sum's half: of white noise per line."""
    return 0.75 * float(np.abs(own.one[0, 0]))
