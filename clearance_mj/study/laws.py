"""The laws of a study: which methods its records allow, and their models, each identified when first asked for."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Sequence

from ..core.cache import ResultCache, code_outside
from ..core.errors import RecordError
from ..identify import get_method, require
from ..identify.records.checks import IdentifiabilityWarning
from ..identify.registry import Identified
from ..io.dataset import Dataset
from ..linear.refusals import refuse_loaded
from . import stored
from .identified import IdentifiedModel

__all__ = ["METHODS", "StudiedLaws", "stored_law"]

METHODS = ("nominal", "constant", "amplitude", "bench")
"""tried where none are named: rig file alone, constants, a law with the rig taken for exact, rig and law; of a rig in
space those that know one"""


class StudiedLaws:
    """Models by the names of the methods that find them.

    Parameters
    ----------
    dataset : Dataset
        Rig and records.
    methods : sequence of str or None
        Methods that are named; None: those of `METHODS` that the records allow.
    cache : ResultCache or None
        Where models are kept for the next study.
    progress : bool
        Show progress bars.

    Raises
    ------
    RecordError
        If the dataset has not what a method that was named needs.
    ClearanceError
        For an unknown method.
    """

    def __init__(self, dataset: Dataset, methods: Sequence[str] | None, cache: ResultCache | None, progress: bool):
        for method in methods or ():
            get_method(method)
        for method in methods or ():
            if not get_method(method).in_space:
                refuse_loaded(dataset.rig, f'method "{method}"')
            require(method, dataset)
        self._candidates = [m for m in METHODS if get_method(m).in_space or not dataset.rig.is_loaded]
        self.dataset, self.cache, self._progress = dataset, cache, progress
        self._named = None if methods is None else tuple(methods)
        self.left_out: dict[str, str] = {}
        """why methods that were not named are left out, by their names"""
        for method in self._candidates if methods is None else ():
            self._find_or_leave_out(method, functools.partial(get_method(method).require, dataset))
        self.identified: dict[str, IdentifiedModel] = {}
        """models identified so far"""

    def _find_or_leave_out(self, method: str, find: Callable[[], object]) -> None:
        """Leave a method out, and warn of it, where it cannot be had from the records."""
        try:
            find()
        except RecordError as error:
            self.left_out[method] = str(error)
            warnings.warn(f'method "{method}" is left out of the study: {error}', IdentifiabilityWarning, stacklevel=4)

    @functools.cached_property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods: those that were named, or those of `METHODS` that give a law."""
        if self._named is not None:
            return self._named
        for method in self._candidates:
            if method not in self.left_out:
                self._find_or_leave_out(method, functools.partial(self.law, method))
        return tuple(method for method in self._candidates if method not in self.left_out)

    def law(self, name: str) -> IdentifiedModel:
        """Return a law by the name of its method, identified if it was not yet.

        Parameters
        ----------
        name : str
            The method.
        """
        if name not in self.identified:

            def find() -> Identified:
                with warnings.catch_warnings():  # all are raised below, those of stored results too
                    warnings.simplefilter("ignore", IdentifiabilityWarning)
                    return get_method(name).find(self.dataset, self._progress)

            law = self.identified[name] = stored_law(self.cache, name, self.dataset, find)
            for text in law.warnings:
                warnings.warn(text, IdentifiabilityWarning, stacklevel=3)
        return self.identified[name]


def stored_law(
    cache: ResultCache | None, name: str, dataset: Dataset, find: Callable[[], Identified]
) -> IdentifiedModel:
    """Return what a method finds in a dataset from the cache, or find it; the command `identify` keeps it there.

    Parameters
    ----------
    cache : ResultCache or None
        Where it is kept.
    name : str
        The method's.
    dataset : Dataset
        Rig and records.
    find : callable
        Finds it.
    """
    inputs = [name, dataset.rig.content(), *map(stored.record_digest, dataset.identify)]
    inputs += code_outside(get_method(name).find)
    return stored.law(cache, name, inputs, dataset.rig, lambda: IdentifiedModel.of(name, find()))
