"""Output error: choose parameters so that the simulated responses to a record's own excitation look like the record.

The modal engine is driven by the measured excitation. Residuals are the differences of the FRF magnitudes, in dB, of
every accelerometer over consecutive pieces of each record (so that a level ramp shows how the clearance depends on
level), and of the RMS of the displacement probes. Pieces that hold hammer hits give the RMS of their accelerometers
instead of FRFs, which between the hits would be mostly noise. Impacting systems are chaotic, so neither residual
compares waveforms.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy.optimize
from tqdm import tqdm

from ...clearance.gap import penetration
from ...clearance.law import Law
from ...core.errors import LawError, RecordError, SimulationError
from ...engines import simulate_and_keep
from ...estimate.estimates import Estimates
from ...estimate.parameter import Parameter
from ...io.dataset import Record
from ...rig import Rig
from ...signals.excitation import Excitation
from ...signals.frf import estimate_frf, random_error
from ...signals.response import Response
from ...signals.welch import SegmentAverages
from ..registry import Identified, fitted_model

__all__ = ["Fit", "fit_law"]

PIECE = 5.0
"""s, shortest piece over which an FRF is taken"""
RESOLUTION = 1.0
"""Hz, of these FRFs"""
RMS_WEIGHT = 5.0
"""one dB of an RMS counts like so many dB of one FRF line"""
BAND = 5.0
"""Hz; lines further apart count as independent in the covariance: a Hann window joins lines up to 2 Hz apart"""
CREST = 10.0
"""peak over RMS above which the excitation of a piece counts as hits"""
DB = 20 / np.log(10)
DIFFERENCE = 0.02
"""step of the finite differences in the logarithm of a parameter: above the chaos of single impacts"""


class Evidence(NamedTuple):
    """What a fit may look at: a measured excitation, which drives the simulations, and the responses to it."""

    excitation: Excitation
    response: Response


def evidence(records: Sequence[Record]) -> list[Evidence]:
    """Read the records that are long enough for an FRF piece; a RecordError if there is none."""
    usable = [record for record in records if record.duration >= PIECE]
    if not usable:
        longest = max((record.duration for record in records), default=0.0)
        raise RecordError(f"records to fit must last {PIECE:g} s or more, the longest lasts {longest:g} s")
    return [Evidence(record.excitation(), record.response()) for record in usable]


def before_contact(found: Sequence[Evidence], rig: Rig) -> list[Evidence]:
    """Cut records to where no probe has yet moved by its gap; those too short for a piece are left out."""
    walls = np.array([b.walls for b in rig.bushings]).reshape(-1, 2)
    quiet = []
    for item in found:
        if item.response.displacement is not None:
            touching = penetration(item.response.displacement, *walls.T[:, :, None]).any(axis=0)
            sample = int(np.argmax(touching)) if touching.any() else touching.size
            if sample >= PIECE * item.response.fs:
                parts = ("excitation", "acceleration", "displacement")
                cut = {name: getattr(item.response, name)[..., :sample] for name in parts}
                excitation = dataclasses.replace(item.excitation, value=item.excitation.value[:sample])
                quiet.append(Evidence(excitation, dataclasses.replace(item.response, **cut)))
    return quiet


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit(Identified):
    """A fitted law with its estimates, and how well it meets the records."""

    estimates: Estimates
    """of the fitted parameters, which varied by their logarithms; covariance: see `_covariance`"""
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
    model_error: float = math.inf,
    tolerance: float = 1e-4,
    differences: int = 2,
    progress: str | None = None,
) -> Fit:
    """Fit the parameters of the law that ``make`` makes of their values, by bounded nonlinear least squares.

    The fit is run from the ``tries`` best of the parameters' own start and ``starts``. ``model_error``: dB by which the
    law is expected to miss FRFs that were measured without noise; lines with a larger random error count less;
    infinite: all lines count alike. ``tolerance``: stop when a step lowers the cost by less than this share.
    ``differences``: simulations per parameter for the derivatives, 2 for central differences, 1 where the start is
    already close.
    """
    problem = _Problem(rig, found, make, model_error, parameters, progress)
    low, high = np.log([p.low for p in parameters]), np.log([p.high for p in parameters])
    candidates = np.clip(np.log([[p.start for p in parameters], *starts]), low, high)
    order = np.argsort([np.sum(np.minimum(np.abs(r), 10.0)) for r in problem.residuals(candidates)])
    settings = {"bounds": (low, high), "loss": "soft_l1", "xtol": 1e-3, "ftol": tolerance, "max_nfev": 30}

    def solve(theta: np.ndarray) -> scipy.optimize.OptimizeResult:
        derivatives = problem.jacobian if differences == 2 else problem.forward_jacobian
        jacobian = partial(derivatives, low=low, high=high)
        return scipy.optimize.least_squares(problem.residual, theta, jac=jacobian, **settings)

    solutions = [solve(candidates[start]) for start in order[:tries]]
    problem.bar.close()
    solution = min(solutions, key=lambda s: s.cost)
    value = np.exp(solution.x)
    estimates = Estimates.of(parameters, value, _covariance(solution.jac, solution.fun, problem.block))
    return Fit(
        model=fitted_model(rig, make, estimates),
        estimates=estimates,
        residual_db=problem.difference_db(solution.fun),
        cost=float(solution.cost),
        evaluations=problem.evaluations,
    )


def _covariance(jacobian: np.ndarray, residual: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Covariance of the parameters' logarithms by a delete-a-block jackknife about the linearised fit.

    Residuals of one block may depend on each other as they like: neighbouring lines share their noise, sensors the
    modes, pieces the law's error. Without block g the optimum is θ + (A - A_g)⁻¹ s_g, with A = JᵀJ and s_g the block's
    part of the gradient (MacKinnon, Nielsen and Webb, Fast and reliable jackknife and bootstrap methods for
    cluster-robust inference, Journal of Applied Econometrics 38, 2023: CV3). What is known of a parameter before the
    fit is one observation of unit variance.

    The Jacobian (n_residuals + n, n) is scaled for the loss soft_l1, as `scipy.optimize.least_squares` returns it, the
    residual (n_residuals + n,) is not; its last n are the parameters' distances from their starts. Infinite if there is
    one block (n_residuals,) only.
    """
    data, prior = np.split(jacobian, [block.size])
    score = data * (residual[: block.size] * (1 + residual[: block.size] ** 2) ** 0.25)[:, None]
    groups = [block == number for number in np.unique(block)]
    if len(groups) < 2:
        return np.full((jacobian.shape[1],) * 2, np.inf)
    information = jacobian.T @ jacobian
    moved = np.array([np.linalg.pinv(information - data[g].T @ data[g]) @ score[g].sum(axis=0) for g in groups])
    inverse = np.linalg.pinv(information)
    return (len(groups) - 1) * np.cov(moved.T, bias=True) + inverse @ (prior.T @ prior) @ inverse


class _Problem:
    """Residuals of a set of records as a function of the logarithms of the parameters."""

    def __init__(
        self, rig: Rig, found: Sequence[Evidence], make: Callable[..., Law], model_error: float,
        parameters: Sequence[Parameter], progress: str | None,
    ):  # fmt: skip
        self.rig, self.make = rig, make
        self.excitations = [item.excitation for item in found]
        self.sights = [Sight(item.response) for item in found]
        self.measured = [_features(item.response) for item in found]
        random = np.concatenate([m.frf_error for m in self.measured] + [m.rms_error for m in self.measured])
        self.weight = 1 / np.hypot(1, random / model_error)
        self.frf_size = sum(m.frf.size for m in self.measured)
        self.block = self._blocks()
        self.start = np.log([p.start for p in parameters])
        self.prior_std = np.array([p.prior_std for p in parameters])
        self.bar = tqdm(desc=progress, unit="simulation", disable=progress is None)
        self.evaluations = 0
        self.latest: tuple[np.ndarray, np.ndarray] | None = None

    def _blocks(self) -> np.ndarray:
        """(n_residuals,) a number for the FRF lines of each band, in all pieces, and one for the RMS of each piece."""
        pieces = [m.rms_piece.max(initial=-1) + 1 for m in self.measured]
        first = np.cumsum([1, *pieces[:-1]])
        rms = [-start - m.rms_piece for start, m in zip(first, self.measured)]
        return np.concatenate((*(m.frf_band for m in self.measured), *rms))

    def residuals(self, thetas: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
        """(n, n_residuals) for several parameter sets at once: weighted differences in dB, FRF lines first."""
        laws = [self.make(*np.exp(theta)) for theta in thetas]
        try:
            cases, records = [(self.rig, law) for law in laws], zip(self.excitations, self.sights)
            seen = zip(*(simulate_and_keep(cases, e, sight.look, forces=False) for e, sight in records))
            differences = [self._residual(of_records) for of_records in seen]
        except (SimulationError, LawError):
            # A trial set that diverges is a very bad one, not an error of the user's.
            return np.full((len(laws), self.weight.size + self.prior_std.size), 60.0)
        self.bar.update(len(laws))
        self.evaluations += len(laws)
        # A parameter off its start by its prior standard deviation weighs as much as one line that is off by 1 dB.
        return np.hstack((differences, (np.reshape(thetas, (len(laws), -1)) - self.start) / self.prior_std))

    def residual(self, theta: np.ndarray) -> np.ndarray:
        """(n_residuals,) for one parameter set."""
        found = self.residuals([theta])[0]
        self.latest = theta.copy(), found
        return found

    def _residual(self, seen: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
        frf = [20 * np.log10(model / test.frf) for (model, _), test in zip(seen, self.measured)]
        rms = [RMS_WEIGHT * 20 * np.log10(model / test.rms) for (_, model), test in zip(seen, self.measured)]
        return self.weight * np.concatenate((*frf, *rms))

    def difference_db(self, residual: np.ndarray) -> float:
        """RMS difference of the FRF magnitudes, without the weights."""
        lines = slice(0, self.frf_size)
        return float(np.sqrt(np.mean((residual[lines] / self.weight[lines]) ** 2)))

    def jacobian(self, theta: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """(n_residuals, n) by differences, central but at the bounds."""
        step = DIFFERENCE * np.eye(theta.size)
        up, down = np.minimum(theta + step, high), np.maximum(theta - step, low)
        values = self.residuals([*up, *down])
        width = np.sum(up - down, axis=1)
        return ((values[: theta.size] - values[theta.size :]) / width[:, None]).T

    def forward_jacobian(self, theta: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """(n_residuals, n) by differences away from the nearer bound."""
        step = np.where(theta - low > high - theta, -DIFFERENCE, DIFFERENCE)
        known = self.latest is not None and np.array_equal(self.latest[0], theta)
        here = self.latest[1] if self.latest is not None and known else self.residual(theta)
        return ((self.residuals(theta + np.diag(step)) - here) / step[:, None]).T


class _Features(NamedTuple):
    """What is compared of a record."""

    frf: np.ndarray
    """(n_lines,) magnitudes of all pieces and sensors"""
    rms: np.ndarray
    """(n_rms,) of what is compared by RMS"""
    frf_error: np.ndarray
    """(n_lines,) random errors, dB"""
    rms_error: np.ndarray
    """(n_rms,) the same"""
    frf_band: np.ndarray
    """(n_lines,) number of the band of `BAND` Hz that the line lies in"""
    rms_piece: np.ndarray
    """(n_rms,) number of the piece"""


def _features(response: Response) -> _Features:
    pieces = [_piece_features(response, piece) for piece in _pieces(response)]
    frf, rms, frf_error, rms_error, band = (np.concatenate(values) for values in zip(*pieces))
    number = np.repeat(np.arange(len(pieces)), [len(piece[1]) for piece in pieces])
    return _Features(frf, rms, frf_error, rms_error, band, number)


def _pieces(response: Response) -> list[slice]:
    edges = np.linspace(0, response.excitation.size, max(1, int(response.duration / PIECE)) + 1).astype(int)
    return [slice(*edge) for edge in itertools.pairwise(edges)]


def _holds_hits(excitation: np.ndarray) -> bool:
    return bool(np.abs(excitation).max() > CREST * excitation.std())


class Sight:
    """How responses to a record's excitation are seen: as `_features`, whose spectra of the excitation are found once.

    Parameters
    ----------
    measured : Response
        The record. Probes are looked at if it has some.
    """

    def __init__(self, measured: Response):
        self.probes = measured.displacement is not None
        self.pieces = [(piece, self._averages(measured, measured.excitation[piece])) for piece in _pieces(measured)]

    @staticmethod
    def _averages(measured: Response, excitation: np.ndarray) -> SegmentAverages | None:
        """What estimates a piece's FRFs; none between hits."""
        if _holds_hits(excitation):
            return None
        return SegmentAverages(excitation, measured.fs, RESOLUTION, measured.band)

    def look(self, response: Response) -> tuple[np.ndarray, np.ndarray]:
        """Return FRF magnitudes (n_lines,) and RMS (n_rms,) of a response to the same excitation.

        Parameters
        ----------
        response : Response
            Of as many sensors as the record's.
        """
        frf, squares = [np.empty(0)], [np.empty(0)]
        for piece, averages in self.pieces:
            signals = [response.displacement[:, piece]] if self.probes and response.displacement is not None else []
            acceleration = response.acceleration[:, piece]
            if averages:
                frf.append(np.abs(averages.frf(acceleration)).ravel())
            else:
                signals.append(acceleration)
            squares += [np.einsum("ij,ij->i", signal, signal) / signal.shape[1] for signal in signals]
        return np.concatenate(frf), np.sqrt(np.concatenate(squares))


def _piece_features(response: Response, piece: slice) -> tuple[np.ndarray, ...]:
    excitation, acceleration = response.excitation[piece], response.acceleration[:, piece]
    signals = [] if response.displacement is None else [response.displacement[:, piece]]
    frf, frf_error, band = np.empty(0), np.empty(0), np.empty(0, dtype=int)
    if _holds_hits(excitation):
        signals.append(acceleration)
    else:
        part = Response(response.fs, excitation, acceleration, kind=response.kind, band=response.band)
        found = estimate_frf(part, resolution=RESOLUTION)
        frf = np.abs(found.functions).ravel()
        frf_error = DB * random_error(found, part.duration).ravel()
        band = np.tile((found.frequency // BAND).astype(int), len(found.value))
    squares = [np.square(signal.T, order="C") for signal in signals]  # summed sample by sample
    rms = np.concatenate([np.empty(0), *(np.sqrt(np.mean(square, axis=0)) for square in squares)])
    # Impacts scatter the RMS of a piece as they scatter its FRFs.
    return frf, rms, frf_error, np.full(rms.size, np.median(frf_error) if frf.size else 0.0), band
