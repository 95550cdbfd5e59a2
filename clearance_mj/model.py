"""A model: a rig and the law of its clearances, which identification finds and everything else predicts with."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .clearance.law import Law
from .clearance.law_files import law_from_dict, load_law
from .clearance.modelled import rig_and_law
from .core.cache import code_outside
from .core.checks import naming
from .core.errors import LawError
from .core.files import plain_file, to_json, write_text
from .core.overview import HasOverview, Overview, few
from .engines import Engine, simulate
from .rig import Rig
from .rig.examples import example_words
from .rig.gaps import Gap
from .signals.excitation import Excitation
from .signals.response import Response

__all__ = ["LAW_FILE", "RIG_FILE", "Model", "model_warnings"]

RIG_FILE, LAW_FILE, POSTERIOR_FILE = "rig.toml", "law.json", "posterior.json"
KEPT_DRAWS = 64  # models that a folder keeps of a posterior: a standard deviation out of so many is known to 9 %


@dataclass(frozen=True, repr=False)
class Model(HasOverview):
    """A rig with the law of its clearances; models are equal if both are.

    The law owns contact and filling; without one it is the nominal law, the rig file's own values.
    """

    rig: Rig
    """linear structure, gaps and offsets, sensors"""
    law: Law = None  # type: ignore[assignment]
    """contact and filling of every clearance; None: the rig file's datasheet values"""
    posterior: Callable[[int, int], Sequence[Model]] | None = field(default=None, repr=False, compare=False)
    """draws n models with a seed that the records do not distinguish from this one; None: not known"""

    def __post_init__(self) -> None:
        object.__setattr__(self, "law", rig_and_law(self.rig, self.law)[1])

    def _overview(self) -> Overview:
        title, facts, _ = self.rig._overview()
        _, over, (head, *rows) = self.law._overview()
        rows = rows * len(self.rig.bushings) if len(rows) == 1 else rows
        table = [
            (str(j), b.where, f"{1e3 * b.gap:.4g}", f"{1e3 * b.offset:.4g}", *row[1:])
            for j, (b, row) in enumerate(zip(self.rig.bushings, rows), 1)
        ]
        columns = ("bushing", "at", "gap (mm)", "offset (mm)", *head[1:])
        datasheet = self.law == rig_and_law(self.rig, None)[1]
        law = f"{self.law.kind}{', as the datasheet in the rig file says' if datasheet else ''}"
        return Overview(f"Model of {title[0].lower()}{title[1:]}", facts | {"law": law} | over, [columns, *table])

    def simulate(self, excitation: Excitation, engine: str | Engine | None = None, progress: bool = False) -> Response:
        """Simulate the model under an excitation, as `clearance_mj.simulate` does.

        Parameters
        ----------
        excitation : Excitation
            Base acceleration or shaker force.
        engine : str or Engine, optional
            "links", "modal", or an engine with other settings; by default that of `default_engine`.
        progress : bool
            Show a progress bar.

        Returns
        -------
        Response
        """
        return simulate(self, excitation, engine=engine, progress=progress)

    def with_gap(self, gap: Gap) -> Model:
        """Return the model with another radial gap at its bushings: what the same machine did with other bushings.

        The law stays, and so do draws of the posterior but for their gap. A contact model holds at any gap; stiffness
        over amplitude belongs to the gap at which it was identified.

        Parameters
        ----------
        gap : float, str, sequence or mapping
            As `Rig.with_gap` takes it, whose errors it raises: 9e-5, "0.09 mm", "x0.5", or these by bushing.
        """
        drawn = partial(_with_gap, self, gap) if self.posterior else None
        return replace(self, rig=self.rig.with_gap(gap), posterior=drawn)

    def draw(self, n: int, seed: int = 0) -> Sequence[Model]:
        """Draw models that the records do not distinguish from this one.

        Parameters
        ----------
        n : int
            Number of models.
        seed : int
            Seed of the random numbers.

        Raises
        ------
        LawError
            If the model has no posterior: it was not identified by a method that fits parameters, or the records leave
            one of them open; or if more models are wanted than its folder keeps.
        """
        if self.posterior is None:
            raise LawError("the model has no posterior to draw from; identify it by a method that fits parameters")
        return self.posterior(n, seed)

    def drawn(self, n: int) -> tuple[Model, ...]:
        """Return draws, or none where the model has no posterior or the records leave a parameter open.

        Parameters
        ----------
        n : int
            Number of models.
        """
        try:
            return tuple(self.draw(n))
        except LawError:
            return ()

    def save(self, folder: str | Path, provenance: Mapping[str, Any] | None = None) -> None:
        """Write ``rig.toml``, ``law.json`` and, of a posterior, ``posterior.json`` with draws, into a folder.

        Parameters
        ----------
        folder : str or Path
            Made if it is not there; files of these names are replaced, each once the new one is whole.
        provenance : mapping, optional
            What the model comes from, for ``law.json``.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.rig.copied(folder / "structure").save(folder / RIG_FILE)
        write_text(folder / LAW_FILE, to_json(self.law.to_dict() | ({"provenance": provenance} if provenance else {})))
        if drawn := self.drawn(KEPT_DRAWS):
            write_text(folder / POSTERIOR_FILE, json.dumps({"drawn": [model.to_dict() for model in drawn]}) + "\n")
        else:
            (folder / POSTERIOR_FILE).unlink(missing_ok=True)

    def to_dict(self) -> dict[str, Any]:
        """Return rig and law as plain data."""
        return {"rig": self.rig.to_dict(), "law": self.law.to_dict()}

    def content(self) -> list[Any]:
        """Return plain data, equal for equal models, for caches; see `Rig.content`.

        Files outside of the package count, such as plugins that define a contact, a grease or a structure.
        """
        of_rig = (part for bushing in self.rig.bushings for part in (bushing.contact, bushing.grease))
        made_of = self.rig.structure, *of_rig, *getattr(self.law, "contact", ()), *(self.law.grease or ())
        return [self.rig.content(), self.law.to_dict(), *code_outside(*made_of)]

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], known: Rig) -> Model:
        """Return the model of what `to_dict` returned.

        Parameters
        ----------
        data : mapping
            Plain data.
        known : Rig
            A rig with the same structure, whose files are taken where that is read from files.
        """
        return cls(_load_rig(data["rig"], known), law_from_dict(data["law"]))

    @classmethod
    def load(cls, path: str | Path, law: str | Path | None = None) -> Model:
        """Read a model from a folder that `save` wrote, or from a rig file and a law file.

        Parameters
        ----------
        path : str or Path
            A folder with ``rig.toml`` and, if a law was identified with the rig, ``law.json``; or a rig file (TOML).
        law : str or Path, optional
            File of another law; without any, the law is the rig file's datasheet values.

        Raises
        ------
        RigError, LawError
            If a file is missing or holds what is impossible.
        """
        path = Path(path)
        if not path.is_dir():
            return cls(Rig.load(path), load_law(law) if law else None)  # type: ignore[arg-type]
        rig, law_file = Rig.load(path / RIG_FILE), path / LAW_FILE
        if law is None and (path / POSTERIOR_FILE).is_file():
            return cls(rig, load_law(law_file), partial(_draw_kept, path / POSTERIOR_FILE, rig))
        law = law or (law_file if law_file.is_file() else None)
        return cls(rig, load_law(law) if law else None)  # type: ignore[arg-type]


def _with_gap(model: Model, gap: Gap, n: int, seed: int) -> list[Model]:
    """Draw models of another gap."""
    return [drawn.with_gap(gap) for drawn in model.draw(n, seed)]


def _draw_kept(path: Path, rig: Rig, n: int, seed: int) -> list[Model]:
    """Return n of the models that a file keeps, each at most once."""
    damages = OSError, ValueError, KeyError, TypeError, RecursionError
    with naming(path, damages, LawError, "{}: holds no draws of a model ({})"):
        drawn = json.loads(plain_file(path).read_text(encoding="utf-8"))["drawn"]
        models = [Model.from_dict(drawn[i], rig) for i in np.random.default_rng(seed).permutation(len(drawn))[:n]]
    if len(models) < n:
        raise LawError(f"{path}: keeps {len(drawn)} draws, {n} are wanted; identify again to draw more")
    return models


def _load_rig(data: dict[str, Any], known: Rig) -> Rig:
    """Return the rig of plain data, with the structure of a known one if that is read from files."""
    of_known = known.to_dict()
    if data == of_known:
        return known
    if known.structure and known.structure.files:
        data = data | {"structure": of_known["structure"]}
    return Rig.from_dict(data)


def model_warnings(model: Model, folder: Path | None) -> list[str]:
    """Say which numbers of a model nobody gave, and which of its gaps no record showed.

    Parameters
    ----------
    model : Model
        The model.
    folder : Path, optional
        Where it was loaded from; what identification wrote says which gaps it took from the rig file.
    """
    words = [example_words(model.rig.examples)] if model.rig.examples else []
    try:
        said = json.loads((folder / "identified.json").read_text(encoding="utf-8"))["only_prior"] if folder else ()
    except (OSError, ValueError, KeyError, TypeError):  # no model that was identified from records
        return words
    gaps = few([name for name in said if name.endswith(".gap")])
    return [*words, f"no record showed {gaps}; contact is predicted with the rig file's number"] if gaps else words
