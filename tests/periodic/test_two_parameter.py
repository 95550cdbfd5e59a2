"""First contact over frequency and level. Truth: branches just below and above."""

import numpy as np
import pytest

from clearance_mj import periodic
from clearance_mj.clearance import ConstantLaw, MaxwellSlip
from clearance_mj.errors import ExcitationError

from ..conftest import TABLE1
from .test_rigs import LAW

SLIDERS = MaxwellSlip(springs=(1500.0, 1500.0), forces=(0.1, 0.25), elastic=1500.0, damping=3.0)


def test_first_contact_in_closed_form():
    frequency = np.array([10.0, 30.0, 39.0, 60.0])
    curve = periodic.first_contact(TABLE1, LAW, frequency)
    for i, level in enumerate(curve.value):
        for factor in (0.999, 1.001):
            branch = periodic.response(
                TABLE1, LAW, factor * level, (frequency[i], 1.0001 * frequency[i]), stability=False
            )
            assert branch.contact_force[0].any() == (factor > 1)


@pytest.mark.slow
def test_first_contact_of_grease_that_remembers():
    law = ConstantLaw(7.8e3, 4.0, grease=SLIDERS)
    curve = periodic.first_contact(TABLE1, law, [39.0, 45.0])
    for frequency, level in zip(curve.frequency, curve.value):
        for factor in (0.999, 1.001):
            branch = periodic.response(TABLE1, law, factor * level, (frequency, 1.0001 * frequency), stability=False)
            assert branch.contact_force[0].any() == (factor > 1)


def test_figure_dataset_and_refusals():
    curve = periodic.first_contact(TABLE1, LAW, [10.0, 20.0])
    axes = curve.plot().axes[0]
    assert axes.get_ylabel() == "level (m/s²)"
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), curve.value)
    assert curve.to_xarray().level.attrs["units"] == "m s-2"
    with pytest.raises(ExcitationError, match="frequencies must be numbers > 0 Hz"):
        periodic.first_contact(TABLE1, LAW, [0.0])
