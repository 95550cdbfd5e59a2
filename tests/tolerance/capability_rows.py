"""Rows of docs/capabilities.md about productions, hours of random excitation, wear and sound: what each is held to."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj import Excitation, Plate, Sensor
from clearance_mj.engines import static_equilibrium
from clearance_mj.sound import radiate
from clearance_mj.tolerance import Runner, Scatter, Scattered, Sines, peaks_over_an_hour, production, tighten
from clearance_mj.tolerance.random_designs import Noise, random_production
from clearance_mj.tolerance.scatter import draw_designs
from clearance_mj.wear import Marched, Sine, predict_life
from tests.periodic.capability_rows import excited, kind_of, weightless

FS, ALONE = 4096.0, Runner(1)
AT = {"teeth": (150.0, (0.2, 0.5, 0.8, 2.0)), "film": (40.0, (5.0, 10.0, 20.0, 40.0))}
"""Frequency, Hz, and levels, N or N m"""
GAPS = Scatter((Scattered("bushings.gap", within="15 %"), Scattered("structure.material.young_modulus", within="4 %")))
BAND = cm.PSD([8.0, 120.0], [1.0, 1.0], "force")
RMS = {"teeth": 0.5}


def shaken(rig):
    """The rig under its shaker alone; in a round clearance without its weight, under which it slides."""
    return excited(rig, **weightless(rig) if kind_of(rig) == "round" else {})


def case(rig):
    """The model, the frequency, and the levels."""
    return (cm.Model(shaken(rig)), *AT.get(kind_of(rig), (20.0, (3.0, 6.0, 12.0, 24.0))))


def hits(model, frequency, level):
    """Whether a sine whose level rises over forty periods, and then stays for twenty, makes the shaft hit a wall."""
    time = np.arange(round(60 * FS / frequency)) / FS
    ramp = np.minimum(time * frequency / 40, 1.0)
    sine = Excitation(level * ramp * np.sin(2 * np.pi * frequency * time), FS, "force", band=(1.0, 2 * frequency))
    response, at_rest = cm.simulate(model, sine, engine="modal"), static_equilibrium(model).displacement
    for bushing, rows in zip(model.rig.bushings, model.rig.clearance_rows):
        depth = depths(bushing, response.displacement[rows])
        rests = depths(bushing, np.atleast_2d(at_rest[rows]).T)[0] > 0
        if (depth.min() < 0) if rests else (depth.max() > 0):
            return True
    return False


def depths(bushing, moved):
    if bushing.is_round:
        return np.hypot(moved[0] + bushing.offset_y, moved[1] + bushing.offset) - bushing.gap
    lower, upper = bushing.walls
    return np.maximum(moved[0] - upper, lower - moved[0])


def shares(rig):
    """Each design is marched 4 % below and above the level from which on it hits a wall."""
    model, frequency, levels = case(rig)
    outcome = production(model, GAPS, Sines(levels, [frequency]), 3, runner=ALONE)
    designs = draw_designs(model, GAPS, 3)
    assert outcome.unknown.max() == 0 and np.isfinite(outcome.first_from_rest).all()
    assert any("rests against its wall" in note for note in outcome.notes) == (kind_of(rig) not in ("round", "film"))
    np.testing.assert_array_equal(outcome.from_rest[:, 0], outcome.over_level("from_rest"))
    for i, level in enumerate(outcome.first_from_rest):
        assert [hits(designs.model(i), frequency, factor * level) for factor in (0.96, 1.04)] == [False, True]


def tightened(rig):
    """A production drawn anew with the tightened gap hits as often as was allowed, within its interval."""
    model, frequency, levels = case(rig)
    number = "bushings.contact.stiffness" if kind_of(rig) == "teeth" else "structure.material.young_modulus"
    scatter = Scatter((Scattered(number, within="15 %"),))
    first = production(model, scatter, Sines(levels, [frequency]), 32, runner=ALONE).first_from_rest
    level = float(np.quantile(first, 0.3))
    tightening = tighten(model, scatter, Sines([level], [frequency]), 0.1, 32, runner=ALONE)
    assert tightening.share == pytest.approx(0.3, abs=0.07) and 0 < tightening.width[0] < 1
    narrowed = scatter.narrowed({number: tightening.width[0]})
    anew = production(model, narrowed, Sines([level], [frequency]), 64, seed=5, runner=ALONE)
    low, high = anew.interval(anew.over_level())[:, 0]
    assert low <= 0.1 <= high


def peaks(rig):
    """As many impacts as by `links`, and forces as large."""
    given, engines = (shaken(rig), BAND.scaled(RMS.get(kind_of(rig), 15.0)), 1.0), ("links", "modal")
    links, modal = (peaks_over_an_hour(*given, settling=0.5, engine=engine) for engine in engines)
    assert modal.impacts_per_second.sum() > 0
    np.testing.assert_allclose(modal.impacts_per_second, links.impacts_per_second, rtol=0.05)
    np.testing.assert_allclose(modal.observed, links.observed, rtol=0.02)


def random_shares(rig):
    """Designs side by side are as each alone under the same noise."""
    model, psd = case(rig)[0], BAND.scaled(RMS.get(kind_of(rig), 15.0))
    designs = draw_designs(model, GAPS, 3)
    (by_design,) = random_production(designs, Noise(psd, [psd.rms], 3.0), runner=ALONE)
    for i, each in enumerate(by_design.by_design):
        alone = peaks_over_an_hour(designs.model(i), psd, 3.0, seed=[0, 0])
        np.testing.assert_allclose(each.impacts_per_second, alone.impacts_per_second, rtol=1e-6)
        np.testing.assert_allclose(each.median, alone.median, rtol=1e-4)


def life(rig):
    """What rubs at the begin of a life under a sine is what a march under the same sine rubs."""
    wears = {"wear": 1e-15, "length": 0.01, "radius": 7e-3}
    bushings = (
        b if kind_of(rig.replace(bushings=(b,))) == "teeth" else dataclasses.replace(b, **wears) for b in rig.bushings
    )
    model, frequency, levels = case(rig.replace(bushings=tuple(bushings)))
    march = cm.excitation.stepped_sine(400 / frequency, 8192.0, frequency, levels[-1], "force")
    drives = Sine(frequency, levels[-1]), Marched(march, 350 / frequency)
    rubbing, known = (predict_life(model, each, "x2", hours=1e-3).rubbing[0] for each in drives)
    assert rubbing.max() > 0
    np.testing.assert_allclose(rubbing, known, rtol=0.02, atol=0.02 * rubbing.max())


def sound(rig):
    """p = ρc v √(S / (2π)) / r of a plate that moves as the shaft's end does (Fahy and Gardonio, 2007)."""
    plate, end = Plate(9, 0.02, 1.0), Sensor(9, rig.structure.sections[0].length)
    model = cm.Model(excited(rig, sensors=(end,), plate=plate))
    noise = cm.excitation.random(2.0, 16384.0, band=(30, 200), rms=15.0, seed=1, kind="force")
    response = cm.simulate(model, noise, engine="modal")
    frequency = np.fft.rfftfreq(response.time.size, 1 / 16384.0)
    lines = frequency > 20
    lines_of_speed = np.fft.rfft(response.acceleration[0])[lines] / (2 * np.pi * frequency[lines])
    speed = np.sqrt(2 * np.sum(np.abs(lines_of_speed) ** 2)) / response.time.size
    heard = radiate(response, model.rig).pressure
    assert np.sqrt(np.mean(heard**2)) == pytest.approx(413.2 * speed * np.sqrt(0.02 / (2 * np.pi)), rel=0.02)


ROWS = {
    "production over level and frequency": (shares, "time integration of each design 4 % below and above its level"),
    "tightening of tolerances": (tightened, "production of the tightened designs, within its interval"),
    "production under random excitation": (random_shares, "each design alone, 1e-4"),
    "peaks over an hour": (peaks, "impacts of `links` 5 %, largest force 2 %"),
    "life under a sine": (life, "time integration by `modal`, 2 %"),
    "sound of a plate": (sound, "formula of a baffled piston, 2 %"),
}
SLOW = ("tightening of tolerances", "production under random excitation", "life under a sine", "peaks over an hour")
