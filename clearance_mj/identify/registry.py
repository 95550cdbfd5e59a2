"""Identification methods by name: how one is registered, what it returns, and how it is run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ..clearance.law import Law
from ..core.errors import ClearanceError, LawError, RecordError
from ..estimate.estimates import Estimates
from ..io.dataset import Dataset
from ..rig import Rig
from .records.checks import check_length, check_records, warn
from .structure.faults.contradictions import contradictions_of_rig

__all__ = ["METHODS", "Identified", "Method", "get_method", "law", "register"]


@dataclass(frozen=True, eq=False)
class Identified:
    """A law, and the parameters that were fitted for it."""

    law: Law
    """the law found"""
    estimates: Estimates | None = None
    """of the fitted parameters; None: the method fits none, or not with one covariance"""
    rig: Rig | None = None
    """that the law belongs to; None: the rig file's"""

    @property
    def parameters(self) -> tuple[dict[str, Any], ...]:
        """Fitted parameters as plain data, see `Estimates.rows`."""
        return self.estimates.rows() if self.estimates else ()

    def draw(self, n: int, seed: int = 0) -> Sequence[tuple[Rig, Law]]:
        """Draw rigs with laws that the records do not distinguish from those found.

        Only of methods whose result says how; laws of others are drawn by `statistics.frf_bands.draw_cases`.

        Parameters
        ----------
        n : int
            How many.
        seed : int
            Of the random numbers.

        Raises
        ------
        LawError
            If it is of another method.
        """
        raise LawError("the method gives no covariance of its parameters; use one that fits them")


Find = Callable[[Dataset, str | None], Identified]


@dataclass(frozen=True)
class Method:
    """A way to a law."""

    prior_information: str
    """what it is given, in words"""
    find: Find
    """takes a dataset and the name of the progress bar, if there is to be one"""
    shortest: Callable[[Rig], float] | None = None
    """s, that one record must last; None: it opens no record, or checks them itself"""
    make: Callable[..., Law] | None = None
    """makes the law from a rig and the values of its fitted parameters; None: it fits none"""
    rig_exact: bool = True
    """whether it takes the rig file for exact"""

    def run(self, dataset: Dataset, progress: str | None = None) -> Identified:
        """Check the records to identify, then find the law; records to validate are never opened."""
        if self.shortest:
            records, rig = dataset.to_identify(), dataset.rig
            if not rig.bushings:
                raise RecordError(f"rig {rig.name!r} has no bushings, so there is no clearance to identify")
            check_length(records, self.shortest(rig), {n: m.shortest(rig) for n, m in METHODS.items() if m.shortest})
            prepared = check_records(records)
            for words in contradictions_of_rig(rig, prepared) if self.rig_exact else ():
                warn(words)
        return self.find(dataset, progress)


METHODS: dict[str, Method] = {}
"""the registered methods, by name"""


def register(
    name: str,
    prior_information: str,
    shortest: Callable[[Rig], float] | None = None,
    make: Callable[..., Law] | None = None,
    rig_exact: bool = True,
) -> Callable[[Find], Find]:
    """Make an identification method known by its name; a decorator of its function.

    Parameters
    ----------
    name : str
        For `law`, the command line, the study and its report.
    prior_information : str
        In words: what the method is given.
    shortest : callable, optional
        Seconds that one record must last, from the rig. With it, the records are checked before the method is called.
    make : callable, optional
        Makes the law from a rig and the values of its fitted parameters, so that laws can be drawn from their
        covariance.
    rig_exact : bool
        Whether it takes the rig file for exact; records that contradict it are then said.

    Returns
    -------
    callable
        Takes a function of a dataset and of the name of the progress bar (or None) that returns `Identified`.
    """

    def add(find: Find) -> Find:
        METHODS[name] = Method(prior_information, find, shortest, make, rig_exact)
        return find

    return add


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


def law(dataset: Dataset, method: str = "output-error", progress: str | None = None) -> Law:
    """Identify the clearance's law from a dataset.

    Parameters
    ----------
    dataset : Dataset
        Records with role "validate" are never opened.
    method : str
        "nominal": the rig file's datasheet values; "constant": the best constants; "ridge": over the record's time,
        from the wavelet ridge; "force-balance" and "amplitude": constant or over amplitude, from the restoring forces;
        "output-error": the physical law (Bouc-Wen grease with squeeze film, power-law contact); or one of your own,
        see `register`.
    progress : str, optional
        Show a progress bar with this name.

    Raises
    ------
    ClearanceError
        For an unknown method; the message lists the known ones.
    RecordError
        If the dataset holds nothing to identify from.
    """
    return get_method(method).run(dataset, progress).law
