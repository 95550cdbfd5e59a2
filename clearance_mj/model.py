"""A model: a rig and the law of its clearances, which identification finds and everything else predicts with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from .clearance.law import ConstantLaw, Law
from .clearance.law_files import load_law
from .core.errors import LawError
from .engines import Engine, simulate
from .rig import Rig
from .signals.excitation import Excitation
from .signals.response import Response

__all__ = ["Model", "nominal_law"]

RIG_FILE, LAW_FILE = "rig.toml", "law.json"


def nominal_law(rig: Rig) -> ConstantLaw:
    """Return the law that the rig file's datasheet values make.

    Parameters
    ----------
    rig : Rig
        Its bushings hold contact stiffness and damping; the filling stays the rig's own.
    """
    if not rig.bushings:
        return ConstantLaw(0.0, 0.0)
    contacts = [bushing.contact for bushing in rig.bushings]
    return ConstantLaw([c.stiffness for c in contacts], [c.damping for c in contacts])


@dataclass(frozen=True)
class Model:
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
        if self.law is None:
            object.__setattr__(self, "law", nominal_law(self.rig))

    def simulate(self, excitation: Excitation, engine: str | Engine = "links", progress: str | None = None) -> Response:
        """Simulate the model under an excitation, as `clearance_mj.simulate` does.

        Parameters
        ----------
        excitation : Excitation
            Base acceleration or shaker force.
        engine : str or Engine
            "links", "modal", "modal-mj", or an engine with settings of its own.
        progress : str, optional
            Show a progress bar with this name.

        Returns
        -------
        Response
        """
        return simulate(self.rig, excitation, self.law, engine, progress)

    def draw(self, n: int, seed: int = 0) -> Sequence[Model]:
        """Draw models that the records do not distinguish from this one.

        Parameters
        ----------
        n : int
            How many.
        seed : int
            Of the random numbers.

        Raises
        ------
        LawError
            If the model has no posterior: it was not identified by a method that fits parameters.
        """
        if self.posterior is None:
            raise LawError("the model has no posterior to draw from; identify it by a method that fits parameters")
        return self.posterior(n, seed)

    def save(self, folder: str | Path) -> None:
        """Write ``rig.toml`` and ``law.json`` into a folder, which is made if it is not there.

        Parameters
        ----------
        folder : str or Path
            Files of these names are replaced, each once the new one is whole.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.rig.save(folder / RIG_FILE)
        self.law.save(folder / LAW_FILE)

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
        if path.is_dir():
            law = law or (path / LAW_FILE if (path / LAW_FILE).is_file() else None)
            path = path / RIG_FILE
        return cls(Rig.load(path), load_law(law) if law else None)  # type: ignore[arg-type]
