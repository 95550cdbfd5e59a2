"""Prototype: the linear rig out of the quiet beginnings of the records, by weighted Gauss-Newton with priors.

    python -m experiments.benches.prototype_linear results/benches/all

A record begins at rest. Until a probe has moved by 0.6 of its gap's lower 1 σ bound, the bench is nearly linear: its
response is the model's FRFs times the spectrum of the measured base, without leakage, however short the piece is. What
is left between them on the lines of the piece's spectrum, over its RMS by channel and band, is minimised together with
the distance of every parameter from its prior. truth.toml is read only to print how far the result is from it.
"""

from __future__ import annotations

import argparse
import dataclasses
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.optimize

from clearance_mj.beam import ritz_model
from clearance_mj.io.dataset import Dataset, Record
from clearance_mj.rig import PointMass, Rig
from clearance_mj.structure.beam import Clamp

BAND = (5.0, 220.0)
"""Hz"""
EDGES = (0.0, 20.0, 60.0, 130.0, 221.0)
"""Hz, of the bands with residuals of their own size"""
SHARE = 0.6 * 0.8
"""of the nominal gap: 0.6 of what it is at 1 σ (20 %) below"""
SHORTEST = 1.0
"""s, of a piece"""
UNWATCHED = 2.0
"""s, of a piece where there are no probes"""
PAD = 16.0
"""s, in which the model's response to a piece has died away"""
RATIOS = 5
"""damping ratios: of four modes, and of the rest"""


@dataclass(frozen=True)
class Prior:
    """A parameter: value = centre + width u, or centre exp(width u), u standard normal."""

    name: str
    centre: float
    width: float
    logarithmic: bool = False

    def value(self, u: float) -> float:
        """In units of its own."""
        return self.centre * np.exp(self.width * u) if self.logarithmic else self.centre + self.width * u


def priors(rig: Rig, probes: bool) -> list[Prior]:
    """As in `bench`; the clamp as of more shaft, in m."""
    beam, d = rig.beam, rig.beam.diameter
    found = [Prior("E", beam.young_modulus, 0.03, True), Prior("density", beam.density, 0.01, True)]
    found += [Prior(f"mass {m.name}", m.mass, 0.05, True) for m in rig.masses]
    found += [Prior("clamp rotation", 0.5 * d, 1.0, True), Prior("clamp translation", 0.5 * d, 1.0, True)]
    omega = ritz_model(rig, 16).omega
    centre = beam.rayleigh[0] / (2 * omega) + beam.rayleigh[1] * omega / 2
    found += [Prior(f"damping ratio {i + 1}", centre[i], np.log(2), True) for i in range(RATIOS)]
    for j, b in enumerate(rig.bushings):
        found += [Prior(f"grease k {j}", b.grease.stiffness, 1.0, True), Prior(f"grease loss {j}", 0.1, 1.0, True)]
        found += [Prior(f"grease c {j}", b.grease.damping, 1.0, True), Prior(f"bushing place {j}", b.position, 2e-3)]
    kinds = [("sensor", [s.position for s in rig.sensors])]
    if probes:
        kinds.append(("probe", [b.position for b in rig.bushings]))
    for kind, places in kinds:
        found += [Prior(f"{kind} gain {i}", 1.0, 0.01) for i in range(len(places))]
        found += [Prior(f"{kind} place {i}", x, 2e-3) for i, x in enumerate(places)]
    return found


def rig_of(rig: Rig, v: dict[str, float]) -> Rig:
    """The rig with an elastic clamp and the values of parameters by name."""
    stiffness = v["E"] * rig.beam.second_moment
    beam = dataclasses.replace(
        rig.beam, young_modulus=v["E"], density=v["density"], rayleigh=(0.0, 0.0),
        damping_ratios=tuple(float(v[f"damping ratio {i + 1}"]) for i in range(RATIOS)),
        clamp=Clamp(stiffness / v["clamp rotation"], 3 * stiffness / v["clamp translation"] ** 3),
    )  # fmt: skip
    masses = tuple(PointMass(m.position, v[f"mass {m.name}"], m.name) for m in rig.masses)
    return rig.replace(beam=beam, masses=masses)


def frf(rig: Rig, v: dict[str, float], frequency: np.ndarray, probes: bool) -> np.ndarray:
    """(n_channels, n_f) accelerations and displacements per acceleration of the base, linear grease."""
    model = ritz_model(rig_of(rig, v), 10)
    s = 2j * np.pi * frequency
    modes = 1 / (model.omega**2 + s[:, None] * model.damping + s[:, None] ** 2)
    end = rig.beam.length
    bushings = model.shapes([v[f"bushing place {j}"] for j in range(len(rig.bushings))])
    stiff = [
        v[f"grease k {j}"] * (1 + 1j * v[f"grease loss {j}"]) + s * v[f"grease c {j}"] for j in range(len(rig.bushings))
    ]
    impedance = np.stack([1 / k for k in stiff], axis=1)[:, :, None] * np.eye(len(stiff))
    inner = impedance + np.einsum("an,fn,bn->fab", bushings, modes, bushings, optimize=True)
    free = -modes * model.participation
    force = np.linalg.solve(inner, (free @ bushings.T)[..., None])[..., 0]
    q = free - modes * (force @ bushings)
    places = [min(v[f"sensor place {i}"], end) for i in range(len(rig.sensors))]
    gains = np.array([v[f"sensor gain {i}"] for i in range(len(places))])
    rows = (1 + s**2 * (model.shapes(places) @ q.T)) * gains[:, None]
    if probes:
        count = range(len(rig.bushings))
        gains = np.array([v[f"probe gain {j}"] for j in count])
        rows = np.vstack((rows, (model.shapes([v[f"probe place {j}"] for j in count]) @ q.T) * gains[:, None]))
    return rows


class Piece:
    """The quiet beginning of a record."""

    def __init__(self, record: Record) -> None:
        response, rig, self.name = record.response(), record.rig, record.name
        self.probes = response.displacement is not None
        signals = [response.acceleration, *([response.displacement] if self.probes else [])]
        limits = SHARE * np.array([b.gap for b in rig.bushings])[:, None]
        n = int(UNWATCHED * response.fs)
        if response.displacement is not None:
            loud = np.any(np.abs(response.displacement) > limits, axis=0)
            n = int(np.argmax(loud)) if loud.any() else loud.size
        self.fs, self.n, self.padded = response.fs, n, int(PAD * response.fs)
        window = np.ones(n)
        taper = n // 8
        window[-taper:] = 0.5 * (1 + np.cos(np.pi * (np.arange(taper) + 1) / taper))
        self.window = window
        lines = np.fft.rfftfreq(n, 1 / response.fs)
        self.keep = (lines >= BAND[0]) & (lines <= BAND[1])
        self.lines = lines[self.keep]
        self.base = np.fft.rfft(response.excitation[:n], self.padded)
        self.frequency = np.fft.rfftfreq(self.padded, 1 / response.fs)
        self.used = (self.frequency > 0.5) & (self.frequency < 300)
        self.measured = self.spectra(np.vstack(signals)[:, :n])
        self.band = np.digitize(self.lines, EDGES)

    def spectra(self, signals: np.ndarray) -> np.ndarray:
        """(n_channels, n_lines) of signals over the piece."""
        return np.fft.rfft(signals * self.window, axis=1)[:, self.keep]

    def model(self, rig: Rig, v: dict[str, float]) -> np.ndarray:
        """(n_channels, n_lines) of the model's response to the measured base."""
        rows = frf(rig, v, self.frequency[self.used], self.probes)
        whole = np.zeros((len(rows), self.frequency.size), dtype=complex)
        whole[:, self.used] = rows * self.base[self.used]
        return self.spectra(np.fft.irfft(whole, self.padded, axis=1)[:, : self.n])


def rms(spectra: np.ndarray) -> np.ndarray:
    """(n_channels, 1) over the lines."""
    return np.sqrt(np.mean(np.abs(spectra) ** 2, axis=1, keepdims=True))


def update(dataset: Dataset, rounds: int = 4) -> tuple[list[Prior], np.ndarray, np.ndarray]:
    """Return priors, the parameters in prior widths and their posterior standard deviations, in prior widths."""
    rig, pieces = dataset.rig, [p for p in map(Piece, dataset.identify) if p.n >= SHORTEST * p.fs]
    print("quiet:", ", ".join(f"{p.name} {p.n / p.fs:.2f} s" for p in pieces))
    known = priors(rig, pieces[0].probes)

    def values(u: np.ndarray) -> dict[str, float]:
        return {p.name: p.value(float(x)) for p, x in zip(known, u)}

    scales = [np.repeat(rms(p.measured), p.lines.size, axis=1) for p in pieces]

    def residual(u: np.ndarray) -> np.ndarray:
        v = values(u)
        parts = [((p.model(rig, v) - p.measured) / s).ravel() for p, s in zip(pieces, scales)]
        data = np.concatenate(parts)
        return np.concatenate((data.real, data.imag, u))

    u = np.zeros(len(known))
    for _ in range(rounds):
        solution = scipy.optimize.least_squares(residual, u, diff_step=1e-4, max_nfev=15)
        u = solution.x
        for p, scale in zip(pieces, scales):
            left = p.model(rig, values(u)) - p.measured
            for b in np.unique(p.band):
                lines = p.band == b
                scale[:, lines] = rms(left[:, lines]) / np.sqrt(2)
    print("residual over response by channel:")
    for p in pieces:
        left = p.model(rig, values(u)) - p.measured
        print(f"  {p.name}:", np.round(rms(left) / rms(p.measured), 3).ravel())
    jacobian = scipy.optimize.approx_fprime(u, residual, 1e-4)
    return known, u, np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))


def main(arguments: Sequence[str] | None = None) -> None:
    """Update the rig of a dataset and print how far it is from truth.toml."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("dataset", type=Path)
    folder = parser.parse_args(arguments).dataset
    dataset = Dataset.load(folder)
    known, u, std = update(dataset)
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
    shaft, rig = truth["shaft"], dataset.rig
    v = {p.name: p.value(float(x)) for p, x in zip(known, u)}
    exact = {"E": shaft["young_modulus"], "density": shaft["density"], f"mass {rig.masses[0].name}": shaft["tip_mass"]}
    stiffness = shaft["young_modulus"] * rig.beam.second_moment
    if shaft["clamp"] != "rigid":
        exact["clamp rotation"] = stiffness / shaft["clamp"]["rotation"]
        exact["clamp translation"] = (3 * stiffness / shaft["clamp"]["translation"]) ** (1 / 3)
    exact |= {f"damping ratio {i + 1}": shaft["damping"][min(i, len(shaft["damping"]) - 1)] for i in range(RATIOS)}
    for j, b in enumerate(truth["bushings"]):
        exact[f"grease k {j}"] = b["elastic"] + b["bouc_wen"][0] + sum(b["slip"][0])
        exact[f"grease c {j}"] = b["film"][1]
        exact[f"bushing place {j}"] = b["position"]
    for kind, name in (("sensor", "accelerometers"), ("probe", "probes")):
        for i, item in enumerate(truth[name]):
            exact[f"{kind} gain {i}"], exact[f"{kind} place {i}"] = item["gain"], item["position"]
    print(f"{'':20} {'rig file':>12} {'found':>12} {'truth':>12} {'post/prior':>10} {'error/post':>10}")
    for p, x, s in zip(known, u, std):
        true = exact.get(p.name, np.nan)
        at = np.log(true / p.centre) / p.width if p.logarithmic else (true - p.centre) / p.width
        print(f"{p.name:20} {p.centre:12.5g} {p.value(float(x)):12.5g} {true:12.5g} {s:10.2f} {(x - at) / s:10.1f}")
    found = ritz_model(rig_of(rig, v), 16).omega[:4] / (2 * np.pi)
    real = np.array(shaft["frequencies_without_grease"][:4])
    before = ritz_model(rig, 16).omega[:4] / (2 * np.pi)
    for words, value in (("rig file", before), ("updated", found)):
        print(f"frequencies without grease, error in %: {words:8}", np.round(100 * (value / real - 1), 2))


if __name__ == "__main__":
    main()
