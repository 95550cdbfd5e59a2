"""Share of the time in contact: counted at the simulation's own steps, whatever the response's rate."""

from dataclasses import replace

import numpy as np
import pytest

from clearance_mj import ConstantLaw, Excitation, Rig, simulate, simulate_blocks
from clearance_mj.engines import get_engine, simulate_together
from clearance_mj.engines.energies import OF_CLEARANCE, OF_END, OF_RIG
from clearance_mj.engines.modal import ModalRun
from clearance_mj.io import formats
from clearance_mj.signals.excitation import random
from clearance_mj.signals.sampling import interpolate
from clearance_mj.statistics import contact_statistics

from .alike import with_bushings

TABLE1, LAW, FS = Rig.load("models/table1_rig.toml"), ConstantLaw(2e4, 3.0), 2048.0
DRIVE = random(3.0, FS, rms=2.0, seed=0)


def at_every_step(rig, engine):
    """The same simulation, its response undecimated: the excitation is sampled at the engine's steps."""
    factor = round(1 / (FS * simulate(rig, DRIVE, LAW, engine).provenance["step"]))
    response = simulate(rig, Excitation(interpolate(DRIVE.value, factor), factor * FS), LAW, engine)
    assert factor > 4 and response.provenance["step"] * factor * FS == pytest.approx(1)
    return response


@pytest.mark.parametrize("engine", ["modal", "links"])
def test_steps_with_the_shaft_beyond_the_gap(engine):
    """Point bushings, one of them with a wall above alone and off centre: |x| > gap is counted of every step."""
    one, other = TABLE1.bushings
    bushings = replace(one, length=0, gap=1e-4), replace(other, length=0, offset=5e-5, stops="upper")
    rig = TABLE1.replace(bushings=bushings)
    x = at_every_step(rig, engine).displacement
    expected = np.mean(np.abs(x[0]) > 1e-4), np.mean(x[1] > other.gap - 5e-5)
    response = simulate(rig, DRIVE, LAW, engine)
    assert min(expected) > 0.02
    np.testing.assert_allclose(response.contact_share, expected, atol=1e-3)
    assert np.all(np.mean(response.contact_force != 0, axis=1) > 1.4 * response.contact_share)  # the filter rings


@pytest.mark.parametrize("engine", ["modal", "links"])
def test_either_end_of_a_long_bushing_counts(engine):
    """The coordinates of every step, at the points of contact: the ends touch more often than the middle."""
    rig = with_bushings(TABLE1, length=0.1)
    engine = get_engine(engine)
    step = engine.largest_step(rig, LAW)
    drive = 20 * np.sin(2 * np.pi * 38 * step * np.arange(4000))
    rows, works = engine.start(rig, LAW, "base", step).balanced(drive)
    touches, middles, gap = rows[:, -2:], np.abs(rows[:, len(rig.sensors) :][:, :2]), rig.bushings[0].gap
    depths = works[:, len(OF_RIG) + 2 * len(OF_CLEARANCE) :].reshape(len(drive), 2, 2, len(OF_END))[..., 0]
    np.testing.assert_array_equal(touches, (depths > 0).any(axis=2))
    assert np.all(np.mean(touches, axis=0) > np.mean(middles > gap, axis=0) + 0.01)


def test_blocks_lanes_files_and_statistics_hold_the_same(tmp_path):
    response = simulate(TABLE1, DRIVE, LAW, "modal")
    blocks = list(simulate_blocks(TABLE1, DRIVE, LAW, "modal"))
    weights = [block.excitation.size for block in blocks]
    fraction = np.average([block.contact_share for block in blocks], axis=0, weights=weights)
    np.testing.assert_allclose(fraction, response.contact_share)
    (in_lanes,) = simulate_together([(TABLE1, LAW)], DRIVE)
    np.testing.assert_allclose(in_lanes.contact_share, response.contact_share, rtol=1e-9)
    formats.write(tmp_path / "a.nc", response)
    assert formats.read(tmp_path / "a.nc") == response
    assert contact_statistics(response)["contact_share"] == response.contact_share.tolist()


def test_an_engine_that_does_not_tell(monkeypatch):
    """Such as a plugin that returns forces alone."""
    advance = ModalRun.advance
    monkeypatch.setattr(ModalRun, "advance", lambda run, excitation: advance(run, excitation)[:, :-2])
    response = simulate(TABLE1, DRIVE, LAW, "modal")
    assert response.contact_share is None and "in contact" not in repr(response)
    assert np.isnan(contact_statistics(response)["contact_share"]).all()


@pytest.mark.parametrize("gravity", [None, (0.0, 1.0, 0.0)])
def test_a_rig_without_bushings_has_no_numbers_of_any(gravity):
    rig = TABLE1.replace(bushings=(), gravity=gravity)
    statistics = contact_statistics(simulate(rig, random(0.1, 2048.0, seed=0), engine="modal"))
    assert statistics.pop("step") > 0 and set(map(tuple, statistics.values())) == {()}
