"""Loudness over the level of an excitation."""

import numpy as np
import pytest

from clearance_mj.core.errors import ExcitationError
from clearance_mj.model import Model
from clearance_mj.rig import Plate, Rig
from clearance_mj.signals.excitation import random, still
from clearance_mj.sound import audible_sound, loudness_over_level, sound_over_level

from ..rig.rig_changes import TABLES

PLATE = Plate(sensor=8, area=0.1, distance=1.0)
NOISE = random(1.5, 4096.0, band=(5, 220), rms=1.0, seed=3)


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(Rig.from_dict(TABLES))


def test_a_shaft_that_touches_nothing_is_linear(model):
    """Twice the level is 6.02 dB more, whatever the plate."""
    a, b = sound_over_level(model, NOISE, (0.01, 0.02), PLATE)
    assert b.level - a.level == pytest.approx(20 * np.log10(2), abs=1e-6)
    assert a.duration == pytest.approx(1.0)


def test_rattle_is_louder_than_its_level_says(model):
    """Impacts bring in frequencies that are heard: loudness grows by more than the sound pressure's own growth."""
    pytest.importorskip("mosqito")
    by_level = loudness_over_level(model, NOISE, (0.05, 5.0), PLATE, method="stationary")
    assert by_level.level == (0.05, 5.0)
    rattles = audible_sound(model.simulate(random(1.5, 4096.0, rms=5.0, seed=3), "modal"), model.rig, PLATE)
    assert np.allclose(by_level.sound[1].pressure, rattles.pressure, atol=1e-9)
    assert by_level.n5[1] > by_level.n5[0]
    assert by_level.pressure_level[1] == pytest.approx(rattles.level)
    assert "5 " in repr(by_level) and "sone" in repr(by_level)


@pytest.mark.parametrize(
    ("excitation", "levels", "words"),
    [
        (NOISE, (), "levels must be one or more numbers > 0"),
        (NOISE, (1.0, -1.0), "levels must be one or more numbers > 0"),
        (still(1.5, 4096.0), (1.0,), "is zero has no level to scale"),
        (random(0.5, 4096.0), (1.0,), "lasts at least 1 s"),
    ],
)
def test_what_cannot_be_listened_to_is_refused(model, excitation, levels, words):
    with pytest.raises(ExcitationError) as caught:
        sound_over_level(model, excitation, levels, PLATE)
    assert words in str(caught.value)
