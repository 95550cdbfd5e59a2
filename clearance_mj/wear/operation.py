"""Operation of a machine, and the source of its vibrations from gap to gap."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..model import Model

__all__ = ["Operation", "Source", "Vibration"]


@dataclass(frozen=True, eq=False)
class Vibration:
    """A steady vibration at one set of gaps, with its rubbing."""

    rubbing: np.ndarray
    """(n_bushings, 2, 6) of both ends of every bushing, W: N m/s; see `rubbing.MOMENTS`"""
    error: np.ndarray
    """(n_bushings,) standard error of each bushing's rubbing, W"""
    state: Any
    """state from which the next vibration is continued"""
    kind: str
    """ "periodic" or "marched" """

    @property
    def power(self) -> np.ndarray:
        """(n_bushings,) mean of normal force times slip speed, W."""
        return np.asarray(self.rubbing[..., 0].sum(axis=1))


class Source(ABC):
    """The vibrations of one model in operation, from gap to gap."""

    @abstractmethod
    def first(self, model: Model) -> Vibration:
        """Return the vibration with which the machine begins, at the gaps of a model.

        Raises
        ------
        ClearanceError
            If there is none.
        """

    @abstractmethod
    def follow(self, before: Vibration, at: Model, to: Model) -> Vibration | None:
        """Return the vibration at other gaps, continued from one before; None where its branch ends in between.

        Parameters
        ----------
        before : Vibration
            The vibration before.
        at, to : Model
            The models with its gaps and the others.
        """

    @abstractmethod
    def leap(self, before: Vibration, model: Model) -> Vibration:
        """Return the vibration to which the machine jumps where a branch ends, at gaps beyond its end.

        Parameters
        ----------
        before : Vibration
            The last vibration of the branch.
        model : Model
            The model with the gaps beyond its end.
        """


class Operation(ABC):
    """Operation of a machine while it wears."""

    @abstractmethod
    def source(self, model: Model) -> Source:
        """Return the source of a model's vibrations in this operation.

        Parameters
        ----------
        model : Model
            Rig and law.

        Raises
        ------
        ClearanceError
            If the operation does not suit the model, or nothing of it wears.
        """

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return the operation as plain data."""
