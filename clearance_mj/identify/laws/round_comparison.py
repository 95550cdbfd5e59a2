"""Families of contact and filling compared at round clearances, and where the unloaded shaft then is in them."""

from __future__ import annotations

import dataclasses
from collections import ChainMap
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from tqdm import tqdm

from ...clearance.family import CONTACT_FAMILIES, FILLING_FAMILIES, ROUND_FILLING_FAMILIES
from ...clearance.greases.bouc_wen import LinearWithFilm
from ...clearance.round_cycle import fill_round_forces
from ...clearance.round_kernel import round_records
from ...core.errors import SimulationError
from ...engines.equilibrium import static_equilibrium
from ...rig import Rig
from ...rotors.spatial import SpatialModel, spatial_model
from ..forces.restoring import MODES, restoring_force
from ..records.prepared import PreparedRecord
from ..structure.rig_update import RigUpdate
from .comparison import WORKERS, FamilyFit, weighted
from .round_fit import RoundFit, fit_round, parameters_of, placed
from .round_motion import RoundMotion

__all__ = ["compare_round_families", "rests_of"]

ALL_FILLINGS = ChainMap(FILLING_FAMILIES, ROUND_FILLING_FAMILIES)
ROUNDS = 50  # of the shaft's sag under its weight and the filling's springs


def compare_round_families(
    records: Sequence[PreparedRecord], update: RigUpdate, rig: Rig, progress: bool = False
) -> tuple[FamilyFit, ...]:
    """Fit families of contact and filling to the restoring forces along y and z; likeliest first.

    All contacts with the first filling, then all other fillings with the likeliest contact.

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
    forces = [
        restoring_force(record, rig=rig, probes=update.values)
        for record in tqdm(records, desc="forces", disable=not progress)
    ]
    motions = [RoundMotion(forces, rig, j) for j in range(len(rig.bushings))]
    rests = rests_of(rig)
    own = [parameters_of(m, update.clearance_priors, rest) for m, rest in zip(motions, rests)]
    contacts, fillings = list(CONTACT_FAMILIES.values()), _fillings(rig)
    bar = tqdm(
        desc="families", total=(len(contacts) + len(fillings) - 1) * len(motions), unit="fit", disable=not progress
    )

    def fitted(j: int, contact: str, filling: str, start: Mapping[str, float]) -> RoundFit:
        starts = [dict(start)] if start else [circle_start(motions[j], own[j])]
        found = fit_round(motions[j], own[j], CONTACT_FAMILIES[contact], ALL_FILLINGS[filling], starts)
        bar.update()
        return found

    def of_all(contact: str, filling: str, before: Sequence[RoundFit]) -> list[RoundFit]:
        starts = [f.values | _start(contact, filling, f, m) for f, m in zip(before, motions)] or [{}] * len(motions)
        return list(pool.map(lambda j: fitted(j, contact, filling, starts[j]), range(len(motions))))

    found: list[list[RoundFit]] = []
    with bar, ThreadPoolExecutor(WORKERS) as pool:
        for contact in sorted(contacts, key=lambda c: c.begins_from is not None):
            found.append(of_all(contact.name, fillings[0], found[0] if found else []))
        best = weighted(motions, found)[0]
        for filling in fillings[1:]:
            before = next((f for f in found if f[0].filling.name == ALL_FILLINGS[filling].begins_from), best.fits)
            found.append(of_all(best.contact, filling, before))  # type: ignore[arg-type]
    families = weighted(motions, found)
    return tuple(dataclasses.replace(f, fits=_offsets(f.fits, rig)) for f in families)  # type: ignore[arg-type]


def _fillings(rig: Rig) -> list[str]:
    """Names of the fillings that are tried, each after that from whose fit its own begins: oil, or all greases.

    Beside oil a spring with a squeeze film is tried, which does not know that the shaft turns.
    """
    if all(b.film for b in rig.bushings):
        return [*ROUND_FILLING_FAMILIES, LinearWithFilm.name]
    names, found = list(FILLING_FAMILIES), list[str]()
    while len(found) < len(names):
        found += [n for n in names if n not in found and FILLING_FAMILIES[n].begins_from in (None, *found)]
    return found


def _start(contact: str, filling: str, fit: RoundFit, motion: RoundMotion) -> dict[str, float]:
    """What other families bring along."""
    found: dict[str, float] = {}
    if contact != fit.contact.name:
        found |= CONTACT_FAMILIES[contact].start(fit, motion)
    if filling != fit.filling.name:
        found |= ALL_FILLINGS[filling].start(fit, motion)
    return found


def circle_start(motion: RoundMotion, parameters: Sequence[object]) -> dict[str, float]:
    """Return gap and place of the shaft as the smallest circle about its motion has them."""
    (y, z), radius = motion.middle
    own = f"bushings[{motion.number}]"
    return {f"{own}.rest_y": -float(y), f"{own}.rest_z": -float(z), f"{own}.gap": 0.98 * radius}


def rests_of(rig: Rig) -> list[tuple[float, float]]:
    """Where the shaft rests in each clearance as the rig file has it, from its middle, m."""
    offsets = np.array([(b.offset_y, b.offset) for b in rig.bushings])
    standing = rig.replace(spin=None, unbalances=())
    try:
        moved = static_equilibrium(standing).displacement.reshape(-1, 2)
    except SimulationError:
        moved = np.zeros_like(offsets)
    return [tuple(each) for each in (offsets + moved).tolist()]


def _offsets(fits: Sequence[RoundFit], rig: Rig) -> tuple[RoundFit, ...]:
    """Fits with the offsets of the unloaded shaft: where it rests, less what weight and forces do there."""
    model: SpatialModel = spatial_model(rig, MODES, turning=False if rig.spin is None else None)
    n = len(fits)
    at = model.at_points[:n].reshape(2 * n, model.size)
    compliance, sag = (at / model.omega**2) @ at.T, at @ (model.weight / model.omega**2)
    rest = np.array([f.case.rest for f in fits]).ravel()
    moved = np.zeros(2 * n)
    for _ in range(ROUNDS):
        forces = np.concatenate([_force_at_rest(f, m) for f, m in zip(fits, moved.reshape(-1, 2))])
        moved = 0.5 * moved + 0.5 * (sag - compliance @ forces)
    return tuple(
        dataclasses.replace(f, bushing=placed(f.bushing, each)) for f, each in zip(fits, (rest - moved).reshape(-1, 2))
    )


def _force_at_rest(fit: RoundFit, moved: np.ndarray) -> np.ndarray:
    """Force (2,) of the clearance on a shaft that has come from its unloaded place to rest, N, without friction."""
    case, offset = fit.case, np.array(fit.case.rest) - moved
    bushing = dataclasses.replace(case.bushing, friction=None, offset=0.0, offset_y=0.0, radius=1.0)
    from types import SimpleNamespace

    records = round_records(SimpleNamespace(bushings=(bushing,)), case.law, 1.0)  # type: ignore[arg-type]
    records.bushings["offset_y"], records.bushings["offset_z"] = offset
    out = np.empty((2, 2))
    x = np.stack([np.zeros((3, 2)), np.tile(moved, (3, 1))])
    fill_round_forces(x, np.zeros_like(x), np.zeros(2), 1.0, np.array(case.out_of_round), records, out)
    return np.asarray(out[1] - (out[0] if np.hypot(*offset) < bushing.gap else 0.0))
