"""The baseline that changes of the engines are held to: what moves, appears with another shape or as nan is found."""

import numpy as np
import pytest

from benchmarks.baseline import compute, differences


@pytest.mark.parametrize("change, off", [
    (lambda x: x, False),
    (lambda x: x * (1 + 1e-14), False),
    (lambda x: x * (1 + 1e-11), True),
    (lambda x: x[:, 1:], True),
    (lambda x: np.where(np.arange(x.shape[1]) == 7, np.nan, x), True),
])  # fmt: skip
def test_what_moves_is_off(change, off):
    old = compute(["slot modal kelvin-voigt"])
    new = {name: change(value) if value.ndim == 2 else value for name, value in old.items()}
    assert all((not far <= most) == off for _, far, most in differences(old, new))
    assert len([*differences(old, new)]) == 4
