"""The clearance from orbits alone: two probes in each bushing and a keyphasor of a machine in operation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...clearance import ContactLaw, KelvinVoigt
from ...core.errors import RecordError
from ...core.kinds import checks_kinds
from ...estimate import Parameter, Solution, solve
from ...estimate.loss import UnknownScale
from ...io.dataset import Dataset, Record
from ...model import Model
from ...rig import Bushing, Friction, Rig, Unbalance
from ...rig.examples import example_words, unknown_examples
from ..laws.case import hole_of, placed
from ..laws.measured_motion import smallest_circle
from ..laws.rest import rests_of
from ..records.prepared import PreparedRecord, prepared, require_one_mark
from ..structure.priors import priors, rig_with
from .contacts import with_likeliest_contacts
from .gains import places_of_unbalance
from .orbit_fit import ClearanceInOperation, OrbitFit
from .problem import ClearanceFamilies, LawProblem, law_parameters, places_of
from .search import FIRST, fit_contact_law, fit_without_contact
from .windows import BandLimits, bands_of, linear_parameters, select_windows

__all__ = ["orbits"]

LIKELY = 10.0  # logarithm of the odds from which on contact is seen
KNOWN = 0.08  # standard deviation of the gap's logarithm up to which it counts as seen
REPEATED = 2.0  # factor on a film's part of it: errors of the rig file are the same in all windows of a record
SHAPE = 0.15  # of the deepest penetration: error of a gap by a contact law of another shape
WEIGHT = 50.0  # N, of the size of a force at rest where the rig file tells no mass
STEP_AROUND = math.radians(10)  # sectors in which the touched part of a wall is counted
COMMON_GAIN = 0.01  # 1 σ of the gain of a pair of probes, which scales all that they show


@checks_kinds
def orbits(records: Dataset | Sequence[Record], rig: Rig | None = None, model: Model | None = None) -> OrbitFit:
    """Find the clearances of a turning shaft from records of probes and keyphasor alone.

    Unbalance excites the shaft; the forces in its clearances follow from two probes in each, up to unbalance, run-out
    and open parameters of the rig file, which are fitted with the gap, the place of the shaft, contact, friction and
    filling, from records at several speeds or a run-up. A slow roll among them shows the run-out.

    Parameters
    ----------
    records : Dataset or sequence of Record
        Those of a shaft that turns, excited by nothing else; of a dataset none to validate.
    rig : Rig, optional
        Instead of the records' own.
    model : Model, optional
        Whose rig is taken instead, as identified before.

    Returns
    -------
    OrbitFit

    Raises
    ------
    RecordError
        If there is no such record, the rig has no bushings or moves in a plane, or a record lacks its probes.
    """
    chosen, rig = _select_records(records, rig or (model.rig if model else None))
    windows = [window for record in chosen for window in select_windows(record)]
    bands = bands_of(rig, windows)
    rig_priors = priors(rig, bands.force, probes=True)
    usual = [*rig_priors, *(p for p in priors(rig.replace(tolerances=())) if p.name.endswith(".gap"))]
    places, rests, weight = places_of(rig), rests_of(rig), 9.81 * (rig.total_mass or WEIGHT / 9.81)
    varied = linear_parameters(rig, rig_priors)

    def law_priors(places: Sequence[ClearanceFamilies], touching: bool = True) -> list[Parameter]:
        return [
            p for place in places for p in law_parameters(place, usual, rests[place.number], True, weight, touching)
        ]

    begin = fit_without_contact(rig, windows, bands, places, varied, law_priors(places, False))
    solution = fit_contact_law(rig, windows, bands, places, varied, law_priors(places), begin)
    odds = _odds(solution, law_priors(places, False))
    solution = with_likeliest_contacts(solution, (odds > LIKELY).tolist(), law_priors)
    return _orbit_fit(rig, chosen, bands, solution, odds)


def _select_records(records: Dataset | Sequence[Record], rig: Rig | None) -> tuple[list[PreparedRecord], Rig]:
    given = [*records.identify, *records.orbits] if isinstance(records, Dataset) else list(records)
    drawn = rig or (records.rig if isinstance(records, Dataset) else given[0].rig if given else None)
    if drawn is None:
        raise RecordError("there are no records; give some of a shaft that turns")
    if not drawn.bushings:
        raise RecordError(f"rig {drawn.name!r} has no bushings, so there is no clearance to find")
    if not drawn.moves_across:
        raise RecordError(f'rig {drawn.name!r} moves in a plane and has no orbits; give its bushings shape = "round"')
    if not (turning := {r.name: r for r in given if r.excitation_kind == "spin"}):
        raise RecordError('no record is of a shaft that turns alone (kind "spin"), which orbits are found in')
    for record in turning.values():
        if record.missing_probes:
            number, label = record.missing_probes[0]
            raise RecordError(f'record "{record.name}": bushings[{number}] has no displacement probe at {label}')
        if not any(np.ptp(c.value) for c in record.channels if c.quantity == "displacement"):
            raise RecordError(
                f'record "{record.name}": no probe moves; needs orbits of a shaft that turns, with its unbalance'
            )
    rates = {record.fs for record in turning.values()}
    if len(rates) > 1:
        raise RecordError(f"records are sampled at {', '.join(f'{fs:g}' for fs in sorted(rates))} Hz; needs one rate")
    chosen = [prepared(replace(r, rig=drawn) if rig is not None else r) for r in turning.values()]
    require_one_mark(chosen)
    return chosen, drawn


def _odds(solution: Solution, law_priors: Sequence[Parameter]) -> np.ndarray:
    """(n_bushings,) logarithm of the likelihood of laws with contact over that of laws without it."""
    problem = solution.problem
    assert isinstance(problem, LawProblem) and isinstance(solution.loss, UnknownScale)
    rival = LawProblem(problem.forces, problem.places, law_priors, touching=False)
    solution_without = solve(rival, [rival.at(dict(zip(problem.names, solution.values.tolist())))], stop=FIRST)
    n = solution.residuals.size / max(solution.loss.correlated, 1.0)
    scales = [float(solution.loss.scale(s.residuals)) for s in (solution_without, solution)]
    return np.full(len(problem.places), 0.5 * n * math.log(scales[0] / scales[1]))


def _orbit_fit(
    rig: Rig, records: Sequence[PreparedRecord], bands: BandLimits, fit: Solution, odds: np.ndarray
) -> OrbitFit:
    problem = fit.problem
    assert isinstance(problem, LawProblem) and isinstance(fit.loss, UnknownScale)
    correlated = max(fit.loss.correlated, 1.0)
    estimates = fit.estimates(np.linalg.inv(fit.information / correlated + fit.prior))
    values = dict(zip(estimates.names, estimates.value.tolist()))
    std = dict(zip(estimates.names, estimates.varied_std.tolist()))
    linear = {n: values[n] for n in problem.names[: problem.n_linear] if "unbalance" not in n and "run-out" not in n}
    base, identified = rig_with(rig, linear), [n for n in estimates.names if n not in estimates.only_prior]
    clearances = [_clearance(rig, problem, p, values, std, float(odds[p.number])) for p in problem.places]
    bushings, contacts = [], []
    for place, clearance, bushing in zip(problem.places, clearances, base.bushings):
        if clearance.seen:
            sag = np.array(rests_of(base)[place.number]) - (bushing.offset_y, bushing.offset)
            filled = _with_filling(bushing, place, values, clearance)
            hole = hole_of(bushing, clearance.gap, estimates, f"bushings[{place.number}].")
            bushing = placed(filled, np.array(clearance.rest) - sag, gap=clearance.gap, **hole)
        else:
            identified = [name for name in identified if not name.startswith(f"bushings[{place.number}].")]
        bushings.append(bushing)
        datasheet = KelvinVoigt(bushing.contact.stiffness, bushing.contact.damping)
        contacts.append(clearance.contact_model if clearance.seen and clearance.contact_model else datasheet)
    misfit, names = float(fit.loss.scale(fit.residuals)) ** 0.5, tuple(r.name for r in records)
    examples = unknown_examples(rig.examples, identified)
    words = (f"of the rig file, {example_words(examples)}",) if examples else ()
    spin = rig.spin or max((r.tested.spin for r in records if r.tested.spin), key=lambda spin: spin.fastest)
    base = base.replace(bushings=tuple(bushings), unbalances=_unbalances(rig, values), examples=examples, spin=spin)
    warnings = _warnings(records, misfit) + words
    model = Model(base, ContactLaw(contacts))
    return OrbitFit(model, tuple(clearances), estimates, names, misfit, bands, rig, warnings)


def _with_filling(
    bushing: Bushing, place: ClearanceFamilies, values: dict[str, float], clearance: ClearanceInOperation
) -> Bushing:
    """Return a bushing with the identified filling and, if the shaft touches, friction and the contact's size."""
    prefix, nominal = f"bushings[{place.number}]", place.nominal
    if clearance.contact_model:
        mu, (k, c) = values[f"{prefix}.friction"], clearance.contact_model.largest(clearance.deepest)
        contact = replace(bushing.contact, stiffness=k, damping=c)
        bushing = replace(bushing, contact=contact, friction=replace(bushing.friction or Friction(mu), coefficient=mu))
    if bushing.film:
        film = replace(bushing.film, viscosity=values[f"{prefix}.grease viscosity"])
        return replace(bushing, film=film)
    filling = (values.get(f"{prefix}.{p.name}", 0.0) for p in place.filling.parameters(nominal))
    return replace(bushing, grease=place.filling.make(nominal, *filling))


def _unbalances(rig: Rig, values: dict[str, float]) -> tuple[Unbalance, ...]:
    """Return the identified unbalances, each at its angle from the keyphasor's mark."""
    unbalances = []
    for i, (x, _) in enumerate(places_of_unbalance(rig)):
        along, across = (values[f"unbalances[{i}] {part} the mark"] for part in ("along", "across"))
        unbalances.append(Unbalance(x, math.hypot(along, across), math.atan2(across, along)))
    return tuple(unbalances)


def _clearance(
    rig: Rig, problem: LawProblem, place: ClearanceFamilies, values: dict[str, float], std: dict[str, float],
    odds: float,
) -> ClearanceInOperation:  # fmt: skip
    prefix = f"bushings[{place.number}]"
    ends, _ = problem.points(values)[place.number]
    rest = np.array([values[f"{prefix}.rest_{axis}"] for axis in "yz"])
    positions, gap = problem.end_positions(place, values).reshape(-1, 2), values[f"{prefix}.gap"]
    distance = np.hypot(*positions.T)
    touches = odds > LIKELY and bool(distance.max() > gap)
    depth = float(distance.max()) / gap - 1 if touches else 0.0
    directions = (positions / distance[:, None])[distance > gap] if touches else np.empty((0, 2))
    arc = np.unique(np.arctan2(*directions.T) // STEP_AROUND).size * STEP_AROUND
    # A contact of another shape moves the middle as far as one side is touched more than the other.
    shift = SHAPE * depth * gap * float(np.hypot(*directions.sum(axis=0))) / max(len(directions), 1)
    rest_std = [math.hypot(std[f"{prefix}.rest_{axis}"], shift) for axis in "yz"]
    repeated = 1.0 if touches else REPEATED
    gap_std = math.sqrt((repeated * std[f"{prefix}.gap"]) ** 2 + COMMON_GAIN**2 / 2 + (SHAPE * depth) ** 2)
    seen = gap_std < KNOWN and (touches or place.filling.round_only)
    radius = smallest_circle(ends[:: max(1, len(ends) // 20000), 0])[1]
    law = {n.partition("].")[2]: (v, std[n]) for n, v in values.items() if n.startswith(prefix) and _is_law(n)}
    return ClearanceInOperation(
        rig.clearance_labels[place.number], seen, touches, odds, gap if seen else rig.bushings[place.number].gap,
        gap_std, (float(rest[0]), float(rest[1])), (rest_std[0], rest_std[1]),
        radius / (1 + 2 * COMMON_GAIN), arc, law, ends[:, 0],
        problem.case(place, values).law.contact[0] if touches else None, depth * gap,
    )  # fmt: skip


def _is_law(name: str) -> bool:
    return any(word in name for word in (".contact ", ".grease ", ".friction"))


def _warnings(records: Sequence[PreparedRecord], misfit: float) -> tuple[str, ...]:
    warnings = []
    speeds = [abs(r.turning.mean_speed) for r in records if r.turning]
    if len(records) == 1 and not (records[0].tested.spin and records[0].tested.spin.rate):
        warnings.append(
            "one speed alone hardly tells unbalance and run-out apart: give more speeds, a run-up or a slow roll"
        )
    elif speeds and min(speeds) > 0.35 * max(speeds):
        warnings.append("no record turns slowly: run-out is told by the faster ones alone, with the unbalance")
    if misfit > 1.5:
        warnings.append(f"rig and laws miss {misfit:.2g} times what they are expected to: intervals may be too narrow")
    return tuple(warnings)
