"""The engine mjx against the engine links, and many cases at once against each alone."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.clearance import Cubic, HuntCrossley, HuntCrossley1975, KelvinVoigt, MaxwellSlip
from clearance_mj.core.errors import ClearanceError
from clearance_mj.engines import simulate_batch
from clearance_mj.rig import Friction, Grease, Rig, Sensor, Shaker
from clearance_mj.signals.correlation import rmse_db
from clearance_mj.sweep import Design, Outputs, Plan, Vary

from ..conftest import ROOT, TABLE1
from .alike import HISTORIES, with_bushings
from .tube import tube_and_shaft

pytest.importorskip("jax", reason="JAX is not installed; make test-mjx installs it")

FS = 4096.0
ROUNDING = 1e-12  # N, of forces of contacts that are none
SPACE = TABLE1.with_shape("round")
PUMP = Rig.load(ROOT / "models" / "stepped_shaft.toml")
FILM = Grease(5e3, 2.0, 0.8, 1.1, 1.5e7, 5e6, 1.9, 8e-4, 0.3)
ENVELOPE = cm.AmplitudeLaw([2e-4, 4e-4, 6e-4], [5e3, 8e3, 2e4], [2.0, 4.0, 5.0], grease=FILM)
SLIPPING = cm.ContactLaw(HuntCrossley1975(2e6, 4e5), grease=FILM)


def noise(rms, seconds=0.1, seed=1, **fields):
    return cm.excitation.random(seconds, FS, band=(5, 220), rms=rms, seed=seed, **fields)


def one_sided_tube():
    """Springs, rigid supports, and a clearance between two points that move, along which one wall is missing."""
    rig = tube_and_shaft(gap=2e-5, stops="upper")
    return rig.replace(sensors=(*rig.sensors, Sensor(2, "inner@0.5", quantity="displacement")))


def off_centre(rig):
    """A rig whose shaft stands off the middle of its first clearance."""
    first, *others = rig.bushings
    fields = {"offset_y": 4e-5} if first.is_round else {}
    return rig.replace(bushings=(dataclasses.replace(first, offset=1e-4, **fields), *others))


def furthest(computed, reference):
    """Largest difference of everything that two responses hold, as a share of the largest value there is of it."""
    parts = [(getattr(computed, name), getattr(reference, name)) for name in HISTORIES]
    return max(np.abs(a - b).max() / np.abs(b).max() for a, b in parts if np.abs(b).max(initial=0.0) > ROUNDING)


@pytest.mark.parametrize("rig", [TABLE1, SPACE, PUMP], ids=["plane", "space", "supports"])
def test_motions_in_the_gap_are_those_of_links(rig):
    """Over 0.1 s; what is left is the geometry of the chain, whose slopes are some 1e-4."""
    links, mjx = (cm.simulate(rig, noise(0.05), engine=engine) for engine in ("links", "mjx"))
    assert not links.contact_share.any() and links.displacement.any()
    assert furthest(mjx, links) < 1e-6


@pytest.mark.parametrize(
    ("rig", "level", "law"),
    [
        (TABLE1, 5.0, cm.ConstantLaw(8e3, 4.0)), (off_centre(TABLE1), 3.0, SLIPPING),
        (TABLE1, 4.0, cm.ContactLaw(HuntCrossley(2e6, 0.4))), (TABLE1, 4.0, ENVELOPE),
        (TABLE1, 4.0, cm.TimeLaw([0.0, 0.05, 0.1], [5e3, 9e3, 7e3], [2.0, 4.0, 3.0])),
        (off_centre(SPACE), 4.0, cm.ContactLaw(Cubic(5e3, 5e10, 2.0, 1.0), grease=FILM)), (PUMP, 2.0, None),
        (one_sided_tube(), 20.0, None), (TABLE1.replace(bushings=()), 5.0, None),
    ],
    ids=["constant", "power law", "restitution", "amplitude", "time", "round", "supports", "stop", "no clearance"],
)  # fmt: skip
def test_contacts_of_every_law_are_those_of_links(rig, level, law):
    """Over 0.1 s with impacts, which magnify what geometry differs by."""
    links, mjx = (cm.simulate(rig, noise(level), law, engine) for engine in ("links", "mjx"))
    assert furthest(mjx, links) < 2e-4
    if rig.bushings:
        assert links.contact_force.any()
        np.testing.assert_allclose(mjx.contact_share, links.contact_share, atol=2e-3)


def test_responses_to_a_force_are_those_of_links():
    rig = TABLE1.replace(shaker=Shaker("force", 0.9))
    links, mjx = (cm.simulate(rig, noise(2.0, kind="force"), engine=engine) for engine in ("links", "mjx"))
    assert links.contact_force.any() and furthest(mjx, links) < 1e-3


def test_frequency_responses_in_contact_are_those_of_links():
    """Within a quarter of what two seeds of links differ by, of every sensor."""
    frfs = {
        (engine, seed): cm.estimate_frf(cm.simulate(TABLE1, noise(5.0, 8.0, seed), engine=engine), resolution=0.5)
        for engine, seed in (("links", 1), ("links", 2), ("mjx", 1))
    }
    links, other, mjx = (frf.functions for frf in frfs.values())
    assert np.all(rmse_db(links, mjx) < rmse_db(links, other) / 4)


def cases(count):
    """Rigs, excitations and laws that differ in gap, shaft, level, duration, seed, k and c."""
    rng = np.random.default_rng(0)
    for i in range(count):
        bushings = [dataclasses.replace(b, gap=rng.uniform(2e-4, 4e-4)) for b in TABLE1.bushings]
        beam = dataclasses.replace(TABLE1.beam, diameter=8.6e-3 + 1e-5 * (i % 3))
        law = cm.ConstantLaw(rng.uniform(7e3, 8e3, 2), rng.uniform(3.0, 5.0, 2))
        yield TABLE1.replace(beam=beam, bushings=tuple(bushings)), noise(rng.uniform(2, 6), 0.1 + 0.05 * i, i), law


def test_many_cases_at_once_are_each_alone():
    """Also where they end at different times; sums of many differ from those of one by rounding."""
    columns = [list(column) for column in zip(*cases(5))]
    for response, rig, excitation, law in zip(simulate_batch(*columns, engine="mjx"), *columns):
        alone = cm.simulate(rig, excitation, law, "mjx")
        assert response.acceleration.shape == (8, excitation.value.size) and alone.contact_force.any()
        assert furthest(response, alone) < 1e-6
        assert response.provenance == alone.provenance


def test_a_case_that_diverges_stops_no_other_one():
    columns = [list(column) for column in zip(*cases(3))]
    columns[1][1] = noise(1e9)
    with pytest.raises(ClearanceError, match="rig 'table1': the mjx simulation diverged at t"):
        simulate_batch(*columns, engine="mjx")
    plan = Plan(
        TABLE1, (Vary("excitation.rms", (2.0, 1e9)), Vary("rig.bushings.gap", (2e-4, 3e-4))),
        excitation={"generator": "random", "duration": 2.0, "fs": FS, "band": [5, 220]}, outputs=Outputs(frf=(8,)),
        engine=cm.engines.get_engine("mjx"), design=Design(),
    )  # fmt: skip
    links = dataclasses.replace(plan, engine=cm.engines.get_engine("links"))
    for case, outcome in enumerate(plan.evaluate_all(range(4))):
        reference = links.evaluate(case)
        if isinstance(reference, str):
            assert "diverged" in outcome
            continue
        np.testing.assert_allclose(outcome["acceleration_rms"], reference["acceleration_rms"], rtol=0.02)
        np.testing.assert_allclose(outcome["natural_frequency"], reference["natural_frequency"])


@pytest.mark.parametrize(("rig", "law", "message"), [
    (SPACE.replace(gravity=(0.0, 0.0, -9.81)), None, "rig 'table1': the mjx engine does not simulate gravity; use"),
    (with_bushings(SPACE, friction=Friction(0.1)), None, r"friction at bushings\[0\]; use links"),
    (TABLE1, cm.ContactLaw(KelvinVoigt(8e3, 4.0, adhesion=True)), "the mjx engine cannot simulate adhesion"),
    (TABLE1, cm.ContactLaw(HuntCrossley(2e6, 0.4), grease=MaxwellSlip((2e3, 900.0), (0.3, 0.5), 500.0, 2.0)),
    r"JAX cannot trace its laws \(.*HuntCrossley.*MaxwellSlip"),
], ids=["gravity", "friction", "adhesion", "a law with branches"])  # fmt: skip
def test_refusals(rig, law, message):
    with pytest.raises(ClearanceError, match=message):
        cm.simulate(rig, noise(1.0), law, "mjx")
