"""An identified law as a study has it, and its plain data for the result cache."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..clearance.law import Law
from ..clearance.law_files import law_from_dict
from ..core.errors import LawError
from ..identify import Identified, get_method
from ..identify.laws.law_misfit import Decay, LawMisfit, Stretch
from ..identify.methods.bench import BenchFit
from ..rig import Rig
from ..statistics.frf_bands import draw_cases

__all__ = ["IdentifiedLaw"]

DRAWN = 12
"""laws for an FRF band: a width out of so many has a standard deviation of a fifth"""
FAMILY = ("contact", "grease", "weight", "log_evidence", "misfit", "held_out")
"""what is kept of a `FamilyFit`"""


@dataclass(frozen=True, eq=False)
class IdentifiedLaw:
    """A law, the rig that it belongs to, and the prior information that it was identified with."""

    name: str
    """the method's"""
    law: Law
    """what was found"""
    prior_information: str
    """in words"""
    parameters: tuple[dict, ...] = ()
    """fitted parameters, see `Estimates.rows`"""
    warnings: tuple[str, ...] = ()
    """what the identification warned of"""
    rig: Rig | None = None
    """on which it is simulated; None: on the rig file's"""
    drawn: tuple[tuple[Rig, Law], ...] = ()
    """rigs with laws that the records do not distinguish from this one; none: the method gives no covariance, or the
    records do not identify a parameter"""
    families: tuple[dict, ...] = ()
    """of contact and grease that the method compared, likeliest first: contact, grease, weight, log_evidence, misfit,
    held_out (see `FamilyFit`)"""
    misfit: LawMisfit | None = None
    """what rig and law missed of the records that they were found from; None: not known"""

    @classmethod
    def of(cls, name: str, found: Identified, warnings: tuple[str, ...], rig: Rig) -> Self:
        """Take what a method found.

        Parameters
        ----------
        name : str
            The method's.
        found : Identified
            What it returned.
        warnings : tuple of str
            What it warned of.
        rig : Rig
            The rig file's.
        """
        try:
            drawn = tuple(draw_cases(rig, name, found, DRAWN))
        except LawError:
            drawn = ()
        words = get_method(name).prior_information
        law = cls(name, found.law, words, found.parameters, warnings, found.rig, drawn)
        if not isinstance(found, BenchFit):
            return law
        rows = tuple({key: getattr(family, key) for key in FAMILY} for family in found.families)
        said = tuple(dict.fromkeys((*warnings, *found.warnings)))
        return dataclasses.replace(law, families=rows, misfit=found.misfit, warnings=said)

    @property
    def simulated_on(self) -> str:
        """The rig on which it is simulated, in words."""
        return "the rig file’s rig" if self.rig is None else "the rig identified with it"

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        data = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        drawn = [[rig.to_dict(), law.to_dict()] for rig, law in self.drawn]
        data |= {"law": self.law.to_dict(), "rig": self.rig and self.rig.to_dict(), "drawn": drawn}
        misfit = self.misfit and json.dumps(dataclasses.asdict(self.misfit), default=np.ndarray.tolist)
        return data | {"misfit": misfit and json.loads(misfit)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], rig: Rig) -> Self:
        """Take what `to_dict` returns.

        Parameters
        ----------
        data : mapping of str to Any
            Plain data.
        rig : Rig
            The rig file's, which tells where files of the structure are.
        """
        drawn = tuple((_rig(of, rig), law_from_dict(law)) for of, law in data["drawn"])
        own = data["rig"] and _rig(data["rig"], rig)
        tuples = {key: tuple(data[key]) for key in ("parameters", "warnings", "families")}
        return cls(**{**data, **tuples, "law": law_from_dict(data["law"]), "rig": own, "drawn": drawn,
                      "misfit": data["misfit"] and _misfit(data["misfit"])})  # fmt: skip


def _misfit(data: dict[str, Any]) -> LawMisfit:
    """Of plain data."""
    stretches = tuple(
        Stretch(**{**s, "missed": np.array(s["missed"]), "random": np.array(s["random"])}) for s in data["stretches"]
    )
    decays = tuple(Decay(**{**d, "missed": np.array(d["missed"])}) for d in data["decays"])
    return LawMisfit(tuple(data["sensors"]), data["unit"], np.array(data["edges"]), stretches, decays)


def _rig(data: dict[str, Any], known: Rig) -> Rig:
    """The rig of plain data, with the structure of a known one if that is read from files."""
    told = known.to_dict()
    if data == told:
        return known
    if known.structure and known.structure.files:
        data = data | {"structure": told["structure"]}
    return Rig.from_dict(data)
