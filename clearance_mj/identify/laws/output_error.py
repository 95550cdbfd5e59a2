"""Output error: parameters with which the simulated responses to a record's excitation are nearest to the record.

The modal engine is driven by the measured excitation. Residuals are the differences of the FRF magnitudes, in dB, of
every accelerometer over consecutive pieces of each record (so that a level ramp shows how the clearance depends on
level), and of the RMS of the displacement probes. Pieces that hold hammer hits give the RMS of their accelerometers
instead of FRFs, which between the hits would be mostly noise. Impacting systems are chaotic, so neither residual
compares waveforms.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from ...clearance.law import Law
from ...clearance.walls.slot import penetration
from ...core.errors import LawError, RecordError, SimulationError
from ...engines import simulate_and_keep
from ...estimate import Estimates, Parameter, Problem, SoftL1, StoppingCriteria, jackknife, solve
from ...io.dataset import Record
from ...rig import Rig
from ...signals.excitation import Excitation
from ...signals.frf import estimate_frf
from ...signals.frf_error import random_error
from ...signals.response import Response
from ...signals.welch import SegmentAverages
from ..registry import Identified, fitted_model

__all__ = ["Fit", "fit_law"]

PIECE = 5.0  # s, shortest piece over which an FRF is taken
RESOLUTION = 1.0  # Hz, of these FRFs
RMS_WEIGHT = 5.0  # one dB of an RMS counts like so many dB of one FRF line
BAND = 5.0  # Hz; lines further apart count as independent: a Hann window joins lines up to 2 Hz apart
CREST = 10.0  # peak over RMS above which the excitation of a piece counts as hits
DB = 20 / np.log(10)
DIFFERENCE = 0.02  # of a parameter's logarithm, for differences: above the chaos of single impacts


class Evidence(NamedTuple):
    """Data of a fit: a measured excitation, which drives the simulations, and the responses to it."""

    excitation: Excitation
    response: Response


def evidence(records: Sequence[Record]) -> list[Evidence]:
    """Read the records that are long enough for an FRF piece; a RecordError if there is none."""
    if not (usable := [record for record in records if record.duration >= PIECE]):
        longest = max((record.duration for record in records), default=0.0)
        raise RecordError(f"records to fit must last {PIECE:g} s or more, the longest lasts {longest:g} s")
    return [Evidence(record.excitation(), record.response()) for record in usable]


def before_contact(records: Sequence[Evidence], rig: Rig) -> list[Evidence]:
    """Return records cut before any probe moves by its gap; those too short for a piece are left out."""
    walls = np.array([b.walls for b in rig.bushings]).reshape(-1, 2)
    quiet = []
    for item in records:
        if item.response.displacement is not None:
            touching = penetration(item.response.displacement, *walls.T[:, :, None]).any(axis=0)
            sample = int(np.argmax(np.append(touching, True)))
            if sample >= PIECE * item.response.fs:
                signal_names = ("excitation", "channels", "displacement")
                cut = {name: getattr(item.response, name)[..., :sample] for name in signal_names}
                excitation = replace(item.excitation, value=item.excitation.value[:sample])
                quiet.append(Evidence(excitation, replace(item.response, **cut)))
    return quiet


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit(Identified):
    """A fitted law with its estimates, and how well it meets the records."""

    estimates: Estimates  #: of the fitted parameters, which varied by their logarithms
    residual_db: float  #: RMS difference of the FRF magnitudes over the records' pieces, dB
    cost: float  #: minimum of the soft L1 of the weighted differences in dB, and squared distances from priors
    evaluations: int  #: number of simulations of the whole set of records


def fit_law(
    rig: Rig, records: Sequence[Evidence], parameters: Sequence[Parameter], make: Callable[..., Law],
    starts: Sequence[Sequence[float]] = (), n_best: int = 1, model_error: float = math.inf, tolerance: float = 1e-4,
    central: bool = True, title: str = "",
) -> Fit:  # fmt: skip
    """Fit the parameters of the law that ``make`` makes of their values, by bounded nonlinear least squares.

    The fit is run from the ``n_best`` best of the parameters' start and ``starts``. ``model_error``: dB by which
    the law is expected to miss FRFs that were measured without noise; lines with a larger random error count less;
    infinite: all lines count the same. ``tolerance``: least relative decrease of the cost in a step.
    ``central``: central differences, which are not needed where the start is already close. The covariance is a
    jackknife over blocks of residuals that depend on each other.
    """
    compared = ResponseResiduals(rig, records, make, model_error, title)
    step = [DIFFERENCE / (p.prior_std if p.has_prior else 1.0) for p in parameters]
    # What is known before is outside of the loss, which takes residuals of many dB for outliers.
    problem = Problem(
        parameters, compared.residuals, loss=SoftL1(), step=step, central=central, lanes=False,
        invalid=(SimulationError, LawError),
    )  # fmt: skip
    candidates = [problem.at(values) for values in ([p.start for p in parameters], *starts)]
    with compared.bar:
        solution = solve(problem, candidates, n_best=n_best, stop=StoppingCriteria(decrease=tolerance))
    estimates = solution.estimates(jackknife(solution.rows, solution.scores, compared.block, solution.prior))
    return Fit(
        model=fitted_model(rig, make, estimates), estimates=estimates, cost=solution.cost,
        residual_db=compared.difference_db(solution.residuals), evaluations=problem.evaluations,
    )  # fmt: skip


class ResponseResiduals:
    """Weighted differences of simulated responses from a set of records, for the laws of several parameter sets."""

    def __init__(
        self, rig: Rig, records: Sequence[Evidence], make: Callable[..., Law], model_error: float, title: str
    ) -> None:
        self.rig, self.make = rig, make
        self.driven = [(item.excitation, ResponseFeatures(item.response)) for item in records]
        self.measured = [features(item.response) for item in records]
        random = np.concatenate([m.frf_error for m in self.measured] + [m.rms_error for m in self.measured])
        self.weight = 1 / np.hypot(1, random / model_error)
        self.frf_size = sum(m.frf.size for m in self.measured)
        self.bar = tqdm(desc=title, unit="simulation", disable=not title)

    @property
    def block(self) -> np.ndarray:
        """(n_residuals,) a number for the FRF lines of each band, in all pieces, and one for the RMS of each piece.

        Residuals of a block depend on each other: neighbouring lines share their noise, sensors the modes, pieces the
        law's error.
        """
        pieces = [m.rms_piece.max(initial=-1) + 1 for m in self.measured]
        first = np.cumsum([1, *pieces[:-1]])
        rms = [-start - m.rms_piece for start, m in zip(first, self.measured)]
        return np.concatenate((*(m.frf_band for m in self.measured), *rms))

    def residuals(self, values: np.ndarray) -> np.ndarray:
        """Return (n_points, n_residuals) weighted differences in dB, FRF lines first, for values (n_points, n)."""
        cases = [(self.rig, self.make(*point)) for point in values]
        of_records = [simulate_and_keep(cases, drive, sight.look, forces=False) for drive, sight in self.driven]
        self.bar.update(len(cases))
        return np.array([self._residual(spectra) for spectra in zip(*of_records)])

    def _residual(self, simulated: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
        frf = [20 * np.log10(model / test.frf) for (model, _), test in zip(simulated, self.measured)]
        rms = [RMS_WEIGHT * 20 * np.log10(model / test.rms) for (_, model), test in zip(simulated, self.measured)]
        return self.weight * np.concatenate((*frf, *rms))

    def difference_db(self, residual: np.ndarray) -> float:
        """Return the RMS difference of the FRF magnitudes, without the weights."""
        return float(np.sqrt(np.mean((residual / self.weight)[: self.frf_size] ** 2)))


class Features(NamedTuple):
    """Features of a record that are compared."""

    frf: np.ndarray  #: (n_lines,) magnitudes of all pieces and sensors
    rms: np.ndarray  #: (n_rms,) of the signals that are compared by RMS
    frf_error: np.ndarray  #: (n_lines,) random errors, dB
    rms_error: np.ndarray  #: (n_rms,) the same
    frf_band: np.ndarray  #: (n_lines,) number of the band of `BAND` Hz that the line lies in
    rms_piece: np.ndarray  #: (n_rms,) number of the piece


def features(response: Response) -> Features:
    """Return the features of a response that output-error compares: FRF magnitudes and RMS values, piece by piece."""
    pieces = [piece_features(response, piece) for piece in pieces_of(response)]
    frf, rms, frf_error, rms_error, band = (np.concatenate(values) for values in zip(*pieces))
    number = np.repeat(np.arange(len(pieces)), [len(piece[1]) for piece in pieces])
    return Features(frf, rms, frf_error, rms_error, band, number)


def pieces_of(response: Response) -> list[slice]:
    """Return the samples of each piece of a response."""
    edges = np.linspace(0, response.excitation.size, max(1, int(response.duration / PIECE)) + 1).astype(int)
    return [slice(*edge) for edge in itertools.pairwise(edges.tolist())]


def holds_hits(excitation: np.ndarray) -> bool:
    """Return True if an excitation (n_t,) consists of hits, between which it hardly acts."""
    return bool(np.abs(excitation).max() > CREST * excitation.std())


class ResponseFeatures:
    """Features of responses to a record's excitation, see `features`; spectra of the excitation are computed once.

    Parameters
    ----------
    measured : Response
        The record. Probes are looked at if it has some.
    """

    def __init__(self, measured: Response):
        self.probes, self.sensors = measured.displacement is not None, measured.responses
        self.pieces = [(piece, self._averages(measured, measured.excitation[piece])) for piece in pieces_of(measured)]

    @staticmethod
    def _averages(measured: Response, excitation: np.ndarray) -> SegmentAverages | None:
        """Return the averages that estimate a piece's FRFs; None between hits."""
        if holds_hits(excitation):
            return None
        return SegmentAverages(excitation, measured.fs, RESOLUTION, measured.band)

    def look(self, response: Response) -> tuple[np.ndarray, np.ndarray]:
        """Return FRF magnitudes (n_lines,) and RMS (n_rms,) of a response to the same excitation.

        Parameters
        ----------
        response : Response
            Response at the rig's sensors.
        """
        if response.responses != self.sensors:
            response = response.at(self.sensors)
        frf, squares = [np.empty(0)], [np.empty(0)]
        for piece, averages in self.pieces:
            signals = [response.displacement[:, piece]] if self.probes and response.displacement is not None else []
            channels = response.channels[:, piece]
            if averages:
                frf.append(np.abs(averages.frf(channels)).ravel())
            else:
                signals.append(channels)
            squares += [np.einsum("ij,ij->i", signal, signal) / signal.shape[1] for signal in signals]
        return np.concatenate(frf), np.sqrt(np.concatenate(squares))


def piece_of(response: Response, piece: slice) -> Response:
    """Return the excitation and the channels of a piece of a response."""
    excitation, channels, band = response.excitation[piece], response.channels[:, piece], response.band
    return Response(response.fs, excitation, channels, kind=response.kind, band=band, quantities=response.quantities)


def piece_features(response: Response, piece: slice) -> tuple[np.ndarray, ...]:
    """Return FRF magnitudes (dB), RMS values, the random errors of both, and bands of one piece of a response."""
    part = piece_of(response, piece)
    signals = [] if response.displacement is None else [response.displacement[:, piece]]
    frf, frf_error, band = np.empty(0), np.empty(0), np.empty(0, dtype=int)
    if holds_hits(part.excitation):
        signals.append(part.channels)
    else:
        frf_estimate = estimate_frf(part, resolution=RESOLUTION, window="hann")
        frf = np.abs(frf_estimate.functions).ravel()
        frf_error = DB * random_error(frf_estimate).ravel()
        band = np.tile((frf_estimate.frequency // BAND).astype(int), len(frf_estimate.value))
    squares = [np.square(signal.T, order="C") for signal in signals]  # summed sample by sample
    rms = np.concatenate([np.empty(0), *(np.sqrt(np.mean(square, axis=0)) for square in squares)])
    # Impacts scatter the RMS of a piece as they scatter its FRFs.
    return frf, rms, frf_error, np.full(rms.size, np.median(frf_error) if frf.size else 0.0), band
