"""Families of contact and filling compared at each clearance: fitted to its restoring force, weighed by evidence."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from tqdm import tqdm

from ...clearance import ContactLaw
from ...clearance.family import CONTACT_FAMILIES, FILLING_FAMILIES, ROUND_FILLING_FAMILIES, ContactFamily, FillingFamily
from ...clearance.greases.bouc_wen import LinearWithFilm
from ...clearance.greases.long_film import LongFilmed
from ...clearance.greases.oil_film import OilFilled
from ...core.errors import LawError
from ...estimate import rival_weights
from ...estimate.solver import NoModelError
from ...rig import Rig
from ...structure.base import is_rotation, parse_place
from ..forces.restoring import NO_PROBES_BAND, RestoringForce, restoring_force
from ..records.prepared import PreparedRecord
from ..structure.rig_update import RigUpdate
from .case import HOLE, OFFSETS, RESTS, nominal_of, open_parameters
from .force_fit import ForceFit, ForceProblem, fit_force, steps_on
from .measured_motion import MeasuredMotion
from .records_to_fit import informative_records, most_informative_parts
from .rest import rests_of, with_offsets
from .slow_motion import SlowMotion, fit_with_slow_motion

Values: TypeAlias = Mapping[str, float]
__all__ = ["FamilyFit", "compare_families", "fit_families", "force_on", "law_of", "weighted"]

WORKERS = 2  # threads
RESAMPLED = 1000  # bootstraps of the records' blocks
SLOW_FITS, SLOW_REFITS = 6, 4  # in turn with the slow motion: of the first family, of the likeliest
LEVER = 0.01  # of a shaft's length: where a point bushing's slope is taken
SHORTEST_CORRELATION = 0.03  # s, a cycle in the middle of 5 to 220 Hz: rig and sensors are a little wrong, too
MOST_FITS = 10  # about, of one clearance
GAPS, STIFFNESSES = (0.5, 0.7, 1.0, 1.4), (0.5, 1.0, 2.0)  # of the rig file's, where searches begin
VALLEY = (1.15, 0.87), (1.05, 0.95), (1.02, 0.98)  # factors of a gap from which a fit begins anew, until none is better
OFF_CENTRE = 0.2  # of a gap, from which on a shaft at rest is nearer to one side
LOWER = 1e-3  # of the misfit, that a step must gain
PRESSED = 0.95  # of the time in contact, from which on a shaft hardly leaves its wall


@dataclass(frozen=True, eq=False)
class FamilyFit:
    """One family of contact and filling, fitted at one clearance."""

    bushing: int
    """index of the clearance"""
    fit: ForceFit
    """fit of its parameters"""
    log_evidence: float
    """logarithm of the probability of the records given the family, but for a constant of the clearance"""
    weight: float
    """probability of the family among those that were compared at this clearance"""

    @property
    def contact(self) -> str:
        """Name of the family of the contact."""
        return self.fit.contact.name

    @property
    def grease(self) -> str:
        """Name of the family of the filling."""
        return self.fit.filling.name

    @property
    def name(self) -> str:
        """Contact and filling in words."""
        return f"contact {self.contact}, grease {self.grease}"

    @property
    def misfit(self) -> float:
        """Misfit of the fitted force, over the expected error of a law."""
        return self.fit.misfit

    @property
    def held_out(self) -> float:
        """Misfit of the part of the records that no fit used."""
        return self.fit.held_out

    def to_dict(self) -> dict[str, Any]:
        """Return clearance, names, weight, evidence and misfits as plain data."""
        names = ("bushing", "contact", "grease", "weight", "log_evidence", "misfit", "held_out")
        return {name: getattr(self, name) for name in names}


def law_of(laws: Sequence[ContactLaw]) -> ContactLaw:
    """Return one law of all clearances from the laws of each."""
    return ContactLaw([law.contact[0] for law in laws], [law.grease[0] for law in laws])


def compare_families(
    records: Sequence[PreparedRecord], update: RigUpdate, rig: Rig | None = None, progress: bool = False
) -> tuple[tuple[FamilyFit, ...], ...]:
    """Fit families of contact and filling to the restoring forces on an updated rig.

    Parameters
    ----------
    records : sequence of PreparedRecord
        Those that the rig was updated to, with the probes that they have.
    update : RigUpdate
        The rig, and the priors of gaps and offsets.
    rig : Rig, optional
        The updated rig with the identified turning loads.
    progress : bool
        Show progress bars.

    Returns
    -------
    tuple of tuple of FamilyFit
        Of each clearance, likeliest first. The likeliest are those of the rig's offsets without load, and their
        estimates vary with the rig, too.
    """
    rig = rig or update.rig
    point_ends, used = _with_length(rig), np.ones((len(rig.bushings), len(records)), dtype=bool)
    if not update.probes and not rig.moves_across:
        used = informative_records([force_on(point_ends, update, record) for record in records])
        indices = np.flatnonzero(used.any(axis=0)).tolist()
        records, used = [records[i] for i in indices], used[:, indices]
    records = most_informative_parts(records)
    forces = [force_on(point_ends, update, record) for record in tqdm(records, desc="forces", disable=not progress)]
    turns = any(force.spin is not None for force in forces)
    motions = []
    for j, rest in enumerate(rests_of(rig) if rig.is_loaded else [None] * len(rig.bushings)):
        parameters = open_parameters(j, nominal_of(rig, j), update.clearance_priors, rest, turns)
        motions.append(MeasuredMotion(forces, rig, j, parameters, used[j]))
    slow = None if update.probes else SlowMotion(motions, records, rig)
    if slow:  # No probe shows the slow part of the motion: it follows from the laws.
        first = [fit_force(m, _first_contact(), _fillings(m)[0]) for m in motions]
        fit_with_slow_motion(slow, first, SLOW_FITS)
    with (
        tqdm(desc="families", total=MOST_FITS * len(motions), unit="fit", disable=not progress) as bar,
        ThreadPoolExecutor(WORKERS) as pool,
    ):
        families = list(pool.map(lambda motion: fit_families(motion, bar.update), motions))
    fits = [fits_of_one[0].fit for fits_of_one in families]
    if slow:
        fits = fit_with_slow_motion(slow, fits, SLOW_REFITS)
    turning = {"unbalances": rig.unbalances, "orders": rig.orders}
    drawn = [(other.replace(**turning), values) for other, values in update.drawn]
    rigs = [other for other, _ in drawn]
    on_drawn = [[force_on(_with_length(r), update, record, values) for record in records] for r, values in drawn]
    for j, (motion, fit) in enumerate(zip(motions, fits)):
        problem = ForceProblem(motion, fit.contact, fit.filling)
        steps = steps_on(fit, problem, [motion.on(each, r) for each, r in zip(on_drawn, rigs)]) * problem.unit
        fits[j] = fit.widened_by(steps.T @ steps / len(drawn))
    best = with_offsets(fits, rig, rigs)
    comparisons = []
    for j, (fit, (likeliest, *others_of)) in enumerate(zip(best, families)):
        unloaded = [with_offsets([*fits[:j], other.fit, *fits[j + 1 :]], rig)[j] for other in others_of]
        pairs = zip((likeliest, *others_of), (fit, *unloaded))
        comparisons.append(tuple(replace(family, fit=each) for family, each in pairs))
    return tuple(comparisons)


def _with_length(rig: Rig) -> Rig:
    """Return a rig whose bushings along shafts are not points, so that the shaft's slope in them is known."""
    bushings = list(rig.bushings)
    for j, bushing in enumerate(bushings):
        if not bushing.length and not is_rotation(bushing.position) and (place := parse_place(bushing.position)):
            shaft = {shaft.name: shaft for shaft in rig.linear.shafts}[place[0]]
            inside = min(place[1] - shaft.start, shaft.end - place[1])
            bushings[j] = replace(bushing, length=min(LEVER * shaft.length, inside))
    return rig.replace(bushings=tuple(bushings))


def force_on(
    rig: Rig, update: RigUpdate, record: PreparedRecord, probes: Mapping[str, float] | None = None
) -> RestoringForce:
    """Return a record's restoring forces on a rig, with an update's probe gains; without probes, of quick motion."""
    low = 0.0 if update.probes or rig.moves_across else NO_PROBES_BAND
    return restoring_force(record, low=low, rig=rig, probes=probes or update.values)


def fit_families(motion: MeasuredMotion, done: Callable[[], object] = lambda: None) -> tuple[FamilyFit, ...]:
    """Fit families of contact and filling at one clearance; likeliest first.

    The fillings that begin from no other with the first contact, all contacts with the likeliest of these, all fillings
    with the likeliest contact, and where another filling is likelier yet, the contacts with that. Each begins from the
    best of the others. One that then misses more than another with the same filling ended in a local optimum, and is
    fitted again from there.

    Parameters
    ----------
    motion : MeasuredMotion
        What laws are compared with.
    done : callable
        Called after each fit.
    """
    first, contacts, fillings = _first_contact(), list(CONTACT_FAMILIES.values()), _fillings(motion)
    fits: dict[tuple[str, str], ForceFit] = {}

    def fit(contact: ContactFamily, filling: FillingFamily, others: Sequence[Values] = ()) -> None:
        if (contact.name, filling.name) not in fits:
            starts = [*others, *_starts(motion, contact, filling, fits)]
            with contextlib.suppress(NoModelError) if fits else contextlib.nullcontext():  # one that diverges is none
                fits[contact.name, filling.name] = fit_force(motion, contact, filling, starts)
            done()

    def leading() -> ForceFit:
        return weighted(motion, list(fits.values()))[0].fit

    initial, grid = fillings[: motion.size], grid_of_starts(motion)  # with a film of two coordinates, one without
    for filling in initial:
        fit(first, filling, grid)
    lead = leading()
    if (valley_fit := with_filling_of_file(along_valley(lead, motion), motion)) is not lead:
        lead, fits = valley_fit, {(first.name, valley_fit.filling.name): valley_fit}
        for filling in initial:
            fit(first, filling)
    if not motion.touches(leading().case):
        contacts = [first]  # one is as good as another
    for contact in contacts:
        fit(contact, lead.filling)
    lead = leading()
    for filling in fillings:
        fit(lead.contact, filling)
    lead = leading()
    for contact in contacts:
        fit(contact, lead.filling)
    for pair, old in fits.items():
        rival = min((f for other, f in fits.items() if other[1] == pair[1]), key=lambda f: f.misfit)
        fits[pair] = fit_from_rival(motion, old, rival)
    return weighted(motion, list(fits.values()))


def _first_contact() -> ContactFamily:
    """Return the contact family that begins from no other, of which the others are special cases, or nearly."""
    return next(family for family in CONTACT_FAMILIES.values() if family.begins_from is None)


def _fillings(motion: MeasuredMotion) -> list[FillingFamily]:
    """Return the fillings to compare, each after the one from whose fit it begins: oil, or all greases.

    With oil a spring with a squeeze film is compared, too, which does not depend on the shaft's spin.
    """
    greases = list[FillingFamily]()
    while remaining := [f for f in FILLING_FAMILIES.values() if f not in greases]:
        ready = [f for f in remaining if f.begins_from is None or f.begins_from in [grease.name for grease in greases]]
        if not ready:
            raise LawError(
                f'family "{remaining[0].name}" begins from "{remaining[0].begins_from}", of which no fit is known; '
                f"known: {', '.join(FILLING_FAMILIES)}"
            )
        greases += ready
    nominal, long_film = motion.nominal, ROUND_FILLING_FAMILIES[LongFilmed.name]
    if nominal.film:
        return [ROUND_FILLING_FAMILIES[OilFilled.name], long_film]
    if not nominal.grease.stiffness:  # there is nothing that could slide
        greases = [FILLING_FAMILIES[LinearWithFilm.name]]
    return [long_film, *greases] if nominal.is_round else greases


def _starts(
    motion: MeasuredMotion, contact: ContactFamily, filling: FillingFamily, fits: Mapping[tuple[str, str], ForceFit]
) -> list[dict[str, float]]:
    """Return starting values of a family's fit, from the fits of the families it begins from and from the best one."""
    lead = min(fits.values(), key=lambda f: f.misfit, default=None)
    begun_from = fits.get((str(contact.begins_from), filling.name)), fits.get((contact.name, str(filling.begins_from)))
    starts = []
    for fit in dict.fromkeys(f for f in (*begun_from, lead) if f):
        start = fit.values
        if fit.contact is not contact:
            start |= contact.start(fit, motion)
        if fit.filling is not filling:
            start |= filling.start(fit, motion)
        starts.append(start)
    return starts


def grid_of_starts(motion: MeasuredMotion) -> list[dict[str, float]]:
    """Return gaps and contacts about the rig file's, with the shaft at its rest place and in the motion's middle.

    A shaft that goes far into a soft wall shows neither gap nor middle, and a search from too wide a gap fails.
    """
    prefix, nominal = f"bushings[{motion.number}]", motion.nominal
    names = RESTS if motion.rest_is_open else OFFSETS
    middle = dict(zip((f"{prefix}.{name}" for name in names[-motion.size :]), (-motion.middle).tolist()))
    contacts = [
        {
            f"{prefix}.gap": gap * nominal.gap,
            "contact stiffness": hardness * nominal.contact.stiffness,
            "contact cubic stiffness": hardness * nominal.contact.stiffness / nominal.gap**2,
        }
        for gap, hardness in itertools.product(GAPS, STIFFNESSES)
    ]
    return [place | contact for place in ({}, middle) for contact in contacts]


def along_valley(fit: ForceFit, motion: MeasuredMotion) -> ForceFit:
    """Return the best of fits that begin with wider and narrower gaps and keep the nearest wall where a fit has it.

    A shaft that touches one side alone shows where the wall is there, and hardly how far the other side is: the search
    ends in a long valley, before its minimum.

    Parameters
    ----------
    fit : ForceFit
        Where the search ended.
    motion : MeasuredMotion
        What was fitted.
    """
    if motion.size == 1 and not motion.meets_one_of_two(fit.case):
        return fit
    for steps in VALLEY:
        while True:
            candidates = [other for step in steps if (other := _fit_with_wider_gap(fit, motion, step))]
            best = min(candidates, key=lambda each: each.misfit, default=fit)
            if best.misfit > (1 - LOWER) * fit.misfit:
                break
            fit = best
    return fit


def with_filling_of_file(fit: ForceFit, motion: MeasuredMotion) -> ForceFit:
    """Return the fit of a round clearance that begins with the rig file's filling, if the shaft hardly leaves its wall.

    There records identify the sum of the stiffnesses of contact and filling, and the contact's times the gap, but
    neither alone: the rig file's filling counts as further evidence.

    Parameters
    ----------
    fit : ForceFit
        Where the search ended.
    motion : MeasuredMotion
        What was fitted.
    """
    values, names = fit.values, (f"bushings[{motion.number}].gap", "contact stiffness", "grease stiffness")
    if motion.size == 1 or not set(names) <= values.keys() or np.mean(motion.depth(fit.case) > 0) < PRESSED:
        return fit
    gap, contact, filling = (values[name] for name in names)
    if (stiffer := contact + filling - motion.nominal.grease.stiffness) <= 0:
        return fit
    start = dict(zip(names, (gap * contact / stiffer, stiffer, motion.nominal.grease.stiffness)))
    refit = fit_force(motion, fit.contact, fit.filling, [values | start])

    def cost(candidate: ForceFit) -> float:  # twice the negative logarithm of the posterior, as intervals count values
        count = candidate.size / max(candidate.correlation_length, motion.shortest_correlation)
        return 2 * count * math.log(candidate.misfit) + float(candidate.point @ candidate.point)

    return min(fit, refit, key=cost)


def _fit_with_wider_gap(fit: ForceFit, motion: MeasuredMotion, step: float) -> ForceFit | None:
    """Return a fit from a gap wider by a factor; None where the shaft is too near to the middle to have a side."""
    prefix, gap, size = f"bushings[{motion.number}]", fit.case.bushing.gap, float(np.linalg.norm(fit.case.middle))
    farther = (step - 1.0) * gap
    if size < OFF_CENTRE * gap or size + farther <= 0:
        return None
    names = RESTS if motion.rest_is_open else OFFSETS
    place = (np.array(fit.case.middle) * (size + farther) / size).tolist()
    shifted = {f"{prefix}.gap": step * gap} | {f"{prefix}.{n}": x for n, x in zip(names[-motion.size :], place)}
    round_hole = {f"{prefix}.{name}": 0.0 for name in HOLE}
    return fit_force(motion, fit.contact, fit.filling, [fit.values | shifted | round_hole])


def fit_from_rival(motion: MeasuredMotion, old: ForceFit, rival: ForceFit) -> ForceFit:
    """Return a fit that begins where one with the same filling and another contact ended, if it has less misfit."""
    if old.misfit <= rival.misfit:
        return old
    contacts = {p.name for family in (old.contact, rival.contact) for p in family.parameters(motion.nominal)}
    others = {name: value for name, value in rival.values.items() if name not in contacts}
    of_contact = {name: value for name, value in old.values.items() if name in contacts}
    return min(old, fit_force(motion, old.contact, old.filling, [others, others | of_contact]), key=lambda f: f.misfit)


def weighted(motion: MeasuredMotion, fits: Sequence[ForceFit]) -> tuple[FamilyFit, ...]:
    """Return the families of a clearance with their probabilities, likeliest first.

    All families miss the records by more than noise, so that pieces of a record do not agree which one is nearest:
    probabilities are means over Bayesian bootstraps of the blocks (pseudo-BMA+; Yao, Vehtari, Simpson and Gelman,
    Using stacking to average Bayesian predictive distributions, Bayesian Analysis 13, 2018).
    """
    # Errors of the best family are those of rig and sensors: they say how many values are one observation, for all.
    length = max(SHORTEST_CORRELATION * motion.rate, min(fits, key=lambda f: f.misfit).correlation_length)
    counts = np.random.default_rng(0).dirichlet(np.ones(motion.blocks.size), RESAMPLED) * motion.blocks.size
    evidence = np.array([float(f.log_evidence(length)) for f in fits])
    resampled = np.array([f.log_evidence(length, counts) for f in fits])
    weight = np.mean([rival_weights(each) for each in resampled.T], axis=0)
    order = np.lexsort((-evidence, -weight))
    return tuple(FamilyFit(motion.number, fits[i], float(evidence[i]), float(weight[i])) for i in order)
