"""The twin of a machine in operation: gap, oil and rubs along a record of probes and keyphasor, window by window.

Everything but gap and viscosity stays as in the orbit fit that the twin begins from. A window refines the belief of
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
from ..follow.follower import Label, SequentialPosterior
from ..follow.history import Twin
from ..records.prepared import prepared
from .forces import ForceReconstruction, forces_in
from .orbit_fit import OrbitFit
from .problem import LawProblem, acts_without_contact, places_of, real
from .windows import LENGTH, RecordWindow, windows_of

__all__ = ["follow_orbits"]

HOP = 0.75  # s, from one window to the next
TRACKED = {"gap": "gap", "grease viscosity": "viscosity"}  # fields of laws, and what they are tracked as
LEARNED = 6  # windows from which on the misfit in health is known
BEYOND, RISE = 6.0, 1.5  # standard deviations of the misfit in health, and factor on it, beyond which is a rub
BLOCK = 200  # successive residuals that may be correlated
IN_A_ROW = 3  # windows that show a rub before it counts: two contain the time before and after a sudden change


@checks_kinds
def follow_orbits(record: Record, found: OrbitFit) -> Twin:
    """Follow gaps and oil films along a record of a machine in operation, with alarms where they change or rub.

    Parameters
    ----------
    record : Record
        Two probes in each bushing and a keyphasor, of a shaft that unbalance alone excites.
    found : OrbitFit
        Fit of earlier orbits of the machine, see `orbits`.

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
    *histories, alarms = zip(*(follower.take(window) for window in windows_of(whole, HOP)))
    time, mean, std, contact, misfit = map(np.array, histories)
    return Twin(
        record.name, found.rig, time, LENGTH, np.full(len(follower.places), np.nan), np.moveaxis(mean, 1, 0),
        np.moveaxis(std, 1, 0), contact, misfit, tuple(itertools.chain(*alarms)), quantities=follower.quantities,
    )  # fmt: skip


class _OrbitFollower:
    """The twin's state, fed window by window."""

    def __init__(self, fit: OrbitFit) -> None:
        self.fit, self.places = fit, places_of(fit.drawn, [c.contact for c in fit.clearances])
        self.values = dict(zip(fit.estimates.names, fit.estimates.value.tolist()))
        parameters = {p.name: p for p in fit.estimates.parameters}
        split = list(parameters).index(f"bushings[{self.places[0].number}].gap")
        self.uncertain, self.law_parameters = list(parameters.values())[:split], list(parameters.values())[split:]
        self.touching = any(c.touches for c in fit.clearances)
        oil = any(place.filling.round_only for place in self.places)
        self.quantities = ("gap", "viscosity") if oil else ("gap",)
        identified = [place for clearance, place in zip(fit.clearances, self.places) if clearance.seen]
        fields = [(p.number, field) for field in TRACKED for p in identified if field == "gap" or p.filling.round_only]
        self.names = [f"bushings[{number}].{field}" for number, field in fields]
        self.labels: list[Label] = [(number, TRACKED[field]) for number, field in fields]
        self.maker: ForceReconstruction | None = None
        self.health: list[np.ndarray] = []
        self.rubbing, self.rubs = np.zeros((2, len(self.places)), dtype=int)
        if fields:
            at = [fit.estimates.names.index(name) for name in self.names]
            covariance = fit.estimates.covariance[np.ix_(at, at)] + 1e-8 * np.eye(len(at))
            belief = Belief(np.log([self.values[name] for name in self.names]), covariance)
            self.follower = SequentialPosterior(belief, self.labels, np.ones(len(at)), self._value, LENGTH, HOP)

    def _value(self, label: Label, x: np.ndarray) -> float:
        return float(np.exp(x[self.labels.index(label)]))

    def take(self, window: RecordWindow) -> tuple[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[Alarm]]:
        """Return end, means and deviations (n_quantities, n_bushings), contact, misfit and alarms of a window.

        Parameters
        ----------
        window : Window
            The next one.
        """
        self.maker = self.maker or ForceReconstruction(self.fit.drawn, self.uncertain, window, self.fit.bands)
        forces = forces_in(self.fit.drawn, [window], self.uncertain, self.values, self.fit.bands, maker=self.maker)
        filling = self.places[0].filling
        law = [p for p in self.law_parameters if self.touching or acts_without_contact(p.name, filling)]
        problem = LawProblem(forces, self.places, law, self.touching)
        base = np.array([self.values[name] for name in problem.names])
        at = [problem.names.index(name) for name in self.names]

        def values_at(point: np.ndarray) -> np.ndarray:
            values = base.copy()
            values[at] = np.exp(point)
            return values

        def residuals(points: np.ndarray) -> np.ndarray:
            return np.array([real(problem.spectral_residuals(values_at(point))) for point in points])

        end = window.start + window.size / window.fs
        alarms: list[Alarm] = []
        mean, std = np.full((2, len(self.quantities), len(self.places)), np.nan)
        newest = np.zeros(0)
        if self.labels:
            refinement, alarm = self.follower.take(residuals, BLOCK, end)
            newest, alarms = refinement.belief.mean, [alarm] if alarm else []
            rows = [self.quantities.index(quantity) for _, quantity in self.labels]
            columns = [number for number, _ in self.labels]
            mean[rows, columns], std[rows, columns] = self.follower.belief.mean, self.follower.belief.std
        remaining = residuals(newest[None])[0].reshape(-1, len(self.places), 4)
        misfit, largest = np.sqrt(np.mean(remaining**2, axis=(0, 2))), np.abs(remaining).max(axis=(0, 2))
        alarms += self._rub_alarms(np.array([misfit, largest]), forces.over_time(), end)
        return end, mean, std, problem.contact(values_at(newest)), misfit, alarms

    def _rub_alarms(self, misfit: np.ndarray, force: np.ndarray, end: float) -> list[Alarm]:
        """Return alarms of unexplained forces by the misfit (2, n_bushings), RMS and largest of all lines."""
        if len(self.health) < LEARNED:
            self.health.append(misfit)
            return []
        learned = np.array(self.health)
        limit = np.maximum(learned.mean(axis=0) + BEYOND * learned.std(axis=0, ddof=1), RISE * learned.max(axis=0))
        self.rubbing = np.where(np.any(misfit > limit, axis=0), self.rubbing + 1, 0)
        alarms = []
        for j in np.flatnonzero((self.rubbing == IN_A_ROW) & (self.rubs == 0)):
            largest = float(np.hypot(*force[0, :, 2 * j : 2 * j + 2].T).max())
            alarms.append(Alarm(end, end - LENGTH - (IN_A_ROW - 1) * HOP, int(j), RUB, 0.0, largest))
        self.rubs = np.where(self.rubbing >= IN_A_ROW, 1, np.where(self.rubbing == 0, 0, self.rubs))
        return alarms
