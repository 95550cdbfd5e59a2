"""Method "ridge": the article's updated model, contact over time from the wavelet ridge."""

from __future__ import annotations

import numpy as np
from tqdm import tqdm

from ...clearance.law import TimeLaw
from ...clearance.walls.slot import describing_function
from ...core.errors import RecordError
from ...io.dataset import Dataset
from ...linear import LinearModel, linear_model
from ...model import Model
from ...rig import Rig
from ...signals.wavelet import scalogram, shortest_record
from ..forces.restoring import MODES, require_measurable
from ..laws.oscillator import check_options
from ..records.lowest_mode import ridge_band, warn_of_no_ridge
from ..records.needs import probes_in_longest
from ..records.prepared import prepared
from ..registry import Identified, register

__all__ = ["ridge_law"]

STEP = 0.05  # s between the rows of the law
WINDOW = 0.3  # s over which a ridge under random excitation is smoothed
MIN_SHARE = 0.1  # describing function of the gap below which a ridge does not identify the contact


def ridge_law(
    dataset: Dataset, correction: str = "adiabatic", damping: str = "viscous", progress: bool = False
) -> TimeLaw:
    """The article's updated model: contact stiffness and damping over time from the wavelet ridge at each bushing.

    The ridge of the lowest mode in a probe's signal gives ω(t) and A(t), and Eqs 12-17 the decay, as if the record were
    a free decay, which it is not under random excitation: there `clearance_mj.identify.ridge` finds no ridge that it
    would vouch for, so the largest component is taken as it is. The contact stiffness follows from the frequency
    equation of the shaft on its grease (as the rig file has it) and on springs k N_j, N_j the gap's describing function
    at A: det(I + k √N R(ω) √N) = 0, R the receptance between the bushings. The damping is that of the decay less the
    shaft's and the grease's, distributed by N_j and the mode's shape.

    Correction and damping are those of `clearance_mj.identify.sdof`. The law is a schedule over the time of the longest
    record to identify: it cannot predict another record, whose motion is another one at the same time. Where the ridge
    shows no contact, values are interpolated; negative ones are zero; beyond the record its last values hold.
    """
    check_options(correction, damping)
    record = prepared(max(dataset.to_identify(), key=lambda r: r.duration))
    require_measurable(record)
    rig, probes = record.rig, record.signals[:, len(record.rig.sensors) : -1]
    model = linear_model(rig, MODES, grease=True)
    band = ridge_band(rig)
    columns = tqdm(probes.T, desc="ridges", unit="bushing", disable=not progress)
    tracks = [_forced_ridge(signal, record.fs, band, correction, damping) for signal in columns]
    rows = np.arange(0, probes.shape[0], max(1, round(STEP * record.fs)))
    omega, amplitude, decay = (np.column_stack(column)[rows] for column in zip(*tracks))
    contact_ratio = describing_function(amplitude, np.array([b.gap for b in rig.bushings]))
    time, at = rows / record.fs, contact_ratio.max(axis=1) > MIN_SHARE
    if not at.any():
        raise RecordError(
            f'record "{record.name}": the ridges between {band[0]:.3g} and {band[1]:.3g} Hz, up to '
            f"{1e3 * amplitude.max():.3g} mm, nowhere reach past a gap; they identify only the grease, not the contact"
        )
    k, c = np.empty(contact_ratio.shape), np.empty(contact_ratio.shape)
    for j in range(contact_ratio.shape[1]):
        k[:, j] = np.interp(time, time[at], _contact_stiffness(model, omega[at, j], contact_ratio[at]))
        c[:, j] = np.interp(time, time[at], _contact_damping(model, rig, decay[at, j], contact_ratio[at]))
    return TimeLaw(time, k, c)


def _forced_ridge(
    signal: np.ndarray, fs: float, band: tuple[float, float], correction: str, damping: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Circular frequency, amplitude and decay 2ζω, each (n_t,), of the largest component, smoothed."""
    plane = scalogram(signal, fs, band)
    rows, columns = np.argmax(np.abs(plane.value), axis=0), np.arange(signal.size)
    before, after = np.maximum(columns - 1, 0), np.minimum(columns + 1, signal.size - 1)
    turn = np.angle(plane.value[rows, after] * plane.value[rows, before].conj())
    amplitude = np.abs(plane.value[rows, columns])
    window = np.hanning(round(WINDOW * fs))

    def smooth(value: np.ndarray) -> np.ndarray:
        return np.convolve(amplitude**2 * value, window, "same") / np.convolve(amplitude**2, window, "same")

    omega = smooth(turn * fs / (after - before))
    level = smooth(np.log(amplitude))
    if correction == "adiabatic":
        level = level + np.log(omega) / 2
    decay = -2 * np.gradient(level) * fs
    return omega, np.exp(smooth(np.log(amplitude))), 2 * decay if damping == "as-printed" else decay


def _contact_stiffness(model: LinearModel, omega: np.ndarray, contact_ratio: np.ndarray) -> np.ndarray:
    """K (n,) >= 0 with which the shaft on springs k N_j has the circular frequencies ω (n,)."""
    at = model.at_bushings
    receptance = np.einsum("jm,im,tm->tji", at, at, 1 / (model.omega**2 - omega[:, None] ** 2))
    root = np.sqrt(contact_ratio)
    softest = np.linalg.eigvalsh(root[:, :, None] * receptance * root[:, None, :])[:, 0]
    return np.where(softest < 0, -1 / np.minimum(softest, -1e-12), 0.0)


def _contact_damping(model: LinearModel, rig: Rig, modal: np.ndarray, contact_ratio: np.ndarray) -> np.ndarray:
    """C (n,) >= 0 from the modal damping 2ζω (n,) of the lowest mode, the rig's own subtracted."""
    lowest = np.flatnonzero(model.omega)[0]
    at = model.at_bushings[:, lowest] ** 2
    without_contact = model.damping[lowest] + at @ [b.grease.damping for b in rig.bushings]
    return np.maximum((modal - without_contact) / (contact_ratio @ at), 0.0)


def shortest_for_ridge(rig: Rig) -> float:
    """Return the length of the shortest record that has a ridge of the rig's lowest mode, s."""
    return shortest_record(ridge_band(rig)[0])


def find(
    dataset: Dataset, progress: bool = False, correction: str = "adiabatic", damping: str = "viscous"
) -> Identified:
    """Identify by `ridge_law` and warn where the longest record shows no ridge."""
    warn_of_no_ridge(prepared(max(dataset.to_identify(), key=lambda r: r.duration)))
    return Identified(model=Model(dataset.rig, ridge_law(dataset, correction, damping, progress)))


register(
    "ridge",
    "the rig file and the longest record to identify: contact over that record's time, from its wavelet ridge",
    shortest_for_ridge,
    needs=(probes_in_longest,),
)(find)
