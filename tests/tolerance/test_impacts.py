"""Impacts that are counted and largest values that are kept while models are marched."""

import dataclasses

import numpy as np
import pytest
import scipy.stats

import clearance_mj as cm
from clearance_mj.clearance.modelled import rig_and_law
from clearance_mj.tolerance.impacts import groups_side_by_side, impact_rate, march

from ..study.turning_rig import RIG as TURNING

RIG = cm.Rig.load("models/table1_rig.toml")


def whole(cases, pieces, settling=0.0):
    """Return the blocks of each model, joined."""
    each = zip(*march(cases, pieces, cm.Modal(), settling))
    return [[np.concatenate(part, axis=1) for part in zip(*blocks)] for blocks in each]


def test_what_is_kept_is_the_largest_of_the_response():
    """One step for each sample, so that nothing is filtered; bushings without length, which touch in their middle."""
    bushings = tuple(dataclasses.replace(b, length=0.0, offset=5e-5) for b in RIG.bushings)
    rig, fs = RIG.replace(bushings=bushings), 20480.0
    noise = cm.excitation.random(1.5, fs, rms=5.0, seed=2)
    response = cm.simulate(rig, noise, engine="modal")
    assert response.provenance["step"] == 1 / fs
    ((depth, force, acceleration, impacts),) = whole([rig_and_law(rig)], [noise])
    moved = np.maximum(response.displacement - 2.5e-4, -3.5e-4 - response.displacement)
    assert depth == pytest.approx(moved, abs=1e-12)
    assert force == pytest.approx(np.abs(response.contact_force), abs=1e-9)
    assert acceleration == pytest.approx(np.abs(response.acceleration), abs=1e-9)
    outside = np.pad(moved > 0, ((0, 0), (1, 0)))
    assert impacts.sum(axis=1).tolist() == (np.diff(outside.astype(int), axis=1) == 1).sum(axis=1).tolist()
    assert impacts.sum(axis=1).min() > 10


def test_depth_does_not_depend_on_how_probes_are_turned():
    noise = cm.excitation.random(0.5, 4096.0, rms=20.0, seed=2)
    depths_ = []
    for angle in (0.0, 0.4):
        bushing = dataclasses.replace(TURNING.bushings[0], gap=3e-4, offset_y=1e-4, offset=-5e-5, probe_angle=angle)
        ((depth, *_),) = whole([rig_and_law(TURNING.replace(bushings=(bushing,)))], [noise])
        depths_.append(depth)
    assert depths_[1] == pytest.approx(depths_[0], abs=1e-12) and depths_[0].max() > 0


def test_pieces_and_settling_change_nothing_of_what_is_left():
    noise = cm.excitation.random(4.0, 2048.0, rms=5.0, seed=2)
    parts = [dataclasses.replace(noise, value=noise.value[i : i + 1000]) for i in range(0, noise.value.size, 1000)]
    ((*a,),), ((*b,),) = whole([rig_and_law(RIG)], [noise]), whole([rig_and_law(RIG)], parts, settling=1.0)
    for one, other in zip(a[:2] + a[3:], b[:2] + b[3:]):
        assert one.shape[1] == 8192 and np.array_equal(one[:, 2048:], other)


def test_side_by_side_is_as_alone():
    noise = cm.excitation.random(2.0, 2048.0, rms=5.0, seed=3)
    cases = [rig_and_law(RIG.with_gap(gap)) for gap in (2e-4, 3e-4, 4e-4)]
    assert groups_side_by_side([*cases, *cases, *cases], noise, cm.Modal()) == [list(range(8)), [8]]
    for case, in_batch in zip(cases, whole(cases, [noise])):
        (alone,) = whole([case], [noise])
        assert all(a == pytest.approx(b, rel=1e-6, abs=1e-9) for a, b in zip(alone, in_batch))


def test_a_rate_of_independent_impacts_has_poissons_interval():
    """Jeffreys' interval of a Poisson rate: quantiles of Gamma(N + 1/2, 1/T)."""
    impacts = np.zeros(2000)
    impacts[50::100] = 1  # one in each twentieth: no scatter at all
    interval, law = impact_rate(impacts, 60.0), scipy.stats.gamma(20.5, scale=1 / 60.0)
    assert (interval.value, interval.dispersion) == (pytest.approx(20 / 60), 1.0)
    assert (interval.low, interval.high) == (pytest.approx(law.ppf(0.05)), pytest.approx(law.ppf(0.95)))
    none = impact_rate(np.zeros(2000), 60.0)
    assert (none.value, none.low, none.high) == (0.0, 0.0, pytest.approx(scipy.stats.gamma(0.5).ppf(0.95) / 60))


def test_interval_of_clustered_impacts_holds_the_rate():
    """Bursts of six impacts at a Poisson rate of 1/s: six of them count as one event."""
    rng, inside = np.random.default_rng(0), 0
    for _ in range(500):
        interval = impact_rate(6.0 * rng.poisson(1.0 / 100, 6000), 60.0)
        inside += interval.low <= 6.0 <= interval.high
    assert inside / 500 == pytest.approx(0.9, abs=0.05)


def test_refuses_what_has_no_impacts():
    noise = cm.excitation.random(1.0, 2048.0, seed=3)
    bare = rig_and_law(RIG.replace(bushings=()))
    with pytest.raises(cm.ClearanceError, match="without clearances has no impacts"):
        next(march([bare], [noise], cm.Modal(), 0.0))
    with pytest.raises(cm.ClearanceError, match="march others one by one"):
        next(march([rig_and_law(RIG)] * 2, [noise], cm.Links(), 0.0))
