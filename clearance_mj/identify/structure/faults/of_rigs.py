"""Dimensions, materials and masses of a rig file that explain the misfit of its updated rig."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ....calibrate.free import keys_of, value_of, with_values
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

    kind: str  #: the number, or "lengths": with every position in proportion
    rig: Rig  #: as it would be
    number: str  #: path of the number that was wrong, such as "masses[0].mass"

    def fault(self, before: Assessment, after: Assessment) -> Fault:
        """Return the fault in words."""
        old, value = (value_of(rig, self.number) for rig in (before.rig, after.update.rig))
        unit = UNITS[self.number.rpartition(".")[2]]
        proportion = "with every position in proportion, " if self.kind == "lengths" else ""
        ratio = f"(factor {value / old:.3f})"
        words = f"{self.number} is {value:.4g} {unit} where the rig file says {old:.4g} {unit} {ratio}"
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
    masses = [f"masses[{k}].mass" for k in range(len(rig.masses))]
    for path in (f"beam.{thick}", "beam.young_modulus", "beam.density", *masses):
        (key,), value = keys_of(rig, path), value_of(rig, path)
        for factor in FACTORS if thick in path else STIFFER:
            yield RigCorrection(path, opened(with_values(rig, {key: factor * value}), {path: OPEN}), path)
    for factor, kind in itertools.product(FACTORS, ("length", "lengths")):
        if changed := longer(rig, factor, kind):
            yield RigCorrection(kind, changed, "beam.length")


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
