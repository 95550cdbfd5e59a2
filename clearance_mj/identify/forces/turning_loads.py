"""Loads that turn with a shaft and are not in its rig file: unbalance, a bend, a coupling that pulls twice per turn.

A probe shows a bend in slow turning as it does run-out, but at speed the bend is amplified, with its shape b along the
shaft: M q̈ + C q̇ + K (q - b e^(iφ)) = 0 (Nicholas, Gunter & Allaire, J. Eng. Power 98, 1976). K b is forces of order 1,
which do not depend on the speed as those of an unbalance do. Evidence says whether they are there.
"""

from __future__ import annotations

import cmath
import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from ...estimate import Estimates, Parameter
from ...linear import LinearModel, linear_model
from ...rig import Order, Rig
from ..records.dry_whirl import without_dry_whirl
from ..records.prepared import PreparedRecord
from ..structure.hypotheses.candidate import place_words, places_along
from .turning import MODES, TIMES, TurningFit, TurningLines, TurningLoad, fit_loads, in_slow_roll, lines_of, times_of

__all__ = ["TurningLoads", "find_turning_loads"]

BENT = np.array([0.2, 0.4, 0.6, 0.8])  # of a shaft's length: forces that bend it like a bent one
ENDS = np.array([0.05, 0.3]), np.array([0.95, 0.7])  # the same, of couplings: a moment on an end that may give
ALONG = np.linspace(0.02, 0.98, 49)  # of a shaft's length: points at which its deflection is computed
SIZE = 0.1  # of the narrowest gap: 1 σ of the shaft's deflection by each of these forces
LARGEST = 10.0  # times the rig file's: 1 σ of an unbalance
ACCEPTED = 5.0  # log evidence, from which on they are there
CERTAIN = 3.0  # standard deviations of their size, too
DRIFT = 0.003  # fraction of a steady speed, from which on it is said to creep

Values: TypeAlias = Mapping[str, float]


class LoadHypothesis(NamedTuple):
    """Loads that may act together, the names of the deflections they cause, and words for these."""

    loads: tuple[Order, ...]
    named: tuple[tuple[str, str], ...]


BEND = (("bend of the shaft", "the shaft is bent: what probes show of that in slow turning is no run-out"),)
COUPLING = tuple(
    (f"bend twice per turn, {way} the spin", f"a load twice per turn, as of a misaligned coupling, {way} the spin")
    for way in ("with", "against")
)


@dataclass(frozen=True, eq=False)
class TurningLoads:
    """Loads that turn with a shaft."""

    rig: Rig
    """with it"""
    remainders: Mapping[float, np.ndarray]
    """(2, n_probes) motion by clearances in the slow turning, m, by multiples of the turns"""
    estimates: Estimates
    """of the unbalance, and of the shaft's deflection by the other identified loads"""
    warnings: tuple[str, ...]

    def with_slow_roll_restored(self, record: PreparedRecord, probes: Values) -> PreparedRecord:
        """Return a record whose probes show again the motion in the slow turning that was taken for their run-out.

        Parameters
        ----------
        record : PreparedRecord
            Without run-out.
        probes : mapping of str to float
            Gains and places of the probes.
        """
        if record.turning is None or not record.slow_roll:
            return record
        model, signals = linear_model(self.rig, MODES), record.signals.copy()
        rows = model.at_probes(probes)
        for times, remainder in self.remainders.items():
            phase = times * record.turning.angle
            motion = in_slow_roll(model, rows, record.slow_roll, times) - remainder
            signals[:, -1 - len(rows) : -1] += np.column_stack((np.cos(phase), np.sin(phase))) @ motion
        return dataclasses.replace(record, signals=signals, slow_roll=0.0)


def find_turning_loads(
    rig: Rig, records: Sequence[PreparedRecord], probes: Values, drawn: Sequence[tuple[Rig, Values]] = ()
) -> TurningLoads:
    """Return the loads that turn with the shaft of records, at one speed or in a ramp, whatever clearances do in them.

    Further unbalances are believed as the rig file has them, and its orders.

    Parameters
    ----------
    rig : Rig
        As updated; without an unbalance none is looked for, as no place of one is known.
    records : sequence of PreparedRecord
        Of it, such as `prepare_turning` returns them.
    probes : mapping of str to float
        Gains and places of the probes.
    drawn : sequence of tuple of Rig and mapping of str to float
        The same of rigs from the posterior, by which intervals are widened.
    """
    without_whirl, words = {record.name: without_dry_whirl(record) for record in records}, _creep_warnings(records)
    for record in records:
        if (remaining := without_whirl[record.name]) is not record:
            used = f"{remaining.duration:.3g} s without that tell" if remaining else "it does not tell"
            words.append(
                f'record "{record.name}": the shaft whirls dry, backwards round the wall of a clearance; {used} what '
                "turns with it"
            )
    used_records = [r for r in without_whirl.values() if r and _fastest_spin(r) > 1.01 * r.slow_roll]
    if not used_records:
        return TurningLoads(rig, {}, Estimates.of([], [], np.zeros((0, 0))), tuple(words))
    fixed: list[TurningLoad] = [*rig.unbalances[1:], *(order for order in rig.orders if times_of(order) in TIMES)]
    rigs = (rig, probes), *drawn
    lines, *drawn_lines = ([lines_of(each, r, values, fixed) for r in used_records] for each, values in rigs)
    loads = _LoadSearch(rig, lines, drawn_lines).find()
    return dataclasses.replace(loads, warnings=(*words, *loads.warnings))


def _creep_warnings(records: Sequence[PreparedRecord]) -> list[str]:
    """Say in words which speeds creep, where records say that they are steady."""
    steady = [r for r in records if not (r.tested.spin and r.tested.spin.rate)]
    return [
        f'record "{r.name}": its speed creeps by {100 * r.turning.drift:+.2g} % and its file says that it is steady; '
        "its keyphasor's angle is taken"
        for r in steady
        if r.turning and abs(r.turning.drift) > DRIFT
    ]


def _fastest_spin(record: PreparedRecord) -> float:
    """Fastest spin of a record, rad/s."""
    return 0.0 if record.turning is None else float(np.abs(record.turning.speed).max())


class _LoadSearch(NamedTuple):
    """Search for turning loads in lines of records on the updated rig, and on others from its posterior."""

    rig: Rig
    lines: Sequence[TurningLines]
    drawn: Sequence[Sequence[TurningLines]]

    def find(self) -> TurningLoads:
        """Return the unbalance, and those hypotheses that evidence accepts, the likeliest first."""
        accepted: tuple[LoadHypothesis, ...] = ()
        loads = self.measured(accepted)
        rivals = _hypotheses(self.rig) if self.lines[0].model.omega.all() else []
        while rivals:
            gains = [self.gain(accepted, rival) for rival in rivals]
            best = rivals[int(np.argmax(gains))]
            rival_loads = self.measured((*accepted, best)) if max(gains) > ACCEPTED else loads
            if len(rival_loads.warnings) == len(loads.warnings):
                break
            accepted, loads = (*accepted, best), rival_loads
            rivals = [rival for rival in rivals if rival.named != best.named]
        return loads

    def gain(self, accepted: Sequence[LoadHypothesis], rival: LoadHypothesis) -> float:
        """Return the gain of log evidence by another hypothesis, with errors as large as those of its fit."""
        wide = math.sqrt(max(self.fit(self.lines, (*accepted, rival)).excess, 1.0))
        more, fewer = (self.fit(self.lines, each, wide).evidence for each in ((*accepted, rival), accepted))
        return more - fewer

    def fit(
        self, lines: Sequence[TurningLines], accepted: Sequence[LoadHypothesis], widening: float = 1.0
    ) -> TurningFit:
        gap = min((b.gap for b in self.rig.bushings), default=1.0)
        orders, unbalances = _orders(accepted), self.rig.unbalances[:1]
        largest = [LARGEST * load.moment for load in unbalances]
        largest += [SIZE * gap / float(np.abs(row).max()) for row in _deflections(self.lines[0].model, orders)[1].T]
        return fit_loads(lines, (*unbalances, *orders), largest, widening)

    def measured(self, accepted: Sequence[LoadHypothesis]) -> TurningLoads:
        """Return a rig with loads, and their sizes with intervals: but for the unbalance, of certain ones only."""
        fit, orders, unbalances = self.fit(self.lines, accepted), _orders(accepted), self.rig.unbalances[:1]
        first, n = len(unbalances), 2 * (len(unbalances) + len(orders))
        draws = np.array([self.fit(lines, accepted).value[:n] for lines in self.drawn]).reshape(len(self.drawn), n)
        covariance = fit.covariance[:n, :n] + (np.cov(draws.T).reshape(n, n) if len(draws) > 1 else 0.0)
        value, points, bent = fit.value[:n:2] + 1j * fit.value[1:n:2], *_deflections(self.lines[0].model, orders)
        sizes = [("unbalances[0].moment", "unbalances[0].phase", "", row) for row in np.eye(len(value))[:first]]
        for name, words, relative_std in _sizes(accepted):
            at = int(np.argmax(np.abs(bent @ (relative_std * value[first:]))))
            row = np.concatenate((np.zeros(first), relative_std * bent[at]))
            sizes.append((name, f"phase of the {name}", f"{words}, at {place_words(points[at])}", row))
        parameters, numbers, slopes, warnings = [], list[float](), [np.zeros((0, n))], []
        for name, angle, words, row in sizes:
            total = complex(row @ value)
            relative_slope = (row[:, None] * [1, 1j] / total).ravel()  # of the logarithm and, imaginary, of the phase
            size, phase, slope = abs(total), cmath.phase(total), np.array([relative_slope.real, relative_slope.imag])
            relative_std, phase_std = np.sqrt(np.diag(slope @ covariance @ slope.T))
            if words and relative_std * CERTAIN > 1:
                continue
            parameters += [
                Parameter(name, "m" if words else "kg m", size, 1e-6 * size, 1e6 * size),
                Parameter(angle, "rad", phase, phase - math.pi, phase + math.pi, transform="linear"),
            ]
            numbers, slopes = [*numbers, size, phase], [*slopes, slope]
            if words:
                warnings.append(
                    f"{words}: {1e6 * size:.3g} ± {1e6 * relative_std * size:.2g} µm at {math.degrees(phase):.0f} ± "
                    f"{math.degrees(phase_std):.1g}° from the keyphasor's mark; the rig has orders for it"
                )
        by_load = np.concatenate(slopes)
        heavy = [dataclasses.replace(u, moment=abs(z), phase=cmath.phase(z)) for u, z in zip(unbalances, value)]
        turning = [dataclasses.replace(o, force=abs(z), phase=cmath.phase(z)) for o, z in zip(orders, value[first:])]
        rig = self.rig.replace(unbalances=(*heavy, *self.rig.unbalances[1:]), orders=(*self.rig.orders, *turning))
        remainders = fit.value[n:].reshape(len(TIMES), -1, 2).swapaxes(1, 2)
        estimates = Estimates.of(parameters, numbers, by_load @ covariance @ by_load.T)
        return TurningLoads(rig, dict(zip(TIMES, remainders)), estimates, tuple(warnings))


def _orders(accepted: Sequence[LoadHypothesis]) -> tuple[Order, ...]:
    return tuple(load for hypothesis in accepted for load in hypothesis.loads)


def _hypotheses(rig: Rig) -> list[LoadHypothesis]:
    def loads(shares: np.ndarray, *orders: float) -> tuple[Order, ...]:
        return tuple(Order(x, order, 1.0) for order in orders for _, x in places_along(rig, shares))

    return [LoadHypothesis(loads(BENT, 1.0), BEND), *(LoadHypothesis(loads(end, 2.0, -2.0), COUPLING) for end in ENDS)]


def _sizes(accepted: Sequence[LoadHypothesis]) -> Iterator[tuple[str, str, np.ndarray]]:
    """Yield names and words of sizes, with the orders that they count, (n_orders,): each as many of a hypothesis."""
    first, count = 0, sum(len(hypothesis.loads) for hypothesis in accepted)
    for hypothesis in accepted:
        indicators = np.eye(count)[first : first + len(hypothesis.loads)]
        rows = indicators.reshape(len(hypothesis.named), -1, count).sum(axis=1)
        yield from ((*named, row) for named, row in zip(hypothesis.named, rows))
        first += len(indicators)


def _deflections(model: LinearModel, loads: Sequence[Order]) -> tuple[list[float | str], np.ndarray]:
    """Points along the shafts, and their deflections (n_points, n_loads) at rest per N, m."""
    points = [x for _, x in places_along(model.rig, ALONG)]
    if not loads:
        return points, np.zeros((len(points), 0))
    return points, model.static_deflection(points, model.shapes([load.position for load in loads]))
