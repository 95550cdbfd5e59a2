"""Data types that hold arrays: read-only, equal by content, short in print."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.core.errors import RecordError
from clearance_mj.signals import FRF, Excitation, Modes, Response, compare
from clearance_mj.signals.arrays import read_only
from clearance_mj.statistics.frf_bands import Band

from ..refusals import assert_refused

LINES = np.arange(5.0, 15.0)
VALUE = np.exp(1j * np.arange(20)).reshape(2, 10)


def frf():
    value = VALUE.copy()
    value[0, 3] = np.nan
    return FRF(LINES, value)


MAKE = {
    "FRF": frf,
    "Response": lambda: Response(64.0, LINES, [LINES], provenance={"seed": 1, "gap": float("nan")}),
    "Excitation": lambda: Excitation(LINES, 64.0, description={"levels": [1, 2]}),
    "Modes": lambda: Modes([9.0], [0.01], [[1.0]], ("1:+Z",)),
    "Comparison": lambda: compare(FRF(LINES, VALUE), FRF(LINES, 2 * VALUE)),
    "Band": lambda: Band(frf(), np.ones((3, 2, 1, 10))),
}


@pytest.mark.parametrize("make", MAKE.values(), ids=MAKE.keys())
def test_arrays_are_read_only_and_content_counts(make):
    one, other = make(), make()
    assert one is not other and (one == other) is True and hash(one) == hash(other)
    assert one != "text" and {one: 1}[other] == 1
    assert len(repr(one)) < 500 and type(one).__name__ in repr(one)
    arrays = [f.name for f in dataclasses.fields(one) if isinstance(getattr(one, f.name), np.ndarray)]
    assert arrays
    for name in arrays:
        with pytest.raises(ValueError, match="read-only"):
            getattr(one, name)[...] = 0
        changed = dataclasses.replace(one, **{name: 1.5 * getattr(one, name)})
        assert changed != one and one != changed


def test_the_arrays_of_the_caller_stay_writeable_and_apart():
    mine = np.ones(10)
    excitation = Excitation(mine, 64.0)
    mine[0] = 7.0
    assert excitation.value[0] == 1.0
    assert read_only(excitation.value) is excitation.value  # not copied again


def test_minus_zero_equals_zero():
    one, other = FRF([1.0], [[0.0]]), FRF([1.0], [[-0.0]])
    assert one == other and hash(one) == hash(other)


@pytest.mark.parametrize("name", ["FRF", "Response", "Modes", "Comparison"])
def test_labelled_arrays_come_back(name):
    one = MAKE[name]()
    ds = one.to_xarray()
    assert type(one).from_xarray(ds) == one
    assert all("units" in variable.attrs for variable in ds.data_vars.values())


def test_dimensions_have_names():
    dims = {
        "FRF": {"value": ("response", "reference", "frequency")},
        "Response": {"acceleration": ("response", "time"), "excitation": ("time",)},
        "Modes": {"shape": ("response", "mode"), "damping": ("mode",)},
        "Comparison": {"csac_per_sensor": ("response", "frequency"), "per_sensor_frac": ("response",)},
    }
    for name, expected in dims.items():
        array = MAKE[name]().to_xarray()
        assert {variable: array[variable].dims for variable in expected} == expected


def test_a_response_whose_time_comes_first_is_still_read():
    """As files of earlier versions have it."""
    sent = MAKE["Response"]()
    assert Response.from_xarray(sent.to_xarray().transpose("time", ...)) == sent


def test_histories_are_real():
    assert_refused(RecordError, "excitation must be real numbers over time", Response, 64.0, 1j * LINES, [LINES])
    assert_refused(RecordError, "channels must be real numbers over time", Response, 64.0, LINES, [1j * LINES])
