"""What the fields of data sets 58 may hold: degrees of freedom, quantities, units, numbers."""

from __future__ import annotations

import re

import numpy as np

from ...errors import RecordError

_AXES = ("X", "Y", "Z", "RX", "RY", "RZ")
DIRECTIONS = {f"{s}{a}": int(f"{s}{i}") for s in "+-" for i, a in enumerate(_AXES, 1)} | {"S": 0}
"""Direction codes of data set 58; R for rotations, S for a scalar."""
QUANTITIES = {"displacement": 8, "velocity": 11, "acceleration": 12, "force": 13}
"""Specific data types of data set 58."""
UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N"}
"""Labels of the units that are written"""
_INTEGER = re.compile(r"[+-]?[0-9]{1,10}")
_REAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(E[+-]?[0-9]{1,3})?")
_DOF = re.compile(r"([0-9]{1,9}):(\S+)")


def read_dof(node: str, direction: str, what: str) -> str:
    code = read_integer(direction, f"{what} direction")
    names = [name for name, value in DIRECTIONS.items() if value == code]
    if not names:
        raise RecordError(f"{what} direction {code} is unknown; needs -6 to 6")
    number = read_integer(node, f"{what} node")
    if not 0 <= number < 10**9:
        raise RecordError(f"{what} node {number} must be a whole number of at most 9 digits")
    return f"{number}:{names[0]}"


def check_dof(label: str):
    match = _DOF.fullmatch(label)
    if not match or match[2] not in DIRECTIONS:
        raise RecordError(f'degree of freedom "{label}" must be a node and a direction, such as "3:+Z"')


def quantity_of(code: int, what: str) -> str:
    for quantity, known in QUANTITIES.items():
        if code == known:
            return quantity
    known = ", ".join(f"{code} ({quantity})" for quantity, code in QUANTITIES.items())
    raise RecordError(f"{what} type {code} cannot be used; needs {known}")


def read_integer(text: str, what: str) -> int:
    text = text.strip()
    if text and not _INTEGER.fullmatch(text):
        raise RecordError(f"{what} is {text!r}, needs a whole number")
    return int(text or 0)  # Fortran reads a blank field as zero


def read_real(text: str, what: str) -> float:
    text = text.strip().upper().replace("D", "E")
    if text and not _REAL.fullmatch(text):
        raise RecordError(f"{what} is {text!r}, needs a number")
    value = float(text or 0)
    if not np.isfinite(value):
        raise RecordError(f"{what} is {text!r}, needs a finite number")
    return value


def require_finite(values: np.ndarray, what: str):
    finite = np.isfinite(values).reshape(len(values), -1).all(axis=1)
    if not finite.all():
        raise RecordError(f"{what}: sample {int(np.argmin(finite))} is not a finite number")
