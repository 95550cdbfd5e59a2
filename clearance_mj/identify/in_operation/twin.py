"""The twin of a machine in operation: gap, oil and rubs along a record of probes and keyphasor, window by window.

Everything but gap and viscosity is as the orbits had it that the twin begins from. A window refines what is believed of
these, widened by a random walk; a change of either beyond what the windows' covariances explain is an alarm. So is a
rub: forces that neither the known law nor the shaft explains, as no window had them while the twin learned.
"""

from __future__ import annotations

import itertools

import numpy as np

from ...core.errors import RecordError
from ...core.kinds import checks_kinds
from ...estimate.beliefs import Belief
from ...io.dataset import Record
from ..follow.alarms import RUB, Alarm
from ..follow.follower import Follower, Label
from ..follow.history import Twin
from ..records.prepared import prepared
from .forces import ForceMaker, forces_in
from .found import OrbitFit
from .problem import LawProblem, acts_without_contact, places_of, real
from .windows import LENGTH, Window, windows_of

__all__ = ["follow_orbits"]

HOP = 0.75  # s, from one window to the next
TRACKED = {"gap": "gap", "grease viscosity": "viscosity"}  # fields of laws, and what they are tracked as
LEARNED = 6  # windows from which on it is known how much is missed in health
BEYOND, RISE = 6.0, 1.5  # standard deviations of what is missed in health, and factor on it, beyond which is a rub
BLOCK = 200  # successive residuals that may be correlated
IN_A_ROW = 3  # windows that show a rub before it counts: two hold what was before a sudden change and what is after


@checks_kinds
def follow_orbits(record: Record, found: OrbitFit) -> Twin:
    """Follow gaps and oil films along a record of a machine in operation, with alarms where they change or rub.

    Parameters
    ----------
    record : Record
        Two probes in each bushing and a keyphasor, of a shaft that unbalance alone excites.
    found : OrbitFit
        What earlier orbits of the machine told, see `orbits`.

    Returns
    -------
    Twin

    Raises
    ------
    RecordError
        If the record lacks probes or is shorter than the twin learns from.
    """
    if record.missing_probes:
        number, label = record.missing_probes[0]
        raise RecordError(f'record "{record.name}": bushings[{number}] has no displacement probe at {label}')
    whole = prepared(record)
    shortest = LENGTH + LEARNED * HOP
    if whole.turning is None or whole.duration < shortest:
        raise RecordError(
            f'record "{record.name}": lasts {whole.duration:.4g} s; a twin learns from {shortest:.3g} s of turning'
        )
    follower = _OrbitFollower(found)
    *histories, alarms = zip(*(follower.take(window) for window in windows_of(whole, LENGTH, HOP)))
    time, mean, std, contact, misfit = map(np.array, histories)
    return Twin(
        record.name, found.rig, time, LENGTH, np.full(len(follower.places), np.nan), np.moveaxis(mean, 1, 0),
        np.moveaxis(std, 1, 0), contact, misfit, tuple(itertools.chain(*alarms)), quantities=follower.quantities,
    )  # fmt: skip


class _OrbitFollower:
    """The twin's state, fed window by window."""

    def __init__(self, found: OrbitFit) -> None:
        self.found, self.places = found, places_of(found.drawn, [c.contact for c in found.clearances])
        self.values = dict(zip(found.estimates.names, found.estimates.value.tolist()))
        own = {p.name: p for p in found.estimates.parameters}
        split = list(own).index(f"bushings[{self.places[0].number}].gap")
        self.uncertain, self.own = list(own.values())[:split], list(own.values())[split:]
        self.touching = any(c.touches for c in found.clearances)
        oil = any(place.filling.round_only for place in self.places)
        self.quantities = ("gap", "viscosity") if oil else ("gap",)
        seen = [place for clearance, place in zip(found.clearances, self.places) if clearance.seen]
        fields = [(p.number, field) for field in TRACKED for p in seen if field == "gap" or p.filling.round_only]
        self.names = [f"bushings[{number}].{field}" for number, field in fields]
        self.labels: list[Label] = [(number, TRACKED[field]) for number, field in fields]
        self.maker: ForceMaker | None = None
        self.health: list[np.ndarray] = []
        self.rubbing, self.rubs = np.zeros((2, len(self.places)), dtype=int)
        if fields:
            at = [found.estimates.names.index(name) for name in self.names]
            covariance = found.estimates.covariance[np.ix_(at, at)] + 1e-8 * np.eye(len(at))
            belief = Belief(np.log([self.values[name] for name in self.names]), covariance)
            self.follower = Follower(belief, self.labels, np.ones(len(at)), self._value, LENGTH, HOP)

    def _value(self, label: Label, x: np.ndarray) -> float:
        return float(np.exp(x[self.labels.index(label)]))

    def take(self, window: Window) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[Alarm]]:
        """Return end, means and deviations (n_quantities, n_bushings), contact, what is missed, alarms of a window.

        Parameters
        ----------
        window : Window
            The next one.
        """
        if self.maker is None:
            frequency = np.fft.rfftfreq(window.size, 1 / window.fs)
            omega = 2 * np.pi * frequency[frequency <= self.found.bands.force]
            self.maker = ForceMaker(self.found.drawn, self.uncertain, omega)
        forces = forces_in(
            self.found.drawn, [window], self.uncertain, self.values, self.found.bands, maker=self.maker
        )  # fmt: skip
        filling = self.places[0].filling
        law = [p for p in self.own if self.touching or acts_without_contact(p.name, filling)]
        problem = LawProblem(forces, self.places, law, self.touching)
        base = np.array([self.values[name] for name in problem.names])
        at = [problem.names.index(name) for name in self.names]

        def moved(point: np.ndarray) -> np.ndarray:
            values = base.copy()
            values[at] = np.exp(point)
            return values

        def misses(points: np.ndarray) -> np.ndarray:
            return np.array([real(problem.misses(moved(point))) for point in points])

        end = window.start + window.size / window.fs
        alarms: list[Alarm] = []
        mean, std = np.full((2, len(self.quantities), len(self.places)), np.nan)
        alone = np.zeros(0)
        if self.labels:
            refinement, alarm = self.follower.take(misses, BLOCK, end)
            alone, alarms = refinement.belief.mean, [alarm] if alarm else []
            rows = [self.quantities.index(quantity) for _, quantity in self.labels]
            columns = [number for number, _ in self.labels]
            mean[rows, columns], std[rows, columns] = self.follower.belief.mean, self.follower.belief.std
        left = misses(alone[None])[0].reshape(-1, len(self.places), 4)
        missed, largest = np.sqrt(np.mean(left**2, axis=(0, 2))), np.abs(left).max(axis=(0, 2))
        alarms += self._rubs(np.array([missed, largest]), forces.over_time(), end)
        return end, mean, std, problem.contact(moved(alone)), missed, alarms

    def _rubs(self, missed: np.ndarray, force: np.ndarray, end: float) -> list[Alarm]:
        """Alarms of forces that nothing explains: missed (2, n_bushings), RMS and largest of all lines."""
        if len(self.health) < LEARNED:
            self.health.append(missed)
            return []
        known = np.array(self.health)
        limit = np.maximum(known.mean(axis=0) + BEYOND * known.std(axis=0, ddof=1), RISE * known.max(axis=0))
        self.rubbing = np.where(np.any(missed > limit, axis=0), self.rubbing + 1, 0)
        alarms = []
        for j in np.flatnonzero((self.rubbing == IN_A_ROW) & (self.rubs == 0)):
            largest = float(np.hypot(*force[0, :, 2 * j : 2 * j + 2].T).max())
            alarms.append(Alarm(end, end - LENGTH - (IN_A_ROW - 1) * HOP, int(j), RUB, 0.0, largest))
        self.rubs = np.where(self.rubbing >= IN_A_ROW, 1, np.where(self.rubbing == 0, 0, self.rubs))
        return alarms
