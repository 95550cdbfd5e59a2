"""Scatter of a production, from a file or from a rig's tolerances, and designs drawn from it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tomli_w
from scipy.stats import norm

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..core.files import write_text
from ..core.plain_numbers import Key, find_numbers, path_of
from ..core.validation import from_plain, read_plain, to_plain
from ..model import Model
from ..rig import Rig
from ..rig.tolerance import CLAMP_COMPLIANCES
from .designs import Designs, DrawingRule, changed, is_datasheet
from .scattered import CUT, Correlation, Scattered

__all__ = ["Scatter", "draw_designs", "softer_and_stiffer"]

APART = ("gain", "delay", "probe_delay", "direction", "probe_angle", "wear")
"""Fields by which a production does not scatter: those of sensors and probes, and those without effect on vibrations"""


@dataclass(frozen=True)
class Scatter:
    """Scatter of a production.

    Raises
    ------
    ClearanceError
        If there is nothing, a number scatters twice, or a correlation is of a number that does not scatter.
    """

    numbers: tuple[Scattered, ...]
    """scattering numbers"""
    correlations: tuple[Correlation, ...] = ()
    """between pairs of numbers"""
    left_out: tuple[str, ...] = ()
    """tolerances of the rig by which a production does not scatter"""

    def __post_init__(self) -> None:
        if not self.numbers:
            raise ClearanceError("nothing scatters: give [[scatter]] in a file, or [[tolerances]] in the rig file")

    @classmethod
    def of_rig(cls, rig: Rig, fields: Collection[str] = ()) -> Scatter:
        """Return the scatter of a rig file's tolerances: normal, with their standard deviations.

        Relative tolerances that reach below zero within four of them, and those of wear, are lognormal. Of several
        tolerances of one number the last one counts.

        Parameters
        ----------
        rig : Rig
            Rig with ``tolerances``; those of instruments, of wear and of the clamp's compliance, and exact numbers, are
            left out.
        fields : collection of str
            Fields such as "gap": use their tolerances alone.
        """
        scattered: list[Scattered] = []
        left_out, known, data = [], set[Key](), rig.to_dict()
        for tolerance in reversed(rig.tolerances):
            of, field = tolerance.of, tolerance.of.rpartition(".")[2]
            if field not in fields if fields else field in APART or of in CLAMP_COMPLIANCES:
                left_out.append(of)
                continue
            keys = find_numbers(data, of)
            new = [key for key in keys if key not in known]
            known.update(keys)
            skew = tolerance.relative and (tolerance.size >= 1 / CUT or field == "wear")
            form: Literal["normal", "lognormal"] = "lognormal" if skew and not field.startswith("offset") else "normal"
            for path in (of,) if len(new) == len(keys) else map(path_of, reversed(new)):
                scattered += [Scattered(path, tolerance.std, None, form)] if tolerance.size > 0 else []
        return cls(tuple(scattered[::-1]), (), tuple(left_out[::-1]))

    @classmethod
    def load(cls, path: str | Path) -> Scatter:
        """Read a scatter file (TOML): ``[[scatter]]`` of `Scattered`, ``[[correlations]]`` of `Correlation`.

        Parameters
        ----------
        path : str or Path
            The file.

        Raises
        ------
        ClearanceError
            If it cannot be read, or its content is impossible.
        """
        data = read_plain(path, ClearanceError)
        if unknown := [key for key in data if key not in ("scatter", "correlations")]:
            raise ClearanceError(f"{path}: {unknown[0]} is not a known key; known: scatter, correlations")
        with naming(path, ClearanceError):
            numbers = from_plain(tuple[Scattered, ...], data.get("scatter", []), "scatter", ClearanceError)
            pairs = from_plain(tuple[Correlation, ...], data.get("correlations", []), "correlations", ClearanceError)
            return cls(numbers, pairs)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, as in a scatter file."""
        return {"scatter": to_plain(self.numbers), "correlations": to_plain(self.correlations)}

    def save(self, path: str | Path) -> None:
        """Write a scatter file for `load`.

        Parameters
        ----------
        path : str or Path
            The file (TOML).
        """
        write_text(Path(path), tomli_w.dumps(self.to_dict()))

    def narrowed(self, widths: Mapping[str, float]) -> Scatter:
        """Return a scatter with the tolerances of some numbers multiplied by factors.

        Parameters
        ----------
        widths : mapping of str to float
            Factors, > 0, by the paths in `numbers`.
        """
        return replace(self, numbers=tuple(each.narrowed(widths.get(each.of, 1.0)) for each in self.numbers))

    def draw(self, model: Model, n: int, seed: int = 0) -> Designs:
        """Draw designs, of which the first ones stay the same if more are drawn.

        Parameters
        ----------
        model : Model
            Model in the middle of the scatter.
        n : int
            Number of designs.
        seed : int
            Seed of scrambled Sobol' points.

        Raises
        ------
        ClearanceError
            If a path is unknown, correlations are impossible, or a design is impossible.
        """
        return self.rule(model).draw(n, seed)

    def rule(self, model: Model) -> DrawingRule:
        """Return the rule for drawing designs of a model.

        Parameters
        ----------
        model : Model
            Model in the middle of the scatter.

        Raises
        ------
        ClearanceError
            As `draw`.
        """
        return DrawingRule(self.numbers, self.correlations, model)


def softer_and_stiffer(model: Model) -> list[Model]:
    """Return models whose contacts are a standard deviation softer, and stiffer, all of them together.

    Parameters
    ----------
    model : Model
        Model with the contacts of its rig file, which has a tolerance of their stiffness.

    Raises
    ------
    ClearanceError
        If it has none, or the model has another law.
    """
    rig = model.rig
    tolerances = tuple(t for t in rig.tolerances if t.of.endswith("contact.stiffness") and t.size > 0)
    if not tolerances:
        raise ClearanceError(f'rig "{rig.name}": no tolerance of "bushings.contact.stiffness" says how far it goes')
    if not is_datasheet(model):
        raise ClearanceError(f'rig "{rig.name}" is under a law of its own, and not under the contacts of its file')
    rule, probabilities = Scatter.of_rig(rig.replace(tolerances=tolerances)).rule(model), norm.cdf([[-1.0], [1.0]])
    each = [*zip(rule.numbers, rule.values, rule.gaps)]
    return [changed(model, rule.keys, [float(n.quantile(s, v, gap)[0]) for n, v, gap in each]) for s in probabilities]


def draw_designs(model: Model, scatter: Scatter | str | None, n_designs: int, seed: int = 0) -> Designs:
    """Draw designs of a production.

    Parameters
    ----------
    model : Model
        Model in the middle of the scatter.
    scatter : Scatter or str or None
        How the production scatters; "posterior": by the posterior of the model's identification, see `Model.draw`;
        None: by the rig file's tolerances.
    n_designs : int
        Number of designs.
    seed : int
        Seed of the draws.

    Raises
    ------
    ClearanceError
        For an impossible scatter, or none.
    LawError
        If the model has no posterior.
    """
    if scatter == "posterior":
        return Designs(model, (), np.zeros((n_designs, 0)), (), tuple(model.draw(n_designs, seed)))
    if isinstance(scatter, str):
        raise ClearanceError(f'scatter must be a Scatter, "posterior" or None, got "{scatter}"')
    return (scatter or Scatter.of_rig(model.rig)).draw(model, n_designs, seed)
