"""Quality of a layout of sensors, and the contribution of each sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import ClearanceError
from ..signals.correlation import mac
from .readings import Candidates

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Placement", "evaluate", "losses"]

SINGULAR = 1e-12  # inverse condition number below which a layout does not distinguish all modes


@dataclass(frozen=True, eq=False)
class Placement:
    """A layout of sensors, with the contribution of each and the effect of its loss."""

    chosen: tuple[int, ...]
    """indices of the candidates, by position"""
    position: np.ndarray
    """(n_sensors,) m, or texts such as "inner@0.4" and "12:+Z" """
    determinant: float
    """of the Fisher information"""
    trace: float
    """of the Fisher information"""
    condition: float
    """condition number of the Fisher information"""
    mac: np.ndarray
    """(n_modes, n_modes) auto-MAC: similarity of the modes at these sensors"""
    std: np.ndarray
    """(n_modes,) least standard deviation of each modal coordinate"""
    contribution: np.ndarray
    """(n_sensors,) E, 0 to 1; with uncorrelated noise they sum up to the number of modes"""
    std_after_loss: np.ndarray
    """(n_sensors, n_modes) standard deviations without each sensor; infinite where a mode is then not identifiable"""

    @property
    def determinant_after_loss(self) -> np.ndarray:
        """(n_sensors,) fraction of the determinant that is left without each sensor, 1 - E."""
        return 1 - self.contribution

    @property
    def std_growth(self) -> np.ndarray:
        """(n_sensors, n_modes) standard deviations without each sensor, over those with it."""
        return self.std_after_loss / self.std

    @property
    def worst_mac(self) -> float:
        """Largest MAC of two different modes."""
        return float(np.max(self.mac - np.eye(len(self.mac)), initial=0.0))

    @property
    def labels(self) -> list[str]:
        """Positions in words, such as "0.45 m" and "12:+Z"."""
        return [_label(x) for x in self.position.tolist()]

    @property
    def table(self) -> pd.DataFrame:
        """A row for each sensor: position, contribution, effect of its loss."""
        import pandas as pd

        columns = {"sensor": np.arange(1, len(self.position) + 1), self._column: self.position}
        columns |= {"contribution": self.contribution, "determinant_after_loss": self.determinant_after_loss}
        columns |= {f"std_growth_mode_{j}": growth for j, growth in enumerate(self.std_growth.T, 1)}
        return pd.DataFrame(columns)

    @property
    def _column(self) -> str:
        return "point" if self.position.dtype == object else "position_m"

    def to_dict(self) -> dict[str, Any]:
        """Return the layout as plain data."""
        numbers = {name: getattr(self, name) for name in ("determinant", "trace", "condition", "worst_mac")}
        table = self.table.to_dict("records")
        return {self._column: self.position.tolist(), **numbers, "std": self.std.tolist(), "sensors": table}


def evaluate(candidates: Candidates, chosen: Sequence[int]) -> Placement:
    """Return the quality of a layout, the contribution of each sensor and the effect of its loss.

    Parameters
    ----------
    candidates : Candidates
        Positions where sensors may sit.
    chosen : sequence of int
        Indices of the candidates that have one.

    Raises
    ------
    ClearanceError
        If the layout does not identify every mode.
    """
    texts = candidates.position.dtype == object
    chosen = sorted(chosen, key=None if texts else lambda i: candidates.position[i])
    information, vectors = candidates.information(chosen), losses(candidates, chosen)
    deviation = _std(information)
    if np.isinf(deviation).any():
        at = ", ".join(map(_label, candidates.position[chosen].tolist()))
        raise ClearanceError(
            f"{len(chosen)} sensors at {at} do not tell {len(information)} modes apart; the trace alone does not see "
            "to that, the determinant does"
        )
    contribution = np.einsum("si,is->s", vectors, np.linalg.solve(information, vectors.T)).clip(0, 1)
    return Placement(
        chosen=tuple(int(i) for i in chosen), position=candidates.position[chosen],
        determinant=float(np.linalg.det(information)), trace=float(np.trace(information)),
        condition=float(np.linalg.cond(information)),
        mac=mac(candidates.shapes[chosen], candidates.shapes[chosen]), std=deviation, contribution=contribution,
        std_after_loss=np.array([_std(information - np.outer(v, v)) for v in vectors]),
    )  # fmt: skip


def _label(point: float | str) -> str:
    return point if isinstance(point, str) else f"{point:.4g} m"


def _std(information: np.ndarray) -> np.ndarray:
    """Return the standard deviation of every coordinate; infinite where one is not identifiable."""
    scale = np.sqrt(np.diag(information))
    if np.all(scale > 0) and np.linalg.cond(information / np.outer(scale, scale)) < 1 / SINGULAR:
        return np.sqrt(np.diag(np.linalg.inv(information)))
    return np.full(len(information), np.inf)


def losses(candidates: Candidates, chosen: Sequence[int]) -> np.ndarray:
    """Return (n_sensors, n_modes) v of each sensor: without it the information is Q - v vᵀ.

    The inverse of a covariance that loses row i loses P e eᵀ P / P_ii (partitioned inverse), P = R_SS⁻¹.
    """
    precision = candidates._precision(chosen)
    return precision @ candidates.shapes[chosen] / np.sqrt(np.diag(precision))[:, None]
