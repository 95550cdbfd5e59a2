"""Spectra: data sets 58 of all other function types, and time functions that are no records."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...core.checks import NOWHERE, UNKNOWN, check_dof, naming, require_finite
from ...core.errors import RecordError
from ...core.quantities import QUANTITIES
from ...signals.spectra import POWERS, RATIOS, Spectra
from ...universal.dataset_58 import FREQUENCY, FUNCTION_TYPES, TIME, UNSTATED_TYPES, Function, samples, spectrum_block
from ...universal.dataset_164 import FunctionQuantity, known_factor, label_of
from ...universal.fields import SI, quantity_of
from .functions import abscissa, name_of

__all__ = ["read_spectra", "spectra_blocks"]

_SQUARE = re.compile(r"\(?(.*?)\)?(?:\^2|\*\*2|²)")
_AXES = {FREQUENCY: ("frequency", "Hz"), TIME: ("time", "s"), 19: ("rotational speed", "rpm"), 20: ("order", "")}
_OF_FREQUENCY = (2, 3, 4, 5, 6, 9, 10, 12, 18, 21, 24, 26)  # function types
_OF_TIME = (1, 7, 8, 25)
_PLAIN_AXIS = ("sample", "")


def read_spectra(data: bytes, functions: Sequence[Function]) -> list[Spectra]:
    """Return spectra, each of all functions of one kind over the same abscissa."""
    groups: list[tuple[tuple[str, str, str], np.ndarray, list[Function]]] = []
    for f in functions:
        axis, unit, values = _axis(data, f)
        key = f.type_name, axis, unit
        group = next((g for g in groups if g[0] == key and np.array_equal(g[1], values)), None)
        if group is None:
            groups.append(group := (key, values, []))
        group[2].append(f)
    return [_spectra(data, *group) for group in groups]


def _axis(data: bytes, function: Function) -> tuple[str, str, np.ndarray]:
    """Return name, unit and values of the abscissa; numbers of samples where it neither rises nor falls."""
    values = abscissa(data, function)
    axis, unit = _AXES.get(function.abscissa_type, ("abscissa", label_of(function.axis_unit)))
    if function.abscissa_type in UNSTATED_TYPES:
        if function.kind in _OF_FREQUENCY or function.axis_unit.lower() in ("hz", "khz"):
            axis, unit = _AXES[FREQUENCY]
        elif function.kind in _OF_TIME:
            axis, unit = _AXES[TIME]
    steps = np.diff(values)
    if not (np.all(steps > 0) or np.all(steps < 0)):
        return *_PLAIN_AXIS, np.arange(float(function.size))
    return axis, unit, values


def _spectra(data: bytes, key: tuple[str, str, str], values: np.ndarray, functions: list[Function]) -> Spectra:
    kind, axis, unit = key
    measures = [_measure(f, kind) for f in functions]
    rows = np.array([samples(data, f, measure.scale) for f, measure in zip(functions, measures)])
    references = tuple(f.reference if f.reference.split(":")[0] != "0" else NOWHERE for f in functions)
    rising = slice(None, None, -1 if values[-1] < values[0] else 1)
    with naming(f"data set {functions[0].number}"):
        return Spectra(
            kind, values[rising], rows[:, rising],
            tuple(f.response for f in functions), references, tuple(map(name_of, functions)),
            tuple(m.quantity for m in measures), tuple(m.unit for m in measures), axis, unit,
        )  # fmt: skip


def _measure(function: Function, kind: str) -> FunctionQuantity:
    """Return quantity, unit in words and scale: in SI where the unit is beyond doubt, otherwise as in the file.

    Some programs give an auto spectrum the unit of its square, others that of its root: of the two only the square,
    and SI, are taken for certain.
    """
    if kind in RATIOS:
        return FunctionQuantity("ratio", "1", 1.0)
    label = label_of(function.unit)
    quantity = quantity_of(function.numerator, label)
    unscaled = FunctionQuantity(UNKNOWN, label, 1.0)
    if quantity == UNKNOWN or function.units != SI:
        return unscaled
    si_unit = QUANTITIES[quantity].unit
    if kind not in POWERS:
        scale = known_factor(label, quantity) if label else 1.0
        return unscaled if scale is None else FunctionQuantity(quantity, si_unit, scale)
    if kind == "cross spectrum":
        return unscaled if label else FunctionQuantity(quantity, "", 1.0)
    per_hertz = {"power spectral density": "/Hz", "energy spectral density": "·s/Hz"}.get(kind, "")
    label = label.removesuffix(per_hertz)
    scale = known_factor(label or si_unit, quantity)
    if scale is None and (square := _SQUARE.fullmatch(label)):
        scale = known_factor(square[1], quantity)
    elif scale != 1:  # of the root in a unit that would have to be squared, or would not
        return unscaled
    return unscaled if scale is None else FunctionQuantity(quantity, f"({si_unit})²{per_hertz}", scale**2)


def spectra_blocks(spectra: Spectra) -> Iterator[bytes]:
    """Return the data sets of spectra, in double precision."""
    if spectra.kind not in FUNCTION_TYPES:
        raise RecordError(f'kind "{spectra.kind}" is no function type; use {", ".join(FUNCTION_TYPES)}')
    types = {axis: code for code, (axis, _) in _AXES.items()}
    axis: dict[str, Any] = {"abscissa_type": types.get(spectra.axis, 0), "axis_unit": spectra.axis_unit or "NONE"}
    axis |= {"axis_label": spectra.axis, "kind": FUNCTION_TYPES.index(spectra.kind)}
    labels = zip(spectra.names, spectra.responses, spectra.references, spectra.quantities, spectra.units)
    for row, (name, response, reference, quantity, unit) in zip(spectra.value, labels):
        check_dof(response)
        check_dof(reference)
        require_finite(row, f"{spectra.kind} {name}")
        plain = unit.replace("(m/s²)²", "(m/s^2)^2").replace("²", "^2")
        place = {"name": name, "response": response, "reference": reference, "unit": plain or "NONE"}
        code = QUANTITIES[quantity].codes[0] if quantity in QUANTITIES else 0
        yield spectrum_block(spectra.abscissa, row, numerator=code, **place, **axis)
