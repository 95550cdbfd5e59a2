"""Laws from what is known: the datasheet, or the records that may be used to identify."""

from __future__ import annotations

from ..clearance.law import ConstantLaw, Law
from ..errors import ClearanceError, RecordError
from ..io.dataset import Dataset
from ..rig import Grease, Rig
from .output_error import Fit, Parameter, fit_law

__all__ = ["METHODS", "fit_constant", "law", "nominal"]


def nominal(rig: Rig) -> ConstantLaw:
    """Law of a designer before any test: the datasheet contact of the rig file, and its grease.

    Parameters
    ----------
    rig : Rig
        The rig.
    """
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
    if not dataset.identify:
        raise RecordError(f'{dataset.path or "dataset"}: no record has role "identify", so nothing can be identified')
    first = dataset.rig.bushings[0]
    parameters = [
        Parameter("contact stiffness", "N/m", first.contact.stiffness, 1e2, 1e7),
        Parameter("contact damping", "N s/m", max(first.contact.damping, 0.1), 1e-3, 1e3),
        Parameter("grease stiffness", "N/m", max(first.grease.stiffness, 1.0), 1.0, 1e6),
        Parameter("grease damping", "N s/m", max(first.grease.damping, 0.1), 1e-3, 1e3),
    ]
    k, c, grease_k, grease_c = (p.start for p in parameters)
    starts = [(k * a, c * b, grease_k * g, grease_c * b) for a in (0.5, 2.0) for b in (1.0, 3.0) for g in (0.7, 1.0)]
    return fit_law(dataset.identify, parameters, _constant, starts, progress)


def _constant(k, c, grease_k, grease_c):
    return ConstantLaw(k, c, grease=Grease(stiffness=float(grease_k), damping=float(grease_c)))


METHODS = {
    "nominal": lambda dataset, progress: nominal(dataset.rig),
    "constant": lambda dataset, progress: fit_constant(dataset, progress).law,
}


def law(dataset: Dataset, method: str = "constant", progress: str | None = None) -> Law:
    """Identify the clearance's law from a dataset.

    Parameters
    ----------
    dataset : Dataset
        Records with role "validate" are never opened.
    method : str
        "nominal": the rig file's datasheet values; "constant": the best constants.
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
    if method not in METHODS:
        raise ClearanceError(f'method "{method}" is unknown; known: {", ".join(METHODS)}')
    return METHODS[method](dataset, progress)
