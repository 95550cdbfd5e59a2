"""Selection of hypotheses of a structure that is not as drawn: screened, fitted, weighed, confirmed by the records.

Every candidate is first put into the updated rig as it is: how the sensors then contradict each other, less what the
open parameters can compensate, says how much its size could explain (a score test; Rao, Proc. Camb. Phil. Soc. 44,
1948). The best of each hypothesis are fitted with all open parameters to the first part of the records and compared by
evidence (MacKay, Neural Computation 4, 1992). One is accepted that gains `MIN_GAIN` and that the rest of the records
confirms; the rig is then updated with it, and the others are tried anew together with it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeAlias

import numpy as np
from tqdm import tqdm

from ...core.errors import ClearanceError
from ...estimate import StoppingCriteria, log_evidence, rival_weights, solve
from ...estimate.solver import Solution
from ...rig import Rig
from ..records.prepared import PreparedRecord
from . import hypotheses  # noqa: F401 - registers them
from .accepted_parts import Accepted, AcceptedParts, Tried
from .faults.assessment import Assessment
from .hypotheses.candidate import HYPOTHESES, Bench, Candidate
from .priors import rig_with
from .rig_fit import RigFit
from .rig_update import RigUpdate

__all__ = ["with_accepted_parts"]

MIN_GAIN = 3.0  # of log evidence, for a hypothesis to be accepted
MIN_SCORE = 1.5  # of log likelihood by the score test, for a candidate to be fitted
RIVAL = 3.0  # of log evidence, within which two hypotheses cannot be told apart
MOST = 3  # hypotheses that are accepted together
FITTED_PART = 0.8  # of each record; the rest confirms
LINES = 400  # of each record
BEST = 3  # candidates of a leading hypothesis that are fitted; of others the best alone
LEADING = 2  # hypotheses, unless they lose more than others must gain
SMALLEST, LARGEST = 0.05, 30.0  # factors of a candidate's usual size
STOP = StoppingCriteria(steps=6, decrease=1e-3, move=0.02)
OWN_STOP = StoppingCriteria(steps=8, decrease=1e-2, move=0.05)
BANDS, CONTRADICTIONS = 40, 3  # of equal width in the logarithm; of them, peaks about which a mode is looked for
CONTRADICTION = 2.0  # of the median over the bands, that such a peak is at least
WORKERS = 2  # threads

_Scored: TypeAlias = tuple[float, Candidate, float]  # score, candidate, factor of its size


class _Trial:
    """A candidate fitted with all open parameters to the first part of the records."""

    def __init__(self, candidate: Candidate, rig: Rig, coarse: RigFit, values: Mapping[str, float]) -> None:
        self.candidate, self.rig = candidate, rig
        initial = coarse.named(coarse.problem.values(np.zeros(coarse.problem.size)))
        fit = RigFit(rig, coarse.records, like=coarse)
        starts = [_fitted_additions(rig, coarse, fixed) for fixed in (values, initial)]
        # With values that compensated for it, a number that the rig file says to be exact stays exact.
        searched = len(starts) if HYPOTHESES[candidate.name].of_rig_file else 1
        self.solution = solve(fit.problem, [fit.problem.at(start) for start in starts], n_best=searched, stop=STOP)
        self.evidence = _evidence(self.solution) - HYPOTHESES[candidate.name].handicap
        self.values = fit.named(self.solution.values)
        self.words = candidate.words(rig_with(rig, self.values))


def _fitted_additions(rig: Rig, coarse: RigFit, fixed: Mapping[str, float]) -> dict[str, float]:
    """Return the values by which the parts added to a rig meet the records best, with all others held."""
    fit = RigFit(rig, coarse.records, like=coarse, held=fixed)
    return fit.named(solve(fit.problem, [fit.problem.at({})], stop=OWN_STOP).values)


def with_accepted_parts(update: RigUpdate, progress: bool = False) -> RigUpdate:
    """Return an updated rig with the parts that its records show beyond the structure in its rig file.

    Parameters
    ----------
    update : RigUpdate
        The rig updated as it is drawn.
    progress : bool
        Show a progress bar.
    """
    drawn, parts = update, AcceptedParts(as_drawn=update.misfit, parameters=update.estimates.names)
    candidates: list[Candidate] = []
    optima: list[tuple[float, Mapping[str, float]]] = []
    while len(parts.accepted) < MOST:
        round_ = _Round(update, progress)
        parts = dataclasses.replace(parts, rounds=(*parts.rounds, round_.tried))
        if (accepted := round_.accepted()) is None:
            break
        trial, part = accepted
        new = RigFit(trial.rig, drawn.records).run(trial.values, drawn.start)
        optima += round_.optima(trial, set(new.estimates.names) - set(update.estimates.names))
        new = dataclasses.replace(new, structure=parts, estimates=new.estimates.with_rivals(optima))
        if Assessment(new).cost > Assessment(update).cost - MIN_GAIN:
            break
        update = new
        candidates.append(trial.candidate)
        named = [dataclasses.replace(a, words=c.words(update.rig)) for a, c in zip((*parts.accepted, part), candidates)]
        parts = dataclasses.replace(parts, accepted=tuple(named))
    # What was opened in the rig is known now; a support that is not exact is not said to be.
    tolerances = tuple(t for t in update.start.tolerances if t.size == 0 or t in drawn.rig.tolerances)
    return dataclasses.replace(update, rig=update.rig.replace(tolerances=tolerances), structure=parts)


class _Round:
    """One round: all hypotheses tried once on a rig."""

    def __init__(self, update: RigUpdate, progress: bool) -> None:
        early, late = zip(*(_split(record) for record in update.records))
        self.rig = update.start
        self.fit = RigFit(self.rig, early, thin=max(1, int(FITTED_PART * update.misfit[0].frequency.size / LINES)))
        self.fit.adapt(update.values)
        self.rest = RigFit(self.rig, late)
        self.rest.adapt(update.values)
        self.base = solve(self.fit.problem, [self.fit.problem.at(update.values)], stop=STOP)
        self.values = self.fit.named(self.base.values)
        self.evidence = _evidence(self.base)
        fs = min(r.fs for r in update.records)
        bench = Bench(self.rig, self.fit.band, self.fit.probes, fs, self._contradictions(*self.fit.band))
        self.weight = np.sqrt(self.base.loss.weights(self.base.residuals).score)
        self.jacobian = self.weight[:, None] * self.base.jacobian
        self.information = (self.jacobian.conj().T @ self.jacobian).real + self.base.prior
        scored: dict[str, list[_Scored]] = {}
        with ThreadPoolExecutor(WORKERS) as pool:
            exact = [hypothesis for hypothesis in HYPOTHESES.values() if hypothesis.of_rig_file]
            first = [(0.0, candidate, 1.0) for hypothesis in exact for candidate in hypothesis.candidates(bench)]
            self.trials = self._fit_all(pool, first, progress)
            if self.accepted() is None:
                scored = self._try_others(pool, bench, progress)
        best = {t.candidate.name: t for t in reversed(self.trials)}
        fitted = [Tried(name, t.words, t.evidence - self.evidence, True) for name, t in best.items()]
        scores = {name: ranked[0][0] if ranked else 0.0 for name, ranked in scored.items() if name not in best}
        scored_only = [Tried(name, HYPOTHESES[name].called, score, False) for name, score in scores.items()]
        self.tried = tuple(sorted([*fitted, *scored_only], key=lambda t: (-t.fitted, -t.gain)))

    def _try_others(self, pool: ThreadPoolExecutor, bench: Bench, progress: bool) -> dict[str, list[_Scored]]:
        """Score the candidates of all other hypotheses, and fit the best of each."""
        others = [hypothesis for hypothesis in HYPOTHESES.values() if not hypothesis.of_rig_file]
        scored = {h.name: _best_of_groups(filter(None, pool.map(self._score, h.candidates(bench)))) for h in others}
        first = [ranked[0] for ranked in scored.values() if ranked and ranked[0][0] > MIN_SCORE]
        self.trials = _best_first([*self.trials, *self._fit_all(pool, first, progress)])
        leading = [t.candidate.name for t in self.trials[:LEADING] if t.evidence > self.evidence - MIN_GAIN]
        second = [s for name in leading for s in scored.get(name, ())[1:BEST] if s[0] > MIN_SCORE]
        self.trials = _best_first([*self.trials, *self._fit_all(pool, second, progress)])
        return scored

    def _contradictions(self, low: float, high: float) -> tuple[float, ...]:
        """Return frequencies, Hz, of the peaks of the residuals' spectrum, the largest first."""
        edges = np.geomspace(low, high, BANDS + 1)
        frequency = np.concatenate([np.repeat(part.frequency, part.measured.shape[1]) for part in self.fit.spectra])
        band, power = np.digitize(frequency, edges[1:-1]), np.abs(self.base.residuals) ** 2
        count, total, moment = (np.bincount(band, w, BANDS) for w in (np.ones_like(power), power, power * frequency))
        height = np.pad(total / np.maximum(count, 1.0), 1)
        least = CONTRADICTION * float(np.median(height[1:-1]))
        peaks = [b for b in range(BANDS) if height[b + 1] > max(height[b], height[b + 2], least)]
        highest = sorted(peaks, key=lambda b: -height[b + 1])[:CONTRADICTIONS]
        return tuple(float(moment[b] / total[b]) for b in highest)

    def _fit_all(self, pool: ThreadPoolExecutor, chosen: Sequence[_Scored], progress: bool) -> list[_Trial]:
        """Return trials of candidates with their factors of size, likeliest first; impossible ones are left out."""
        fits, hidden = pool.map(self._fit, chosen), not progress or not chosen
        return _best_first([t for t in tqdm(fits, desc="structures", total=len(chosen), disable=hidden) if t])

    def _score(self, candidate: Candidate) -> _Scored | None:
        """Return the gain of log likelihood by a candidate, and its factor of size; None if it is impossible."""
        try:
            changed = self.fit.residuals_of(candidate.make(1.0), self.values)
        except (ClearanceError, np.linalg.LinAlgError):
            return None
        residual = self.weight * self.base.residuals
        change = self.weight * changed - residual
        columns = np.column_stack((residual, change))
        projected = columns - self.jacobian @ np.linalg.solve(self.information, (self.jacobian.conj().T @ columns).real)
        along, size = float((change.conj() @ projected[:, 0]).real), float((change.conj() @ projected[:, 1]).real)
        factor = -along / size if size > 0 else 0.0
        if not factor or (factor < 0 and candidate.size != "signed"):
            return None
        if candidate.size == "fixed":
            return along**2 / size / 2, candidate, 1.0
        return along**2 / size / 2, candidate, float(np.sign(factor) * np.clip(abs(factor), SMALLEST, LARGEST))

    def _fit(self, chosen: _Scored) -> _Trial | None:
        _, candidate, factor = chosen
        try:
            return _Trial(candidate, candidate.make(factor), self.fit, self.values)
        except (ClearanceError, np.linalg.LinAlgError):
            return None

    def accepted(self) -> tuple[_Trial, Accepted] | None:
        """Return the likeliest trial that the rest of the records confirms; None if there is none."""
        for trial in self.trials:
            gain = trial.evidence - self.evidence
            if gain < MIN_GAIN:
                break
            confirmed = (self._cost_of_rest(self.rig, self.values) - self._cost_of_rest(trial.rig, trial.values)) / 2
            if confirmed > 0:
                chosen = trial.candidate
                return trial, Accepted(chosen.name, trial.words, gain, confirmed, self._rivals(trial), chosen.apart)
        return None

    def optima(self, accepted: _Trial, names: set[str]) -> list[tuple[float, dict[str, float]]]:
        """Return the probability of every fit of the same hypothesis that explains the records about as well.

        With the values where it ended, of parameters with these names: a place along a shaft has several optima.
        """
        alike = [t for t in self.trials if t.candidate.name == accepted.candidate.name]
        near = [accepted, *(t for t in alike if t is not accepted and abs(accepted.evidence - t.evidence) < RIVAL)]
        weights = rival_weights([t.evidence for t in near]).tolist()
        return [(w, {n: t.values[n] for n in names & set(t.values)}) for w, t in zip(weights[1:], near[1:])]

    def _cost_of_rest(self, rig: Rig, values: Mapping[str, float]) -> float:
        return float(self.rest.problem.loss.cost(self.rest.residuals_of(rig, values)))

    def _rivals(self, accepted: _Trial) -> tuple[str, ...]:
        """Return other hypotheses that explain the records about as well."""
        near = dict.fromkeys(t.candidate.name for t in self.trials if accepted.evidence - t.evidence < RIVAL)
        return tuple(HYPOTHESES[name].called for name in near if name != accepted.candidate.name)


def _best_of_groups(scored: Iterable[_Scored]) -> list[_Scored]:
    """Return the best first, of each group the best alone."""
    best = sorted(scored, key=lambda s: -s[0])
    groups = [c.group for _, c, _ in best]
    return [s for i, s in enumerate(best) if groups[i] is None or groups[i] not in groups[:i]]


def _best_first(trials: Sequence[_Trial]) -> list[_Trial]:
    return sorted(trials, key=lambda t: -t.evidence)


def _evidence(solution: Solution) -> float:
    cost = solution.cost - float(solution.problem.prior_cost(solution.at))
    return log_evidence(cost, solution.at, solution.information / solution.loss.divisor)


def _split(record: PreparedRecord) -> tuple[PreparedRecord, PreparedRecord]:
    """Return the first part of a record, and the rest."""
    first, rest = np.split(record.signals, [int(FITTED_PART * len(record.signals))])
    return dataclasses.replace(record, signals=first), dataclasses.replace(record, signals=rest)
