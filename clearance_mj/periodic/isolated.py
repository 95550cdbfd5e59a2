"""Detached branches: random starts integrated in time, and the whole branch of every new vibration."""

from __future__ import annotations

import numbers
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from tqdm import tqdm

from ..core.errors import ClearanceError, ExcitationError
from ..core.tasks import workers_to_use
from ..signals import labelled
from ..signals.arrays import ArrayData, read_only
from .branch import Branch
from .continuation import EndOfBranch, NoConvergence, PeriodicMotion, difference, first_half, meets
from .following import follow, place, solver_of
from .random_starts import LANES, PERIODIC, March
from .solver import Solver
from .subharmonic import until_halved
from .vibrations import UNITS, complex_amplitudes, turned

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Isolas", "find_isolas"]

MAX_STARTS = 1000
SAME = 0.02  # relative distance of a motion from the straight line between two points of the branch it lies on


@dataclass(frozen=True, eq=False, repr=False)
class Isolas(ArrayData):
    """Branches of the vibrations to which random starts converge."""

    known: tuple[Branch, ...]
    """as given"""
    branches: tuple[Branch, ...]
    """new ones; a closed one is an isola: its ``ended`` is "it comes back to its beginning" """
    frequency: np.ndarray
    """(n,) of the starts, Hz"""
    branch: np.ndarray
    """(n, n_starts) branch to which a start converges, the known ones counted first; -1 if its vibration does not
    repeat, as chaotic and quasi-periodic ones"""

    def __post_init__(self) -> None:
        self._set(frequency=read_only(self.frequency), branch=read_only(self.branch, int))

    @property
    def basins(self) -> np.ndarray:
        """(n, n_branches + 1) fraction of the starts that converge to each branch; last, that do not repeat."""
        count = len(self.known) + len(self.branches)
        return np.stack([(self.branch == i).mean(axis=1) for i in (*range(count), -1)], axis=1)

    def plot(self, quantity: str = "acceleration", row: int = 0) -> Figure:
        """Draw amplitudes over frequency, known branches black, and below the fraction of the starts for each.

        Parameters
        ----------
        quantity : str
            Quantity, as in `Branch.amplitude`.
        row : int
            Which sensor or clearance.

        Raises
        ------
        ClearanceError
            For another quantity, or a row that is not there.
        """
        from ..core.drawing import canvas

        branches = (*self.known, *self.branches)
        amplitudes = [branch.amplitude(quantity) for branch in branches]
        if not 0 <= row < amplitudes[0].shape[1]:
            raise ClearanceError(f"row must be between 0 and {amplitudes[0].shape[1] - 1}, got {row}")
        figure = canvas(5.5, 8)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        width = 0.5 * np.min(np.diff(np.sort(self.frequency)), initial=np.ptp(branches[0].frequency) / 4)
        base = np.zeros(self.frequency.size)
        for i, (branch, amplitude, fraction) in enumerate(zip(branches, amplitudes, self.basins.T)):
            new = i - len(self.known)
            colour = f"C{new}" if new >= 0 else f"{0.5 * i / len(branches)}"
            name = f"new {new + 1}" if new >= 0 else f"known {i + 1}"
            stable = branch.stable if branch.stable is not None else np.ones(branch.frequency.size, dtype=bool)
            upper.plot(branch.frequency, amplitude[:, row], "--", color=colour, lw=1)
            label = f"{name}, repeats after {branch.periods}"
            upper.plot(branch.frequency, np.where(stable, amplitude[:, row], np.nan), color=colour, label=label)
            lower.bar(self.frequency, fraction, width, base, color=colour)
            base = base + fraction
        lower.bar(self.frequency, 1 - base, width, base, color="w", edgecolor="k", hatch="//", label="do not repeat")
        upper.set(ylabel=f"amplitude of the {quantity.replace('_', ' ')} ({UNITS[quantity]})", yscale="log")
        lower.set(xlabel="frequency (Hz)", ylabel="share of the starts (-)")
        upper.legend(frameon=False)
        lower.legend(frameon=False)
        return figure

    def to_xarray(self) -> xr.Dataset:
        """Return the branch of every start; each branch has a dataset itself."""
        variables: dict[str, Any] = {
            "branch": (("frequency", "start"), self.branch, "1"),
            "basin": (("frequency", "attractor"), self.basins, "1"),
        }
        count = len(self.known)
        names = [f"known {i + 1}" for i in range(count)] + [f"new {i + 1}" for i in range(len(self.branches))]
        coordinates = {"frequency": self.frequency, "attractor": (*names, "none")}
        return labelled.dataset("isolas", variables, coordinates, {"known": count})


def find_isolas(
    branch: Branch | Sequence[Branch], n_starts: int = 16, frequencies: int | Sequence[float] = 9, seed: int = 0,
    periods: int = 6, longest: int | None = None, reach: float | None = None, workers: int | None = None,
    progress: bool = False,
) -> Isolas:  # fmt: skip
    """Find vibrations that lie on no known branch, and follow their whole branches.

    At several frequencies the modal engine marches from random states until the motion repeats after some periods of
    the excitation. A motion on no known branch, up to a shift by periods, is followed in both directions: until it
    returns to its beginning, which makes it an isola, to half its period, or to an end of the known branches'
    range.

    Parameters
    ----------
    branch : Branch or sequence of Branch
        Known branches over frequency of one rig, law and level; period-doubled ones too.
    n_starts : int
        Number of random starts at every frequency, at most 1000.
    frequencies : int or sequence of float
        Hz, or their number, spread evenly over the range of the known branches.
    seed : int
        Seed of the random states.
    periods : int
        Largest number of excitation periods after which a motion may repeat.
    longest : int, optional
        Periods of the excitation to wait for that; None: until a motion that never touches has decayed.
    reach : float, optional
        Largest displacement of the starts at the clearances, m; None: three times that of the known branches.
    workers : int, optional
        Number of threads; default: one for each processor.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Isolas
        The new branches, and the fraction of the starts that converge to each.

    Raises
    ------
    ClearanceError
        For impossible numbers, or branches over level, of unbalance, or of different rigs, laws or levels.
    ExcitationError
        For frequencies outside of the known branches'.
    SimulationError
        If a march diverges.
    """
    known = (branch,) if isinstance(branch, Branch) else tuple(branch)
    _validate(known, n_starts, periods, longest, reach)
    first = known[0]
    system = solver_of(first, list(first.level[0]), 1, 1, first.n_samples).system
    decay = -system.driven.model.poles().vibrating.value.real.max()
    starts_at = _frequencies(known, frequencies)
    random = np.random.default_rng(seed)
    groups = [(f, min(LANES, n_starts - i)) for f in starts_at for i in range(0, n_starts, LANES)]
    marches = [March(known, f, lanes, random, reach) for f, lanes in groups]
    with ThreadPoolExecutor(workers_to_use(workers)) as pool:
        jobs = pool.map(lambda march: march.settled(periods, longest or march.waits(decay)), marches)
        settled = list(tqdm(jobs, desc="random starts", total=len(marches), unit="march", disable=not progress))
    new: list[Branch] = []
    final = [(frequency, *start) for (frequency, _), group in zip(groups, settled) for start in group]
    bar = tqdm(final, desc="branches of starts", unit="start", disable=not progress)
    indices = [_branch_index((*known, *new), new, *end) for end in bar]
    return Isolas(known, tuple(new), starts_at, np.reshape(indices, (starts_at.size, n_starts)))


def _validate(known: tuple[Branch, ...], starts: int, periods: int, longest: int | None, reach: float | None) -> None:
    for name, value in (("n_starts", starts), ("periods", periods), ("longest", 1 if longest is None else longest)):
        if not isinstance(value, numbers.Integral) or isinstance(value, bool) or value < 1:
            raise ClearanceError(f"{name} must be a whole number from 1 on, got {value!r}")
    if starts > MAX_STARTS:
        raise ClearanceError(f"at most {MAX_STARTS} starts at a frequency, enough for shares to 2 %, got {starts}")
    if reach is not None and not 0 < reach < np.inf:
        raise ClearanceError(f"reach must be a displacement > 0 m, got {reach!r}")
    if not known:
        raise ClearanceError("isolas are searched beside known branches; give one of periodic.follow_response")
    first = known[0]
    if first.kind not in ("base", "force"):
        raise ClearanceError(f'isolas are searched under a base or a force, not of kind "{first.kind}"')
    for member in known:
        if member.over != "frequency":
            raise ClearanceError("isolas are searched over frequency; give branches of periodic.follow_response")
        if not (_setting(member) == _setting(first) and np.array_equal(member.level[0], first.level[0])):
            raise ClearanceError("known branches must be of one rig, law, level and number of modes")


def _setting(branch: Branch) -> tuple[Any, ...]:
    return branch.model.rig, branch.model.law, branch.kind, branch.n_modes


def _frequencies(known: tuple[Branch, ...], frequencies: int | Sequence[float]) -> np.ndarray:
    low = min(each.frequency.min() for each in known)
    high = max(each.frequency.max() for each in known)
    if isinstance(frequencies, int) and not isinstance(frequencies, bool) and frequencies >= 1:
        return np.linspace(low, high, frequencies + 2)[1:-1]
    at = np.asarray(frequencies, dtype=float)
    if at.ndim != 1 or not at.size or not ((at >= low) & (at <= high)).all():
        raise ExcitationError(
            f"frequencies must be their number, 1 or more, or Hz between {low:.6g} and {high:.6g}, the known branches' "
            f"range, got {frequencies!r}"
        )
    return at


def _branch_index(
    branches: tuple[Branch, ...], new: list[Branch], frequency: float, periods: int, motion: np.ndarray
) -> int:
    """Return the index of a motion's branch, -1 if it does not repeat; a new branch is followed and appended."""
    if not periods:
        return -1
    first = branches[0]
    harmonics = periods * (first.acceleration.shape[-1] - 1) // first.periods
    samples = periods * first.n_samples // first.periods
    solver = solver_of(first, list(first.level[0]), harmonics, periods, samples)
    z, y = solver.system.split(motion @ solver.grid.project.T)
    try:
        exact = solver.solved_at(2 * np.pi * frequency / periods, z, y, float(np.linalg.norm(z)))
    except NoConvergence:
        return -1
    x_exact = complex_amplitudes(solver.all_points(exact)[: 3 * first.model.rig.n_rows][None])[0]
    for nu in (nu for nu in range(1, periods) if periods % nu == 0):  # the slow end of a transient repeats sooner
        others = np.arange(harmonics + 1) % (periods // nu) != 0
        if np.linalg.norm(x_exact[:, others]) < PERIODIC * np.linalg.norm(x_exact):
            return _branch_index(branches, new, frequency, nu, motion[:, : nu * motion.shape[1] // periods])
    for i, branch in enumerate(branches):
        if branch.periods == periods and _lies_on(branch, frequency, x_exact):
            return i
    low, high = (f(each.frequency.min() if f is min else each.frequency.max() for each in branches) for f in (min, max))
    ends = 2 * np.pi * low / periods, 2 * np.pi * high / periods
    new.append(follow(solver, all_around(solver, exact, *ends), True))
    return len(branches)


def _lies_on(branch: Branch, frequency: float, x: np.ndarray) -> bool:
    """Return True if the branch has a motion (n_points, H + 1) at a frequency, shifted by some excitation periods."""
    turns = np.exp(2j * np.pi * np.outer(np.arange(branch.periods), np.arange(x.shape[1])) / branch.periods)
    distance = branch.frequency - frequency
    distance[np.abs(distance) < 1e-9 * frequency] = 0.0
    for i in np.flatnonzero(distance[:-1] * distance[1:] <= 0):
        fraction = distance[i] / (distance[i] - distance[i + 1]) if distance[i] != distance[i + 1] else 0.0
        ends = [np.concatenate((branch.clearance_displacement[k], branch.end_displacement[k])) for k in (i, i + 1)]
        expected = ends[0] + fraction * (ends[1] - ends[0])
        if min(np.linalg.norm(turn * x - expected) for turn in turns) < SAME * np.linalg.norm(x):
            return True
    return False


# The whole branch through a motion: closed, or from one end to the other.

ROUND, BACKWARDS = "it comes back to its beginning", "it turns back along itself"


def all_around(solver: Solver, motion: PeriodicMotion, low: float, high: float) -> Iterator[PeriodicMotion]:
    """Yield the motions of the whole branch through one, from one end to the other.

    Raises
    ------
    EndOfBranch
        At the end, if the branch is closed or does not end at an end of the range.
    """
    ahead, why = _until_end(solver, motion, low, high)
    back, why_back = ([], "") if why == ROUND else _until_end(solver, _reverse(motion), low, high)
    if why_back == ROUND:
        ahead, why = [], ROUND
    yield from (_reverse(each) for each in reversed(back[1:] if ahead else back))
    yield from ahead
    if why == ROUND:
        raise EndOfBranch(why)
    if why or why_back:
        raise EndOfBranch("; ".join(filter(None, (why, why_back and f"before its first point {why_back}"))))


def _until_end(solver: Solver, motion: PeriodicMotion, low: float, high: float) -> tuple[list[PeriodicMotion], str]:
    """Return motions from one on along its tangent, and why they end, "" at an end of the range."""
    motions: list[PeriodicMotion] = []
    try:
        for point in _until_closed(solver, until_halved(solver, motion, low, high)):
            motions.append(point)
    except EndOfBranch as end:
        if str(end) != BACKWARDS:
            return motions, str(end)
        motions = first_half(motions)
        return motions, f"{BACKWARDS} at {place(solver, motions[-1].parameter)}"
    except NoConvergence as end:
        return motions, f"no further periodic vibration was found beyond {place(solver, end.args[0])}"
    return motions, ""


def _until_closed(solver: Solver, motions: Iterator[PeriodicMotion]) -> Iterator[PeriodicMotion]:
    """Yield motions until the first one recurs, some periods of the excitation later.

    Raises
    ------
    EndOfBranch
        Then.
    """
    first = before = next(motions)
    yield first
    copies = [_shift(first, k / solver.system.periods) for k in range(solver.system.periods)]
    for i, motion in enumerate(motions):
        for copy in copies if i else ():
            if meets(solver, before, motion, copy, 1.0):
                if copy.tangent @ difference(before, motion) < 0:  # as at a corner where a contact is lost
                    raise EndOfBranch(BACKWARDS)
                yield copy
                raise EndOfBranch(ROUND)
        yield motion
        before = motion


def _shift(motion: PeriodicMotion, fraction: float) -> PeriodicMotion:
    """Return a motion shifted by a fraction of its period."""
    dz = motion.tangent[:-1].reshape(motion.z.shape)
    z, y, force, dz = (turned(each, 2 * np.pi * fraction) for each in (motion.z, motion.y, motion.force, dz))
    return replace(motion, z=z, y=y, force=force, tangent=np.append(dz.ravel(), motion.tangent[-1]))


def _reverse(motion: PeriodicMotion) -> PeriodicMotion:
    return replace(motion, tangent=-motion.tangent)
