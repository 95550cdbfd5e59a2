"""Identification methods by name: their registration, their result, and `identify`, which runs one."""

from __future__ import annotations

import contextlib
import functools
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from ..clearance.law import Law
from ..core.errors import ClearanceError, LawError, RecordError
from ..core.files import to_json, write_text
from ..core.kinds import checks_kinds
from ..estimate.estimates import Estimates
from ..io.dataset import Dataset
from ..linear.refusals import refuse_loaded
from ..model import Model
from ..rig import Rig
from ..rig.examples import example_words, unknown_examples
from ..version import __version__
from .forces.restoring import possible_forces, restoring_force
from .records.checks import IdentifiabilityWarning, check_length, check_records, warn, warn_of_no_contact
from .records.needs import Need
from .records.prepared import PreparedRecord
from .structure.faults.contradictions import contradictions_of_rig

__all__ = ["METHODS", "Identified", "Method", "fitted_model", "get_method", "identify", "law", "register", "require"]

UNIDENTIFIED = 5.0  # standard deviation of a logarithm from which on a parameter counts as not identified at all


@dataclass(frozen=True, eq=False, kw_only=True)
class Identified:
    """An identified model with the estimates of its parameters and warnings."""

    model: Model
    """rig and law; of a method that takes the rig file for exact, the rig is the dataset's"""
    estimates: Estimates | None = None
    """of the fitted parameters; None: the method fits none, or not with one covariance"""
    warnings: tuple[str, ...] = ()
    """plain words on what not to rely on"""
    pages: Mapping[str, Any] = field(default_factory=dict)
    """further results of the method, by the names of the sections that report them"""

    @property
    def rig(self) -> Rig:
        """The model's."""
        return self.model.rig

    @property
    def law(self) -> Law:
        """The model's."""
        return self.model.law

    @property
    def parameters(self) -> tuple[dict[str, Any], ...]:
        """Fitted parameters as plain data, see `Estimates.rows`."""
        return self.estimates.rows() if self.estimates else ()

    @property
    def unseen_gaps(self) -> tuple[int, ...]:
        """Numbers of the bushings of whose gap the records say nothing: it is the rig file's."""
        only = self.estimates.only_prior if self.estimates else ()
        return tuple(j for j in range(len(self.rig.bushings)) if f"bushings[{j}].gap" in only)

    def draw(self, n: int, seed: int = 0) -> Sequence[Model]:
        """Draw models that the records do not distinguish from the identified one, see `Model.draw`.

        Parameters
        ----------
        n : int
            Number of models.
        seed : int
            Seed of the random numbers.
        """
        return self.model.draw(n, seed)

    def to_dict(self) -> dict[str, Any]:
        """Return parameters with their priors, correlations and warnings as plain data."""
        estimates = self.estimates
        return {
            "parameters": estimates.beside_priors() if estimates else [],
            "correlation": estimates.correlation.tolist() if estimates else [],
            "only_prior": list(estimates.only_prior) if estimates else [],
            "warnings": list(self.warnings),
        }

    def save(self, folder: str | Path, dataset: Dataset, provenance: Mapping[str, Any] | None = None) -> None:
        """Write the model as `Model.save` does, and ``identified.json``: its estimates and their provenance.

        Parameters
        ----------
        folder : str or Path
            Folder that is written to.
        dataset : Dataset
            That it was identified from.
        provenance : mapping, optional
            Versions and digests of files that it comes from.
        """
        about = {"version": __version__, "dataset": str(dataset.path), "rig": dataset.rig.name,
                 "synthetic": dataset.is_synthetic, "identified_from": [r.name for r in dataset.identify]}  # fmt: skip
        data = about | self.to_dict() | ({"provenance": provenance} if provenance else {})
        Path(folder).mkdir(parents=True, exist_ok=True)
        write_text(Path(folder) / "identified.json", to_json(data))
        self.model.save(folder, provenance)  # which draws from the posterior, last


def fitted_model(rig: Rig, make: Callable[..., Law], estimates: Estimates) -> Model:
    """Return a rig with the law of fitted values; its posterior is the covariance of the estimates.

    Parameters
    ----------
    rig : Rig
        That the law was fitted on.
    make : callable
        Makes the law of the parameters' values.
    estimates : Estimates
        Values and covariance.
    """

    def posterior(n: int, seed: int) -> list[Model]:
        for name, std in zip(estimates.names, estimates.varied_std):
            if not std < UNIDENTIFIED:
                raise LawError(f"the records do not identify the {name}, so no models can be drawn")
        return [Model(rig, make(*row)) for row in estimates.draw(n, seed).tolist()]

    return Model(rig, make(*estimates.value), posterior)


AnyIdentified = TypeVar("AnyIdentified", bound=Identified)
IdentifyFunction = Callable[[Dataset, bool], Identified]


@dataclass(frozen=True)
class Method:
    """A method of identification."""

    prior_information: str  #: information that it is given, in words
    find: IdentifyFunction  #: takes a dataset and a flag for progress bars; checks the records first
    shortest: Callable[[Rig], float] | None = None
    """s, that one record must last; None: it opens no record, or checks them itself"""
    finds_rig: bool = False  #: True if it identifies the rig too; else it takes the rig file for exact
    needs: tuple[Need, ...] = ()  #: requirements on the records besides their length
    in_space: bool = False  #: True if it knows rigs that move in space

    def require(self, dataset: Dataset) -> None:
        """Refuse a dataset from which the method can find nothing, before anything is computed.

        Parameters
        ----------
        dataset : Dataset
            Its records to identify are not opened.

        Raises
        ------
        RecordError
            If there is no record to identify, no clearance, or if what the method needs is not there.
        """
        if self.shortest is not None:
            records, rig = dataset.to_identify(), dataset.rig
            if not rig.bushings:
                raise RecordError(f"rig {rig.name!r} has no bushings, so there is no clearance to identify")
            check_length(records, self.shortest(rig), {n: m.shortest(rig) for n, m in METHODS.items() if m.shortest})
        for need in self.needs:
            if lacking := need(dataset):
                raise RecordError(lacking)


METHODS: dict[str, Method] = {}
"""the registered methods, by name"""


def register(
    name: str, prior_information: str, shortest: Callable[[Rig], float] | None = None, finds_rig: bool = False,
    needs: Sequence[Need] = (), in_space: bool = False,
) -> Callable[[Callable[..., AnyIdentified]], Callable[..., AnyIdentified]]:  # fmt: skip
    """Make an identification method known by its name; a decorator of its function.

    The function then checks the records before it begins, however it is called, and what it warns of is in its result.

    Parameters
    ----------
    name : str
        For `identify`, the command line, the study and its report.
    prior_information : str
        Information that the method is given, in words.
    shortest : callable, optional
        Seconds that one record must last, from the rig. With it, the records are checked before the method begins.
    finds_rig : bool
        True if it identifies the rig too. Of the others, which take the rig file for exact, a warning says where the
        records contradict it.
    needs : sequence of callable
        Requirements on the records besides their length, such as `records.needs.probes`: each takes the dataset and
        returns in words what is lacking, or "". They are checked before anything is computed.
    in_space : bool
        True if it knows rigs that move in space.

    Returns
    -------
    callable
        Decorator of a function that takes a dataset and a flag to show progress bars and returns `Identified`.
    """

    def add(find: Callable[..., AnyIdentified]) -> Callable[..., AnyIdentified]:
        @functools.wraps(find)
        def checked(dataset: Dataset, progress: bool = False) -> AnyIdentified:
            caught: list[warnings.WarningMessage] = []
            try:
                with warnings.catch_warnings(record=True) as caught:
                    warnings.simplefilter("always", IdentifiabilityWarning)
                    require(name, dataset)
                    records = _checked_records(dataset, exact=not finds_rig) if shortest else ()
                    result = find(dataset, progress)
                    if finds_rig:
                        warn_of_no_contact(records, result.rig)
            finally:  # caught warnings are for scripts, too, and above all where the method fails
                for each in caught:
                    warnings.warn(each.message, each.category, stacklevel=2)
            words = (str(each.message) for each in caught if issubclass(each.category, IdentifiabilityWarning))
            pages = result.pages or (_default_pages(dataset) if shortest else {})
            if result.rig.examples:
                result = _warn_of_examples(result)
            return replace(result, warnings=tuple(dict.fromkeys((*words, *result.warnings))), pages=pages)

        METHODS[name] = Method(prior_information, checked, shortest, finds_rig, tuple(needs), in_space)
        return checked

    return add


def _warn_of_examples(result: AnyIdentified) -> AnyIdentified:
    """Return the result with a warning of the examples in the rig file about which the records say nothing."""
    only = result.estimates.only_prior if result.estimates else ()
    examples = unknown_examples(result.rig.examples, [p["name"] for p in result.parameters if p["name"] not in only])
    words = (f"of the rig file, {example_words(examples)}",) if examples else ()
    model = replace(result.model, rig=result.rig.replace(examples=examples))
    return replace(result, model=model, warnings=result.warnings + words)


def _checked_records(dataset: Dataset, exact: bool) -> tuple[PreparedRecord, ...]:
    """Return the records to identify, their samples checked; records to validate are never opened."""
    prepared = check_records(dataset.to_identify())
    if exact:
        warn_of_no_contact(prepared, dataset.rig)
        for words in contradictions_of_rig(dataset.rig, prepared):
            warn(words)
    return prepared


def _default_pages(dataset: Dataset) -> dict[str, Any]:
    """Return the default pages of a method: forces and contact, as far as the records allow."""
    records = dataset.to_identify()
    return {"forces": functools.partial(possible_forces, records, restoring_force), "contact": records}


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
    ClearanceError.require_known("method", name, METHODS)
    return METHODS[name]


def require(name: str, dataset: Dataset) -> None:
    """Refuse a method that cannot be had from a dataset, and say which can be; nothing is computed.

    Parameters
    ----------
    name : str
        The method's.
    dataset : Dataset
        Its records to identify are not opened.

    Raises
    ------
    ClearanceError
        For an unknown method.
    RecordError
        Says what the method lacks.
    """
    try:
        get_method(name).require(dataset)
    except RecordError as error:
        others = []
        for other, method in METHODS.items():
            with contextlib.suppress(RecordError):
                method.require(dataset)
                others.append(other)
        allowed = f"; these records allow {', '.join(others)}" if others else ""
        raise RecordError(f'method "{name}": {error}{allowed}') from None


@checks_kinds
def identify(dataset: Dataset, method: str = "bench", progress: bool = False) -> Identified:
    """Identify a model, rig and law, from a dataset.

    Parameters
    ----------
    dataset : Dataset
        Records with role "validate" are never opened.
    method : str
        "bench": rig, gaps, offsets and the likeliest family of contact and filling. All others take the rig file for
        exact: "nominal": its datasheet values; "constant": the best constants; "ridge": contact over the record's time,
        from its wavelet ridge; "force-balance" and "amplitude": constant or over amplitude, from the restoring forces;
        "output-error": the physical law (Bouc-Wen grease with squeeze film, power-law contact); or one of your own, see
        `register`.
    progress : bool
        Show progress bars.

    Raises
    ------
    ClearanceError
        For an unknown method; the message lists the known ones.
    RecordError
        If the dataset holds nothing to identify from.
    """
    if not get_method(method).in_space:
        refuse_loaded(dataset.rig, f'method "{method}"')
    return get_method(method).find(dataset, progress)


@checks_kinds
def law(dataset: Dataset, method: str = "output-error", progress: bool = False) -> Law:
    """Identify the clearance's law alone, for a rig file that is exact.

    Parameters
    ----------
    dataset : Dataset
        Records with role "validate" are never opened.
    method : str
        As in `identify`, but not one that finds the rig too, such as "bench": its law belongs to that rig.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ClearanceError
        For an unknown method, or one that finds the rig too.
    RecordError
        If the dataset holds nothing to identify from.
    """
    if get_method(method).finds_rig:
        raise ClearanceError(
            f'method "{method}" finds the rig too, and its law belongs to that rig: identify.identify(dataset, '
            f'"{method}").model has both'
        )
    return identify(dataset, method, progress).law
