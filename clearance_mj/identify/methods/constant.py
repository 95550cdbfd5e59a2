"""Method "constant": the best constants for contact and linear grease, by output error."""

from __future__ import annotations

from ...clearance.law import ConstantLaw
from ...estimate.parameter import Parameter
from ...io.dataset import Dataset
from ...rig import Grease
from ..laws.output_error import PIECE, Fit, evidence, fit_law
from ..registry import register

__all__ = ["fit_constant"]


def linear_grease(grease: Grease) -> list[Parameter]:
    """Return the parameters of a linear grease, which start at the rig file's."""
    return [
        Parameter("grease stiffness", "N/m", max(grease.stiffness, 1.0), 1.0, 1e6),
        Parameter("grease damping", "N s/m", max(grease.damping, 0.1), 1e-3, 1e3),
    ]


def _law(k: float, c: float, grease_k: float, grease_c: float) -> ConstantLaw:
    return ConstantLaw(k, c, grease=Grease(stiffness=float(grease_k), damping=float(grease_c)))


@register(
    "constant",
    "the rig file and the records to identify: best constants for contact and linear grease",
    shortest=lambda rig: PIECE,
)
def fit_constant(dataset: Dataset, progress: bool = False) -> Fit:
    """Fit the best constants: contact stiffness and damping and a linear grease, the same at every bushing."""
    records, first = evidence(dataset.to_identify()), dataset.rig.bushings[0]
    parameters = [
        Parameter("contact stiffness", "N/m", first.contact.stiffness, 1e2, max(1e7, 100 * first.contact.stiffness)),
        Parameter("contact damping", "N s/m", max(first.contact.damping, 0.1), 1e-3, 1e3),
        *linear_grease(first.grease),
    ]
    k, c, grease_k, grease_c = (p.start for p in parameters)
    starts = [(k * a, c * b, grease_k * g, grease_c * b) for a in (0.5, 2.0) for b in (1.0, 3.0) for g in (0.7, 1.0)]
    return fit_law(dataset.rig, records, parameters, _law, starts, title="constants" if progress else "")
