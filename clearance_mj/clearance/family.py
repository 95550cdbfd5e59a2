"""Families of contacts and fillings of one form, whose free parameters identification estimates.

A contact or filling with a family in its file is fitted by method "bench" of `identify` and by its twin, and is sampled
for bands of FRFs: at each clearance contacts are fitted with the likeliest filling and fillings with the likeliest
contact, and their evidence gives their probabilities. A model without a family is simulated only. One model may have
several families.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from ..estimate.parameter import Parameter
from ..rig import Bushing, Grease
from .contact import ContactModel
from .grease import GreaseModel

__all__ = [
    "CONTACT_FAMILIES", "DECADE", "FILLING_FAMILIES", "ROUND_FILLING_FAMILIES", "ContactFamily", "EarlierFit", "Family",
    "FamilyParameter", "FillingFamily", "GapForces", "positive_parameter", "register_family",
]  # fmt: skip

DECADE = math.log(10.0)  # prior standard deviation of a datasheet value known within a factor of ten
BOUND = 5.0  # prior standard deviations from the start to a parameter's bounds


@dataclass(frozen=True)
class FamilyParameter(Parameter):
    """A parameter of a contact or filling, with the quantity as which a twin tracks it."""

    tracked_as: str | None = None
    """quantity of the clearance to which it belongs, such as "stiffness", a name of `TRACKED` in
    ``identify.follow.alarms``; None: a twin keeps it constant"""


def positive_parameter(
    name: str, unit: str, start: float, prior_std: float, low: float = 0.0, high: float = math.inf,
    tracked_as: str | None = None,
) -> FamilyParameter:  # fmt: skip
    """Return a positive parameter whose logarithm has a normal prior, bounded five standard deviations from its start.

    Parameters
    ----------
    name : str
        In words, beginning with "contact" or "grease"; a name that two families share is one quantity, whose fitted
        value in one is the start in the other.
    unit : str
        Of its values, SI.
    start : float
        Median of the prior, and default start of a fit.
    prior_std : float
        Standard deviation of the logarithm.
    low, high : float
        Physical limits.
    tracked_as : str, optional
        How a twin tracks it, see `FamilyParameter`.
    """
    factor = math.exp(BOUND * prior_std)
    bounds = max(low, start / factor), min(high, start * factor)
    return FamilyParameter(name, unit, start, *bounds, prior_std, tracked_as=tracked_as)


class GapForces(Protocol):
    """Measured forces of the filling alone."""

    def in_gap(self, bushing: Bushing, fillings: Sequence[GreaseModel]) -> tuple[np.ndarray, np.ndarray]:
        """Return forces (n, n_fillings) of fillings, and the measured force (n,), both over its standard error.

        At the n instants at which neither end of a bushing touches its walls. The factors of a filling that is a sum of
        such elements follow by linear least squares.
        """


class EarlierFit(Protocol):
    """A fit that gives the start of another family's fit."""

    @property
    def nominal(self) -> Bushing:
        """The bushing as the rig file has it."""

    @property
    def bushing(self) -> Bushing:
        """The bushing with the fitted gap and offset."""

    @property
    def contact_model(self) -> ContactModel:
        """The fitted contact."""

    @property
    def filling_model(self) -> GreaseModel | Grease:
        """The fitted filling."""

    @property
    def values(self) -> dict[str, float]:
        """All parameters by name, SI."""


class Family(ABC):
    """Free parameters of models of one form: base class of contacts' and fillings' families."""

    name: ClassVar[str]  #: in tables and results
    model: ClassVar[type]  #: class of its models
    begins_from: ClassVar[str | None]
    """name of the family of the same kind whose fit gives the start; None: the rig file's values"""

    @abstractmethod
    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return the free parameters with their starts and priors.

        Parameters
        ----------
        bushing : Bushing
            As in the rig file: its gap, datasheet contact and grease scale the priors.
        """

    @abstractmethod
    def make(self, bushing: Bushing, *values: float) -> Any:
        """Return the model of values, in the order of `parameters`.

        Parameters
        ----------
        bushing : Bushing
            The bushing as the rig file has it.
        *values : float
            SI units.
        """

    @abstractmethod
    def values(self, bushing: Bushing, model: Any) -> dict[str, float]:
        """Return the values by name of a model of this family; parameters that it does not determine are left out.

        Parameters
        ----------
        bushing : Bushing
            The bushing as the rig file has it.
        model : ContactModel or GreaseModel
            One that `holds`.
        """

    def holds(self, model: Any) -> bool:
        """Return True if a model is of this family.

        Parameters
        ----------
        model : ContactModel or GreaseModel
            Of any kind.
        """
        return isinstance(model, self.model)

    def start(self, fit: EarlierFit, forces: GapForces) -> dict[str, float]:
        """Return start values by name, in addition to those of parameters that both families share.

        Parameters
        ----------
        fit : EarlierFit
            Of the family that `begins_from` names.
        forces : GapForces
            Forces in the records.
        """
        return {}


class ContactFamily(Family):
    """Contacts of one form. Subclasses are registered with `register_family`; see `docs/extending.md` for one."""

    begins_from: ClassVar[str | None] = "linear + cubic"


class FillingFamily(Family):
    """Fillings, such as greases, of one form. Subclasses are registered with `register_family`."""

    begins_from: ClassVar[str | None] = "linear"
    round_only: ClassVar[bool] = False
    """True if it fills round clearances alone, in which the shaft moves along y and z"""


CONTACT_FAMILIES: dict[str, ContactFamily] = {}  # Families of contact that identification tries, by name
FILLING_FAMILIES: dict[str, FillingFamily] = {}  # Families of filling that identification tries, by name
ROUND_FILLING_FAMILIES: dict[str, FillingFamily] = {}  # Families of filling of round clearances alone, by name

Registered = TypeVar("Registered", bound=type[ContactFamily] | type[FillingFamily])


def register_family(family: Registered) -> Registered:
    """Register a family for identification; a class decorator.

    Parameters
    ----------
    family : type
        Subclass of `ContactFamily` or `FillingFamily` that is made without arguments.
    """
    instance = family()
    if isinstance(instance, ContactFamily):
        CONTACT_FAMILIES[instance.name] = instance
    else:
        (ROUND_FILLING_FAMILIES if instance.round_only else FILLING_FAMILIES)[instance.name] = instance
    return family
