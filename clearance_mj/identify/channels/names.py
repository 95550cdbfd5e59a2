"""Hints in the name of a channel at its place: the number of a node, and words for excitation and quantity."""

from __future__ import annotations

import re

from ...core.quantities import QUANTITIES

__all__ = ["agreement_of_name"]

EXCITATION = ("base", "plate", "table", "shaker", "excit", "drive", "input", "ref", "stinger")
_NUMBER = re.compile(r"(?<![.\d])\d{1,9}(?![.\d])")


def agreement_of_name(name: str, label: str, quantity: str, excites: bool) -> int:
    """Return the number of a name's hints that are true of a place, less those that are not.

    Parameters
    ----------
    name : str
        The channel's.
    label : str
        Degree of freedom of the place, such as "3:+Z".
    quantity : str
        Quantity measured there.
    excites : bool
        True if it is the excitation.
    """
    lower = name.lower()
    numbers = _NUMBER.findall(lower)
    named = [known for known, has in QUANTITIES.items() if any(word in lower for word in has.words)]
    excitation = [word for word in EXCITATION if word in lower]
    hints = (numbers, label.partition(":")[0] in numbers), (named, quantity in named), (excitation, excites)
    return sum(1 if true else -1 for hint, true in hints if hint)
