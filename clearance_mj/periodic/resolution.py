"""How many harmonics and samples a periodic motion is computed with."""

from __future__ import annotations

import numbers

import numpy as np

from ..beam import MAX_MODES
from ..core.errors import ClearanceError

__all__ = ["resolution"]

MAX_HARMONICS, MAX_SAMPLES = 500, 16384
SAMPLES = 12  # of a period for each harmonic: contacts are not smooth
FINER = 4  # times as many samples where a branch ends early with fewer


def resolution(harmonics: int, samples: int | None, excited: int, modes: int) -> tuple[int, tuple[int, ...]]:
    """Return numbers of harmonics and, each for where those before do not do, of samples; after a check."""
    for name, value in (("n_harmonics", harmonics), ("n_samples", samples), ("n_modes", modes)):
        whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
        if not (whole or (value is None and name == "n_samples")):
            raise ClearanceError(f"{name} must be a whole number, got {value!r}")
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
