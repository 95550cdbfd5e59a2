"""Laws from what is known: the datasheet, or the records that may be used to identify."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..clearance.contact import HuntCrossley
from ..clearance.law import ConstantLaw, ContactLaw, Law
from ..errors import ClearanceError, RecordError
from ..io.dataset import Dataset
from ..rig import Grease, Rig
from .checks import check_length, check_records, ridge_band, warn_of_no_ridge
from .force_balance import (
    SETTLE,
    amplitude_law,
    force_balance_law,
    grease_parameters,
    restoring_forces,
    ridge_law,
)
from .output_error import PIECE, Fit, Parameter, before_contact, evidence, fit_law
from .wavelet import shortest_record

MODEL_ERROR = 1.0
"""dB by which the physical law is expected to miss FRFs without noise"""
ROUGH = 0.02
"""tolerance of a fit from which another goes on"""
LIKENESS = 0.5
"""standard deviation of the logarithms of the bushings' parameters about common ones"""

__all__ = ["METHODS", "Identified", "Method", "fit_constant", "fit_output_error", "get_method", "law", "nominal"]


def nominal(rig: Rig) -> ConstantLaw:
    """Law of a designer before any test: the datasheet contact of the rig file, and its grease.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
    if not rig.bushings:
        return ConstantLaw(0.0, 0.0)
    contacts = [b.contact for b in rig.bushings]
    return ConstantLaw([c.stiffness for c in contacts], [c.damping for c in contacts])


def fit_constant(dataset: Dataset, progress: str | None = None) -> Fit:
    """Fit the best constants: contact stiffness and damping and a linear grease, the same at every bushing.

    Parameters
    ----------
    dataset : Dataset
        Only its rig and its records with role "identify" are used.
    progress : str, optional
        Show a progress bar with this name.

    Raises
    ------
    RecordError
        If there is no such record, or none is long enough.
    """
    found, first = evidence(dataset.to_identify()), dataset.rig.bushings[0]
    parameters = [
        Parameter("contact stiffness", "N/m", first.contact.stiffness, 1e2, 1e7),
        Parameter("contact damping", "N s/m", max(first.contact.damping, 0.1), 1e-3, 1e3),
        *_linear_grease(first.grease),
    ]
    k, c, grease_k, grease_c = (p.start for p in parameters)
    starts = [(k * a, c * b, grease_k * g, grease_c * b) for a in (0.5, 2.0) for b in (1.0, 3.0) for g in (0.7, 1.0)]
    return fit_law(dataset.rig, found, parameters, partial(_constant, dataset.rig), starts, progress=progress)


def fit_output_error(dataset: Dataset, progress: str | None = None) -> Fit:
    """Fit the physical law: Bouc-Wen grease with squeeze film, and a power-law contact.

    First with the same parameters at every bushing, from the force balance (`force_balance.amplitude_law`). Records
    that do not allow one, for want of probes or contact, are continued from low to high level instead: the grease is
    fitted first to the part in which no probe has moved by its gap, from the restoring forces where there are probes,
    then grease and contact together to everything, from several starts. Then every bushing has its own parameters,
    which stay near the common ones where the records do not tell them apart.

    Parameters
    ----------
    dataset : Dataset
        Only its rig and its records with role "identify" are used.
    progress : str, optional
        Show a progress bar with this name.

    Raises
    ------
    RecordError
        If there is no such record, or none is long enough.
    """
    rig, found = dataset.rig, evidence(dataset.to_identify())
    parameters, make = _physical_parameters(rig), partial(_physical, rig)
    try:
        balance, _ = amplitude_law(dataset)
    except RecordError:
        common = _continued(dataset, found, parameters, make, progress)
    else:
        starts, part = _from_balance(balance, rig.bushings[0].gap), _part(progress, "bushings alike")
        common = fit_law(rig, found, parameters, make, starts, 1, MODEL_ERROR, ROUGH, progress=part)
    return _each(rig, found, common, make, _part(progress, "each bushing"))


def _physical_parameters(rig):
    first, gap = rig.bushings[0], rig.bushings[0].gap
    return [
        *_linear_grease(first.grease),
        Parameter("grease elastic ratio", "1", 0.85, 0.02, 1.0),
        Parameter("grease yield displacement", "m", gap, 0.05 * gap, 50 * gap),
        Parameter("grease film height", "m", 3 * gap, 1.02 * gap, 100 * gap),
        Parameter("grease exponent", "1", 2.0, 1.0, 3.0),
        Parameter("grease beta / (beta + gamma)", "1", 0.5, 0.5, 3.0),
        Parameter("contact force at one gap", "N", first.contact.stiffness * gap / 1.5, 1e-2 * gap, 1e7 * gap),
        Parameter("contact exponent", "1", 1.5, 1.0, 3.0),
        Parameter("contact restitution", "1", 0.6, 0.02, 0.999),
    ]


def _from_balance(balance, gap):
    """Start values, the means of the bushings' of an amplitude law, with several exponents and restitutions."""
    force = np.mean([np.interp(2 * gap, balance.amplitude, k) for k in balance.k.T]) * gap
    greases = _grease_starts(balance.grease, gap)
    return [(*grease, force, n, e) for grease in greases for n in (1.0, 1.5) for e in (0.3, 0.6, 0.9)]


def _grease_starts(greases, gap):
    """Start values of a grease, the means of the bushings', with two shapes of the loop."""
    film = [g.film_height or 100 * gap for g in greases]
    columns = [(g.stiffness, g.damping, g.elastic_ratio, min(g.yield_displacement, 50 * gap)) for g in greases]
    return [(*np.mean(columns, axis=0), np.mean(film), *shape) for shape in ((2.0, 0.5), (1.0, 1.0))]


def _in_balance(dataset, gap):
    """Start values of the grease from the restoring forces, if every record has the probes for it."""
    try:
        return _grease_starts(grease_parameters(restoring_forces(dataset)).grease, gap)
    except RecordError:
        return []


def _continued(dataset, found, parameters, make, progress):
    """Fit from low to high level."""
    rig = dataset.rig
    gap, contact = rig.bushings[0].gap, [p.start for p in parameters[-3:]]
    grease = parameters[:-3]
    quiet = before_contact(found, rig)
    if quiet:
        values = [*_yields(grease, gap), *_in_balance(dataset, gap)]
        part = _part(progress, "before contact")
        low = fit_law(rig, quiet, grease, lambda *v: make(*v, *contact), values, 1, MODEL_ERROR, ROUGH, progress=part)
        grease = [replace(p, start=float(v)) for p, v in zip(grease, low.value)]
    values, part = [p.start for p in grease], _part(progress, "bushings alike")
    starts = [(*values, contact[0] * f, contact[1], e) for f in (0.3, 1.0, 3.0) for e in (0.3, 0.6, 0.9)]
    parameters = [*grease, *parameters[-3:]]
    return fit_law(rig, found, parameters, make, starts, 2, MODEL_ERROR, ROUGH, progress=part)


def _each(rig, found, common, make, progress):
    """Fit every bushing's own parameters, from the common ones and held to them as far as the records do not tell."""
    parameters = [
        replace(p, name=f"{p.name}, bushings[{j}]", start=float(v), spread=LIKENESS)
        for j in range(len(rig.bushings))
        for p, v in zip(common.parameters, common.value)
    ]
    return fit_law(rig, found, parameters, make, model_error=MODEL_ERROR, differences=1, progress=progress)


def _yields(grease, gap):
    """Starts with other yield displacements and elastic ratios, of which the product matters most at low level."""
    k, c, _, _, height, *shape = (p.start for p in grease)
    return [(k, c, ratio, y * gap, height, *shape) for ratio in (0.5, 0.75, 0.9) for y in (0.4, 0.8, 1.6)]


def _part(progress, name):
    return progress and f"{progress} ({name})"


def _linear_grease(grease):
    return [
        Parameter("grease stiffness", "N/m", max(grease.stiffness, 1.0), 1.0, 1e6),
        Parameter("grease damping", "N s/m", max(grease.damping, 0.1), 1e-3, 1e3),
    ]


def _constant(rig, k, c, grease_k, grease_c):
    return ConstantLaw(k, c, grease=Grease(stiffness=float(grease_k), damping=float(grease_c)))


def _physical(rig, *values):
    """The law of ten values for all bushings, or ten for each."""
    gap, rows = rig.bushings[0].gap, np.reshape(values, (-1, 10)).tolist()
    contacts = [HuntCrossley(force / gap**exponent, e, exponent) for *_, force, exponent, e in rows]
    return ContactLaw(contacts, [_physical_grease(*row[:7]) for row in rows])


def _physical_grease(stiffness, damping, ratio, yield_displacement, height, exponent, share):
    """Bouc-Wen with A = 1: the loop's size is told by k, λ and z_ult = (β+γ)^(-1/n), its shape by n and β/(β+γ)."""
    total = yield_displacement**-exponent
    beta = max(share, 0.5) * total
    shape = {"beta": beta, "gamma": total - beta, "exponent": max(exponent, 1.0), "film_height": height}
    return Grease(stiffness=stiffness, damping=damping, elastic_ratio=min(ratio, 1.0), **shape)


@dataclass(frozen=True)
class Identified:
    """A law, and the parameters that were fitted for it."""

    law: Law
    """the law found"""
    parameters: tuple[dict, ...] = ()
    """plain data: name, unit, value, bounds low and high, relative_std and correlation with each of them"""

    @classmethod
    def of_fit(cls, fit: Fit) -> Identified:
        """Take law and parameters from a fit.

        Parameters
        ----------
        fit : Fit
            The fit.
        """
        values = zip(fit.parameters, fit.value, fit.relative_std, fit.correlation)
        rows = (
            {"name": p.name, "unit": p.unit, "value": float(v), "low": p.low, "high": p.high}
            | {"relative_std": float(s), "correlation": r.tolist()}
            for p, v, s, r in values
        )
        return cls(fit.law, tuple(rows))


@dataclass(frozen=True)
class Method:
    """A way to a law."""

    knows: str
    """what it is allowed to know, in words"""
    find: Callable[[Dataset, str | None], Identified]
    """takes a dataset and the name of the progress bar, if there is to be one"""
    shortest: Callable[[Rig], float] | None = None
    """s, that one record must last; None: it opens no record"""
    make: Callable[..., Law] | None = None
    """makes the law from a rig and the values of its fitted parameters; None: it fits none"""

    def run(self, dataset: Dataset, progress: str | None = None) -> Identified:
        """Check the records to identify, then find the law.

        Parameters
        ----------
        dataset : Dataset
            Records with role "validate" are never opened.
        progress : str, optional
            Show a progress bar with this name.

        Raises
        ------
        RecordError
            If there is no record to identify, one cannot be used, or all are too short.
        """
        if self.shortest:
            records, rig = dataset.to_identify(), dataset.rig
            check_length(records, self.shortest(rig), {n: m.shortest(rig) for n, m in METHODS.items() if m.shortest})
            check_records(records)
        return self.find(dataset, progress)


def _ridge(dataset, *options):
    warn_of_no_ridge(max(dataset.to_identify(), key=lambda r: r.duration))
    return Identified(ridge_law(dataset, *options))


METHODS = {
    "nominal": Method(
        "the rig file only: datasheet contact, fresh grease as a linear spring and damper",
        lambda dataset, progress: Identified(nominal(dataset.rig)),
    ),
    "constant": Method(
        "the rig file and the records to identify: best constants for contact and linear grease",
        lambda dataset, progress: Identified.of_fit(fit_constant(dataset, progress)),
        lambda rig: PIECE,
        _constant,
    ),
    "ridge": Method(
        "the rig file and the longest record to identify: contact over that record's time, from its wavelet ridge",
        lambda dataset, progress: _ridge(dataset, "adiabatic", "viscous", progress),
        lambda rig: shortest_record(ridge_band(rig)[0]),
    ),
    "ridge-as-printed": Method(
        "as ridge, with the article's Equations 12 and 17 as printed",
        lambda dataset, progress: _ridge(dataset, "none", "as-printed", progress),
        lambda rig: shortest_record(ridge_band(rig)[0]),
    ),
    "force-balance": Method(
        "the rig file and the records to identify: constant contact and Bouc-Wen grease out of the restoring forces",
        lambda dataset, progress: Identified(force_balance_law(dataset, progress)),
        lambda rig: 4 * SETTLE,
    ),
    "amplitude": Method(
        "the rig file and the records to identify: contact over amplitude, Bouc-Wen grease, from the restoring forces",
        lambda dataset, progress: Identified(amplitude_law(dataset, progress)[0]),
        lambda rig: 4 * SETTLE,
    ),
    "output-error": Method(
        "the rig file and the records to identify: Bouc-Wen grease, squeeze film and power-law contact of each bushing",
        lambda dataset, progress: Identified.of_fit(fit_output_error(dataset, progress)),
        lambda rig: PIECE,
        _physical,
    ),
}
"""The ways to a law, by name."""


def law(dataset: Dataset, method: str = "output-error", progress: str | None = None) -> Law:
    """Identify the clearance's law from a dataset.

    Parameters
    ----------
    dataset : Dataset
        Records with role "validate" are never opened.
    method : str
        "nominal": the rig file's datasheet values; "constant": the best constants; "ridge" and "ridge-as-printed": over
        the record's time, from the wavelet ridge, corrected or as the article prints it; "force-balance" and
        "amplitude": constant or over amplitude, from the restoring forces; "output-error": the physical law (Bouc-Wen
        grease with squeeze film, power-law contact).
    progress : str, optional
        Show a progress bar with this name.

    Returns
    -------
    Law

    Raises
    ------
    ClearanceError
        For an unknown method; the message lists the known ones.
    RecordError
        If the dataset holds nothing to identify from.
    """
    return get_method(method).run(dataset, progress).law


def get_method(name: str) -> Method:
    """Return the method of a name.

    Parameters
    ----------
    name : str
        Such as "output-error".

    Raises
    ------
    ClearanceError
        For an unknown name; the message lists the known ones.
    """
    if name not in METHODS:
        raise ClearanceError(f'method "{name}" is unknown; known: {", ".join(METHODS)}')
    return METHODS[name]
