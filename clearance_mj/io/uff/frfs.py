"""FRFs and their coherences: data sets 58 of function types 4, 5 (transmissibility) and 6."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...core.checks import NOWHERE, UNKNOWN, check_dof, naming, require_finite
from ...core.errors import RecordError
from ...core.quantities import QUANTITIES
from ...signals.frf import FRF
from ...signals.quantities import two_quantities
from ...signals.references import join_references
from ...universal.dataset_58 import COHERENCE, FREQUENCY, FREQUENCY_RESPONSE, Function, samples, spectrum_block
from ...universal.dataset_164 import FunctionQuantity, frf_measure
from .functions import abscissa

__all__ = ["frf_blocks", "read_frfs"]

Pair = tuple[str, str]  # response and reference
_WINDOW = re.compile(r"exponential window (\S+) 1/s")
"""The second line of the description of FRFs under an exponential window, as this package writes it"""


@dataclass
class _FrfGroup:
    """Functions that fit into one FRF: of one quantity, on the same lines, each pair once."""

    kind: int
    measure: FunctionQuantity
    frequency: np.ndarray
    functions: dict[Pair, Function] = field(default_factory=dict)
    coherences: dict[Pair, Function] = field(default_factory=dict)

    def fits(self, kind: int, measure: FunctionQuantity, frequency: np.ndarray, pair: Pair) -> bool:
        """Return True if a function belongs to this group."""
        same = (kind, measure.quantity, measure.unit) == (self.kind, self.measure.quantity, self.measure.unit)
        return same and pair not in self.functions and np.array_equal(frequency, self.frequency)

    def place_of(self, coherence: Function, frequency: np.ndarray, only: bool) -> Pair | None:
        """Return the pair whose coherence this is; ``only``: there is one reference, which it need not name."""
        references = {reference for _, reference in self.functions}
        reference_label = next(iter(references)) if only and len(references) == 1 else coherence.reference
        pair = coherence.response, reference_label
        is_open = pair in self.functions and pair not in self.coherences
        return pair if is_open and np.array_equal(frequency, self.frequency) else None


def read_frfs(
    data: bytes, functions: Sequence[Function], reference: str | None, notes: list[str]
) -> tuple[list[FRF], list[Function]]:
    """Return the FRFs of a file, as few as hold them all, and the coherences that belong to none of them."""
    groups: list[_FrfGroup] = []
    references = list(dict.fromkeys(f.reference for f in functions if f.is_frf))
    if reference is not None and references and reference not in references:
        raise RecordError(f"holds FRFs to {', '.join(references)}; not {reference}")
    for f in functions:
        if not f.is_frf or reference not in (None, f.reference):
            continue
        with naming(f"data set {f.number}"):
            measure, pair = frf_measure(f, notes), (f.response, f.reference)
        frequency = abscissa(data, f)
        group = next((g for g in groups if g.fits(f.kind, measure, frequency, pair)), None)
        if group is None:
            groups.append(group := _FrfGroup(f.kind, measure, frequency))
        group.functions[pair] = f
    lone = [f for f in functions if f.kind == COHERENCE and not _attach(data, f, groups, len(references) == 1)]
    return [_frf(data, group) for group in groups], lone


def _attach(data: bytes, coherence: Function, groups: list[_FrfGroup], only: bool) -> bool:
    """Attach a coherence to its FRF and return True, or return False if no group has it."""
    frequency = abscissa(data, coherence)
    for group in groups:
        if pair := group.place_of(coherence, frequency, only):
            group.coherences[pair] = coherence
            return True
    return False


def _frf(data: bytes, group: _FrfGroup) -> FRF:
    references = dict.fromkeys(reference for _, reference in group.functions)
    with naming(f"data set {next(iter(group.functions.values())).number}"):
        return join_references([_to_reference(data, group, reference) for reference in references])


def _to_reference(data: bytes, group: _FrfGroup, reference: str) -> FRF:
    pairs = [pair for pair in group.functions if pair[1] == reference]
    value = np.empty((len(pairs), group.frequency.size), dtype=complex)
    coherence = np.full(value.shape, np.nan)
    for row, pair in enumerate(pairs):
        function = group.functions[pair]
        value[row] = samples(data, function, frf_measure(function, []).scale)
        if pair in group.coherences:
            coherence[row] = samples(data, group.coherences[pair]).real
    responses = tuple(response for response, _ in pairs)
    rising = slice(None, None, -1 if group.frequency[-1] < group.frequency[0] else 1)  # sweeps go down, too
    known = None if np.isnan(coherence).all() else coherence[:, rising]
    labels = responses, (reference,), group.measure.quantity, group.measure.unit
    match = _WINDOW.fullmatch(group.functions[pairs[0]].note)
    return FRF(group.frequency[rising], value[:, rising], known, *labels, window_rate=float(match[1]) if match else 0.0)


def frf_blocks(frf: FRF) -> list[bytes]:
    """Return the data sets of FRFs, one for each response and reference."""
    return [block for reference in frf.references for block in _frf_blocks(frf.to_reference(reference))]


def _frf_blocks(frf: FRF) -> Iterator[bytes]:
    """Yield the data sets of FRFs to one reference, then of their coherences."""
    for label in (frf.reference, *frf.responses):
        check_dof(label)
    note = f"exponential window {frf.window_rate:.9g} 1/s" if frf.window_rate else "NONE"
    kind: dict[str, Any] = {"kind": FREQUENCY_RESPONSE, "note": note}
    ratios = [kind | _ratio_fields(quantity, frf.unit_label) for quantity in frf.row_quantities]
    coherences: list[dict[str, Any]] = [{"kind": COHERENCE}] * len(ratios)
    for name, headers, rows in (("FRF", ratios, frf.value), ("coherence", coherences, frf.coherence)):
        for header, label, row in zip(headers, frf.responses, () if rows is None else rows[:, 0]):
            if name == "coherence" and np.isnan(row).all():
                continue  # of a function whose coherence is not known
            require_finite(row, f"{name} {label}")
            suffix = "" if frf.reference == NOWHERE else f" / {frf.reference}"
            place = {"name": f"{name} {label}{suffix}", "response": label, "reference": frf.reference}
            yield spectrum_block(frf.frequency, row, abscissa_type=FREQUENCY, **place, **header)


def _ratio_fields(quantity: str, label: str) -> dict[str, Any]:
    """Return types and unit of a ratio of two quantities."""
    quantities = [QUANTITIES.get(name) for name in two_quantities(quantity, UNKNOWN)]
    units = [entry.ascii_unit for entry in quantities if entry]
    unit = "/".join(f"({unit})" if "/" in unit else unit for unit in units) if all(quantities) else label or "NONE"
    above, below = (entry.codes[0] if entry else 0 for entry in quantities)
    return {"numerator": above, "denominator": below, "unit": unit}
