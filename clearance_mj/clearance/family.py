"""What a family is: contacts, or fillings, of one form, of which identification finds the free numbers.

A contact or filling that brings a family in its own file is tried by method "bench" of `identify` and by its twin, and
is drawn from for bands of FRFs: at each clearance contacts are fitted with the likeliest filling and fillings with the
likeliest contact, and their evidence says how likely each is. A model without a family is simulated only. One model may
bring several families.
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

DECADE = math.log(10.0)  # prior standard deviation of what a datasheet gives within a factor of ten
BOUND = 5.0  # prior standard deviations from the start to a parameter's bounds


@dataclass(frozen=True)
class FamilyParameter(Parameter):
    """A parameter of a contact or filling, and how a twin tracks it."""

    tracked_as: str | None = None
    """what of the clearance it is a part of, such as "stiffness", a name of `TRACKED` in ``identify.follow.alarms``;
    None: a twin keeps it as it was at first"""


def positive_parameter(
    name: str, unit: str, start: float, prior_std: float, low: float = 0.0, high: float = math.inf,
    tracked_as: str | None = None,
) -> FamilyParameter:  # fmt: skip
    """Return a positive parameter whose logarithm has a normal prior, bounded five standard deviations from its start.

    Parameters
    ----------
    name : str
        In words, beginning with "contact" or "grease"; a name that two families share is one quantity, whose value is
        handed on from the fit of one to the start of the other.
    unit : str
        Of its values, SI.
    start : float
        Median of the prior; where a fit begins that knows no better.
    prior_std : float
        Standard deviation of the logarithm.
    low, high : float
        Limits of what is possible.
    tracked_as : str, optional
        How a twin tracks it, see `FamilyParameter`.
    """
    reach = math.exp(BOUND * prior_std)
    bounds = max(low, start / reach), min(high, start * reach)
    return FamilyParameter(name, unit, start, *bounds, prior_std, tracked_as=tracked_as)


class GapForces(Protocol):
    """What a record shows of the filling alone."""

    def in_gap(self, bushing: Bushing, fillings: Sequence[GreaseModel]) -> tuple[np.ndarray, np.ndarray]:
        """Return forces (n, n_fillings) of fillings, and the measured force (n,), both over its standard error.

        At the n instants at which neither end of a bushing touches its walls. Where fillings are elements of another
        one that add up, the latter's factors follow by linear least squares.
        """


class EarlierFit(Protocol):
    """The fit from which another family's fit begins."""

    @property
    def nominal(self) -> Bushing:
        """The bushing as the rig file has it."""

    @property
    def bushing(self) -> Bushing:
        """The bushing with the gap and offset found."""

    @property
    def contact_model(self) -> ContactModel:
        """The contact found."""

    @property
    def filling_model(self) -> GreaseModel | Grease:
        """The filling found."""

    @property
    def values(self) -> dict[str, float]:
        """All parameters by name, SI."""


class Family(ABC):
    """Free numbers of models of one form: what contacts and fillings share."""

    name: ClassVar[str]  #: in tables and results
    model: ClassVar[type]  #: class of its models
    begins_from: ClassVar[str | None]
    """name of the family of the same kind from whose fit its own begins; None: it begins from the rig file's values"""

    @abstractmethod
    def parameters(self, bushing: Bushing) -> list[FamilyParameter]:
        """Return the free parameters with their starts and priors.

        Parameters
        ----------
        bushing : Bushing
            As the rig file has it: its gap, its datasheet contact and its grease say of which size numbers are.
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
        """Return the values by name of a model of this family; parameters that it does not tell are left out.

        Parameters
        ----------
        bushing : Bushing
            The bushing as the rig file has it.
        model : ContactModel or GreaseModel
            One that `holds`.
        """

    def holds(self, model: Any) -> bool:
        """Return whether a model is of this family.

        Parameters
        ----------
        model : ContactModel or GreaseModel
            Of any kind.
        """
        return isinstance(model, self.model)

    def start(self, fit: EarlierFit, forces: GapForces) -> dict[str, float]:
        """Return values by name from which a fit begins, beside those of parameters that both families share.

        Parameters
        ----------
        fit : EarlierFit
            Of the family that `begins_from` names.
        forces : GapForces
            What the records show.
        """
        return {}


class ContactFamily(Family):
    """Contacts of one form. Subclasses are registered with `register_family`; see `docs/extending.md` for one."""

    begins_from: ClassVar[str | None] = "linear + cubic"


class FillingFamily(Family):
    """Fillings, such as greases, of one form. Subclasses are registered with `register_family`."""

    begins_from: ClassVar[str | None] = "linear"
    round_only: ClassVar[bool] = False
    """whether it fills round clearances alone, in which the shaft moves along y and z"""


CONTACT_FAMILIES: dict[str, ContactFamily] = {}  # Families of contact that identification tries, by name
FILLING_FAMILIES: dict[str, FillingFamily] = {}  # Families of filling that identification tries, by name
ROUND_FILLING_FAMILIES: dict[str, FillingFamily] = {}  # Families of filling of round clearances alone, by name

Registered = TypeVar("Registered", bound=type[ContactFamily] | type[FillingFamily])


def register_family(family: Registered) -> Registered:
    """Let identification try a family; a class decorator.

    Parameters
    ----------
    family : type
        Subclass of `ContactFamily` or `FillingFamily` that is made without arguments.
    """
    found = family()
    if isinstance(found, ContactFamily):
        CONTACT_FAMILIES[found.name] = found
    else:
        (ROUND_FILLING_FAMILIES if found.round_only else FILLING_FAMILIES)[found.name] = found
    return family
