"""Checks that readers and writers of several formats share: time steps, degrees of freedom, finite numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from .errors import RecordError

AXES = ("X", "Y", "Z", "RX", "RY", "RZ")
"""Directions of degrees of freedom: translations, then rotations; numbers 1 to 6 in universal files"""
DIRECTIONS = {f"{s}{a}": int(f"{s}{i}") for s in "+-" for i, a in enumerate(AXES, 1)} | {"S": 0}
"""Directions and their codes in universal files; R for rotations, S for a scalar"""
QUANTITIES = {"displacement": 8, "velocity": 11, "acceleration": 12, "force": 13}
"""Quantities and their codes in universal files (specific data types)"""
UNKNOWN = "unknown"
"""Quantity that a file does not say, or that is none of `QUANTITIES`"""
NOWHERE = "0:S"
"""Degree of freedom of what a file does not place: no node, no direction"""
NAME_LIMIT = 72
"""Characters. A longer name could end the 80-character line of a universal file in "    -1", its delimiter."""
_DOF = re.compile(r"([0-9]{1,9}):(\S+)")


@contextmanager
def naming(place: object) -> Iterator[None]:
    """Put the file, or the place in it, before what is wrong."""
    try:
        yield
    except RecordError as error:
        raise RecordError(f"{place}: {error}") from None


def check_dof(label: str) -> None:
    """Refuse a degree of freedom that is no node and direction."""
    match = _DOF.fullmatch(label)
    if not match or match[2] not in DIRECTIONS:
        raise RecordError(f'degree of freedom "{label}" must be a node and a direction, such as "3:+Z"')


def require_finite(values: np.ndarray, what: str) -> None:
    """Refuse numbers that are not finite."""
    finite = np.isfinite(values).reshape(len(values), -1).all(axis=1)
    if not finite.all():
        raise RecordError(f"{what}: sample {int(np.argmin(finite))} is not a finite number")


def even_rate(time: np.ndarray, digits: float) -> tuple[float, float]:
    """Return the sampling rate in Hz and time of the first sample in s, of instants in even steps."""
    if time.size < 2:
        raise RecordError("needs two samples to tell its time step")
    step = (time[-1] - time[0]) / (time.size - 1)
    slack = 2 * digits * np.abs(time).max()
    off = np.abs(time - (time[0] + step * np.arange(time.size))) > 1e-3 * step + slack
    if not step > slack or off.any():
        raise RecordError(
            f"its times are uneven at sample {int(np.argmax(off))} or have too few digits; needs one time step "
            "throughout"
        )
    return simplest_rate(float(step), slack / (time.size - 1)), float(time[0])


def simplest_rate(step: float, slack: float) -> float:
    """Return the rate with the fewest decimals whose time step is ``step`` within ``slack``.

    Six digits is all that a universal file holds of a time step: 1/2048 s is written as 4.88281e-04.
    """
    slack = 1.001 * min(slack, 1e-5 * step)
    for decimals in range(12):
        rate = round(1 / step, decimals)
        if rate > 0 and abs(1 / rate - step) <= slack:
            return rate
    return 1 / step
