"""Method "output-error": Bouc-Wen grease with squeeze film and a power-law contact, by output error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...clearance import HuntCrossley
from ...clearance.law import AmplitudeLaw, ContactLaw
from ...core.errors import RecordError
from ...estimate.parameter import Parameter
from ...io.dataset import Dataset
from ...rig import Grease, Rig
from ..forces.restoring import restoring_forces
from ..laws.grease import grease_parameters
from ..laws.output_error import PIECE, Evidence, Fit, before_contact, evidence, fit_law
from ..registry import register
from .amplitude import amplitude_law
from .constant import linear_grease

__all__ = ["fit_output_error"]

MODEL_ERROR = 1.0  # dB by which the law is expected to miss FRFs without noise
ROUGH = 0.02  # tolerance of a fit from which another goes on
LIKENESS = 0.5  # prior standard deviation of the logarithms of the bushings' parameters about common ones


def _law(rig: Rig, *values: float) -> ContactLaw:
    """Return the law of ten values for all bushings, or ten for each."""
    gap, rows = rig.bushings[0].gap, np.reshape(values, (-1, 10)).tolist()
    contacts = [HuntCrossley(force / gap**exponent, e, exponent) for *_, force, exponent, e in rows]
    return ContactLaw(contacts, [_grease(*row[:7]) for row in rows])


def _grease(
    stiffness: float, damping: float, ratio: float, yield_: float, height: float, exponent: float, beta_ratio: float
) -> Grease:
    """Bouc-Wen with A = 1: k, λ and z_ult = (β+γ)^(-1/n) give the loop's size, n and β/(β+γ) its shape."""
    total = yield_**-exponent
    beta = max(beta_ratio, 0.5) * total
    shape = {"beta": beta, "gamma": total - beta, "exponent": max(exponent, 1.0), "film_height": height}
    return Grease(stiffness=stiffness, damping=damping, elastic_ratio=min(ratio, 1.0), **shape)


@register(
    "output-error",
    "the rig file and the records to identify: Bouc-Wen grease, squeeze film and power-law contact of each bushing",
    shortest=lambda rig: PIECE,
)
def fit_output_error(dataset: Dataset, progress: bool = False) -> Fit:
    """Fit the physical law: Bouc-Wen grease with squeeze film, and a power-law contact.

    First with the same parameters at every bushing, from the force balance (`amplitude_law`). Records that do not allow
    one, for want of probes or contact, are continued from low to high level instead: the grease is fitted first to the
    part in which no probe has moved by its gap, from the restoring forces where there are probes, then grease and
    contact together to everything, from several starts. Then every bushing has its own parameters, which stay near the
    common ones where the records do not distinguish them.
    """
    rig, records = dataset.rig, evidence(dataset.to_identify())
    parameters, make = _parameters(rig), partial(_law, rig)
    try:
        balance, grease = amplitude_law(dataset)
    except RecordError:
        common = _fit_by_level(dataset, records, parameters, make, progress)
    else:
        starts = _starts_from_balance(balance, grease.grease, rig.bushings[0].gap)
        title = "bushings alike" if progress else ""
        common = fit_law(rig, records, parameters, make, starts, 1, MODEL_ERROR, ROUGH, title=title)
    parameters_of_each = [
        replace(p, name=f"{p.name}, bushings[{j}]", start=float(v), prior_std=LIKENESS)
        for j in range(len(rig.bushings))
        for p, v in zip(parameters, common.estimates.value)
    ]
    title = "each bushing" if progress else ""
    return fit_law(rig, records, parameters_of_each, make, model_error=MODEL_ERROR, central=False, title=title)


def _parameters(rig: Rig) -> list[Parameter]:
    first, gap = rig.bushings[0], rig.bushings[0].gap
    stiffness = first.contact.stiffness
    narrowest, widest = min(b.gap for b in rig.bushings), max(b.gap for b in rig.bushings)
    return [
        *linear_grease(first.grease),
        Parameter("grease elastic ratio", "1", 0.85, 0.02, 1.0),
        Parameter("grease yield displacement", "m", gap, 0.05 * narrowest, 50 * widest),
        Parameter("grease film height", "m", 3 * widest, 1.02 * widest, 100 * widest),
        Parameter("grease exponent", "1", 2.0, 1.0, 3.0),
        Parameter("grease beta / (beta + gamma)", "1", 0.5, 0.5, 3.0),
        Parameter("contact force at one gap", "N", stiffness * gap / 1.5, 1e-2 * gap, max(1e7, 100 * stiffness) * gap),
        Parameter("contact exponent", "1", 1.5, 1.0, 3.0),
        Parameter("contact restitution", "1", 0.6, 0.02, 0.999),
    ]


def _starts_from_balance(balance: AmplitudeLaw, greases: Sequence[Grease], gap: float) -> list[tuple[float, ...]]:
    """Start values, the means of the bushings' of an amplitude law, with several exponents and restitutions."""
    force = np.mean([np.interp(2 * gap, balance.amplitude, k) for k in balance.k.T]) * gap
    starts = _grease_starts(greases, gap)
    return [(*grease, force, n, e) for grease in starts for n in (1.0, 1.5) for e in (0.3, 0.6, 0.9)]


def _grease_starts(greases: Sequence[Grease], gap: float) -> list[tuple[float, ...]]:
    """Start values of a grease, the means of the bushings', with two shapes of the loop."""
    film = [g.film_height or 100 * gap for g in greases]
    columns = [(g.stiffness, g.damping, g.elastic_ratio, min(g.yield_displacement, 50 * gap)) for g in greases]
    return [(*np.mean(columns, axis=0), float(np.mean(film)), *shape) for shape in ((2.0, 0.5), (1.0, 1.0))]


def _fit_by_level(
    dataset: Dataset, records: list[Evidence], parameters: list[Parameter], make: Callable[..., ContactLaw],
    progress: bool,
) -> Fit:  # fmt: skip
    """Fit from low to high level."""
    rig, gap = dataset.rig, dataset.rig.bushings[0].gap
    grease, contact = parameters[:-3], [p.start for p in parameters[-3:]]
    if quiet := before_contact(records, rig):
        starts = [*_yield_starts(grease, gap), *_starts_from_forces(dataset, gap)]
        title = "before contact" if progress else ""
        low = fit_law(rig, quiet, grease, lambda *v: make(*v, *contact), starts, 1, MODEL_ERROR, ROUGH, title=title)
        grease = [replace(p, start=float(v)) for p, v in zip(grease, low.estimates.value)]
    values, title = [p.start for p in grease], "bushings alike" if progress else ""
    starts = [(*values, contact[0] * f, contact[1], e) for f in (0.3, 1.0, 3.0) for e in (0.3, 0.6, 0.9)]
    return fit_law(rig, records, [*grease, *parameters[-3:]], make, starts, 2, MODEL_ERROR, ROUGH, title=title)


def _starts_from_forces(dataset: Dataset, gap: float) -> list[tuple[float, ...]]:
    """Start values of the grease from the restoring forces, if every record has the probes for it."""
    try:
        return _grease_starts(grease_parameters(restoring_forces(dataset)).grease, gap)
    except RecordError:
        return []


def _yield_starts(grease: Sequence[Parameter], gap: float) -> list[tuple[float, ...]]:
    """Starts with other yield displacements and elastic ratios, of which the product matters most at low level."""
    k, c, _, _, height, *shape = (p.start for p in grease)
    return [(k, c, ratio, y * gap, height, *shape) for ratio in (0.5, 0.75, 0.9) for y in (0.4, 0.8, 1.6)]
