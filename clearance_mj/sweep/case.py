"""Results of a case: natural frequencies and, where it is simulated, FRFs, their peaks, RMS, contact and RMSE."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from ..beam import natural_frequencies
from ..clearance.law import Law
from ..clearance.modelled import rig_in_gap
from ..core.errors import ClearanceError, RecordError
from ..core.validation import Number, Whole, checked
from ..rig import BASE_NODE, SHAKER_NODE, Rig
from ..signals.correlation import rmse_db
from ..signals.excitation import Excitation
from ..signals.frf import FRF, estimate_frf
from ..signals.response import Response
from ..statistics.contact import contact_statistics

__all__ = ["Observer", "Outputs", "linear_frequencies", "windows_around_modes"]


@checked(ClearanceError)
class Outputs:
    """Results to keep of every case."""

    natural_frequencies: Annotated[Whole, Field(ge=1, le=20)] = 4
    """number of them, of the linear rig within the gap"""
    resolution: Number = 0.5
    """distance of the FRF's lines, Hz"""
    band: tuple[Number, Number] | None = None
    """of the FRFs, Hz; default: that of the excitation"""
    frf: tuple[Whole, ...] | None = None
    """nodes of the sensors whose FRFs are kept; default: all. Their peaks and RMSE are kept in any case"""
    peaks: tuple[tuple[Number, Number], ...] | None = None
    """Hz, bands of which the highest peak is kept; default: one around each natural frequency of the plan's
    rig, from the geometric mean with the one before to that with the next"""

    def __post_init__(self) -> None:
        for low, high in self.peaks or ():
            if not 0 <= low < high:
                raise ValueError(f"peaks: {low:g} to {high:g} Hz are not two rising frequencies")


@dataclass(frozen=True, eq=False)
class Observer:
    """Computes the results of a case from its response; made once for a plan."""

    outputs: Outputs  #: requested results
    band: tuple[float, float]  #: Hz, of the FRFs
    frequency: np.ndarray  #: (n_f,) Hz, their lines
    kept: tuple[int, ...]  #: rows of the sensors whose FRFs are kept
    peaks: tuple[tuple[float, float], ...]  #: Hz
    reference: FRF | None  #: FRFs for comparison
    compared: tuple[int, ...]  #: rows of the sensors that the reference has

    @classmethod
    def of(cls, outputs: Outputs, rig: Rig, excitation: Excitation, reference: FRF | None) -> Observer:
        """Make the observer of a plan with this rig and, in its first case, this excitation.

        A ClearanceError names the sensor, band or line of the reference that does not fit them.
        """
        if (band := outputs.band or excitation.band) is None:
            raise ClearanceError("outputs.band is missing: this excitation does not tell its band")
        frequency = _frf_lines(rig, excitation, outputs.resolution, band)
        nodes = [s.node for s in rig.sensors]
        if missing := [node for node in outputs.frf or () if node not in nodes]:
            raise ClearanceError(f"outputs.frf: node {missing[0]} is no sensor of the rig: {nodes}")
        kept = range(len(nodes)) if outputs.frf is None else [nodes.index(node) for node in outputs.frf]
        peaks = outputs.peaks or windows_around_modes(rig, outputs.natural_frequencies, band)
        for low, high in peaks:
            if not np.any((frequency >= low) & (frequency <= high)):
                raise ClearanceError(f"outputs.peaks: no line of the FRFs lies in {low:g} to {high:g} Hz")
        compared = () if reference is None else _compared_rows(reference, rig, excitation.kind)
        if reference is not None:
            reference = _cut_to_lines(reference, band, frequency)
        return cls(outputs, band, frequency, tuple(kept), peaks, reference, compared)

    def shapes(self, rig: Rig) -> dict[str, tuple[int, ...]]:
        """Return the shape of each result of a simulated case."""
        n, bushings = len(rig.sensors), len(rig.bushings)
        shapes: dict[str, tuple[int, ...]] = {"acceleration_rms": (n,)}
        shapes |= dict.fromkeys(("displacement_rms", "contact_share"), (bushings,))
        shapes |= dict.fromkeys(("peak_frequency", "peak_magnitude"), (len(self.peaks),))
        if self.reference is not None:
            shapes["rmse"] = (len(self.compared),)
        if self.kept:
            shapes["frf"] = (len(self.kept), self.frequency.size, 2)
        return shapes

    def __call__(self, response: Response) -> dict[str, np.ndarray]:
        """Return the results of a case, with the names and shapes of `shapes`."""
        frf = estimate_frf(response, resolution=self.outputs.resolution, band=self.band)
        statistics = contact_statistics(response)
        results = {"acceleration_rms": response.channels.std(axis=1)} | self._peaks(frf)
        results |= {name: statistics[name] for name in ("displacement_rms", "contact_share")}
        if self.reference is not None:
            results["rmse"] = rmse_db(self.reference.functions, frf.functions[list(self.compared)])
        if self.kept:
            results["frf"] = frf.functions[list(self.kept)].view(float).reshape(len(self.kept), -1, 2)
        return results

    def _peaks(self, frf: FRF) -> dict[str, np.ndarray]:
        """Return the highest peak in each band of the root mean square over the sensors, and its frequency."""
        magnitude = np.sqrt(np.mean(np.abs(frf.functions) ** 2, axis=0))
        inside = [(self.frequency >= low) & (self.frequency <= high) for low, high in self.peaks]
        peaks = [_peak(self.frequency, magnitude, int(np.argmax(np.where(lines, magnitude, -1.0)))) for lines in inside]
        frequency, height = np.reshape(peaks, (-1, 2)).T
        return {"peak_frequency": frequency, "peak_magnitude": height}


def _peak(frequency: np.ndarray, magnitude: np.ndarray, i: int) -> tuple[float, float]:
    """Return frequency and height of a peak at line i: the vertex of a parabola through three logarithms."""
    if not 0 < i < frequency.size - 1 or magnitude[i] <= max(magnitude[i - 1], magnitude[i + 1]):
        return frequency[i], magnitude[i]
    a, b, c = np.log(magnitude[i - 1 : i + 2])
    shift = 0.5 * (a - c) / (a - 2 * b + c)
    return frequency[i] + shift * (frequency[i + 1] - frequency[i]), np.exp(b - 0.25 * (a - c) * shift)


def linear_frequencies(rig: Rig, law: Law, n: int) -> np.ndarray:
    """Return the natural frequencies (n,), Hz, within the gap, with the law's grease if it has one; nan for none."""
    frequencies = natural_frequencies(rig_in_gap(rig, law), n)
    return np.pad(frequencies, (0, n - frequencies.size), constant_values=np.nan)


def _frf_lines(rig: Rig, excitation: Excitation, resolution: float, band: tuple[float, float]) -> np.ndarray:
    """Return the lines of the FRFs, from a response of zeros; an error if no FRF can be estimated."""
    zeros = np.zeros((len(rig.sensors), excitation.value.shape[-1]))
    response = Response(excitation.fs, excitation.value, zeros, kind=excitation.kind)
    with np.errstate(divide="ignore", invalid="ignore"):  # zero responses have no coherence
        return estimate_frf(response, resolution=resolution, band=band).frequency


def windows_around_modes(rig: Rig, n: int, band: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    """Return one window of frequency, Hz, around each of the first natural frequencies, cut between neighbours.

    Parameters
    ----------
    rig : Rig
        The rig, whose linear state in the gap has the modes.
    n : int
        Number of modes.
    band : tuple of float
        First and last frequency, Hz: windows end there.
    """
    modes = natural_frequencies(rig, n + 1)
    last = [band[1]] if modes.size <= n else []  # the structure has no more
    edges = np.clip([band[0], *np.sqrt(modes[1:] * modes[:-1]), *last], *band)
    return tuple((float(low), float(high)) for low, high in zip(edges, edges[1:]) if low < high)


def _compared_rows(reference: FRF, rig: Rig, kind: str) -> tuple[int, ...]:
    """Return the rows of the rig's sensors that the reference has."""
    if reference.reference.split(":")[0] != str(BASE_NODE if kind == "base" else SHAKER_NODE):
        raise RecordError(f"its FRFs are to {reference.reference}, the plan's excitation is of kind {kind}")
    labels = rig.sensor_labels
    if missing := [label for label in reference.responses if label not in labels]:
        raise RecordError(f"its response {missing[0]} is no sensor of the rig: {', '.join(labels)}")
    return tuple(labels.index(label) for label in reference.responses)


def _cut_to_lines(reference: FRF, band: tuple[float, float], frequency: np.ndarray) -> FRF:
    """Return the reference on the sweep's lines; RecordError if it lacks one."""
    cut = reference.within(band)
    if cut.frequency.shape != frequency.shape or not np.allclose(cut.frequency, frequency, rtol=1e-6):
        raise RecordError(
            f"its lines ({cut.frequency.size} from {cut.frequency[0]:g} to {cut.frequency[-1]:g} Hz) are not "
            f"the sweep's ({frequency.size} from {frequency[0]:g} to {frequency[-1]:g} Hz)"
        )
    if not np.all(np.abs(cut.value) > 0):
        raise RecordError("its FRFs are zero or not finite at a line; cut it off with outputs.band")
    return cut
