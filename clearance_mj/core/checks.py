"""Checks common to readers and writers of several formats: time steps, degrees of freedom, finite numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from .errors import RecordError

AXES = ("X", "Y", "Z", "RX", "RY", "RZ")
"""Directions of degrees of freedom: translations, then rotations; numbers 1 to 6 in universal files"""
DIRECTIONS = {f"{s}{a}": int(f"{s}{i}") for s in "+-" for i, a in enumerate(AXES, 1)} | {"S": 0}
"""Directions and their codes in universal files; R for rotations, S for a scalar"""
UNKNOWN = "unknown"
"""Quantity that a file does not say, or that is none of `quantities.QUANTITIES`"""
NOWHERE = "0:S"
"""Degree of freedom of what a file does not place: no node, no direction"""
NAME_LIMIT = 72
"""Characters. A longer name could end the 80-character line of a universal file in "    -1", its delimiter."""
JITTER = 0.45
"""Largest deviation of an instant from an even grid, as a fraction of the step"""
MIN_INSTANTS = 16
"""Fewest instants from which jitter can be distinguished from uneven steps"""
_DOF = re.compile(r"([0-9]{1,9}):(\S+)")


@contextmanager
def naming(
    place: object, kind: type[Exception] | tuple[type[Exception], ...] = RecordError,
    raised: type[Exception] | None = None, form: str = "{}: {}",
) -> Iterator[None]:  # fmt: skip
    """Prefix an error's message with the file, or the place in it, and raise it as the same or another kind.

    ``form`` says how the two are put together.
    """
    try:
        yield
    except kind as error:
        raise (raised or type(error))(form.format(place, error)) from None


def check_dof(label: str) -> None:
    """Raise an error for a degree of freedom that is no node and direction."""
    match = _DOF.fullmatch(label)
    if not match or match[2] not in DIRECTIONS:
        raise RecordError(f'degree of freedom "{label}" must be a node and a direction, such as "3:+Z"')


def require_finite(values: np.ndarray, what: str) -> None:
    """Raise an error for numbers that are not finite."""
    finite = np.isfinite(values).reshape(len(values), -1).all(axis=1)
    if not finite.all():
        raise RecordError(f"{what}: sample {int(np.argmin(finite))} is not a finite number")


def even_rate(time: np.ndarray, digits: float, notes: list[str] | None = None) -> tuple[float, float]:
    """Return the sampling rate in Hz and time of the first sample in s, of instants in even steps.

    With ``notes``, instants that jitter about even steps are taken for these, which a note says, see `jittering_rate`.
    """
    if time.size < 2:
        raise RecordError("needs two samples to tell its time step")
    step = (time[-1] - time[0]) / (time.size - 1)
    slack = 2 * digits * np.abs(time).max()
    uneven = np.abs(time - (time[0] + step * np.arange(time.size))) > 1e-3 * step + slack
    if not step > slack or uneven.any():
        if notes is not None and (rate := jittering_rate(time, notes)):
            return rate
        raise RecordError(
            f"its times are uneven at sample {int(np.argmax(uneven))} or have too few digits; needs one time step "
            "throughout"
        )
    return simplest_rate(float(step), slack / (time.size - 1)), float(time[0])


def jittering_rate(time: np.ndarray, notes: list[str]) -> tuple[float, float] | None:
    """Return rate in Hz and start in s of even steps about which instants jitter, which a note says; None of others.

    No instant is further than `JITTER` of a step from the straight line of least squares: where a sample is missing,
    two are half a step from it.
    """
    number = np.arange(time.size) - (time.size - 1) / 2
    center, spread = time.mean(), number @ number
    step = float(number @ (time - center) / spread)
    departure = time - center - step * number
    if time.size < MIN_INSTANTS or not np.abs(departure).max() < JITTER * step:
        return None
    rate = simplest_rate(step, 3 * float(departure.std()) / math.sqrt(spread), 1e-2)
    notes.append(f"times jitter by up to {np.abs(departure).max():.2g} s about even steps; taken for {rate:.9g} Hz")
    return rate, float(center + number[0] / rate)


def simplest_rate(step: float, slack: float, most: float = 1e-5) -> float:
    """Return the rate with the fewest decimals whose time step is ``step`` within ``slack``, at most ``most`` of it.

    Six digits is all that a universal file holds of a time step: 1/2048 s is written as 4.88281e-04.
    """
    slack = 1.001 * min(slack, most * step)
    for decimals in range(12):
        rate = round(1 / step, decimals)
        if rate > 0 and abs(1 / rate - step) <= slack:
            return rate
    return 1 / step
