"""FRFs from different places, made comparable: quantity, degrees of freedom, frequency lines."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.interpolate

from ..errors import RecordError
from .frf import FRF

__all__ = ["Match", "accelerance", "convert_quantity", "match", "match_references"]

ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Times that the motion is differentiated"""
EACH = "each reference"
"""stands for the reference of FRFs whose rows are labelled "3:+Z/5:+Z", response and reference"""
SAME_LINE = 1e-6
"""relative difference of frequencies that are one line: files hold six digits"""


@dataclass(frozen=True, eq=False)
class Match:
    """Two FRFs on the same responses and lines, and what was done to get there."""

    test: FRF
    """of the test, on the common responses and lines"""
    model: FRF
    """of the model, on the same"""
    notes: tuple[str, ...]
    """what was converted, turned, cut or interpolated, one sentence each"""
    only_test: tuple[str, ...]
    """the test's responses without a partner"""
    only_model: tuple[str, ...]
    """the model's responses without a partner"""

    def within(self, band: tuple[float, float]) -> Match:
        """Cut both to a band.

        Parameters
        ----------
        band : (float, float)
            lo and hi, Hz.
        """
        return dataclasses.replace(self, test=self.test.within(band), model=self.model.within(band))


def convert_quantity(frf: FRF, quantity: str) -> FRF:
    """Differentiate or integrate FRFs over time: receptance, mobility and accelerance are (jω)ⁿ apart.

    Parameters
    ----------
    frf : FRF
        The functions.
    quantity : str
        Such as "acceleration/force"; what it is over must be of the same kind, force or motion.

    Returns
    -------
    FRF
        Without the line at 0 Hz if integrals would divide by it.

    Raises
    ------
    RecordError
        If no power of jω leads from one quantity to the other.

    Notes
    -----
    Ewins, Modal Testing, 2nd ed., 2000, section 2.2.
    """
    if frf.quantity == quantity:
        return frf
    power = _order(quantity) - _order(frf.quantity)
    if _is_over_force(quantity) != _is_over_force(frf.quantity):
        raise RecordError(
            f"{frf.quantity} cannot be made {quantity}: one is over a force, the other over a motion of the base"
        )
    frf = _moving(frf) if power < 0 else frf
    value = frf.value * (2j * np.pi * frf.frequency) ** power
    return dataclasses.replace(frf, value=value, quantity=quantity)


def accelerance(frf: FRF) -> FRF:
    """Convert FRFs to accelerations, over force or over the acceleration of the base.

    Parameters
    ----------
    frf : FRF
        The functions.

    Raises
    ------
    RecordError
        As `convert_quantity`.
    """
    return convert_quantity(frf, "acceleration/force" if _is_over_force(frf.quantity) else "acceleration/acceleration")


def _is_over_force(quantity) -> bool:
    return quantity.partition("/")[2] == "force"


def _order(quantity) -> int:
    above, _, below = quantity.partition("/")
    if above not in ORDERS or below not in (*ORDERS, "force"):
        raise RecordError(f'quantity "{quantity}" cannot be converted; needs a motion over a force or a motion')
    return ORDERS[above] - ORDERS.get(below, 0)


def match(test: FRF, model: FRF) -> Match:
    """Bring FRFs from two places to one quantity, the same responses and the same lines.

    Responses are matched by node and axis; where their signs differ (+Z, -Z) the model's function changes sign, and so
    for the reference. Frequencies are those of the coarser of the two within the band that both cover; the finer is
    interpolated there (real and imaginary part, cubic spline), never beyond its ends.

    Parameters
    ----------
    test, model : FRF
        The functions; both come out in the test's quantity.

    Returns
    -------
    Match

    Raises
    ------
    RecordError
        If references differ in node or axis, no response is common, the bands do not overlap, or a quantity cannot be
        converted.
    """
    notes = []
    if model.quantity != test.quantity:
        notes.append(f"the model's {model.quantity} is converted to the test's {test.quantity}")
        model = convert_quantity(model, test.quantity)
    model = _along(test.reference, model, notes)
    rows, only_test, only_model = _partners(test, model, notes)
    test = _rows(test, [i for i, _, _ in rows], [1] * len(rows), [test.responses[i] for i, _, _ in rows])
    model = _rows(model, [j for _, j, _ in rows], [sign for _, _, sign in rows], test.responses)
    test, model = _on_common_lines(test, model, notes)
    return Match(test, model, tuple(notes), only_test, only_model)


def match_references(test: Mapping[str, FRF], model: Mapping[str, FRF]) -> Match:
    """Bring FRFs to several references from two places to one quantity, the same pairs and the same lines.

    A pair is a response and a reference, both matched by node and axis as in `match`; every pair is one row, labelled
    "3:+Z/5:+Z". Where both have one reference this is `match`.

    Parameters
    ----------
    test, model : mapping of str to FRF
        The functions by reference.

    Returns
    -------
    Match

    Raises
    ------
    RecordError
        As `match`, and if the references of one side differ in quantity or lines.
    """
    if len(test) == len(model) == 1:
        return match(*test.values(), *model.values())
    return match(_pairs_as_rows("test", test), _pairs_as_rows("model", model))


def _pairs_as_rows(who, frfs) -> FRF:
    first, *others = frfs.values()
    for frf in others:
        pair = f"the {who}'s FRFs to {first.reference} and to {frf.reference}"
        if frf.quantity != first.quantity:
            raise RecordError(f"{pair} are {first.quantity} and {frf.quantity}; needs one quantity")
        if not np.array_equal(frf.frequency, first.frequency):
            raise RecordError(f"{pair} are not on the same lines")
    coherences = [np.full(f.value.shape, np.nan) if f.coherence is None else f.coherence for f in frfs.values()]
    return FRF(
        first.frequency,
        np.concatenate([frf.value for frf in frfs.values()]),
        np.concatenate(coherences) if any(f.coherence is not None for f in frfs.values()) else None,
        tuple(f"{response}/{frf.reference}" for frf in frfs.values() for response in frf.responses),
        EACH,
        first.quantity,
    )


def _along(reference, model, notes) -> FRF:
    """The model's FRFs to the test's reference."""
    if reference == model.reference:
        return model
    sign = _same_axis(reference, model.reference)
    if not sign:
        raise RecordError(f"the test's reference is {reference}, the model's {model.reference}; needs one reference")
    if sign < 0:
        notes.append(f"the model's reference {model.reference} is turned to {reference}")
    return dataclasses.replace(model, value=sign * model.value, reference=reference)


def _same_axis(a, b) -> int:
    """1 for one degree of freedom, or pair of them, -1 if the signs of the direction differ, 0 for different ones."""
    return math.prod(map(_same_axis_of_one, a.split("/"), b.split("/")))


def _same_axis_of_one(a, b) -> int:
    (node, direction), (other_node, other) = a.split(":"), b.split(":")
    if int(node) != int(other_node) or direction.lstrip("+-") != other.lstrip("+-"):
        return 0
    return 1 if direction == other else -1


def _partners(test, model, notes):
    """Rows (of test, of model, sign), and the responses that are left."""
    rows = []
    for i, label in enumerate(test.responses):
        for j, other in enumerate(model.responses):
            if sign := _same_axis(label, other):
                rows.append((i, j, sign))
                break
    if not rows:
        raise RecordError(
            f"no response is common; the test has {', '.join(test.responses)}, the model {', '.join(model.responses)}"
        )
    turned = [f"{model.responses[j]} to {test.responses[i]}" for i, j, sign in rows if sign < 0]
    if turned:
        notes.append(f"the model's responses are turned: {', '.join(turned)}")
    of_test, of_model = {i for i, _, _ in rows}, {j for _, j, _ in rows}
    only_test = tuple(label for i, label in enumerate(test.responses) if i not in of_test)
    only_model = tuple(label for j, label in enumerate(model.responses) if j not in of_model)
    return rows, only_test, only_model


def _rows(frf, rows, signs, labels) -> FRF:
    coherence = None if frf.coherence is None else frf.coherence[rows]
    value = np.array(signs)[:, None] * frf.value[rows]
    return dataclasses.replace(frf, value=value, coherence=coherence, responses=tuple(labels))


def _on_common_lines(test, model, notes):
    """Both on the coarser one's lines in the common band."""
    test, model = _moving(test), _moving(model)
    low = max(test.frequency[0], model.frequency[0])
    high = min(test.frequency[-1], model.frequency[-1])
    slack = SAME_LINE * high
    if low > high + slack:
        raise RecordError(
            f"the bands do not overlap: the test has {_band(test)}, the model {_band(model)}; nothing is extrapolated"
        )
    common = low - slack, high + slack
    cut = test.within(common), model.within(common)
    if cut[0].frequency.size < test.frequency.size or cut[1].frequency.size < model.frequency.size:
        notes.append(
            f"the band is the common one, {low:g} to {high:g} Hz: the test has {_band(test)}, the model {_band(model)}"
        )
    lines = cut[0].frequency, cut[1].frequency
    if lines[0].shape == lines[1].shape and np.allclose(*lines, rtol=SAME_LINE, atol=0):
        return cut[0], dataclasses.replace(cut[1], frequency=lines[0])
    of_test, of_model = f"the test's lines ({_spacing(cut[0])})", f"the model's lines ({_spacing(cut[1])})"
    if lines[0].size <= lines[1].size:
        notes.append(f"{of_model} are interpolated onto {of_test}")
        return cut[0], _interpolated(model, lines[0])
    notes.append(f"{of_test} are interpolated onto {of_model}")
    return _interpolated(test, lines[1]), cut[1]


def _moving(frf) -> FRF:
    """Without the line at 0 Hz, where accelerations are zero and receptances static: no decibels are told there."""
    if frf.frequency[0] > 0 or frf.frequency.size == 1:
        return frf
    return frf.within((frf.frequency[1], frf.frequency[-1]))


def _interpolated(frf, frequency) -> FRF:
    if not np.isfinite(frf.value).all():
        line = int(np.argmin(np.isfinite(frf.value).all(axis=0)))
        raise RecordError(f"an FRF that is to be interpolated is not finite at {frf.frequency[line]:g} Hz")
    if frf.frequency.size < 4:
        raise RecordError(f"interpolation needs at least 4 lines, there are {frf.frequency.size}")
    at = np.clip(frequency, *frf.frequency[[0, -1]])  # within six digits
    value = scipy.interpolate.CubicSpline(frf.frequency, frf.value, axis=1)(at)
    coherence = frf.coherence
    if coherence is not None:
        coherence = np.array([np.interp(at, frf.frequency, row) for row in coherence])
    return dataclasses.replace(frf, frequency=frequency, value=value, coherence=coherence)


def _band(frf) -> str:
    return f"{frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz"


def _spacing(frf) -> str:
    apart = f", {np.median(np.diff(frf.frequency)):g} Hz apart" if frf.frequency.size > 1 else ""
    return f"{frf.frequency.size}{apart}"
