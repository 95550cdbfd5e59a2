"""FRFs from different places, made comparable: quantity, degrees of freedom, frequency lines."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import scipy.interpolate

from .errors import RecordError
from .frf import FRF

__all__ = ["Match", "convert_quantity", "match"]

ORDERS = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Times that the motion is differentiated"""
SAME_LINE = 1e-6
"""relative difference of frequencies that are one line: files hold six digits"""


@dataclass(frozen=True, eq=False)
class Match:
    """Two FRFs on the same responses and lines, and what was done to get there."""

    test: FRF
    model: FRF
    notes: tuple[str, ...]
    """what was converted, turned, interpolated or left out, one sentence each"""
    only_test: tuple[str, ...]
    """responses without a partner"""
    only_model: tuple[str, ...]


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
    if power < 0 and frf.frequency[0] == 0:
        if frf.frequency.size == 1:
            raise RecordError(f"{frf.quantity} at 0 Hz alone cannot be made {quantity}")
        frf = frf.within((frf.frequency[1], frf.frequency[-1]))
    value = frf.value * (2j * np.pi * frf.frequency) ** power
    return dataclasses.replace(frf, value=value, quantity=quantity)


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


def _along(reference, model, notes) -> FRF:
    """The model's FRFs to the test's reference."""
    sign = _same_axis(reference, model.reference)
    if not sign:
        raise RecordError(f"the test's reference is {reference}, the model's {model.reference}; needs one reference")
    if sign < 0:
        notes.append(f"the model's reference {model.reference} is turned to {reference}")
    return dataclasses.replace(model, value=sign * model.value, reference=reference)


def _same_axis(a, b) -> int:
    """1 for one degree of freedom, -1 if the signs of the direction differ, 0 for different ones."""
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
            f"no response is common; the test's are {', '.join(test.responses)}, the model's {', '.join(model.responses)}"
        )
    turned = [f"{model.responses[j]} to {test.responses[i]}" for i, j, sign in rows if sign < 0]
    if turned:
        notes.append(f"the model's responses are turned: {', '.join(turned)}")
    of_test, of_model = {i for i, _, _ in rows}, {j for _, j, _ in rows}
    only_test = tuple(label for i, label in enumerate(test.responses) if i not in of_test)
    only_model = tuple(label for j, label in enumerate(model.responses) if j not in of_model)
    for who, left in (("test", only_test), ("model", only_model)):
        if left:
            notes.append(f"only the {who} has {', '.join(left)}: left out")
    return rows, only_test, only_model


def _rows(frf, rows, signs, labels) -> FRF:
    coherence = None if frf.coherence is None else frf.coherence[rows]
    value = np.array(signs)[:, None] * frf.value[rows]
    return dataclasses.replace(frf, value=value, coherence=coherence, responses=tuple(labels))


def _on_common_lines(test, model, notes):
    """Both on the coarser one's lines in the common band."""
    low = max(test.frequency[0], model.frequency[0])
    high = min(test.frequency[-1], model.frequency[-1])
    if not low * (1 - SAME_LINE) <= high:
        raise RecordError(
            f"the bands do not overlap: the test has {_band(test)}, the model {_band(model)}; nothing is extrapolated"
        )
    slack = SAME_LINE * high
    cut = [frf.within((low - slack, high + slack)) for frf in (test, model)]
    if any(c.frequency.size < frf.frequency.size for c, frf in zip(cut, (test, model))):
        notes.append(
            f"the band is the common one, {low:g} to {high:g} Hz: the test has {_band(test)}, the model {_band(model)}"
        )
    test, model = cut
    if test.frequency.size == model.frequency.size and np.allclose(
        test.frequency, model.frequency, rtol=SAME_LINE, atol=0
    ):
        return test, dataclasses.replace(model, frequency=test.frequency)
    finer = "model" if test.frequency.size <= model.frequency.size else "test"
    notes.append(
        f"the {finer}'s lines ({_spacing(model if finer == 'model' else test)}) are interpolated onto the other's "
        f"({_spacing(test if finer == 'model' else model)})"
    )
    if finer == "model":
        test = _inside(test, model)
        return test, _interpolated(model, test.frequency)
    model = _inside(model, test)
    return _interpolated(test, model.frequency), model


def _inside(coarse, fine) -> FRF:
    """The coarse lines that lie between the ends of the fine ones."""
    slack = SAME_LINE * fine.frequency[-1]
    return coarse.within((fine.frequency[0] - slack, fine.frequency[-1] + slack))


def _interpolated(frf, frequency) -> FRF:
    if not np.isfinite(frf.value).all():
        line = int(np.argmin(np.isfinite(frf.value).all(axis=0)))
        raise RecordError(f"an FRF that is to be interpolated is not finite at {frf.frequency[line]:g} Hz")
    if frf.frequency.size < 4:
        raise RecordError(f"interpolation needs at least 4 lines in the common band, there are {frf.frequency.size}")
    at = np.clip(frequency, *frf.frequency[[0, -1]])  # within six digits
    value = scipy.interpolate.CubicSpline(frf.frequency, frf.value, axis=1)(at)
    coherence = frf.coherence
    if coherence is not None:
        coherence = np.array([np.interp(at, frf.frequency, row) for row in coherence])
    return dataclasses.replace(frf, frequency=frequency, value=value, coherence=coherence)


def _band(frf) -> str:
    return f"{frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz"


def _spacing(frf) -> str:
    return (
        f"{frf.frequency.size} lines, {np.median(np.diff(frf.frequency)) if frf.frequency.size > 1 else 0:g} Hz apart"
    )
