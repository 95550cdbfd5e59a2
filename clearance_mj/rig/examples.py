"""Example numbers of a rig file, which nobody gave: until they are replaced, results are examples, too."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Any

from ..core.checks import naming
from ..core.errors import ClearanceError
from ..core.overview import few
from ..core.plain_numbers import find_numbers
from .tolerance import CLAMP_COMPLIANCES, Tolerance

__all__ = ["check_paths", "example_words", "unknown_examples"]

LISTED = 20  # examples at most that are named in a sentence
_OF_LAW = ("contact", "grease")  # an identified law takes the place of these numbers of the rig file


def check_paths(data: dict[str, Any], tolerances: Sequence[Tolerance], examples: Sequence[str]) -> None:
    """Raise a ValueError if a tolerance or an example is of a number that a rig's plain data do not have."""
    paths = {f"tolerances[{i}].of": tolerance.of for i, tolerance in enumerate(tolerances)}
    for name, path in (paths | {f"examples[{i}]": path for i, path in enumerate(examples)}).items():
        if not ("beam" in data and path in CLAMP_COMPLIANCES):
            with naming(name, ClearanceError, ValueError):
                find_numbers(data, path)


def example_words(examples: Sequence[str]) -> str:
    """Return in words which numbers are examples, by their paths, and the remedy."""
    are, names = ("numbers are examples", "their names") if len(examples) > 1 else ("number is an example", "its name")
    return (
        f"{len(examples)} {are} that nobody gave, and so is what rests on them: {few(examples, LISTED)}; put in your "
        f'own and delete {names} from "examples" in the rig file'
    )


def unknown_examples(examples: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Return the examples that records have not determined.

    Parameters
    ----------
    examples : sequence of str
        Their paths.
    known : collection of str
        Names of parameters that records determine: paths such as "bushings[0].gap", or such as "contact stiffness".
    """
    paths = {re.sub(r"\[\d+\]", "", name) for name in known}
    paths |= {path.replace("damping_ratios", "rayleigh") for path in paths}  # in the place of which they were fitted
    laws = tuple(f"bushings.{part}." for part in _OF_LAW if any(f"{part} " in name for name in known))
    return tuple(path for path in examples if path not in paths and not path.startswith(laws))
