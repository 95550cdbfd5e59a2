"""FRFs from different sources, made comparable: quantity, degrees of freedom, frequency lines."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.interpolate

from ..core.errors import RecordError
from ..core.kinds import checks_kinds
from ..core.quantities import QUANTITIES
from .frf import FRF
from .quantities import require_quantity

__all__ = ["Alignment", "accelerance", "align", "convert_quantity"]

ORDERS = {name: known.order for name, known in QUANTITIES.items() if known.motion == "displacement"}
"""Times that the motion is differentiated in each quantity."""
Labels = tuple[str, ...]
Block = tuple[np.ndarray, ...]  # rows and columns of pairs, as np.ix_ makes them
LINE_TOLERANCE = 1e-6  # relative difference of frequencies that count as one line: files hold six digits


@dataclass(frozen=True)
class Alignment:
    """Two FRFs on the same responses, references and lines, and the changes that this took."""

    test: FRF
    """of the test, on all that is common"""
    model: FRF
    """of the model, on the same"""
    notes: tuple[str, ...]
    """conversions, changes of sign, cuts and interpolations, one sentence each"""
    only_test: tuple[str, ...]
    """the test's responses, or pairs with a reference, without a partner"""
    only_model: tuple[str, ...]
    """the model's"""

    def within(self, band: tuple[float, float]) -> Alignment:
        """Return both on the lines of a band.

        Parameters
        ----------
        band : (float, float)
            Lower and upper end of the band, Hz.
        """
        return dataclasses.replace(self, test=self.test.within(band), model=self.model.within(band))


@checks_kinds
def convert_quantity(frf: FRF, quantity: str) -> FRF:
    """Return FRFs differentiated or integrated over time: receptance, mobility and accelerance are (jω)ⁿ apart.

    Parameters
    ----------
    frf : FRF
        The functions; without the line at 0 Hz afterwards, if integrals would divide by it.
    quantity : str
        Such as "acceleration/force"; its divisor must be of the same kind, force or motion (Ewins 2000, 2.2).

    Raises
    ------
    RecordError
        If no power of jω leads from one quantity to the other.
    """
    if frf.quantity == quantity:
        return frf
    require_quantity(frf)
    power = _order(quantity) - _order(frf.quantity)
    if _is_over_force(quantity) != _is_over_force(frf.quantity):
        raise RecordError(
            f"{frf.quantity} cannot be made {quantity}: one is over a force, the other over a motion of the base"
        )
    frf = _without_zero(frf) if power < 0 else frf
    value = frf.value * (frf.window_rate + 2j * np.pi * frf.frequency) ** power
    return dataclasses.replace(frf, value=value, quantity=quantity)


@checks_kinds
def accelerance(frf: FRF) -> FRF:
    """Return FRFs of accelerations, over force or over the acceleration of the base, as `convert_quantity`.

    Parameters
    ----------
    frf : FRF
        The functions.
    """
    require_quantity(frf)
    return convert_quantity(frf, "acceleration/force" if _is_over_force(frf.quantity) else "acceleration/acceleration")


def _is_over_force(quantity: str) -> bool:
    return quantity.partition("/")[2] == "force"


def _order(quantity: str) -> int:
    above, _, below = quantity.partition("/")
    if above not in ORDERS or below not in (*ORDERS, "force"):
        raise RecordError(f'quantity "{quantity}" cannot be converted; needs a motion over a force or a motion')
    return ORDERS[above] - ORDERS.get(below, 0)


@checks_kinds
def align(test: FRF, model: FRF) -> Alignment:
    """Return FRFs from two sources in one quantity, on the same responses, references and lines.

    Responses and references are paired by node and axis; where their signs differ (+Z, -Z) the model's function
    changes sign. Of several references, only the pairs of response and reference that both have are kept. Frequencies
    are those of the coarser of the two within the band that both cover; the finer is interpolated there (real and
    imaginary part, cubic spline), never beyond its ends.

    Parameters
    ----------
    test, model : FRF
        The functions; both come out in the test's quantity.

    Raises
    ------
    RecordError
        If no reference or no response is common, the bands do not overlap, or a quantity cannot be converted.
    """
    notes: list[str] = []
    if test.quantities or model.quantities:
        raise RecordError('holds FRFs of several quantities; take those of one, such as of_quantity("velocity/force")')
    if (model.quantity, model.unit_label) != (test.quantity, test.unit_label):
        require_quantity(test)
        require_quantity(model)
        notes.append(f"the model's {model.quantity} is converted to the test's {test.quantity}")
        model = convert_quantity(model, test.quantity)
    if test.window_rate != model.window_rate:
        rates = f"{test.window_rate:g} and {model.window_rate:g} 1/s"
        notes.append(f"test and model are under exponential windows of {rates}: their peaks differ by these")
    columns = _partners("reference", test.references, model.references, notes)
    rows = _partners("response", test.responses, model.responses, notes)
    of_test, of_model = np.ix_(rows[0], columns[0]), np.ix_(rows[1], columns[1])
    common = test.measured[of_test] & model.measured[of_model]
    if not common.any():
        raise RecordError("no pair of response and reference is common")
    signs = np.outer(rows[2], columns[2])
    kept_rows, kept_columns = rows[0][common.any(axis=1)], columns[0][common.any(axis=0)]
    labels = tuple(test.responses[i] for i in kept_rows), tuple(test.references[i] for i in kept_columns)
    pair = _select(test, of_test, common, np.ones(signs.shape), labels), _select(model, of_model, common, signs, labels)
    unmatched = _only(test, of_test, common), _only(model, of_model, common)
    return Alignment(*_on_common_lines(*pair, notes), tuple(notes), *unmatched)


def _same_axis(a: str, b: str) -> int:
    """Return 1 for one degree of freedom, -1 if the signs of the direction differ, 0 for different ones."""
    (node, direction), (other_node, other) = a.split(":"), b.split(":")
    if int(node) != int(other_node) or direction.lstrip("+-") != other.lstrip("+-"):
        return 0
    return 1 if direction == other else -1


def _partners(role: str, test: Sequence[str], model: Sequence[str], notes: list[str]) -> np.ndarray:
    """Return (3, n) indices of the labels of test and model that are one degree of freedom, and the model's sign."""
    pairs = []
    for i, label in enumerate(test):
        for j, other in enumerate(model):
            if sign := _same_axis(label, other):
                pairs.append((i, j, sign))
                break
    if not pairs:
        raise RecordError(f"no {role} is common; the test has {', '.join(test)}, the model {', '.join(model)}")
    if reversed_labels := [f"{model[j]} to {test[i]}" for i, j, sign in pairs if sign < 0]:
        notes.append(f"the model's {role}s are turned: {', '.join(reversed_labels)}")
    return np.array(pairs).T


def _select(frf: FRF, block: Block, common: np.ndarray, signs: np.ndarray, labels: tuple[Labels, Labels]) -> FRF:
    """Return the FRF of the pairs of a block that both have, with their signs."""

    def pick(values: np.ndarray) -> np.ndarray:
        return np.where(common[:, :, None], values, np.nan)[np.ix_(common.any(axis=1), common.any(axis=0))]

    value = pick(signs[:, :, None] * frf.value[block])
    coherence = None if frf.coherence is None else pick(frf.coherence[block])
    return FRF(frf.frequency, value, coherence, *labels, frf.quantity, frf.unit_label, frf.averages, frf.window_rate)


def _only(frf: FRF, block: Block, common: np.ndarray) -> Labels:
    """Return the labels of the pairs that the other does not have."""
    matched = np.zeros(frf.measured.shape, dtype=bool)
    matched[block] = common
    return tuple(label for label, is_matched in zip(frf.labels, matched.T[frf.measured.T]) if not is_matched)


def _on_common_lines(test: FRF, model: FRF, notes: list[str]) -> tuple[FRF, FRF]:
    """Return both on the coarser one's lines in the common band."""
    test, model = _without_zero(test), _without_zero(model)
    low = max(test.frequency[0], model.frequency[0])
    high = min(test.frequency[-1], model.frequency[-1])
    slack = LINE_TOLERANCE * high
    bands = f"the test has {_band(test)}, the model {_band(model)}"
    if low > high + slack:
        raise RecordError(f"the bands do not overlap: {bands}; nothing is extrapolated")
    common = low - slack, high + slack
    cut = test.within(common), model.within(common)
    if cut[0].frequency.size < test.frequency.size or cut[1].frequency.size < model.frequency.size:
        notes.append(f"the band is the common one, {low:g} to {high:g} Hz: {bands}")
    lines = cut[0].frequency, cut[1].frequency
    if lines[0].shape == lines[1].shape and np.allclose(*lines, rtol=LINE_TOLERANCE, atol=0):
        return cut[0], dataclasses.replace(cut[1], frequency=lines[0])
    of_test, of_model = f"the test's lines ({_spacing(cut[0])})", f"the model's lines ({_spacing(cut[1])})"
    if lines[0].size <= lines[1].size:
        notes.append(f"{of_model} are interpolated onto {of_test}")
        return cut[0], _interpolate(model, lines[0])
    notes.append(f"{of_test} are interpolated onto {of_model}")
    return _interpolate(test, lines[1]), cut[1]


def _without_zero(frf: FRF) -> FRF:
    """Return an FRF without the line at 0 Hz, where accelerations are zero and receptances static: no dB exist."""
    if frf.frequency[0] > 0 or frf.frequency.size == 1:
        return frf
    return frf.within((frf.frequency[1], frf.frequency[-1]))


def _interpolate(frf: FRF, frequency: np.ndarray) -> FRF:
    if not np.isfinite(frf.functions).all():
        line = int(np.argmin(np.isfinite(frf.functions).all(axis=0)))
        raise RecordError(f"an FRF that is to be interpolated is not finite at {frf.frequency[line]:g} Hz")
    if frf.frequency.size < 4:
        raise RecordError(f"interpolation needs at least 4 lines, there are {frf.frequency.size}")
    f = np.clip(frequency, *frf.frequency[[0, -1]])  # within six digits
    value = np.full((*frf.value.shape[:2], f.size), complex(np.nan, np.nan))
    value[frf.measured] = scipy.interpolate.CubicSpline(frf.frequency, frf.value[frf.measured], axis=1)(f)
    if (coherence := frf.coherence) is not None:
        coherence = np.apply_along_axis(lambda row: np.interp(f, frf.frequency, row), 2, coherence)
    return dataclasses.replace(frf, frequency=frequency, value=value, coherence=coherence)


def _band(frf: FRF) -> str:
    return f"{frf.frequency[0]:g} to {frf.frequency[-1]:g} Hz"


def _spacing(frf: FRF) -> str:
    distance = f", {np.median(np.diff(frf.frequency)):g} Hz apart" if frf.frequency.size > 1 else ""
    return f"{frf.frequency.size}{distance}"
