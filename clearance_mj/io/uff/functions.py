"""Time functions (data sets 58 of function type 1), FRFs and their coherences (types 4 and 6)."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal

import numpy as np

from ...core.checks import QUANTITIES, check_dof, even_rate, naming, require_finite, simplest_rate
from ...core.errors import RecordError
from ...signals.frf import FRF, join_references
from ...universal.dataset_58 import (  # fmt: skip
    COHERENCE,
    COMPLEX64,
    FREQUENCY,
    FREQUENCY_RESPONSE,
    REAL32,
    REAL64,
    TIME,
    TIME_FUNCTION,
    UNIT_LABELS,
    UNKNOWN,
    Function,
    Header,
    function_block,
    numbers,
    samples,
)
from ...universal.dataset_164 import frf_scale, time_scale
from ...universal.fields import quantity_of
from ..channels import Channel, ChannelHeader


def read_channel_header(data: bytes, function: Function) -> ChannelHeader:
    """Return what the header of a time function says of its channel."""
    with naming(f"data set {function.number}"):
        quantity = quantity_of(function.numerator, "ordinate")
        if function.is_complex:
            raise RecordError("a time function must be real, its ordinate data type is complex")
        if function.abscissa_type not in (TIME, *UNKNOWN):
            raise RecordError(f"abscissa type {function.abscissa_type} of a time function must be 17 (time)")
        time_scale(function, quantity)
        fs, start = _timing(data, function)
    node, direction = function.response.split(":")
    name = function.response if function.name in ("", "NONE") else function.name
    return ChannelHeader(name, int(node), direction, quantity, function.size, fs, start)


def read_channel(data: bytes, function: Function) -> Channel:
    """Return the channel that a time function holds, in SI units."""
    header = read_channel_header(data, function)
    value = samples(data, function, time_scale(function, header.quantity))
    return Channel(header.name, header.node, header.direction, header.quantity, value, header.fs, header.start)


def _timing(data: bytes, function: Function) -> tuple[float, float]:
    """Sampling rate in Hz and time of the first sample in s."""
    if function.even:
        return simplest_rate(float(function.step), _half_digit(function.step)), function.first
    # Precision of the stored times: E13.5, single, double.
    digits = 5e-6 if not function.dtype else 6e-8 if not function.is_double else 1e-15
    return even_rate(numbers(data, function)[:, 0], digits)


def channel_block(channel: Channel) -> bytes:
    """Return a channel in single precision; its time step has at most 8 digits."""
    if np.abs(channel.value).max() > np.finfo(np.float32).max:
        raise RecordError(f'channel "{channel.name}" exceeds single precision (3.4e38)')
    header = Header(
        name=channel.name,
        kind=TIME_FUNCTION,
        response=channel.label,
        reference="0:S",
        ordinate=REAL32,
        size=channel.size,
        even=True,
        first=channel.start,
        step=_step_text(channel.fs),
        abscissa_type=TIME,
        numerator=QUANTITIES[channel.quantity],
        denominator=0,
        unit=UNIT_LABELS[channel.quantity],
    )
    return function_block(header, channel.value.astype("<f4"))


def _step_text(fs: float) -> str:
    """Write 1/fs in the usual six digits if reading gives fs again, or else in up to eight, which fill the field."""
    texts = [f"{1 / fs:.{digits}e}" for digits in (5, 6, 7)]
    return next((text for text in texts if simplest_rate(float(text), _half_digit(text)) == fs), texts[-1])


def _half_digit(text: str) -> float:
    return 0.5 * 10.0 ** int(Decimal(text).as_tuple().exponent)


def read_frfs(data: bytes, functions: list[Function], reference: str | None = None) -> FRF:
    """Put the FRFs of a file, and their coherences, together; those to one reference if it is named."""
    groups: dict[str, list[Function]] = {}
    for f in functions:
        if f.kind == FREQUENCY_RESPONSE:
            groups.setdefault(f.reference, []).append(f)
    for f in functions:
        if f.kind == COHERENCE:
            # Beside FRFs of one reference coherences need not tell theirs.
            its = f.reference if len(groups) > 1 else next(iter(groups))
            if its not in groups:
                raise RecordError(f"data set {f.number}: coherence to {its}, the FRFs are to {', '.join(groups)}")
            groups[its].append(f)
    if reference is not None:
        if reference not in groups:
            raise RecordError(f"holds FRFs to {', '.join(groups)}; not {reference}")
        return _read_frf(data, groups[reference])
    try:
        return join_references([_read_frf(data, group) for group in groups.values()])
    except RecordError as error:
        if len(groups) == 1:
            raise
        raise RecordError(f"{error}; name a reference to read the FRFs to that one") from None


def _read_frf(data: bytes, functions: list[Function]) -> FRF:
    """FRFs to one reference."""
    parts: dict[int, dict[str, Function]] = {FREQUENCY_RESPONSE: {}, COHERENCE: {}}
    for f in functions:
        if f.response in parts[f.kind]:
            raise RecordError(f"data set {f.number}: response {f.response} comes twice")
        parts[f.kind][f.response] = f
    frfs, coherences = parts.values()
    first = next(iter(frfs.values()))
    quantity = _frf_quantity(first)
    frequency = _frequency(data, first)
    for f in functions:
        if f.kind == FREQUENCY_RESPONSE and _frf_quantity(f) != quantity:
            raise RecordError(f"data set {f.number}: is {_frf_quantity(f)}, data set {first.number} is {quantity}")
        if not np.array_equal(_frequency(data, f), frequency):
            raise RecordError(f"data set {f.number}: its frequencies differ from data set {first.number}'s")
    above, _, below = quantity.partition("/")
    value = np.array([samples(data, f, frf_scale(f, above, below)) for f in frfs.values()])
    coherence = None
    if coherences:
        missing = [label for label in frfs if label not in coherences]
        if missing or len(coherences) != len(frfs):
            raise RecordError(f"coherences and FRFs are not of the same responses: {missing or list(coherences)}")
        coherence = np.array([samples(data, coherences[label]) for label in frfs])
    return FRF(frequency, value, coherence, tuple(frfs), (first.reference,), quantity)


def _frf_quantity(function: Function) -> str:
    """Check that a function is an FRF of known quantities and name them "numerator/denominator"."""
    with naming(f"data set {function.number}"):
        if not function.is_complex:
            raise RecordError("an FRF must be complex, its ordinate data type is real")
        if function.abscissa_type not in (FREQUENCY, *UNKNOWN):
            raise RecordError(f"abscissa type {function.abscissa_type} of an FRF must be 18 (frequency)")
        above, below = quantity_of(function.numerator, "ordinate"), quantity_of(function.denominator, "denominator")
        frf_scale(function, above, below)
    return f"{above}/{below}"


def _frequency(data: bytes, function: Function) -> np.ndarray:
    if function.even:
        return function.first + np.arange(function.size) * float(function.step)
    return numbers(data, function)[:, 0]


def frf_blocks(frf: FRF) -> list[bytes]:
    """Return the data sets of FRFs, one for each response and reference."""
    return [block for reference in frf.references for block in _frf_blocks(frf.to_reference(reference))]


def _frf_blocks(frf: FRF) -> list[bytes]:
    """FRFs to one reference, then their coherences."""
    names = frf.quantity.split("/")
    if len(names) != 2 or not set(names) <= set(QUANTITIES):
        raise RecordError(f'quantity "{frf.quantity}" is unknown; needs two of {", ".join(QUANTITIES)} as a/b')
    for label in (frf.reference, *frf.responses):
        check_dof(label)
    # Six digits for the first frequency and the step, or every frequency in full.
    first, step = f"{frf.frequency[0]:.5e}", f"{np.ptp(frf.frequency[:2]):.5e}"
    lines = float(first) + np.arange(frf.frequency.size) * float(step)
    even = float(step) > 0 and np.array_equal(lines, frf.frequency)
    plain = Header(
        name="",
        kind=COHERENCE,
        response="",
        reference=frf.reference,
        ordinate=REAL64,
        size=frf.frequency.size,
        even=even,
        first=float(first) if even else 0.0,
        step=step if even else "0.0",
        abscissa_type=FREQUENCY,
        numerator=0,
        denominator=0,
    )
    labels = [f"({UNIT_LABELS[n]})" if "/" in UNIT_LABELS[n] else UNIT_LABELS[n] for n in names]
    ratio = replace(
        plain,
        kind=FREQUENCY_RESPONSE,
        ordinate=COMPLEX64,
        numerator=QUANTITIES[names[0]],
        denominator=QUANTITIES[names[1]],
        unit="/".join(labels),
    )
    axis = () if even else (frf.frequency,)
    blocks = []
    for what, header, rows in (("FRF", ratio, frf.value), ("coherence", plain, frf.coherence)):
        for label, row in zip(frf.responses, () if rows is None else rows[:, 0]):
            require_finite(row, f"{what} {label}")
            parts = (row.real, row.imag) if np.iscomplexobj(row) else (row,)
            header = replace(header, name=f"{what} {label} / {frf.reference}", response=label)
            blocks.append(function_block(header, np.stack((*axis, *parts), axis=1).astype("<f8")))
    return blocks
