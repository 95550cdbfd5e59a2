"""Impacts per second and the largest contact force, penetration or acceleration of an hour of random excitation."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..beam import natural_frequencies
from ..clearance.law import Law
from ..clearance.modelled import Modelled, rig_and_law, rig_in_gap
from ..core.errors import ClearanceError, ExcitationError
from ..core.overview import HasOverview, Overview
from ..engines import Engine, get_engine
from ..rig import Rig
from ..signals.arrays import ArrayData
from ..signals.excitation import Excitation, from_psd
from ..signals.psd import PSD
from .extremes import Largest, decluster, largest_value
from .impacts import BlockMaxima, ImpactRate, impact_rate, march

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["QUANTITIES", "SETTLING", "HourPeaks", "noise_of", "peaks_of_record", "peaks_over_an_hour"]

QUANTITIES = {"contact_force": "N", "penetration": "m", "acceleration": "m/s²"}
SETTLING = 5.0
"""s, marched before the record begins"""
LEAST_RATE = 2048.0  # samples per second of noise, at least
PASS = 0.4  # of the rate, up to which excitations reach the steps without loss: signals.sampling
LOWEST = 1.0  # Hz, of the frequency whose period ends a cluster


@dataclass(frozen=True, eq=False, repr=False)
class HourPeaks(HasOverview, ArrayData):
    """Prediction for a longer time, an hour by default, from a record of a model under random excitation.

    Rows of largest values are clearances, or the sensors of an acceleration. Intervals go from the 5 % to the 95 %
    quantile; that of the largest value is predictive: it holds the largest value of nine such times in ten, the
    uncertainty of the fit included.
    """

    quantity: str
    """"contact_force" (N), "penetration" (m) or "acceleration" (m/s²)"""
    hours: float
    """predicted time, h"""
    duration: float
    """s of the record, without settling"""
    clearances: tuple[str, ...]
    """name of each bushing"""
    impacts: tuple[ImpactRate, ...]
    """contacts that begin per second, of each bushing, with their interval"""
    impact_probability: np.ndarray
    """(n_bushings,) probability that the shaft hits the bushing's wall at all in the time; a shaft that rests against
    the wall hits it once it leaves it"""
    rests: np.ndarray
    """(n_bushings,) True if the shaft was in contact throughout the record, pressed by its weight or a load"""
    rows: tuple[str, ...]
    """name of each row of ``largest``"""
    largest: tuple[Largest, ...]
    """largest value of the time, of each row: median, interval and fit"""
    observed: np.ndarray
    """(n_rows,) largest value of the record"""
    limit: float | None = None
    """given limit, in the quantity's unit"""
    peaks: tuple[np.ndarray, ...] = ()
    """peaks of the clusters above the threshold, of each row, for figures"""
    provenance: dict[str, Any] = field(default_factory=dict)
    """its inputs; plain data"""

    @property
    def impacts_per_second(self) -> np.ndarray:
        """(n_bushings,) 1/s"""
        return np.array([rate.value for rate in self.impacts])

    @property
    def median(self) -> np.ndarray:
        """(n_rows,) median of the largest value of the time; nan with too few peaks"""
        return np.array([largest.median for largest in self.largest])

    @property
    def interval(self) -> np.ndarray:
        """(n_rows, 2) 5 % and 95 % quantile of the largest value of the time"""
        return np.array([(largest.low, largest.high) for largest in self.largest])

    @property
    def exceeded(self) -> np.ndarray:
        """(n_rows,) probability that the limit is exceeded within the time; nan without a limit"""
        return np.array([largest.exceeded[0] if largest.exceeded else np.nan for largest in self.largest])

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return QUANTITIES[self.quantity]

    def plot(self) -> Figure:
        """Draw the rate of each row's peaks above a value, with the predicted largest value."""
        from .peaks_figure import peaks_figure

        return peaks_figure(self)

    def _overview(self) -> Overview:
        scale, unit = (1e3, "mm") if self.quantity == "penetration" else (1.0, self.unit)
        touch = [
            f"{name} {rate.value:.3g} ({rate.low:.3g} to {rate.high:.3g})" + ", rests against its wall" * bool(rests)
            for name, rate, rests in zip(self.clearances, self.impacts, self.rests)
        ]
        facts = {"impacts per second": ", ".join(touch)}
        head = ("", f"in the record ({unit})", f"largest in {self.hours:g} h ({unit})", "5 to 95 %", "peaks", "shape")
        table = [
            (name, f"{scale * seen:.4g}", f"{scale * x.median:.4g}", f"{scale * x.low:.4g} to {scale * x.high:.4g}",
             str(x.peaks), f"{x.shape:.2f}")
            for name, seen, x in zip(self.rows, self.observed, self.largest)
        ]  # fmt: skip
        words = self.quantity.replace("_", " ")
        return Overview(f"Largest {words} in {self.hours:g} h, from {self.duration:g} s", facts, [head, *table])


def peaks_over_an_hour(
    model: Rig | Modelled, excitation: PSD | Excitation, duration: float = 60.0, seed: int = 0,
    quantity: str = "contact_force", hours: float = 1.0, limit: float | None = None, law: Law | None = None,
    engine: str | Engine = "modal", settling: float = SETTLING,
) -> HourPeaks:  # fmt: skip
    """March a model under random excitation, and predict impacts per second and the largest value of an hour.

    Contacts that begin are counted at the engine's steps. Peaks of clusters above a threshold, one period of the
    lowest natural frequency apart, are fitted by a generalised Pareto distribution; see `tolerance.extremes`.

    Parameters
    ----------
    model : Model or Rig
        Model with one clearance or more.
    excitation : PSD or Excitation
        From a PSD noise is generated. An excitation is marched whole, and must be stationary.
    duration : float
        Length of the record after settling, s, under a PSD.
    seed : int
        Seed of the noise, of a PSD.
    quantity : str
        "contact_force" (N) or "penetration" (m) of each bushing, or "acceleration" (m/s²) of each sensor, a magnitude.
    hours : float
        Time whose largest value is predicted, h.
    limit : float, optional
        Value whose probability of being exceeded in the time is predicted.
    law : Law, optional
        Law of a rig; a model has one.
    engine : str or Engine
        "modal", or another one.
    settling : float
        Time at the start that is left out, s.

    Returns
    -------
    HourPeaks
        Rows with fewer than five peaks have nan for their largest value.

    Raises
    ------
    ClearanceError
        As `simulate`; if the rig has no clearance, a parameter is impossible or the record shorter than a second.
    """
    rig, law = rig_and_law(model, law)
    noise = excitation if isinstance(excitation, Excitation) else noise_of(excitation, duration + settling, seed)
    blocks = march([(rig, law)], [noise], get_engine(engine), settling)
    return peaks_of_record(rig, law, (block for (block,) in blocks), noise, quantity, hours, limit)


def noise_of(psd: PSD, seconds: float, seed: int | list[int]) -> Excitation:
    """Return noise of a PSD at the lowest power-of-two rate, 2048 Hz or more, that passes all of its band to the steps.

    Parameters
    ----------
    psd : PSD
        Power spectral density.
    seconds : float
        Length of the noise, s.
    seed : int
        Seed of the random numbers.
    """
    fs = max(LEAST_RATE, 2.0 ** np.ceil(np.log2(psd.band[1] / PASS)))
    return from_psd(psd, seconds, fs, seed)  # type: ignore[arg-type]


def peaks_of_record(
    rig: Rig, law: Law, blocks: Iterable[BlockMaxima], noise: Excitation, quantity: str, hours: float,
    limit: float | None = None,
) -> HourPeaks:  # fmt: skip
    """Predict the peaks of a longer time from the blocks of one model's march; see `peaks_over_an_hour`.

    Parameters
    ----------
    rig, law : Rig, Law
        The model.
    blocks : iterable of Block
        Consecutive blocks of its march.
    noise : Excitation
        Excitation of the march.
    quantity, hours, limit
        As in `peaks_over_an_hour`.
    """
    ClearanceError.require_known("quantity", quantity, QUANTITIES)
    if not 0 < hours < np.inf:
        raise ClearanceError(f"hours {hours!r}: must be > 0")
    if quantity == "acceleration" and (others := [s.label for s in rig.sensors if s.quantity != quantity]):
        raise ClearanceError(
            f"largest accelerations are of accelerometers: leave sensor {others[0]} out of the rig file"
        )
    if limit is not None and not 0 <= limit < np.inf:
        raise ClearanceError(f"limit {limit!r}: must be >= 0 {QUANTITIES[quantity]}")
    parts = [np.concatenate(part, axis=1) for part in zip(*blocks)]
    if not parts or parts[0].shape[1] < noise.fs:
        raise ExcitationError("less than a second of the excitation is left after settling; give a longer one")
    record = BlockMaxima(*parts)
    duration = record.depth.shape[1] / noise.fs
    lowest = float(natural_frequencies(rig_in_gap(rig, law), 1)[0])
    ratio, run = 3600.0 * hours / duration, round(noise.fs / max(lowest, LOWEST))
    rates = tuple(impact_rate(impacts, duration) for impacts in record.impacts)
    rests = record.depth.min(axis=1) > 0
    to_wall = np.where(rests[:, None], -record.depth, record.depth)
    touch = np.array([_impact_probability(near, rate, run, ratio, duration) for near, rate in zip(to_wall, rates)])
    values = record.depth if quantity == "penetration" else getattr(record, quantity)
    least = 0.0 if quantity == "contact_force" else -np.inf
    limits = () if limit is None else (float(limit),)
    largest = tuple(largest_value(value, run, ratio, least, limits) for value in values)
    if quantity == "penetration":
        largest = tuple(map(_clip_negative, largest))
    peaks = tuple(decluster(value, each.threshold, run) for value, each in zip(values, largest))
    return HourPeaks(
        quantity, float(hours), duration, tuple(rig.clearance_labels), rates, touch, rests,
        tuple(rig.sensor_labels if quantity == "acceleration" else rig.clearance_labels), largest,
        np.maximum(values.max(axis=1), 0.0), limit, peaks,
        {"rig": rig.to_dict(), "law": law.to_dict(), "excitation": dict(noise.description)},
    )  # fmt: skip


def _impact_probability(near: np.ndarray, rate: ImpactRate, run: int, ratio: float, duration: float) -> float:
    """Return the probability of an impact: from the rate if there are some, else from the distance ``near`` to 0."""
    if rate.value:
        return float(1 - (1 + ratio) ** -(rate.value * duration / rate.dispersion + 0.5))
    return largest_value(near, run, ratio, limits=(0.0,)).exceeded[0] if np.ptp(near) > 0 else 0.0


def _clip_negative(largest: Largest) -> Largest:
    """Return the largest penetration with negative depths, in the gap, set to 0."""
    inside = {name: max(getattr(largest, name), 0.0) for name in ("median", "low", "high")}
    return largest if np.isnan(largest.median) else replace(largest, **inside)
