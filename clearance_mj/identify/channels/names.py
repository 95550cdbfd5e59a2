"""What the name of a channel says of where it is: the number of a node, and words for excitation and quantity."""

from __future__ import annotations

import re

from ...core.quantities import QUANTITIES

__all__ = ["agreement_of_name"]

EXCITATION = ("base", "plate", "table", "shaker", "excit", "drive", "input", "ref", "stinger")
_NUMBER = re.compile(r"(?<![.\d])\d{1,9}(?![.\d])")


def agreement_of_name(name: str, label: str, quantity: str, excites: bool) -> int:
    """Return how many things a channel's name says that are true of a place, less those that are not.

    Parameters
    ----------
    name : str
        The channel's.
    label : str
        Degree of freedom of the place, such as "3:+Z".
    quantity : str
        What is measured there.
    excites : bool
        Whether it is the excitation.
    """
    lower = name.lower()
    found = 0
    if numbers := _NUMBER.findall(lower):
        found += 1 if label.partition(":")[0] in numbers else -1
    said = [known for known, has in QUANTITIES.items() if any(word in lower for word in has.words)]
    if said:
        found += 1 if quantity in said else -1
    if any(word in lower for word in EXCITATION):
        found += 1 if excites else -1
    return found
