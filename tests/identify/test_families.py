"""Families of laws and their fits to forces along a motion. Forces are computed here, by formulae of their own."""

import dataclasses

import numpy as np
import pytest

from clearance_mj.clearance import ContactLaw
from clearance_mj.clearance.family import CONTACT_FAMILIES, FILLING_FAMILIES
from clearance_mj.clearance.greases.maxwell_slip import slip_start
from clearance_mj.estimate.parameter import Parameter
from clearance_mj.identify.forces.restoring import RestoringForce
from clearance_mj.identify.laws.comparison import fit_families, fit_from_rival
from clearance_mj.identify.laws.force_fit import fit_force
from clearance_mj.identify.laws.measured_motion import MeasuredMotion
from clearance_mj.rig import Bushing, Contact, Grease

from ..conftest import TABLE1

FS, SECONDS, FINE = 2048.0, 5.0, 8
GAP, OFFSET = 3.3e-4, 6e-5  # of the truth; the rig file says 0.3 mm and 0
NOMINAL = Bushing(0.5, 3e-4, 0.012, Grease(4000.0, 2.0), Contact(1e4, 2.0))
RIG = TABLE1.replace(bushings=(NOMINAL,))
K, C, HEIGHT = 3500.0, 3.0, 9e-4  # of the grease
GAPS = [
    Parameter("bushings[0].gap", "m", 3e-4, 1e-4, 9e-4, 0.2),
    Parameter("bushings[0].offset", "m", 0.0, -2.7e-4, 2.7e-4, 9e-5, "linear"),
]


# What families make.


@pytest.mark.parametrize("gap", [1e-4, 3e-4])
def test_a_power_law_has_its_force_at_one_gap(gap):
    contact = CONTACT_FAMILIES["power law"].make(dataclasses.replace(NOMINAL, gap=gap), 2.5, 4.0, 1.7)
    assert contact.force(gap, 0.0) == pytest.approx(2.5, rel=1e-12)
    assert contact.force(2 * gap, 0.0) == pytest.approx(2.5 * 2**1.7, rel=1e-12)
    assert contact.force(gap, 0.05) == pytest.approx(2.5 * (1 + 4.0 * 0.05), rel=1e-12)


def test_linear_and_cubic_contacts_are_springs_and_dampers():
    linear = CONTACT_FAMILIES["linear"].make(NOMINAL, 8e3, 5.0)
    cubic = CONTACT_FAMILIES["linear + cubic"].make(NOMINAL, 8e3, 5.0, 9e10, 2.0)
    assert linear.force(2e-4, 0.1) == pytest.approx(8e3 * 2e-4 + 0.5, rel=1e-12)
    assert cubic.force(2e-4, 0.1) == pytest.approx((8e3 * 2e-4 + 9e10 * 2e-4**3) * 1.2 + 0.5, rel=1e-12)


def test_the_elements_of_maxwell_slip_slide_from_their_displacements_on():
    springs, yields = (400.0, 300.0, 200.0, 100.0), (2e-5, 6e-5, 1e-4, 3e-4)
    grease = FILLING_FAMILIES["Maxwell-slip"].make(NOMINAL, K, C, HEIGHT, *yields, *springs)
    np.testing.assert_allclose(np.divide(grease.forces, grease.springs), yields, rtol=1e-12)
    assert grease.small_motion() == (pytest.approx(K + 1000.0), C)
    falling = FILLING_FAMILIES["Maxwell-slip, Stribeck"].make(NOMINAL, 0.4, 0.02, K, C, HEIGHT, *yields, *springs)
    assert (falling.static_ratio, falling.stribeck_speed, falling.forces) == (1.4, 0.02, grease.forces)


def test_bouc_wen_ends_at_its_yield_displacement():
    """z tends to (A / (β + γ))^(1/n) with A = 1."""
    grease = FILLING_FAMILIES["Bouc-Wen"].make(NOMINAL, K, C, HEIGHT, 0.7, 1.5e-4, 1.6, 0.8)
    assert grease.yield_displacement == pytest.approx(1.5e-4, rel=1e-12)
    assert grease.beta / (grease.beta + grease.gamma) == pytest.approx(0.8, rel=1e-12)


@pytest.mark.parametrize("contact", CONTACT_FAMILIES.values(), ids=lambda family: family.name)
@pytest.mark.parametrize("grease", FILLING_FAMILIES.values(), ids=lambda family: family.name)
def test_bounds_and_starts_make_laws(contact, grease):
    parameters = [*contact.parameters(NOMINAL), *grease.parameters(NOMINAL)]
    for end in ("low", "start", "high"):
        values, n = [getattr(p, end) for p in parameters], len(contact.parameters(NOMINAL))
        law = ContactLaw(contact.make(NOMINAL, *values[:n]), grease.make(NOMINAL, *values[n:]))
        assert isinstance(law, ContactLaw)
    assert all(p.low < p.start < p.high and p.prior_std > 0 for p in parameters)


# Fits.


def shaken(level, seed, seconds):
    """Displacements (3, n) of middle and ends, m, and velocities, at FINE x FS: random from 5 to 150 Hz, rising."""
    n = int(seconds * FS)
    rng = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(n, 1 / FS)
    spectrum = (rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size)) / (1 + frequency / 20)
    spectrum[(frequency < 5) | (frequency > 150)] = 0
    x = np.fft.irfft(spectrum)
    time = np.arange(n) / FS
    flanks = np.clip(np.minimum(time, time[-1] - time) / 0.1, 0, 1)
    x *= np.sin(0.5 * np.pi * flanks) ** 2 * (0.1 + 0.9 * time / seconds)
    x *= level / np.abs(x).max()
    points = np.fft.rfft(x * np.array([[1.0], [0.97], [1.03]]))
    return [np.fft.irfft(s, n * FINE) * FINE for s in (points, 1j * (2 * np.pi * frequency) * points)]


def recorded(x, v, force, noise=0.0):
    """What `restoring_force` would say of a force at FINE x FS."""
    n = x.shape[1] // FINE
    high = 0.4 * FS
    frequency = np.arange(0, high, FS / n)
    spectrum = np.fft.rfft(force)[: frequency.size] / FINE
    rng = np.random.default_rng(5)
    spectrum += noise * np.sqrt(n / 2) * (rng.standard_normal((2, frequency.size)).T @ [1, 1j])
    slow = np.zeros(n // 2 + 1, dtype=complex)
    slow[: frequency.size] = spectrum
    time = np.arange(n) / FS
    return RestoringForce(
        "shaken", RIG, FS, (0.0, high), time, x[:1, ::FINE], v[:1, ::FINE], np.fft.irfft(slow)[None],
        np.array([noise + 1e-9]), np.zeros(1), x[None, 1:, ::FINE], (time > 0.3) & (time < time[-1] - 0.3),
        frequency, np.full((1, frequency.size), (noise + 1e-9) * np.sqrt(2 / FS)), np.zeros(0),
    )  # fmt: skip


def wall_force(x, v, force):
    """Half of a contact at each end, never pulling; force of penetration and speed."""
    total = np.zeros(x.shape[1])
    for place, speed in zip(x[1:] + OFFSET, v[1:]):
        for side in (1.0, -1.0):
            depth = side * place - GAP
            total += side * 0.5 * np.where(depth > 0, np.maximum(force(np.maximum(depth, 0), side * speed), 0), 0)
    return total


def film(x, v):
    return C * v[0] / np.maximum(1 - np.abs(x[0] + OFFSET) / HEIGHT, 0.2) ** 2


def sliding(x, springs, yields):
    """Force of springs in series with sliders."""
    z, force = np.zeros(len(springs)), np.empty(x.shape[1])
    for i, dx in enumerate(np.diff(x[0], prepend=0.0)):
        z = np.minimum(np.maximum(z + dx, -yields), yields)
        force[i] = springs @ z
    return force


CONTACT_FORCES = {
    "linear": lambda depth, speed: 9e3 * depth + 4.0 * speed,
    "power law": lambda depth, speed: 3.0 * (depth / 3e-4) ** 1.8 * (1 + 3.0 * speed),
    "linear + cubic": lambda depth, speed: 5e3 * depth + 1.5e11 * depth**3 + 4.0 * speed,
}


def motion(rig, contact, slips=False, level=1e-3, noise=2e-3, records=(SECONDS,), low=0.0):
    bands = []
    for seed, seconds in enumerate(records, 1):
        x, v = shaken(level, seed, seconds)
        force = K * x[0] + film(x, v) + wall_force(x, v, CONTACT_FORCES[contact])
        if slips:
            force += sliding(x, np.full(4, 500.0), 3e-4 * np.array([0.1, 0.3, 0.7, 1.4]))
        spectrum = np.fft.rfft(force)
        spectrum[: int(np.ceil(low * seconds))] = 0
        whole = recorded(x, v, np.fft.irfft(spectrum), noise)
        bands.append(dataclasses.replace(whole, band=(low, whole.band[1])))
    return MeasuredMotion(bands, rig.replace(bushings=(NOMINAL,)), 0, GAPS)


@pytest.mark.parametrize("name", CONTACT_FORCES)
def test_gap_offset_and_stiffness_are_those_of_the_force(rig, name, measured):
    fit = fit_force(motion(rig, name), CONTACT_FAMILIES[name], FILLING_FAMILIES["linear"])
    value = dict(zip(fit.estimates.names, fit.estimates.value))
    of = f"of a {name} contact, from forces along a motion"
    measured.equal(f"gap {of} (m)", fit.bushing.gap, GAP, "prescribed", rel=3e-3)
    measured.equal(f"offset {of} (m)", fit.bushing.offset, OFFSET, "prescribed", abs=1e-6)
    measured.equal(f"force at 0.3 mm {of} (N)", fit.law.contact[0].force(3e-4, 0), CONTACT_FORCES[name](3e-4, 0),
                   "prescribed", rel=0.01)  # fmt: skip
    assert value["grease stiffness"] == pytest.approx(K, rel=2e-3)
    assert value["grease damping"] == pytest.approx(C, rel=0.01)
    assert value["grease film height"] == pytest.approx(HEIGHT, rel=0.02) and fit.misfit < 0.1


PREFERRED = [pytest.param("linear", False, marks=pytest.mark.slow), ("power law", True)]


@pytest.mark.parametrize(("contact", "slips"), PREFERRED)
def test_the_family_that_made_the_forces_is_preferred(rig, contact, slips):
    families = fit_families(motion(rig, contact, slips))
    assert families[0].contact == contact
    assert families[0].grease == ("Maxwell-slip" if slips else "linear")
    assert families[0].weight > 0.9 and sum(f.weight for f in families) == pytest.approx(1.0)
    assert max(families[0].misfit, families[0].held_out) < 0.1


def test_a_fit_that_misses_more_than_a_rival_begins_again_from_there(rig):
    """Contact linear + cubic holds the linear one that made the forces, so it need not miss more."""
    here, grease = motion(rig, "linear"), FILLING_FAMILIES["linear"]
    rival = fit_force(here, CONTACT_FAMILIES["linear"], grease)
    fit = fit_force(here, CONTACT_FAMILIES["linear + cubic"], grease)
    wrong = dataclasses.replace(fit.bushing, gap=1.3 * GAP)
    stuck = dataclasses.replace(fit, bushing=wrong, misfit=2 * rival.misfit)
    assert fit_from_rival(here, stuck, rival).bushing.gap == pytest.approx(GAP, rel=3e-3)
    assert fit_from_rival(here, dataclasses.replace(fit, misfit=rival.misfit), rival).point is fit.point


def test_what_never_met_a_wall_keeps_its_prior_and_a_gap_beyond_its_reach(rig):
    fit = fit_force(motion(rig, "linear", level=2.4e-4), CONTACT_FAMILIES["linear"], FILLING_FAMILIES["linear"])
    value, std = fit.estimates.value, fit.estimates.varied_std
    gap, _, k, *_ = fit.estimates.parameters
    assert value[2] == pytest.approx(k.start, rel=1e-3)
    assert std[2] == pytest.approx(k.prior_std, rel=0.05)
    ends = shaken(2.4e-4, 1, SECONDS)[0][1:]
    assert gap.low == pytest.approx(0.5 * (ends.max() - ends.min()), rel=1e-3)
    assert fit.estimates.interval(0.99)[0, 0] == pytest.approx(gap.low)
    assert fit.estimates.draw(50)[:, 0].min() == pytest.approx(gap.low)
    assert np.isfinite(fit.log_evidence(fit.correlation_length))


def test_several_short_records_are_enough(rig):
    """1.25 s of which 0.3 s at both ends do not count, and a part is held out."""
    of_records = motion(rig, "linear", records=(1.25, 1.5, 1.25))
    fit = fit_force(of_records, CONTACT_FAMILIES["linear"], FILLING_FAMILIES["linear"])
    assert fit.bushing.gap == pytest.approx(GAP, rel=3e-3)
    assert fit.bushing.offset == pytest.approx(OFFSET, abs=1e-6) and fit.held_out < 0.1
    assert of_records.fitted.size + of_records.held_out.size == pytest.approx((0.65 + 0.9 + 0.65) * FS / 2, abs=6)


def test_forces_that_are_not_known_at_rest_still_tell_gap_and_offset(rig):
    """Without what is below 2 Hz, as of records without probes."""
    of_record = motion(rig, "linear", low=2.0)
    fit = fit_force(of_record, CONTACT_FAMILIES["linear"], FILLING_FAMILIES["linear"])
    assert fit.bushing.gap == pytest.approx(GAP, rel=3e-3)
    assert fit.bushing.offset == pytest.approx(OFFSET, abs=1e-6)
    spectrum = np.abs(np.fft.rfft(of_record.forces([fit.case])[:, 0]))
    assert spectrum[: int(2.0 * SECONDS)].max() < 1e-9 * spectrum.max()


class Forceless:
    """A record in which no filling shows."""

    def in_gap(self, bushing, fillings):
        return np.random.default_rng(1).standard_normal((400, len(fillings))), np.zeros(400)


@pytest.mark.parametrize("stiffness", [4000.0, 0.0])
def test_a_search_begins_somewhere_where_neither_the_record_nor_the_rig_file_knows_a_grease(stiffness):
    """Springs have logarithms: a thousandth of the file's, or of a tenth of the contact's where it has none."""
    start = slip_start(dataclasses.replace(NOMINAL, grease=Grease(stiffness)), Forceless())
    assert all(np.isfinite(value) and value > 0 for value in start.values())
    assert start["grease stiffness"] == pytest.approx(1e-3 * (stiffness or 0.1 * NOMINAL.contact.stiffness))
