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

import numpy as np
import scipy.optimize
from tqdm import tqdm

from ..clearance.law import Law
from ..engines import simulate_batch
from ..errors import RecordError, SimulationError
from ..frf import estimate_frf
from ..io.dataset import Record
from ..response import Response

__all__ = ["Fit", "Parameter", "fit_law"]

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
class Fit:
    """A fitted law and how well the records tell its parameters."""

    law: Law
    parameters: tuple[Parameter, ...]
    value: np.ndarray
    """(n,) fitted values"""
    relative_std: np.ndarray
    """(n,) standard deviation of each, as a share of its value"""
    residual_db: float
    """RMS difference of the FRF magnitudes over the records' pieces, dB"""
    evaluations: int
    """simulations of the whole set of records"""


def fit_law(
    records: Sequence[Record], parameters: Sequence[Parameter], make: Callable[..., Law], starts=None, progress=None
) -> Fit:
    """Fit the parameters of a law to records by bounded nonlinear least squares.

    Parameters
    ----------
    records : sequence of Record
        Of one rig. At least one must be long enough for an FRF piece.
    parameters : sequence of Parameter
        What to fit.
    make : callable
        Makes the law from the parameters' values, in their order.
    starts : sequence of sequence of float, optional
        Values to start from besides the parameters' own; the fit begins at the best of them.
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    Fit

    Raises
    ------
    RecordError
        If no record is long enough.
    """
    problem = _Problem(records, make, progress)
    candidates = np.log([[p.start for p in parameters], *(starts or [])])
    costs = [np.sum(np.minimum(np.abs(r), 10.0)) for r in problem.residuals(candidates)]
    low, high = np.log([p.low for p in parameters]), np.log([p.high for p in parameters])
    solution = scipy.optimize.least_squares(
        lambda theta: problem.residuals([theta])[0],
        candidates[int(np.argmin(costs))],
        jac=lambda theta: problem.jacobian(theta, high),
        bounds=(low, high), loss="soft_l1", xtol=1e-3, ftol=1e-4, max_nfev=30,
    )  # fmt: skip
    problem.bar.close()
    frf_residual = solution.fun[: problem.frf_size]
    variance = 2 * solution.cost / max(solution.fun.size - solution.x.size, 1)
    covariance = np.linalg.pinv(solution.jac.T @ solution.jac) * variance
    value = np.exp(solution.x)
    return Fit(
        law=make(*value),
        parameters=tuple(parameters),
        value=value,
        relative_std=np.sqrt(np.diag(covariance)),
        residual_db=float(np.sqrt(np.mean(frf_residual**2))),
        evaluations=problem.evaluations,
    )


class _Problem:
    """Residuals of a set of records as a function of the logarithms of the parameters."""

    def __init__(self, records, make, progress):
        self.make = make
        self.rig = records[0].rig
        self.excitations = [record.excitation() for record in records]
        measured = [record.response() for record in records]
        usable = [i for i, m in enumerate(measured) if m.duration >= PIECE]
        if not usable:
            longest = max(m.duration for m in measured)
            raise RecordError(f"records to fit must last {PIECE:g} s or more, the longest lasts {longest:g} s")
        self.excitations = [self.excitations[i] for i in usable]
        self.probes = [measured[i].displacement is not None for i in usable]
        self.measured = [_features(measured[i]) for i in usable]
        self.frf_size = sum(frf.size for frf, _ in self.measured)
        self.bar = tqdm(desc=progress, unit="simulation", disable=progress is None)
        self.evaluations = 0

    def residuals(self, thetas):
        """(n, n_residuals) for several parameter sets at once: differences in dB, FRF lines first."""
        laws = [self.make(*np.exp(theta)) for theta in thetas]
        n = len(self.excitations)
        try:
            responses = simulate_batch(self.rig, self.excitations * len(laws), np.repeat(laws, n).tolist(), "modal")
        except SimulationError:
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

    def jacobian(self, theta, high):
        """(n_residuals, n) by central differences, one-sided at the upper bound."""
        step = DIFFERENCE * np.eye(theta.size)
        up, down = np.minimum(theta + step, high), theta - step
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
