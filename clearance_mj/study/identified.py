"""An identified model as a study has it, and its plain data for the result cache."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..clearance.law import Law
from ..estimate.estimates import Estimates
from ..identify import Identified, get_method
from ..identify.laws.law_misfit import DecayMisfit, LawMisfit, Stretch
from ..model import Model
from ..rig import Rig

__all__ = ["IdentifiedModel"]

DRAWN = 12  # models for an FRF band: a width out of so many has a standard deviation of a fifth


@dataclass(frozen=True, eq=False)
class IdentifiedModel:
    """A model, and the prior information that it was identified with."""

    name: str
    """the method's"""
    model: Model
    """rig and law"""
    prior_information: str = ""
    """in words"""
    finds_rig: bool = False
    """whether the method identified the rig too; else it is the rig file's"""
    parameters: tuple[dict, ...] = ()
    """fitted parameters, see `Estimates.rows`"""
    warnings: tuple[str, ...] = ()
    """what not to rely on"""
    drawn: tuple[Model, ...] = ()
    """models that the records do not distinguish from this one; none: the method gives no covariance, or the records do
    not identify a parameter"""
    families: tuple[dict, ...] = ()
    """of contact and grease that the method compared, likeliest first, see `FamilyFit.to_dict`"""
    misfit: LawMisfit | None = None
    """misfit of the model to the records it is identified from; None: not known"""

    @classmethod
    def of(cls, name: str, found: Identified) -> Self:
        """Return the model that a method identified.

        Parameters
        ----------
        name : str
            The method's.
        found : Identified
            What it returned.
        """
        method, pages = get_method(name), found.pages
        return cls(
            name, found.model, method.prior_information, method.finds_rig, found.parameters, found.warnings,
            found.model.drawn(DRAWN), tuple(f.to_dict() for f in pages.get("families", ())), pages.get("misfit"),
        )  # fmt: skip

    @property
    def law(self) -> Law:
        """The model's."""
        return self.model.law

    @property
    def rig(self) -> Rig:
        """The model's."""
        return self.model.rig

    @property
    def unseen_gaps(self) -> tuple[int, ...]:
        """Numbers of the bushings of whose gap the records say nothing: it is the rig file's."""
        return Identified(model=self.model, estimates=Estimates.from_rows(self.parameters)).unseen_gaps

    @property
    def simulated_on(self) -> str:
        """The rig on which it is simulated, in words."""
        return "the rig identified with it" if self.finds_rig else "the rig file’s rig"

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        data = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        misfit = self.misfit and json.loads(json.dumps(dataclasses.asdict(self.misfit), default=np.ndarray.tolist))
        drawn = [model.to_dict() for model in self.drawn]
        return data | {"model": self.model.to_dict(), "drawn": drawn, "misfit": misfit}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], rig: Rig) -> Self:
        """Return the model of `to_dict`'s plain data.

        Parameters
        ----------
        data : mapping of str to Any
            Plain data.
        rig : Rig
            The rig file's, which tells where files of the structure are.
        """
        tuples = {key: tuple(data[key]) for key in ("parameters", "warnings", "families")}
        drawn = tuple(Model.from_dict(each, rig) for each in data["drawn"])
        model, misfit = Model.from_dict(data["model"], rig), data["misfit"] and _misfit_of_dict(data["misfit"])
        return cls(**{**data, **tuples, "model": model, "drawn": drawn, "misfit": misfit})


def _misfit_of_dict(data: dict[str, Any]) -> LawMisfit:
    """Return the misfit of plain data."""
    stretches = tuple(
        Stretch(**{**s, "missed": np.array(s["missed"]), "random": np.array(s["random"])}) for s in data["stretches"]
    )
    decays = tuple(DecayMisfit(**{**d, "missed": np.array(d["missed"])}) for d in data["decays"])
    return LawMisfit(tuple(data["sensors"]), data["unit"], np.array(data["edges"]), stretches, decays)
