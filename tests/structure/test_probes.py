"""What a displacement probe reads where a bushing's housing or the base's foot moves, by the points' own motion."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.linear import LinearModel, linear_model
from clearance_mj.structure.attached import FixtureMode, Housing, foot, housing_of

from ..conftest import TABLE1


@pytest.mark.parametrize("place", [None, 0.3], ids=["in the middle", "elsewhere"])
@pytest.mark.parametrize("fixed_to", ["housing", "base"])
def test_a_probe_reads_the_shaft_less_what_it_is_fixed_to(fixed_to: str, place: float | None) -> None:
    model = _model(Housing(2e5, 0.1, 5.0, fixed_to))
    values = {} if place is None else {"probes[0].position": place}
    at = model.rig.bushings[0].position if place is None else place
    held = housing_of(0) if fixed_to == "housing" else foot(model.rig.bushings[0].position)
    shaft, other = model.shapes([at, held])
    np.testing.assert_allclose(model.at_probes(values)[0], shaft - other, atol=1e-12)
    assert np.abs(other).max() > 1e-6


def test_a_probe_that_is_moved_along_a_shaft_still_reads_the_base_s_foot() -> None:
    model = _model(None)
    shaft, other = model.shapes([0.3, foot(model.rig.bushings[0].position)])
    np.testing.assert_allclose(model.at_probes({"probes[0].position": 0.3})[0], shaft - other, atol=1e-12)


def test_a_late_probe_is_late_in_the_channels_gains() -> None:
    model, omega = _model(None), 2 * np.pi * np.array([20.0, 80.0])
    bushings = (model.rig.bushings[0], dataclasses.replace(model.rig.bushings[1], probe_delay=2e-3))
    late = dataclasses.replace(model, rig=model.rig.replace(bushings=bushings))
    rows, channel = model.at_probes({}), len(model.rig.sensors) + 1
    expected = model.channel_gains(rows, "base", omega)
    expected[:, channel] *= np.exp(-2e-3j * omega)[:, None]
    np.testing.assert_allclose(late.channel_gains(rows, "base", omega), expected, rtol=1e-12)


def _model(housing: Housing | None) -> LinearModel:
    bushings = (dataclasses.replace(TABLE1.bushings[0], housing=housing), *TABLE1.bushings[1:])
    return linear_model(TABLE1.replace(bushings=bushings, fixture=(FixtureMode(150.0, 0.02, 0.5),)))
