"""FRFs to several references, joined from those to one each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.errors import RecordError
from .frf import FRF

__all__ = ["join_references"]


def join_references(frfs: Sequence[FRF]) -> FRF:
    """Return one FRF of several, to different references or of different responses; missing pairs are nan.

    Parameters
    ----------
    frfs : sequence of FRF
        FRFs on the same lines and of one quantity; others raise RecordError, and so does a pair that comes twice.
    """
    first, *others = frfs
    if not others:
        return first
    for frf in others:
        pair = f"the FRFs to {', '.join(first.references)} and to {', '.join(frf.references)}"
        if (frf.quantity, frf.unit_label) != (first.quantity, first.unit_label) or first.quantities:
            one, other = (f"{f.quantity} {f.unit_label}".rstrip() for f in (first, frf))
            raise RecordError(f"{pair} are {one} and {other}; needs one quantity")
        if not np.array_equal(frf.frequency, first.frequency):
            raise RecordError(f"{pair} are not on the same lines")
        if frf.window_rate != first.window_rate:
            raise RecordError(f"{pair} are under different exponential windows")
    responses = tuple(dict.fromkeys(label for frf in frfs for label in frf.responses))
    references = tuple(dict.fromkeys(label for frf in frfs for label in frf.references))
    value = np.full((len(responses), len(references), first.frequency.size), complex(np.nan, np.nan))
    coherence = np.full(value.shape, np.nan)
    taken = np.zeros(value.shape[:2], dtype=bool)
    for frf in frfs:
        for i, j in np.argwhere(frf.measured):
            entry = responses.index(frf.responses[i]), references.index(frf.references[j])
            if taken[entry]:
                raise RecordError(f"the FRF of {frf.responses[i]} to {frf.references[j]} comes twice")
            value[entry], taken[entry] = frf.value[i, j], True
            if frf.coherence is not None:
                coherence[entry] = frf.coherence[i, j]
    has_coherence = any(frf.coherence is not None for frf in frfs)
    averages = first.averages if len({frf.averages for frf in frfs}) == 1 else None
    labels = responses, references, first.quantity, first.unit_label, averages, first.window_rate
    return FRF(first.frequency, value, coherence if has_coherence else None, *labels)
