"""One-line errors for arguments of the wrong kind: public calls given another object than their signature names."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from .errors import ClearanceError

__all__ = ["ArgumentError", "checks_kinds"]

TYPE_HINTS_IN_WORDS = {
    "Excitation": "an Excitation, such as cm.excitation.random(...)",
    "Rig": 'a Rig, such as cm.Rig.load("rig.toml")',
    "Modelled": "a Model, such as cm.Model(rig, law)",
    "Law": "a Law, such as cm.ConstantLaw(k, c)",
    "Response": "a Response, such as cm.simulate(...) or record.response() returns",
    "FRF": "an FRF, such as cm.estimate_frf(response) returns",
    "Dataset": 'a Dataset, such as cm.Dataset.load("folder")',
    "Record": "a Record, such as dataset.records[0]",
}
"""Types that signatures name, and how to make one"""
NAMES = {"Model": "Modelled"}  # whatever has a rig and a law does for a model
P = ParamSpec("P")
R = TypeVar("R")


class ArgumentError(ClearanceError, TypeError):
    """An argument is of another kind than the call takes; the message says which it takes."""


def checks_kinds(function: Callable[P, R]) -> Callable[P, R]:
    """Wrap a call so that arguments which are not of its annotations' types raise a one-line error.

    Only parameters are checked whose annotation consists of what `TYPE_HINTS_IN_WORDS` lists. Classes are known by
    their names, so that the check imports none of them.
    """
    signature = inspect.signature(function)
    wanted = {name: kinds for name, p in signature.parameters.items() if (kinds := _type_names(str(p.annotation)))}

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        given = dict(zip(signature.parameters, args)) | kwargs
        for name, kinds in wanted.items():
            if name in given:
                _require_type(name, given[name], kinds)
        return function(*args, **kwargs)

    return checked


def _type_names(annotation: str) -> tuple[str, ...]:
    kinds = tuple(NAMES.get(part.strip(), part.strip()) for part in annotation.split("|"))
    return kinds if {*kinds} <= {*TYPE_HINTS_IN_WORDS, "None"} and {*kinds} != {"None"} else ()


def _require_type(name: str, value: object, kinds: tuple[str, ...]) -> None:
    class_names = {kind.__name__ for kind in type(value).__mro__} | ({"None"} if value is None else set())
    if class_names.isdisjoint(kinds) and not ("Modelled" in kinds and hasattr(value, "rig") and hasattr(value, "law")):
        words = " or ".join(TYPE_HINTS_IN_WORDS[kind] for kind in kinds if kind in TYPE_HINTS_IN_WORDS)
        shown = f" {value!r}" if isinstance(value, str | int | float) else ""
        raise ArgumentError(f"{name} must be {words}; got {type(value).__name__}{shown}")
