"""Plans of sweeps: varied parameters, simulation and results; read from TOML, checked before anything runs."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import inspect
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..clearance.law import Law
from ..clearance.law_files import law_from_dict
from ..clearance.modelled import nominal_law
from ..core.cache import digest
from ..core.checks import naming
from ..core.errors import ClearanceError, RecordError
from ..core.plain_numbers import find_numbers, get_number, replace_numbers
from ..core.validation import from_plain, read_plain, to_plain
from ..engines import Engine, get_engine
from ..engines.batch import simulate_all
from ..io.dataset import Record
from ..io.uff import read_uff
from ..model import LAW_FILE, Model
from ..rig import Rig
from ..signals import excitation as excitations
from ..signals.excitation import Excitation
from ..signals.frf import FRF, estimate_frf
from .case import Observer, Outputs, linear_frequencies
from .design import Design, Vary

__all__ = ["Plan", "load_plan"]

FILE, TABLE = (str, "the name of a file"), (dict, "a table")
KEYS: dict[str, tuple[Any, str]] = {
    **{"rig": (str, "the name of a file or folder"), "law": FILE, "reference": FILE},
    **{"excitation": TABLE, "outputs": TABLE, "design": TABLE},
    **{"engine": (str | dict, "a name or a table"), "vary": (list, "a list of tables ([[vary]])")},
}  # of a plan's file, with their types
GENERATORS = tuple(name for name in excitations.__all__ if name != "Excitation")
CHECKED = 1000  # cases whose rig and law are checked before anything runs, at about a millisecond each
MAX_SAMPLES = 10_000_000  # of a case's excitation: 80 MB, and a few times as much while it is made
AXES = ("excitation.fs", "excitation.band")  # parameters of the results' axes


@dataclass(frozen=True, eq=False)
class Plan:
    """A sweep: cases that differ in the varied parameters.

    Without excitation nothing is simulated: a case then has natural frequencies only.

    Raises
    ------
    ClearanceError
        If a path is unknown, varies twice or has no effect, or if a case's rig or law is impossible. Of many cases
        only `CHECKED` are tried, the first and the last among them; others that are impossible have no results.
    """

    rig: Rig
    """rig whose fields vary"""
    vary: tuple[Vary, ...]
    """varied parameters"""
    design: Design = field(default_factory=Design)
    """distribution of the cases"""
    law: Law | None = None
    """None: each case's datasheet contact"""
    engine: Engine = field(default_factory=lambda: get_engine("modal"))
    """engine of the simulations"""
    excitation: dict | Excitation | None = None
    """generator and its parameters, or a measured one; None: nothing is simulated"""
    reference: FRF | None = None
    """FRFs for comparison with each case's"""
    outputs: Outputs = field(default_factory=Outputs)
    """results to keep of each case"""
    files: tuple[Path, ...] = field(default=(), compare=False)
    """files that it was read from: itself and those that it names"""

    def __post_init__(self) -> None:
        if not self.vary:
            raise ClearanceError("the plan varies nothing; give at least one [[vary]]")
        if self.excitation is None and self.reference is not None:
            raise ClearanceError("the reference holds FRFs, so the plan needs an [excitation]")
        if isinstance(self.excitation, dict):
            object.__setattr__(self, "excitation", _complete_excitation(self.excitation, self.rig.shaker.kind))
        places = [place for group in self._places for place in group]
        if len(set(places)) < len(places):
            raise ClearanceError(f"a field varies twice: {', '.join(self.paths)}")
        for case in np.unique(np.linspace(0, len(self.points) - 1, CHECKED).astype(int)):
            self._parts(case)

    @property
    def paths(self) -> list[str]:
        """Paths of the varied parameters."""
        return [v.path for v in self.vary]

    @functools.cached_property
    def points(self) -> np.ndarray:
        """(n_cases, n_varied) values of the varied parameters."""
        return self.design.points(self.vary)

    @functools.cached_property
    def observer(self) -> Observer | None:
        """Observer of the simulations; None if nothing is simulated."""
        _, _, excitation = self.case(0)
        if excitation is None:
            return None
        with naming("reference") if self.reference is not None else contextlib.nullcontext():
            return Observer.of(self.outputs, self.rig, excitation, self.reference)

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of every result of a case."""
        simulated = self.observer.shapes(self.rig) if self.observer else {}
        return {"natural_frequency": (self.outputs.natural_frequencies,), **simulated}

    def case(self, case: int) -> tuple[Rig, Law, Excitation | None]:
        """Return rig, law and excitation of a case.

        Parameters
        ----------
        case : int
            Number of the case.

        Raises
        ------
        ClearanceError
            If its excitation is impossible.
        """
        rig, law, parameters = self._parts(case)
        if parameters is None:
            return rig, law, self._measured
        given = dict(parameters)
        with naming("excitation", (TypeError, ValueError, MemoryError), ClearanceError):
            if given.get("duration", 0) * given.get("fs", 0) > MAX_SAMPLES:
                raise ClearanceError(f"excitation: duration times fs is more than {MAX_SAMPLES} samples")
            return rig, law, getattr(excitations, given.pop("generator"))(**given)

    def evaluate(self, case: int) -> dict[str, np.ndarray] | str:
        """Compute a case.

        Parameters
        ----------
        case : int
            Number of the case.

        Returns
        -------
        dict of str to ndarray, or str
            Results with the names of `shapes`; or, if it cannot be simulated, the reason.
        """
        return next(self.evaluate_all([case]))

    def evaluate_all(self, cases: Sequence[int]) -> Iterator[dict[str, np.ndarray] | str]:
        """Compute cases, together where the engine supports it, and yield the result of `evaluate` for each.

        Parameters
        ----------
        cases : sequence of int
            Numbers of the cases.
        """
        models = dict[int, tuple[Rig, Law]]()

        def make_case(case: int) -> tuple[Rig, Excitation | None, Law]:
            rig, law, excitation = self.case(case)
            models[case] = rig, law
            return rig, excitation, law

        tasks = [functools.partial(make_case, case) for case in cases]
        responses = simulate_all(tasks, self.engine) if self.observer else [None] * len(cases)
        for case, response in zip(cases, responses):
            try:
                if response is None:
                    make_case(case)
                elif isinstance(response, ClearanceError):
                    raise response
                rig, law = models.pop(case)
                results = {"natural_frequency": linear_frequencies(rig, law, self.outputs.natural_frequencies)}
                yield results | (self.observer(response) if self.observer and response else {})
            except ClearanceError as error:
                yield str(error)

    def to_dict(self) -> dict:
        """Return the plan as plain data, with digests of arrays."""
        reference, measured = self.reference, self._measured
        return {
            "rig": self.rig.content(),
            "law": self.law and self.law.to_dict(),
            "engine": {"name": self.engine.name, **dataclasses.asdict(self.engine)},
            "excitation": self._generated or (measured and _digest(measured.fs, measured.value)),
            "reference": reference and _digest(reference.responses, reference.frequency, reference.value),
            "outputs": to_plain(self.outputs),
            "design": to_plain(self.design),
            "vary": [to_plain(v) for v in self.vary],
        }

    @property
    def _generated(self) -> dict | None:
        return self.excitation if isinstance(self.excitation, dict) else None

    @property
    def _measured(self) -> Excitation | None:
        return None if isinstance(self.excitation, dict) else self.excitation

    @functools.cached_property
    def _data(self) -> dict:
        """Data that can vary, as plain data."""
        return {"rig": self.rig.to_dict(), "law": self.law and self.law.to_dict(), "excitation": self._generated}

    @functools.cached_property
    def _places(self) -> list[list[tuple]]:
        return [self._find_places(v) for v in self.vary]

    def _find_places(self, vary: Vary) -> list[tuple]:
        path, (part, _, rest) = vary.path, vary.path.partition(".")
        if part not in self._data or not rest:
            raise ClearanceError(f"vary {path}: begin with rig., law. or excitation., as in rig.bushings[0].gap")
        if self._data[part] is None:
            raise ClearanceError(f"vary {path}: the plan has no {part}{_INSTEAD.get(part, '')}")
        if path.startswith(AXES) or path.endswith(".node"):
            raise ClearanceError(f"vary {path}: cannot vary, the results' axes depend on it")
        places = [(part, *place) for place in find_numbers(self._data[part], rest)]
        if self.law is not None and part == "rig" and "contact" in rest:
            raise ClearanceError(f"vary {path}: has no effect beside a law; vary law. instead")
        if self.law is not None and self.law.grease is not None and part == "rig" and "grease" in rest:
            raise ClearanceError(f"vary {path}: has no effect, the law brings its own grease; vary law.grease instead")
        given = self._generated or {}
        if part == "excitation" and places[0][1] not in given:
            raise ClearanceError(f"vary {path}: unknown; {given['generator']} has {', '.join(given)}")
        whole = part == "excitation" and isinstance(get_number(self._data, places[0]), int)
        if whole and (vary.values is None or any(v != int(v) for v in vary.values)):
            raise ClearanceError(f"vary {path}: takes whole numbers; give them as values")
        return places

    def _parts(self, case: int) -> tuple[Rig, Law, dict | None]:
        """Return rig, law and the excitation's parameters of a case."""
        values = self.points[case].tolist()
        settings = ", ".join(f"{path} = {v:g}" for path, v in zip(self.paths, values))
        with naming(f"case {case} ({settings})", ClearanceError, ClearanceError):
            changes = {place: v for group, v in zip(self._places, values) for place in group}
            data = replace_numbers(self._data, {p: int(v) if p[-1] == "seed" else v for p, v in changes.items()})
            rig = Rig.from_dict(data["rig"])
            law = nominal_law(rig) if self.law is None else law_from_dict(data["law"])
            law.table(len(rig.bushings))
        return rig, law, data["excitation"]


_INSTEAD = {"law": " file; without one vary rig.bushings.contact", "excitation": " table"}


def _complete_excitation(given: dict, kind: str) -> dict:
    """Return an excitation's parameters, completed by defaults."""
    name = given.get("generator")
    if name not in GENERATORS:
        raise ClearanceError(f"excitation.generator {name!r} is unknown; use {', '.join(GENERATORS)}")
    known = inspect.signature(getattr(excitations, name)).parameters
    if unknown := [key for key in given if key not in known and key != "generator"]:
        raise ClearanceError(f"excitation.{unknown[0]} is unknown; {name} has {', '.join(known)}")
    defaults = {key: p.default for key, p in known.items() if p.default is not p.empty} | {"kind": kind}
    if missing := [key for key in known if key not in defaults and key not in given]:
        raise ClearanceError(f"excitation.{missing[0]} is missing")
    values = defaults | given
    return {"generator": name} | {key: _as_number(values[key], p.annotation) for key, p in known.items()}


def _as_number(value: Any, annotation: object) -> Any:
    """Convert TOML's 2 to 2.0, unless the generator declares it whole."""
    if isinstance(value, list | tuple):
        return [_as_number(item, annotation) for item in value]
    if not isinstance(value, int) or annotation == "int":
        return value
    try:
        return float(value)
    except OverflowError:
        raise ClearanceError("excitation: a whole number is too large to use") from None


def _digest(facts: object, *arrays: np.ndarray) -> str:
    return digest(facts, *(hashlib.sha256(np.ascontiguousarray(a).tobytes()).hexdigest() for a in arrays))


def load_plan(path: str | Path) -> Plan:
    """Read a plan from a TOML file; files that it names are taken relative to its folder.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    ClearanceError
        If the file is missing or not TOML, has unknown keys, or its plan is impossible.
    """
    path = Path(path)
    data = read_plain(path, ClearanceError)
    with naming(path, ClearanceError):
        plan = _plan(data, path.parent)
        named_files = [path.parent / data[key] for key in ("rig", "law", "reference") if key in data]
        plan = dataclasses.replace(plan, files=(path, *named_files))
        plan.observer  # noqa: B018 that refuses what cannot be observed
    return plan


def _plan(data: dict, folder: Path) -> Plan:
    if unknown := [key for key in data if key not in KEYS]:
        raise ClearanceError(f"{unknown[0]} is not a known key; known: {', '.join(KEYS)}")
    for key, value in data.items():
        kind, words = KEYS[key]
        if not isinstance(value, kind):
            raise ClearanceError(f"{key} must be {words}, got {value!r}")
    if "rig" not in data:
        raise ClearanceError('rig is missing: rig = "rig.toml"')
    given = folder / data["rig"]
    model = Model.load(given, folder / data["law"] if "law" in data else None)
    rig, law = model.rig, model.law if "law" in data or (given / LAW_FILE).is_file() else None
    outputs = from_plain(Outputs, data.get("outputs", {}), "outputs", ClearanceError)
    reference, measured = _reference(folder / data["reference"], rig, outputs) if "reference" in data else (None, None)
    vary = tuple(from_plain(Vary, one, f"vary[{i}]", ClearanceError) for i, one in enumerate(data.get("vary", [])))
    design = from_plain(Design, data.get("design", {}), "design", ClearanceError)
    engine, excitation = _engine(data.get("engine", "modal")), data.get("excitation", measured)
    return Plan(rig, vary, design, law, engine, excitation, reference, outputs)


def _engine(given: str | dict) -> Engine:
    settings = {"name": given} if isinstance(given, str) else dict(given)
    engine = get_engine(str(settings.pop("name", None)))
    try:
        return dataclasses.replace(engine, **settings)
    except TypeError:
        known = ", ".join(f.name for f in dataclasses.fields(engine))
        raise ClearanceError(f"engine: {engine.name} has the settings {known}, got {', '.join(settings)}") from None


def _reference(path: Path, rig: Rig, outputs: Outputs) -> tuple[FRF, Excitation | None]:
    """Read FRFs for comparison; of a record also its excitation."""
    content = read_uff(path)
    if isinstance(content, FRF):
        if len(content.references) > 1:
            references = ", ".join(content.references)
            raise RecordError(f"{path}: holds FRFs to {references}; a sweep needs them to one reference")
        return content, None
    if not isinstance(content, list):
        raise RecordError(f"{path}: holds neither FRFs nor records; a sweep needs FRFs or a record")
    if outputs.band is None:
        raise ClearanceError("outputs.band is missing: the reference is a record, which does not tell its band")
    record = Record("reference", "validate", rig, content[0].fs, content, rig.shaker.kind)
    return estimate_frf(record.response(), resolution=outputs.resolution, band=outputs.band), record.excitation()
