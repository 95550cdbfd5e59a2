"""A dataset with its updated rig, and how far that is from what noise and priors explain."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ...core.errors import ClearanceError
from ...io.dataset import Dataset, Record
from ...rig import Rig
from .updating import FLOOR, MODEL, RigUpdate, gains_of, update_rig

__all__ = ["Fault", "Trial", "channel_of", "distance", "projected", "trial_of", "with_records", "with_rig"]

MISFIT = 4.0
"""% of a channel's level, from which on it is suspicious; of sound benches 0.6 to 1.5"""
FAR = 4.0
"""prior standard deviations, from which on a parameter is suspicious; of sound benches up to 2.1"""
ALIKE = 20.0
"""lines that count as one"""
FEW = 1500
"""lines of all records, by which hypotheses are compared before the rig is updated with them"""
MOST = 0.7
"""of the channels, which must fit for the rig to be sound"""


@dataclass(frozen=True)
class Fault:
    """A cause of what a dataset misses, in words."""

    cause: str
    """what is wrong, and where"""
    evidence: str
    """what would be right, and how much that explains"""
    factor: float | None = None
    """by which the number in question is to be multiplied, if it is one"""

    def __str__(self) -> str:
        return f"{self.cause}: {self.evidence}"


@dataclass(frozen=True, eq=False)
class Trial:
    """A dataset, all of its records to identify from, and what its updated rig misses."""

    dataset: Dataset
    """as it is, or with a hypothesis put right"""
    update: RigUpdate
    """of this dataset"""

    @functools.cached_property
    def misfit(self) -> np.ndarray:
        """(n_channels,) % of each channel's level that is missed."""
        return 100 * self.update.share

    @functools.cached_property
    def measured(self) -> list[np.ndarray]:
        """(n_f, n_channels) some lines of each record."""
        return [m.measured.T[:: self._step] for m in self.update.misfit]

    @property
    def _step(self) -> int:
        return -(-sum(m.frequency.size for m in self.update.misfit) // FEW)

    def gains(self, rig: Rig, values: Mapping[str, float]) -> list[np.ndarray]:
        """Of unknown forces and the excitation on the same lines, of a rig with values of its open parameters."""
        lines = [(m.kind, m.omega[:: self._step]) for m in self.update.misfit]
        return gains_of(rig, dict(values), self.update.probes, lines)

    @functools.cached_property
    def far(self) -> dict[str, float]:
        """Of each parameter, from its prior's mean in prior standard deviations."""
        found = self.update.estimates
        return {
            p.name: (p.to_varied(v) - p.to_varied(p.start)) / p.prior_std for p, v in zip(found.parameters, found.value)
        }

    @functools.cached_property
    def cost(self) -> float:
        """-2 ln of the posterior at its maximum, the noise of each channel being open: Σ n ln(1 + misfit²) + Σ z²."""
        lines = 2 * max(m.frequency.size for m in self.update.misfit) / ALIKE
        return float(lines * np.sum(np.log1p(self.misfit**2)) + sum(z**2 for z in self.far.values()))

    @functools.cached_property
    def suspects(self) -> tuple[int, ...]:
        """Channels that stand out, by themselves or by their place or gain."""
        far = {channel_of(name, self.dataset.rig) for name, z in self.far.items() if abs(z) > FAR}
        return tuple(i for i, misfit in enumerate(self.misfit) if misfit > MISFIT or i in far)

    @functools.cached_property
    def wrong(self) -> tuple[str, ...]:
        """Parameters of the rig itself that stand out."""
        rig = self.dataset.rig
        return tuple(name for name, z in self.far.items() if abs(z) > FAR and channel_of(name, rig) is None)

    @property
    def sound(self) -> bool:
        """Whether most channels fit and the rig itself is near what its file says."""
        return float(np.quantile(self.misfit, MOST)) <= MISFIT and not self.wrong

    def missed(self) -> str:
        """In words, what stands out; "" if nothing does."""
        parts = []
        if self.suspects:
            names = ", ".join(self.update.channels[i] for i in self.suspects)
            worst = self.misfit[list(self.suspects)].max()
            parts.append(f"{names}, by up to {worst:.0f} % of the level")
        if self.wrong:
            moved = ", ".join(f"{name} by {abs(self.far[name]):.1f}" for name in self.wrong)
            parts.append(f"prior standard deviations from the rig file: {moved}")
        return "; ".join(parts)


def trial_of(dataset: Dataset) -> Trial | None:
    """Update the rig of a dataset; None if that cannot be."""
    try:
        return Trial(dataset, update_rig(dataset))
    except ClearanceError:
        return None


def projected(
    gains: list[np.ndarray], measured: list[np.ndarray], without: tuple[int, ...] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """(n_f, n_channels) weights, and spectra under the forces that meet the other channels best, all records' lines."""
    seen, found = np.vstack(gains), np.vstack(measured)
    rms = [np.broadcast_to(np.sqrt(np.mean(np.abs(m) ** 2, axis=0)), m.shape) for m in measured]
    weights = 1 / np.hypot(FLOOR * np.vstack(rms), 3 * MODEL * np.abs(found))
    kept = np.setdiff1d(np.arange(found.shape[1]), without)
    basis, upper = np.linalg.qr(seen[:, kept] * weights[:, kept, None])
    along = basis.conj().transpose(0, 2, 1) @ (found * weights)[:, kept, None]
    return weights, (seen @ np.linalg.solve(upper, along))[:, :, 0]


def distance(gains: list[np.ndarray], measured: list[np.ndarray]) -> float:
    """Sum over the channels of the logarithm of what is missed, over weights."""
    weights, predicted = projected(gains, measured)
    left = np.abs((predicted - np.vstack(measured)) * weights) ** 2
    return float(np.sum(np.log1p(np.mean(left, axis=0))))


def channel_of(name: str, rig: Rig) -> int | None:
    """Channel, accelerometers and then probes, that a parameter of an instrument belongs to."""
    where, _, rest = name.partition("[")
    number, _, field = rest.partition("].")
    if where not in ("sensors", "probes") or field not in ("gain", "position"):
        return None
    return int(number) + (len(rig.sensors) if where == "probes" else 0)


def with_records(dataset: Dataset, change: Callable[[Record], Record]) -> Dataset:
    """The dataset with other records."""
    return Dataset(dataset.rig, tuple(map(change, dataset.records)), dataset.path)


def with_rig(dataset: Dataset, rig: Rig) -> Dataset:
    """The dataset as of another rig."""
    return Dataset(rig, tuple(dataclasses.replace(r, rig=rig) for r in dataset.records), dataset.path)
