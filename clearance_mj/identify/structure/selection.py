"""Which hypotheses of a structure that is not as drawn the records want: screened, fitted, weighed, confirmed.

Every candidate is first put into the updated rig as it is: how the sensors then contradict each other, less what the
open parameters can make good, says how much its size could explain (a score test; Rao, Proc. Camb. Phil. Soc. 44,
1948). The best of each hypothesis are fitted with all open parameters to the first part of the records and compared by
evidence (MacKay, Neural Computation 4, 1992). One is accepted that gains `MIN_GAIN` and that the rest of the records
confirms; the rig is then updated with it, and the others are tried anew beside it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from ...core.errors import ClearanceError
from ...estimate import Stop, log_evidence, solve
from ...estimate.solver import Solution
from ...rig import Rig
from ..records.prepared import PreparedRecord
from . import hypotheses  # noqa: F401 - registers them
from .hypotheses.candidate import HYPOTHESES, Bench, Candidate
from .rig_fit import RigFit
from .rig_update import RigUpdate

__all__ = ["Accepted", "StructureSearch", "Tried", "search_structure"]

MIN_GAIN = 12.0  # of log evidence, for a hypothesis to be accepted
MIN_SCORE = 6.0  # of log likelihood by the score test, for a candidate to be fitted
RIVAL = 3.0  # of log evidence, within which two hypotheses cannot be told apart
MOST = 3  # hypotheses that are accepted beside each other
FITTED_PART = 0.8  # of each record; the rest confirms
LINES = 400  # of each record
BEST = 2  # candidates of each hypothesis that are fitted
SMALLEST, LARGEST = 0.05, 30.0  # factors of a candidate's usual size
STOP = Stop(steps=6, decrease=1e-3, move=0.02)
WORKERS = 2  # threads


@dataclass(frozen=True)
class Tried:
    """A hypothesis as it was tried once."""

    name: str  #: of the hypothesis
    words: str  #: with the numbers found
    gain: float  #: of log evidence; by the score test alone where it was not fitted
    fitted: bool  #: whether it was


@dataclass(frozen=True)
class Accepted:
    """A hypothesis that the records want."""

    name: str  #: of the hypothesis
    words: str  #: with the numbers found
    gain: float  #: of log evidence
    confirmed: float  #: by how much the log likelihood of the rest of the records rises
    rivals: tuple[str, ...]  #: hypotheses that explain the records about as well
    apart: str  #: the measurement that would tell it from others


@dataclass(frozen=True, eq=False)
class StructureSearch:
    """What was tried beside the rig file's structure, and the rig updated with what was accepted."""

    before: RigUpdate  #: the rig updated as it is drawn
    update: RigUpdate  #: with what was accepted; ``before`` if nothing was
    accepted: tuple[Accepted, ...]  #: in the order of their evidence
    rounds: tuple[tuple[Tried, ...], ...]  #: each hypothesis's best in every round

    @property
    def warnings(self) -> tuple[str, ...]:
        """Plain words on what the rig file does not have."""
        return tuple(_sentence(one) for one in self.accepted)


class _Trial:
    """A candidate fitted with all open parameters to the first part of the records."""

    def __init__(self, candidate: Candidate, rig: Rig, coarse: RigFit, values: Mapping[str, float]) -> None:
        self.candidate, self.rig = candidate, rig
        fit = RigFit(rig, coarse.records, like=coarse)
        self.solution = solve(fit.problem, [fit.problem.at(values)], stop=STOP)
        self.evidence = _evidence(self.solution)
        self.values = dict(zip((p.name for p in fit.problem.parameters), self.solution.values.tolist()))


def search_structure(rig: Rig, records: Sequence[PreparedRecord], progress: bool = False) -> StructureSearch:
    """Update a rig to prepared records, with what the records want beside the structure that its file has.

    Parameters
    ----------
    rig : Rig
        The rig file's.
    records : sequence of PreparedRecord
        As `update_from` takes them.
    progress : bool
        Show a progress bar.

    Raises
    ------
    RecordError
        As `update_rig`.
    """
    before = update = RigFit(rig, records).run()
    accepted: list[Accepted] = []
    rounds: list[tuple[Tried, ...]] = []
    at = rig
    while len(accepted) < MOST:
        search = _Round(at, update, progress)
        rounds.append(search.tried)
        found = search.best()
        if found is None:
            break
        trial, confirmed = found
        new = RigFit(trial.rig, records).run(trial.values, rig)
        gain = trial.evidence - search.evidence
        words = trial.candidate.words(new.rig)
        accepted.append(
            Accepted(trial.candidate.name, words, gain, confirmed, search.rivals(trial), trial.candidate.apart)
        )
        at, update = trial.rig, new
    if accepted:
        update = dataclasses.replace(update, start=at, rig=update.rig.replace(tolerances=rig.tolerances))
    return StructureSearch(before, update, tuple(accepted), tuple(rounds))


class _Round:
    """All hypotheses tried once beside a rig."""

    def __init__(self, rig: Rig, update: RigUpdate, progress: bool) -> None:
        self.rig, self.values = rig, update.values
        first, rest = zip(*(_cut(record) for record in update.records))
        lines = max(m.frequency.size for m in update.misfit)
        self.fit = RigFit(rig, first, thin=max(1, int(FITTED_PART * lines / LINES)))
        self.fit.adapt(self.values)
        self.rest = RigFit(rig, rest)
        self.rest.adapt(self.values)
        self.base = solve(self.fit.problem, [self.fit.problem.at(self.values)], stop=STOP)
        self.values = self.values | dict(zip((p.name for p in self.fit.problem.parameters), self.base.values.tolist()))
        self.evidence = _evidence(self.base)
        low, high = (f(part.frequency[i] for part in self.fit.spectra) for f, i in ((min, 0), (max, -1)))
        bench = Bench(rig, (float(low), float(high)), self.fit.probes, min(r.fs for r in update.records))
        scores = [(score, c, size) for c in _candidates(bench) for score, size in self._score(c)]
        chosen: list[tuple[float, Candidate, float]] = []
        for name in HYPOTHESES:
            own = sorted((s for s in scores if s[1].name == name), key=lambda s: -s[0])
            chosen += [s for s in own[:BEST] if s[0] > MIN_SCORE]
        with ThreadPoolExecutor(WORKERS) as pool:
            trials = pool.map(self._fitted, chosen)
            bar = tqdm(trials, desc="structures", total=len(chosen), disable=not progress or not chosen)
            self.trials = sorted((t for t in bar if t), key=lambda t: -t.evidence)
        best = {t.candidate.name: t for t in reversed(self.trials)}
        unfitted = {
            name: max((s[0] for s in scores if s[1].name == name), default=0.0)
            for name in HYPOTHESES
            if name not in best
        }
        fitted = [
            Tried(name, t.candidate.words(_rig_of(t)), t.evidence - self.evidence, True) for name, t in best.items()
        ]
        self.tried = tuple(
            sorted(
                [*fitted, *(Tried(n, "", s, False) for n, s in unfitted.items())], key=lambda t: (-t.fitted, -t.gain)
            )
        )

    def _score(self, candidate: Candidate) -> Iterator[tuple[float, float]]:
        """Yield by how much a candidate could raise the log likelihood, and its factor of size, if it can be."""
        try:
            moved = self.fit.residuals_of(candidate.make(1.0), self.values)
        except (ClearanceError, np.linalg.LinAlgError):
            return
        weight = np.sqrt(self.base.loss.weights(self.base.residuals).score)
        residual, jacobian = weight * self.base.residuals, weight[:, None] * self.base.jacobian
        change = weight * moved - residual
        both = np.column_stack((residual, change))
        cross = (jacobian.conj().T @ both).real
        free = both - jacobian @ np.linalg.solve((jacobian.conj().T @ jacobian).real + self.base.prior, cross)
        along, size = float((change.conj() @ free[:, 0]).real), float((change.conj() @ free[:, 1]).real)
        if size <= 0:
            return
        factor = -along / size
        if factor > 0 or candidate.signed:
            yield along**2 / size / 2, float(np.sign(factor) * np.clip(abs(factor), SMALLEST, LARGEST))

    def _fitted(self, chosen: tuple[float, Candidate, float]) -> _Trial | None:
        _, candidate, factor = chosen
        try:
            return _Trial(candidate, candidate.make(factor), self.fit, self.values)
        except (ClearanceError, np.linalg.LinAlgError):
            return None

    def best(self) -> tuple[_Trial, float] | None:
        """Return the likeliest trial and by how much the rest of the records confirms it; None if none is accepted."""
        for trial in self.trials:
            if trial.evidence - self.evidence < MIN_GAIN:
                break
            confirmed = self._cost_of_rest(self.rig, self.values) - self._cost_of_rest(trial.rig, trial.values)
            if confirmed > 0:
                return trial, confirmed / 2
        return None

    def _cost_of_rest(self, rig: Rig, values: Mapping[str, float]) -> float:
        return float(self.rest.problem.loss.cost(self.rest.residuals_of(rig, values)))

    def rivals(self, accepted: _Trial) -> tuple[str, ...]:
        """Return other hypotheses that explain the records about as well."""
        near = (t.candidate.name for t in self.trials if accepted.evidence - t.evidence < RIVAL)
        return tuple(name for name in dict.fromkeys(near) if name != accepted.candidate.name)


def _candidates(bench: Bench) -> Iterator[Candidate]:
    for one in HYPOTHESES.values():
        yield from one.candidates(bench)


def _evidence(solution: Solution) -> float:
    cost = solution.cost - float(solution.problem.prior_cost(solution.at))
    return log_evidence(cost, solution.at, solution.information / solution.loss.divisor)


def _rig_of(trial: _Trial) -> Rig:
    from .priors import rig_with

    return rig_with(trial.rig, trial.values)


def _cut(record: PreparedRecord) -> tuple[PreparedRecord, PreparedRecord]:
    """The first part of a record, and the rest."""
    end = int(FITTED_PART * len(record.signals))
    return (
        dataclasses.replace(record, signals=record.signals[:end]),
        dataclasses.replace(record, signals=record.signals[end:]),
    )


def _sentence(one: Accepted) -> str:
    words = f"the rig file lacks something that the records show: {one.words}"
    if one.rivals:
        others = " or ".join(HYPOTHESES[name].called for name in one.rivals)
        words += f"; {others} explains them about as well"
        words += f", which {one.apart} would tell" if one.apart else ""
    return words
