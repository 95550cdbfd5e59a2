"""Families of contact and filling compared at round clearances, and where the unloaded shaft then is in them."""

from __future__ import annotations

import dataclasses
import itertools
from collections import ChainMap
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import cast

import numpy as np
from tqdm import tqdm

from ...clearance.family import CONTACT_FAMILIES, FILLING_FAMILIES, ROUND_FILLING_FAMILIES
from ...clearance.greases.bouc_wen import LinearWithFilm
from ...clearance.greases.long_film import LongFilmed
from ...clearance.greases.oil_film import OilFilled
from ...core.errors import SimulationError
from ...engines.equilibrium import static_equilibrium
from ...estimate import Parameter
from ...linear import linear_model
from ...rig import Rig
from ..forces.restoring import MODES, restoring_force
from ..records.prepared import PreparedRecord
from ..structure.priors import rig_with
from ..structure.rig_update import RigUpdate
from .comparison import WORKERS, FamilyFit, weighted
from .measured_motion import RoundMotion, forces_along
from .round_fit import HOLE, RoundFit, fit_round, parameters_of, spread_by_rig

__all__ = ["compare_round_families", "rests_of"]

FIRST = (LinearWithFilm.name,)  # the filling that all others but films begin from
ALL_FILLINGS = ChainMap(FILLING_FAMILIES, ROUND_FILLING_FAMILIES)
MAX_SECONDS = 40.0  # of all records together, to which laws are fitted
MIN_SECONDS = 4.0  # of each of them
DRAWS = 8  # rigs from the posterior, on which laws are moved by a step
GAPS, STIFFNESSES = (0.5, 0.7, 1.0, 1.4), (0.5, 1.0, 2.0)  # of the rig file's, where searches begin
VALLEY = (1.15, 0.87), (1.05, 0.95), (1.02, 0.98)  # factors of a gap from which a fit begins anew, until none is better
OFF_CENTRE = 0.2  # of a gap, from which on a shaft at rest is nearer to one side
LOWER = 1e-3  # of the misfit, that a step must gain
ROUNDS = 50  # of the shaft's sag under its weight and the filling's springs


def compare_round_families(
    records: Sequence[PreparedRecord], update: RigUpdate, rig: Rig, progress: bool = False
) -> tuple[FamilyFit, ...]:
    """Fit families of contact and filling to the restoring forces along y and z; likeliest first.

    The first two fillings with the first contact, all contacts with the likelier of these, all other fillings with the
    likeliest contact, and where one of them is likelier yet, the contacts with that once more.

    Parameters
    ----------
    records : sequence of PreparedRecord
        Of a rig in space, with probes.
    update : RigUpdate
        Of it.
    rig : Rig
        The updated rig with the unbalance that was found.
    progress : bool
        Show progress bars.
    """
    seconds = sum(record.duration for record in records)
    records = [loudest(record, MAX_SECONDS / seconds) for record in records]
    motions = _motions(records, rig, update.values)
    own = [parameters_of(m, update.clearance_priors, rest) for m, rest in zip(motions, rests_of(rig))]
    # That from whose fit the others begin first; a linear contact is a special case of all.
    nonlinear = [name for name in CONTACT_FAMILIES if name != "linear"]
    contacts = sorted(nonlinear, key=lambda name: CONTACT_FAMILIES[name].begins_from is not None)
    fillings = _fillings(rig)
    most = (2 * len(contacts) + len(fillings) - 1) * len(motions)
    bar = tqdm(desc="families", total=most, unit="fit", disable=not progress)

    def fitted(j: int, contact: str, filling: str, start: Mapping[str, float]) -> RoundFit:
        starts = [dict(start)] if start else grid_of_starts(motions[j])
        found = fit_round(motions[j], own[j], CONTACT_FAMILIES[contact], ALL_FILLINGS[filling], starts)
        bar.update()
        return found

    def of_all(contact: str, filling: str, before: Sequence[RoundFit]) -> list[RoundFit]:
        starts = [f.values | _start(contact, filling, f, m) for f, m in zip(before, motions)] or [{}] * len(motions)
        return list(pool.map(lambda j: fitted(j, contact, filling, starts[j]), range(len(motions))))

    def leading() -> tuple[str, str, Sequence[RoundFit]]:
        best = weighted(motions, found)[0]
        return best.contact, best.grease, cast(Sequence[RoundFit], best.fits)

    with bar, ThreadPoolExecutor(WORKERS) as pool:
        found = [of_all(contacts[0], filling, []) for filling in fillings[:2]]
        contact, filling, fits = leading()
        fits = list(pool.map(along_valley, fits, motions, own))
        found = [fits, *(of_all(contact, other, fits) for other in fillings[:2] if other != filling)]
        _, filling, fits = leading()
        if not any(m.touches(f.case) for m, f in zip(motions, fits)):
            contacts = contacts[:1]  # one is as good as another
        found += [of_all(contact, filling, fits) for contact in contacts[1:]]
        contact, _, fits = leading()
        for other in fillings[2:]:
            begun = (f for f in found if f[0].filling.name == ALL_FILLINGS[other].begins_from)
            found.append(of_all(contact, other, next(begun, fits)))
        contact, filling, fits = leading()
        if filling in fillings[2:]:
            found += [of_all(other, filling, fits) for other in contacts if other != contact]
    families = weighted(motions, found)
    names = update.estimates.names
    drawn = [dict(zip(names, row)) for row in update.estimates.draw(DRAWS, 0).tolist()]
    rigs = [rig_with(update.start, values).replace(unbalances=rig.unbalances) for values in drawn]
    with ThreadPoolExecutor(WORKERS) as pool:
        moved = list(pool.map(lambda r, values: _motions(records, r, values), rigs, drawn))
    spread = [
        spread_by_rig(m, [each[j] for each in moved], p, f)  # type: ignore[arg-type]
        for j, (m, p, f) in enumerate(zip(motions, own, families[0].fits))
    ]
    likeliest = dataclasses.replace(families[0], fits=_offsets(spread, rig, rigs))
    others = (dataclasses.replace(f, fits=_offsets(f.fits, rig)) for f in families[1:])  # type: ignore[arg-type]
    return (likeliest, *others)


def loudest(record: PreparedRecord, share: float) -> PreparedRecord:
    """Return the part of a record, a share of it, in which the shaft moves most; all of one that is short anyway."""
    n = len(record.signals)
    size = max(int(share * n), int(MIN_SECONDS * record.fs))
    if size >= n or record.displacement is None:
        return record
    power = np.concatenate(([0.0], np.cumsum(np.sum(record.displacement**2, axis=0))))
    first = int(np.argmax(power[size:] - power[:-size]))
    return record.part(slice(first, first + size))


def _motions(records: Sequence[PreparedRecord], rig: Rig, values: Mapping[str, float]) -> list[RoundMotion]:
    """Motions of all clearances on a rig, with values of its probes."""
    forces = [restoring_force(record, rig=rig, probes=values) for record in records]
    return [RoundMotion(forces, rig, j) for j in range(len(rig.bushings))]


def _fillings(rig: Rig) -> list[str]:
    """Names of the fillings that are tried, each after that from whose fit its own begins: oil, or all greases.

    Beside oil a spring with a squeeze film is tried, which does not know that the shaft turns.
    """
    if all(b.film for b in rig.bushings):
        return [OilFilled.name, LongFilmed.name]
    if not any(b.grease.stiffness for b in rig.bushings):  # nothing that could slide
        return [LongFilmed.name, *FIRST]
    return [
        LongFilmed.name,
        *(n for n, family in FILLING_FAMILIES.items() if n in FIRST or family.begins_from in FIRST),
    ]


def _start(contact: str, filling: str, fit: RoundFit, motion: RoundMotion) -> dict[str, float]:
    """What other families bring along."""
    found: dict[str, float] = {}
    if contact != fit.contact.name:
        found |= CONTACT_FAMILIES[contact].start(fit, motion)
    if filling != fit.filling.name:
        found |= ALL_FILLINGS[filling].start(fit, motion)
    return found


def grid_of_starts(motion: RoundMotion) -> list[dict[str, float]]:
    """Return gaps and contacts about the rig file's, with the shaft where that has it and in the motion's middle.

    A shaft that goes far into a soft wall shows neither the gap nor the middle, and from too wide a gap none is found.
    """
    y, z = motion.middle
    own, nominal = f"bushings[{motion.number}]", motion.nominal
    middle = {f"{own}.rest_y": -float(y), f"{own}.rest_z": -float(z)}
    sizes = itertools.product(GAPS, STIFFNESSES)
    contacts = [
        {
            f"{own}.gap": gap * nominal.gap,
            "contact stiffness": hardness * nominal.contact.stiffness,
            "contact cubic stiffness": hardness * nominal.contact.stiffness / nominal.gap**2,
        }
        for gap, hardness in sizes
    ]
    return [place | contact for place in ({}, middle) for contact in contacts]


def along_valley(fit: RoundFit, motion: RoundMotion, parameters: Sequence[Parameter]) -> RoundFit:
    """Return the best fit of those that begin with wider and narrower gaps whose nearest wall is where a fit has it.

    A shaft that touches one side alone shows where the wall is there, and hardly how far the other side is: the search
    ends in a long valley, before its lowest place.

    Parameters
    ----------
    fit : RoundFit
        Where the search ended.
    motion : RoundMotion
        What was fitted.
    parameters : sequence of Parameter
        As `fit_round` takes them.
    """
    for steps in VALLEY:
        while True:
            others = [each for step in steps if (each := _beside(fit, motion, parameters, step))]
            best = min(others, key=lambda each: each.misfit, default=fit)
            if best.misfit > (1 - LOWER) * fit.misfit:
                break
            fit = best
    return fit


def _beside(fit: RoundFit, motion: RoundMotion, parameters: Sequence[Parameter], step: float) -> RoundFit | None:
    """Fit from a gap that is wider by a factor; None where the shaft is too near to the middle to tell a side."""
    own, gap, rest = f"bushings[{motion.number}]", fit.case.bushing.gap, np.array(fit.case.rest)
    size = float(np.hypot(*rest))
    farther = (step - 1.0) * gap
    if size < OFF_CENTRE * gap or size + farther <= 0:
        return None
    y, z = (rest * (size + farther) / size).tolist()
    moved = {f"{own}.gap": step * gap, f"{own}.rest_y": y, f"{own}.rest_z": z}
    round_hole = {f"{own}.{name}": 0.0 for name in HOLE}
    return fit_round(motion, parameters, fit.contact, fit.filling, [fit.values | moved | round_hole])


def rests_of(rig: Rig) -> list[tuple[float, float]]:
    """Where the shaft rests in each clearance as the rig file has it, from its middle, m."""
    offsets = np.array([(b.offset_y, b.offset) for b in rig.bushings])
    standing = rig.replace(spin=None, unbalances=())
    try:
        moved = static_equilibrium(standing).displacement.reshape(-1, 2)
    except SimulationError:
        moved = np.zeros_like(offsets)
    return [tuple(each) for each in (offsets + moved).tolist()]


def _offsets(fits: Sequence[RoundFit], rig: Rig, drawn: Sequence[Rig] = ()) -> tuple[RoundFit, ...]:
    """Fits with the offsets of the unloaded shaft: where it rests, less what weight and forces do there."""
    moved = _moved_to_rest(fits, rig)
    others = np.array([_moved_to_rest(fits, other) for other in drawn]).reshape(-1, len(fits), 2) - moved
    spread = np.einsum("kji,kjl->jil", others, others) / max(len(drawn), 1)
    return tuple(f.offset_by(*each) for f, *each in zip(fits, moved, spread))


def _moved_to_rest(fits: Sequence[RoundFit], rig: Rig) -> np.ndarray:
    """How far (n_bushings, 2) weight and the forces of the clearances move the shaft from its unloaded place, m."""
    model = linear_model(rig, MODES)
    at = model.at_bushings
    compliance, sag = (at / model.omega**2) @ at.T, at @ (model.weight / model.omega**2)
    moved = np.zeros(2 * len(fits))
    for _ in range(ROUNDS):
        forces = np.concatenate([_force_at_rest(f, m) for f, m in zip(fits, moved.reshape(-1, 2))])
        moved = 0.5 * moved + 0.5 * (sag - compliance @ forces)
    return moved.reshape(-1, 2)


def _force_at_rest(fit: RoundFit, moved: np.ndarray) -> np.ndarray:
    """Force (2,) of the clearance on a shaft that has come from its unloaded place to rest, N, without friction."""
    offset = np.array(fit.case.rest) - moved
    bushing = dataclasses.replace(fit.case.bushing, friction=None, radius=1.0)
    case = fit.case._replace(bushing=bushing, rest=tuple(offset.tolist()))
    x = np.stack([np.zeros((3, 2)), np.tile(moved, (3, 1))])
    unloaded, loaded = forces_along(case, x, np.zeros_like(x), np.zeros(2), 1.0)
    return np.asarray(loaded - (unloaded if np.hypot(*offset) < bushing.gap else 0.0))
