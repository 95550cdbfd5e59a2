"""Output error: choose parameters so that the simulated responses to a record's own excitation look like the record.

The modal engine is driven by the measured excitation. Residuals are the differences of the FRF magnitudes, in dB, of
every accelerometer over consecutive pieces of each record (so that a level ramp tells how the clearance depends on
level), and of the RMS of the displacement probes. Pieces that hold hammer hits give the RMS of their accelerometers
instead of FRFs, which between the hits would be mostly noise. Impacting systems are chaotic, so neither residual
compares waveforms.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.optimize
from tqdm import tqdm

from ..clearance.law import Law
from ..engines import simulate_batch
from ..errors import LawError, RecordError, SimulationError
from ..excitation import Excitation
from ..frf import estimate_frf
from ..io.dataset import Record
from ..response import Response
from ..rig import Rig

__all__ = ["Evidence", "Fit", "Parameter", "before_contact", "evidence", "fit_law"]

PIECE = 5.0
"""s, shortest piece over which an FRF is taken"""
RESOLUTION = 1.0
"""Hz, of these FRFs"""
RMS_WEIGHT = 5.0
"""one dB of an RMS counts like so many dB of one FRF line"""
CREST = 10.0
"""peak over RMS above which the excitation of a piece counts as hits"""
DIFFERENCE = 0.02
"""step of the finite differences in the logarithm of a parameter: above the chaos of single impacts"""


@dataclass(frozen=True)
class Parameter:
    """A positive parameter to fit, varied by its logarithm."""

    name: str
    unit: str
    start: float
    low: float
    high: float


@dataclass(frozen=True)
class Evidence:
    """What a fit may look at: a measured excitation and the responses measured with it."""

    excitation: Excitation
    response: Response

    def until(self, sample: int) -> Evidence:
        """Cut to the samples before ``sample``.

        Parameters
        ----------
        sample : int
            First sample that is left out.
        """
        parts = ("excitation", "acceleration", "displacement")
        cut = {name: value[:sample] for name in parts if (value := getattr(self.response, name)) is not None}
        excitation = dataclasses.replace(self.excitation, value=self.excitation.value[:sample])
        return Evidence(excitation, dataclasses.replace(self.response, **cut))


def evidence(records: Sequence[Record]) -> list[Evidence]:
    """Read the records that are long enough for an FRF piece.

    Parameters
    ----------
    records : sequence of Record
        Records to identify from.

    Raises
    ------
    RecordError
        If none is long enough.
    """
    usable = [record for record in records if record.duration >= PIECE]
    if not usable:
        longest = max((record.duration for record in records), default=0.0)
        raise RecordError(f"records to fit must last {PIECE:g} s or more, the longest lasts {longest:g} s")
    return [Evidence(record.excitation(), record.response()) for record in usable]


def before_contact(found: Sequence[Evidence], rig: Rig) -> list[Evidence]:
    """Cut records to where no probe has yet moved by its gap; those too short for a piece are left out.

    Parameters
    ----------
    found : sequence of Evidence
        Records with displacement probes.
    rig : Rig
        The rig, for its gaps.
    """
    gaps = np.array([b.gap for b in rig.bushings])
    quiet = []
    for item in found:
        if item.response.displacement is not None:
            touching = np.any(np.abs(item.response.displacement) > gaps, axis=1)
            sample = int(np.argmax(touching)) if touching.any() else touching.size
            if sample >= PIECE * item.response.fs:
                quiet.append(item.until(sample))
    return quiet


@dataclass(frozen=True)
class Fit:
    """A fitted law and how well the records tell its parameters."""

    law: Law
    parameters: tuple[Parameter, ...]
    value: np.ndarray
    """(n,) fitted values"""
    relative_std: np.ndarray
    """(n,) standard deviation of each, as a share of its value"""
    correlation: np.ndarray
    """(n, n) of the parameters' logarithms; near ±1: the records tell only a combination of the two"""
    residual_db: float
    """RMS difference of the FRF magnitudes over the records' pieces, dB"""
    cost: float
    """what was minimised"""
    evaluations: int
    """simulations of the whole set of records"""


def fit_law(
    rig: Rig,
    found: Sequence[Evidence],
    parameters: Sequence[Parameter],
    make: Callable[..., Law],
    starts: Sequence[Sequence[float]] = (),
    tries: int = 1,
    progress: str | None = None,
) -> Fit:
    """Fit the parameters of a law to records by bounded nonlinear least squares.

    Parameters
    ----------
    rig : Rig
        The rig.
    found : sequence of Evidence
        What to fit to.
    parameters : sequence of Parameter
        What to fit.
    make : callable
        Makes the law from the parameters' values, in their order.
    starts : sequence of sequence of float
        Values to start from besides the parameters' own.
    tries : int
        From how many of the starts, the best ones, the fit is run; the best result counts.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    Fit
    """
    problem = _Problem(rig, found, make, progress)
    low, high = np.log([p.low for p in parameters]), np.log([p.high for p in parameters])
    candidates = np.clip(np.log([[p.start for p in parameters], *starts]), low, high)
    order = np.argsort([np.sum(np.minimum(np.abs(r), 10.0)) for r in problem.residuals(candidates)])
    settings = {"bounds": (low, high), "loss": "soft_l1", "xtol": 1e-3, "ftol": 1e-4, "max_nfev": 30}

    def solve(theta):
        jacobian = partial(problem.jacobian, low=low, high=high)
        return scipy.optimize.least_squares(lambda t: problem.residuals([t])[0], theta, jac=jacobian, **settings)

    solutions = [solve(candidates[start]) for start in order[:tries]]
    problem.bar.close()
    solution = min(solutions, key=lambda s: s.cost)
    variance = 2 * solution.cost / max(solution.fun.size - solution.x.size, 1)
    covariance = np.linalg.pinv(solution.jac.T @ solution.jac) * variance
    std, value = np.sqrt(np.diag(covariance)), np.exp(solution.x)
    return Fit(
        law=make(*value),
        parameters=tuple(parameters),
        value=value,
        relative_std=std,
        correlation=covariance / np.maximum(np.outer(std, std), np.finfo(float).tiny),
        residual_db=float(np.sqrt(np.mean(solution.fun[: problem.frf_size] ** 2))),
        cost=float(solution.cost),
        evaluations=problem.evaluations,
    )


class _Problem:
    """Residuals of a set of records as a function of the logarithms of the parameters."""

    def __init__(self, rig, found, make, progress):
        self.rig, self.make = rig, make
        self.excitations = [item.excitation for item in found]
        self.probes = [item.response.displacement is not None for item in found]
        self.measured = [_features(item.response) for item in found]
        self.frf_size = sum(frf.size for frf, _ in self.measured)
        self.bar = tqdm(desc=progress, unit="simulation", disable=progress is None)
        self.evaluations = 0

    def residuals(self, thetas):
        """(n, n_residuals) for several parameter sets at once: differences in dB, FRF lines first."""
        laws = [self.make(*np.exp(theta)) for theta in thetas]
        n = len(self.excitations)
        try:
            responses = simulate_batch(self.rig, self.excitations * len(laws), np.repeat(laws, n).tolist(), "modal")
        except (SimulationError, LawError):
            # A trial set that diverges is a very bad one, not an error of the user's.
            return np.full((len(laws), sum(f.size + p.size for f, p in self.measured)), 60.0)
        self.bar.update(len(laws))
        self.evaluations += len(laws)
        return np.array([self._residual(responses[n * i : n * i + n]) for i in range(len(laws))])

    def _residual(self, responses):
        seen = [r if p else dataclasses.replace(r, displacement=None) for r, p in zip(responses, self.probes)]
        pairs = [(_features(r), m) for r, m in zip(seen, self.measured)]
        frf = [20 * np.log10(model[0] / test[0]) for model, test in pairs]
        rms = [RMS_WEIGHT * 20 * np.log10(model[1] / test[1]) for model, test in pairs]
        return np.concatenate((*frf, *rms))

    def jacobian(self, theta, low, high):
        """(n_residuals, n) by differences, central but at the bounds."""
        step = DIFFERENCE * np.eye(theta.size)
        up, down = np.minimum(theta + step, high), np.maximum(theta - step, low)
        values = self.residuals([*up, *down])
        width = np.sum(up - down, axis=1)
        return ((values[: theta.size] - values[theta.size :]) / width[:, None]).T


def _features(response: Response):
    """FRF magnitudes (n_sensors, n_f) of the pieces one after the other, and RMS of what is compared by RMS."""
    count = max(1, int(response.duration / PIECE))
    edges = np.linspace(0, response.excitation.size, count + 1).astype(int)
    magnitudes, signals = [], []
    for piece in (slice(*edge) for edge in itertools.pairwise(edges)):
        excitation, acceleration = response.excitation[piece], response.acceleration[piece]
        if np.abs(excitation).max() > CREST * excitation.std():
            signals.append(acceleration)
        else:
            part = dataclasses.replace(response, excitation=excitation, acceleration=acceleration)
            magnitudes.append(np.abs(estimate_frf(part, resolution=RESOLUTION).value))
        if response.displacement is not None:
            signals.append(response.displacement[piece])
    rms = [np.sqrt(np.mean(signal**2, axis=0)) for signal in signals]
    return np.concatenate([*magnitudes, np.empty(0)], axis=None), np.concatenate([*rms, np.empty(0)])
