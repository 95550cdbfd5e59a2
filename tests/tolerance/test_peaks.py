"""Impacts per second and the largest value of an hour, predicted from a record."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.engines import static_equilibrium
from clearance_mj.report.peaks import summary_lines
from clearance_mj.tolerance.peaks import noise_of, peaks_over_an_hour

from ..refusals import assert_refused

RIG = cm.Rig.load("models/table1_rig.toml")
SHAPE = cm.PSD([5.0, 20.0, 80.0, 220.0], [0.5, 1.0, 1.0, 0.2])
FREQUENCY = np.arange(5.0, 220.0, 0.01)


def spread_and_rate(density):
    """Standard deviation of a Gaussian motion of this spectral density, and its upward crossings of zero, 1/s."""
    spread = np.sqrt(density.sum(axis=-1) * 0.01)
    return spread, np.sqrt((density * FREQUENCY**2).sum(axis=-1) * 0.01) / spread


def test_without_contact_it_is_rices_largest_value():
    """A linear rig: its acceleration is Gaussian, and crosses a level u > 0 upwards ν exp(-u²/2σ²) times a second.

    σ² and ν are moments of its spectrum |H|² S (S. O. Rice, 1945). With crossings both ways that are independent, the
    largest of T has the median σ √(2 ln(2νT/ln 2)); clusters of a narrow band make it a little less.
    """
    rig, psd = RIG.with_gap(0.1), SHAPE.scaled(1.0)
    spread, rate = spread_and_rate(np.abs(cm.beam.linear_frf(rig, FREQUENCY)) ** 2 * psd.at(FREQUENCY))
    rice = spread * np.sqrt(2 * np.log(2 * rate * 3600 / np.log(2)))
    peaks = [peaks_over_an_hour(rig, psd, seed=seed, quantity="acceleration") for seed in range(5)]
    assert np.mean([(each.interval[:, 0] <= rice) & (rice <= each.interval[:, 1]) for each in peaks]) >= 0.9
    ratio = np.mean([each.median for each in peaks], axis=0) / rice
    assert ratio[:7] == pytest.approx(np.ones(7), abs=0.1)
    assert ratio[7] == pytest.approx(1.0, abs=0.2)  # the tip, whose lowest mode has a damping ratio of 1.6 %
    assert not peaks[0].impacts_per_second.any() and peaks[0].impact_probability.max() < 1e-6


def test_a_shaft_that_rests_leaves_its_wall_as_often_as_rice_says():
    """On its wall the rig is linear: it lifts once the motion there, of moments as above, is its static penetration.

    At the level at which that is as likely as not within an hour, at half and at twice of it.
    """
    bushing = dataclasses.replace(RIG.bushings[0], length=0.0, gap=1e-5, grease=cm.rig.Grease(0.0))
    rig = RIG.replace(bushings=(bushing,), gravity=(0.0, 0.0, -9.81))
    spring = cm.rig.Grease(bushing.contact.stiffness, bushing.contact.damping)
    held = dataclasses.replace(bushing, gap=0.1, grease=spring)
    sensor = cm.rig.Sensor(1, bushing.position)
    of_wall = cm.beam.linear_frf(rig.replace(bushings=(held,), sensors=(sensor,)), FREQUENCY)[0]
    psd = SHAPE.scaled(1.0)
    spread, rate = spread_and_rate(np.abs(of_wall - 1) ** 2 * psd.at(FREQUENCY) / (2 * np.pi * FREQUENCY) ** 4)
    pressed = -static_equilibrium(rig).displacement[0] - bushing.gap
    level = pressed / (spread * np.sqrt(2 * np.log(rate * 3600 / np.log(2))))
    halfway = [peaks_over_an_hour(rig, psd.scaled(level), seed=seed) for seed in range(5)]
    assert np.mean([each.impact_probability for each in halfway]) == pytest.approx(0.5, abs=0.25)
    quiet, loud = (peaks_over_an_hour(rig, psd.scaled(factor * level)) for factor in (0.5, 2.0))
    assert quiet.rests.all() and not quiet.impacts_per_second.any() and quiet.impact_probability[0] < 0.1
    assert "rests against its wall" in str(quiet)
    assert "leaves the wall against which it rests" in summary_lines(quiet)[1]
    assert not loud.rests.any() and loud.impacts_per_second[0] > 0.1 and loud.impact_probability[0] > 0.999


def test_force_and_penetration_of_a_rattling_rig_fit_each_other():
    """Contact of 7800 N/m: in the slow motion of this rig the damper adds less than a third to the spring's force."""
    psd = SHAPE.scaled(4.0)
    force = peaks_over_an_hour(RIG, psd, duration=20.0, seed=1, limit=1.0)
    depth = peaks_over_an_hour(RIG, psd, duration=20.0, seed=1, quantity="penetration")
    ratio = force.observed / (7.8e3 * depth.observed)
    assert (ratio > 0.95).all() and (ratio < 1.35).all()
    assert force.duration == depth.duration == 20.0 and force.impacts == depth.impacts
    assert force.rows == force.clearances == ("6:+Z", "7:+Z") and force.unit == "N"
    assert (force.impact_probability > 0.999).all() and (force.exceeded > 0.9).all()
    assert (force.observed < force.median).all()  # an hour is 180 such records


def test_another_engine_finds_the_same_impacts():
    """MuJoCo's flexible links against the compiled modes: as many contacts, forces within 1 %."""
    given = {"duration": 2.0, "settling": 1.0}
    links, modal = (peaks_over_an_hour(RIG, SHAPE.scaled(4.0), engine=name, **given) for name in ("links", "modal"))
    assert links.impacts_per_second.tolist() == modal.impacts_per_second.tolist()
    assert links.observed == pytest.approx(modal.observed, rel=0.01)


def test_a_rotor_in_a_round_clearance_is_as_its_response():
    rig = cm.Rig.load("models/rotor.toml")
    soft = cm.Contact(2e6, 50.0)  # impacts so long that a response of 2048 samples per second holds them whole
    bushing = dataclasses.replace(rig.bushings[0], gap=2e-4, contact=soft)
    rig, noise = rig.replace(bushings=(bushing,)), noise_of(SHAPE.scaled(20.0), 2.0, 1)
    peaks = peaks_over_an_hour(rig, noise, quantity="penetration", settling=0.0)
    y, z = cm.simulate(rig, noise, engine="modal").displacement
    depth = np.hypot(y, z + bushing.offset) - bushing.gap
    assert peaks.observed[0] == pytest.approx(depth.max(), rel=0.01)  # of the steps, and of the filtered response


def test_an_excitation_that_is_given_is_the_noise_of_its_psd():
    psd = SHAPE.scaled(2.0)
    noise = noise_of(psd, 8.0, 4)
    assert noise.fs == 2048.0 and noise_of(cm.PSD([5, 900], [1, 1]), 1.0, 0).fs == 4096.0
    a, b = peaks_over_an_hour(RIG, psd, duration=3.0, seed=4), peaks_over_an_hour(RIG, noise)
    assert a == b and "impacts per second" in str(a) and "7:+Z" in str(a)


def test_few_impacts_are_said_to_be_too_few():
    peaks = peaks_over_an_hour(RIG, SHAPE.scaled(0.3), duration=5.0, limit=1.0)
    assert np.isnan(peaks.median[0]) and np.isnan(peaks.exceeded[0]) and peaks.largest[0].peaks == 0
    assert peaks.impact_probability[0] < 0.1
    assert "0 peaks: too few" in [text.get_text() for ax in peaks.plot().axes for text in ax.texts]


def test_figure_shows_every_row_and_the_limit():
    figure = peaks_over_an_hour(RIG, SHAPE.scaled(4.0), duration=5.0, limit=2.0).plot()
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["6:+Z", "7:+Z"]
    assert {ax.get_xlabel() for ax in figure.axes} == {"Contact force (N)"}
    assert all([2.0, 2.0] in [list(line.get_xdata()) for line in ax.lines] for ax in figure.axes)


@pytest.mark.parametrize(("changed", "words"), [
    ({"quantity": "noise"}, 'quantity "noise" is unknown; use contact_force, penetration, acceleration'),
    ({"hours": 0.0}, "hours 0.0: must be > 0"),
    ({"limit": -1.0}, "limit -1.0: must be >= 0 N"),
    ({"duration": 0.5}, "less than a second of the excitation is left after settling"),
    ({"seed": -1}, "seed -1: must be a whole number >= 0"),
])  # fmt: skip
def test_refuses_in_one_line(changed, words):
    options = {"duration": 2.0, "settling": 0.0} | changed
    assert words in assert_refused(cm.ClearanceError, None, peaks_over_an_hour, RIG, SHAPE, **options)
