"""Numbers as Fortran writes them: no E before an exponent of three digits, D for double precision, no blanks between.

ISO/IEC 1539-1:2018, 13.7.2.3.3: of Ew.d and Dw.d the exponent is E+z1z2 or +0z1z2 up to 99, and +z1z2z3 beyond.
"""

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.universal.fields import read_real

from .uff_by_hand import by_hand

NUMBERS = [1.0, 2e-101, -2.5, 3e-120, -3e-105, 4.25e-99, 0.0, -1e-100, 5e-100, 6.0, -7e-7, 8e-300]


def fortran(value, digits, width, letter="E"):
    """A number as 1PEw.d gives it."""
    mantissa, exponent = f"{value:.{digits}E}".split("E")
    sign, size = exponent[0], exponent[1:].zfill(2)
    return f"{mantissa}{letter if len(size) == 2 else ''}{sign}{size}".rjust(width)


def rows(width, digits, per_line, letter="E"):
    words = [fortran(value, digits, width, letter) for value in NUMBERS]
    assert all(len(word) == width for word in words)
    return ["".join(words[i : i + per_line]) for i in range(0, len(words), per_line)]


@pytest.mark.parametrize("letter", ["E", "D"])
@pytest.mark.parametrize("ordinate, width, digits, per_line", [
    (2, 13, 5, 6), (2, 13, 6, 6), (4, 20, 11, 4),  # the format's; negative numbers that fill their columns; double
    (2, 12, 5, 6), (2, 15, 7, 4),  # other columns
])  # fmt: skip
def test_exponents_of_three_digits(write, ordinate, width, digits, per_line, letter):
    (tip,) = cm.read(write(by_hand(rows(width, digits, per_line, letter), ordinate=ordinate)))
    np.testing.assert_array_equal(tip.value, NUMBERS)


@pytest.mark.parametrize("width, digits", [(13, 7), (12, 6)])
def test_positive_numbers_that_fill_their_columns(write, width, digits):
    """Neither blank nor sign between 2.0000000-101 and 3.0000000E+00; in the format's columns and in others."""
    numbers = [2e-101, 3.0, 4e-100, 5e-120, 6.5, 7e-101] * 2
    words = [fortran(value, digits, width) for value in numbers]
    (tip,) = cm.read(write(by_hand(["".join(words[:6]), "".join(words[6:])])))
    np.testing.assert_array_equal(tip.value, numbers)


def test_an_frf(write):
    """The second part of a complex number is the one that lost its E."""
    value = np.array([1 + 2e-101j, 2 + 1j, 3 - 3e-120j, 4 + 4j, 5, 6 + 6j])
    words = [fortran(part, 5, 13) for one in value for part in (one.real, one.imag)]
    body = ["".join(words[:6]), "".join(words[6:])]
    frf = cm.read(write(by_hand(body, kind=4, ordinate=5, count=6, axis=18, denominator=13, dof=(1, 3, 2, 3))))
    np.testing.assert_array_equal(frf.value[0, 0], value)


def test_more_numbers_than_the_header_says_are_refused(write):
    """A last line may be filled with zeros; other numbers were cut off without a word."""
    body = ["".join(f"{i:13.5E}" for i in range(1, 7)), "".join(f"{i:13.5E}" for i in (*range(7, 11), 0, 0))]
    (tip,) = cm.read(write(by_hand(body, count=10)))
    np.testing.assert_array_equal(tip.value, np.arange(1.0, 11))
    body[1] = body[1].replace("0.00000E+00", "9.00000E+09")
    with pytest.raises(cm.RecordError, match="data set 1: holds 12 numbers, 10 samples need 10"):
        cm.read(write(by_hand(body, count=10)))


def test_fields_of_other_data_sets():
    assert read_real("  2.00000-101", "parameter") == 2e-101
    assert read_real("-2.00000D+02", "parameter") == -200.0
