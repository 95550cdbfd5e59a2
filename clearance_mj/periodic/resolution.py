"""Numbers of harmonics and samples of a periodic motion, and checks of ranges."""

from __future__ import annotations

import numbers
from collections.abc import Iterable

import numpy as np

from ..core.errors import ClearanceError, ExcitationError
from ..linear import MAX_MODES

__all__ = ["different_ends", "ends_of_range", "pair_of", "require_whole", "resolution"]

MAX_HARMONICS, MAX_SAMPLES = 500, 16384
SAMPLES = 12  # of a period for each harmonic: contacts are not smooth
FINER = 4  # times as many samples where a branch ends early with fewer
LARGEST = 1e6  # Hz or rad/s; no structure of this size vibrates beyond, and no shaft turns faster


def pair_of(ends: Iterable[float], name: str, unit: str) -> tuple[float, float]:
    """Return both ends of a range as numbers, or raise ExcitationError; ``unit`` such as " in Hz"."""
    try:
        start, stop = map(float, ends)
    except (TypeError, ValueError):
        raise ExcitationError(f"{name} is a pair (from, to){unit}, got {ends!r}") from None
    return start, stop


def different_ends(ends: tuple[float, float], name: str, quantities: str, unit: str) -> tuple[float, float]:
    """Return both ends of a range of frequencies or speeds in their unit, or raise ExcitationError."""
    start, stop = pair_of(ends, name, f" in {unit}")
    if not (0 < start <= LARGEST and 0 < stop <= LARGEST and start != stop):
        raise ExcitationError(
            f"{name} must be two different {quantities} > 0 {unit} and at most {LARGEST:g} {unit}, got {start:g} and "
            f"{stop:g}"
        )
    return start, stop


def ends_of_range(frequency_range: tuple[float, float]) -> tuple[float, float]:
    """Return both ends of a range of frequencies, Hz, or raise ExcitationError."""
    return different_ends(frequency_range, "frequency_range", "frequencies", "Hz")


def require_whole(**numbers_by_name: object) -> None:
    """Raise ClearanceError for a value that is no whole number, by its name."""
    for name, value in numbers_by_name.items():
        if not isinstance(value, numbers.Integral) or isinstance(value, bool):
            raise ClearanceError(f"{name} must be a whole number, got {value!r}")


def resolution(harmonics: int, samples: int | None, excited: int, modes: int) -> tuple[int, tuple[int, ...]]:
    """Check and return the number of harmonics and the numbers of samples to try in turn."""
    require_whole(n_harmonics=harmonics, n_samples=1 if samples is None else samples, n_modes=modes)
    if harmonics < max(excited, 1):
        raise ClearanceError(f"n_harmonics must be {max(excited, 1)} or more, as the excitation's are, got {harmonics}")
    if harmonics > MAX_HARMONICS or (samples or 0) > MAX_SAMPLES:
        raise ClearanceError(
            f"at most {MAX_HARMONICS} harmonics and {MAX_SAMPLES} samples are computed, got {harmonics} and {samples}"
        )
    if not 1 <= modes <= MAX_MODES:
        raise ClearanceError(f"n_modes must be between 1 and {MAX_MODES}, got {modes}")
    if samples is None:
        least = 2 ** int(np.ceil(np.log2(SAMPLES * harmonics)))
        return int(harmonics), (least, FINER * least)
    if samples < 4 * harmonics + 1:
        raise ClearanceError(
            f"n_samples must be {4 * harmonics + 1} or more for {harmonics} harmonics (4 H + 1), got {samples}"
        )
    return int(harmonics), (int(samples),)
