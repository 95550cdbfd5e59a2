"""Gross faults of a dataset, diagnosed from the misfit of its updated rig: the likeliest cause, in words.

The misfit of a channel is its error on the updated rig under the forces in the clearances that meet all sensors best,
in % of its level. A bench is suspicious where a channel's misfit is above 4 (of sound benches: 0.6 to 1.5), or a
parameter ends more than 4 prior standard deviations from the rig file (of sound benches: up to 2.1). Only then
hypotheses are put right, instruments first, then the structure, and the rig is updated anew with those by which the
sensors contradict each other least. One is named if

- it lowers Σ n ln(1 + misfit²) + Σ z² by 30 or more, a likelihood ratio of e¹⁵: n counts the independent lines
  of a channel, z are the parameters' distances from their priors, so that what priors allow is never named;
- the corrected part is then no longer suspicious: the channels in question, or most channels and the rig itself;
- no other one lowers that sum as far.

The restoring force of each bushing bends where the shaft meets its walls: gaps far from there are named.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass

from ..rig_update import RigUpdate
from .assessment import Assessment, Fault, assess
from .of_channels import channel_corrections, correction_faults
from .of_gaps import gap_faults
from .of_rigs import RigCorrection, longer, rig_corrections
from .of_signals import describe_signal_fault

__all__ = ["Diagnosis", "Fault", "diagnose", "misfit_alone"]

MIN_GAIN = 30.0  # by which putting a cause right must lower the cost
MAX_FAULTS = 4  # that may occur together
CANDIDATES = 4  # corrections of one kind with which the rig is updated
REFINEMENTS = 3  # of a length, after the grid

NamedFaults = tuple[list[Fault], Assessment] | None  # Faults in words, and the assessment with them put right.


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Gross faults of a dataset."""

    faults: tuple[Fault, ...]
    """the likeliest causes, in the order in which they were put right, then gaps; none of a sound bench"""
    unexplained: str
    """misfit that no hypothesis explains, in words; "" of a sound bench"""
    update: RigUpdate
    """with instruments and structure put right"""

    @property
    def words(self) -> tuple[str, ...]:
        """One sentence for each fault, and one on what none of them explains; none of a sound bench."""
        return (*map(str, self.faults), *filter(None, [self.unexplained]))


def diagnose(update: RigUpdate) -> Diagnosis:
    """Find instruments, units, gaps or dimensions that are grossly wrong, where records do not fit their rig.

    Parameters
    ----------
    update : RigUpdate
        Result of `update_rig` for a dataset.

    Returns
    -------
    Diagnosis
        Without faults where the updated rig misses no more than noise and priors explain.
    """
    assessment, faults = Assessment(update), list[Fault]()
    for _ in range(MAX_FAULTS):
        if (fault := _next_fault(assessment)) is None:
            break
        of_fault, assessment = fault
        faults += of_fault
    if assessment.sound and not update.rig.is_loaded:  # other gaps are compared with the rig file's by their fits
        faults += gap_faults(assessment.update)
    return Diagnosis(tuple(faults), _unexplained(assessment), assessment.update)


def misfit_alone(update: RigUpdate) -> Diagnosis:
    """Return the misfit of an updated rig in words, without a search for gross faults.

    Parameters
    ----------
    update : RigUpdate
        With the identified structure.
    """
    return Diagnosis((), _unexplained(Assessment(update)), update)


def _unexplained(assessment: Assessment) -> str:
    """Return the misfit that stands out and its likeliest cause, in words; "" if there is none."""
    if not (outstanding := assessment.unexplained):
        return ""
    words = f"no single cause explains what the updated rig misses: {outstanding}"
    cause = describe_signal_fault(assessment)
    return f"{words}; likeliest: {cause}" if cause else words


def _next_fault(assessment: Assessment) -> NamedFaults:
    """Return the likeliest fault, in words, and the assessment with it put right."""
    of_channels = _channel_fault(assessment) if assessment.unexplained else None
    if assessment.sound or (of_channels and not of_channels[1].unexplained):
        return of_channels
    return _of_least_cost(filter(None, (of_channels, _rig_fault(assessment))))


def _of_least_cost(faults: Iterable[tuple[list[Fault], Assessment]]) -> NamedFaults:
    return min(faults, key=lambda fault: fault[1].cost, default=None)


def _channel_fault(before: Assessment) -> NamedFaults:
    """Return faults of signs, swaps or units of instruments."""
    good = []
    for correction in channel_corrections(before)[:CANDIDATES]:
        after = assess(before.rig, correction.applied(before.update.records))
        if after is None or after.cost > before.cost - MIN_GAIN or set(correction.channels) & set(after.suspects):
            continue
        good.append((correction_faults(correction, before, after), after))
        if not after.unexplained:
            break
    return _of_least_cost(good)


def _rig_fault(before: Assessment) -> NamedFaults:
    """Return faults of dimensions, material or masses of the rig file."""
    good = []
    for correction in rig_corrections(before)[:CANDIDATES]:
        after = assess(correction.rig, before.update.records)
        if after and correction.number == "beam.length":
            correction, after = _refine_length(before, correction, after)
        if after and after.sound and after.cost < before.cost - MIN_GAIN:
            good.append(([correction.fault(before, after)], after))
    return _of_least_cost(good)


def _refine_length(before: Assessment, coarse: RigCorrection, after: Assessment) -> tuple[RigCorrection, Assessment]:
    """Return a length between the grid's: the modulus's change stands for its inverse fourth power."""
    for _ in range(REFINEMENTS):
        updated, tried, beam = after.update.rig.beam, coarse.rig.beam, before.rig.beam
        assert updated and tried and beam
        factor = tried.length / beam.length * (tried.young_modulus / updated.young_modulus) ** 0.25
        rig = longer(before.rig, factor, coarse.kind)
        finer = assess(rig, before.update.records) if rig else None
        if rig is None or finer is None or finer.cost > after.cost:
            break
        coarse, after = dataclasses.replace(coarse, rig=rig), finer
    return coarse, after
