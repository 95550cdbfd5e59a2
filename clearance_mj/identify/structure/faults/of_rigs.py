"""Dimensions, materials and masses of a rig file that explain the misfit of its updated rig."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ....core.errors import ClearanceError
from ....rig import Rig
from ..hypotheses.candidate import opened
from .assessment import Assessment, Fault, distance

__all__ = ["RigCorrection", "rig_corrections"]

FACTORS = tuple(np.exp(np.linspace(-0.4, 0.4, 33)).tolist())  # of a length or diameter
STIFFER = tuple(np.exp(np.linspace(-1.6, 1.6, 17)).tolist())  # of a modulus
UNITS = {"length": "m", "diameter": "m", "height": "m", "young_modulus": "Pa", "density": "kg/m³", "mass": "kg"}
OPEN = "10 %"  # tolerance of a value from the grid


@dataclass(frozen=True)
class RigCorrection:
    """A rig file put right in one number."""

    kind: str  #: which number
    rig: Rig  #: as it would be
    number: tuple[str, int, str]  #: part of the rig, its index, and the field that was wrong

    def of(self, rig: Rig) -> float:
        """Return the number, in a rig."""
        part, index, field = self.number
        return float(getattr(rig.beam, field)) if part == "beam" else rig.masses[index].mass

    def fault(self, before: Assessment, after: Assessment) -> Fault:
        """Return the fault in words."""
        old, value = self.of(before.rig), self.of(after.update.rig)
        part, index, field = self.number
        unit = UNITS[field]
        name = f"{part}.{field}" if part == "beam" else f"{part}[{index}].{field}"
        proportion = "with every position in proportion, " if self.kind == "lengths" else ""
        words = f"{name} is {value:.4g} {unit} where the rig file says {old:.4g} {unit} (factor {value / old:.3f})"
        return Fault(words, proportion + _evidence(before, after), value / old)


def _evidence(before: Assessment, after: Assessment) -> str:
    was, now = (float(np.sqrt(np.mean(t.misfit**2))) for t in (before, after))
    far, near = (max(map(abs, t.shift.values())) for t in (before, after))
    fall = f"the misfit falls from {was:.1f} to {now:.1f} % of the level, " if was > 2 * now else ""
    return f"{fall}the parameter farthest from the rig file comes from {far:.1f} to {near:.1f} standard deviations"


def rig_corrections(assessment: Assessment) -> list[RigCorrection]:
    """Return of each kind the correction with which the sensors contradict each other least, best first."""
    rig = assessment.rig
    if not assessment.measured:
        return []

    def distance_of(candidate: Rig) -> float:
        return distance(assessment.gains(candidate, {}), assessment.measured)

    now = distance_of(rig)
    best: dict[str, tuple[float, RigCorrection]] = {}
    for candidate in _candidates(rig):
        if (corrected := distance_of(candidate.rig)) < best.get(candidate.kind, (now, candidate))[0]:
            best[candidate.kind] = corrected, candidate
    return [correction for _, correction in sorted(best.values(), key=lambda pair: pair[0])]


def _candidates(rig: Rig) -> Iterator[RigCorrection]:
    """Every change on the grids that makes a rig."""
    if (beam := rig.beam) is None:
        return
    thick = "diameter" if beam.diameter else "height"
    for field, factors in ((thick, FACTORS), ("young_modulus", STIFFER), ("density", STIFFER)):
        for factor in factors:
            other = rig.replace(beam=dataclasses.replace(beam, **{field: factor * getattr(beam, field)}))
            yield RigCorrection(field, opened(other, {f"beam.{field}": OPEN}), ("beam", 0, field))
    for factor in FACTORS:
        for kind in ("length", "lengths"):
            if changed := longer(rig, factor, kind):
                yield RigCorrection(kind, changed, ("beam", 0, "length"))
    for k, mass in enumerate(rig.masses):
        for factor in STIFFER:
            masses = (*rig.masses[:k], dataclasses.replace(mass, mass=factor * mass.mass), *rig.masses[k + 1 :])
            other = opened(rig.replace(masses=masses), {f"masses[{k}].mass": OPEN})
            yield RigCorrection(f"mass {k}", other, ("masses", k, "mass"))


def longer(rig: Rig, factor: float, kind: str) -> Rig | None:
    """Return the rig with a longer beam, parts at its tip stay there; ``kind`` "lengths": all positions in proportion.

    None if something would stand beyond the tip.
    """
    assert rig.beam
    end, old = factor * rig.beam.length, rig.beam.length

    def moved(x: float | str) -> float:
        assert isinstance(x, float)
        return factor * x if kind == "lengths" or x == old else x

    try:
        parts = {
            part: tuple(dataclasses.replace(item, position=moved(item.position)) for item in getattr(rig, part))
            for part in ("masses", "bushings", "sensors")
        }
        return rig.replace(beam=dataclasses.replace(rig.beam, length=end), **parts)
    except ClearanceError:
        return None
