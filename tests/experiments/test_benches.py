"""The virtual benches' simulator against closed forms, and their datasets as the package reads them."""

import dataclasses
import tomllib

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from clearance_mj import ContactLaw, Dataset, Grease, excitation, simulate
from clearance_mj.clearance import Cubic, HuntCrossley1975, MaxwellSlip
from clearance_mj.signals.channel_check import check_channel
from experiments.benches import make, motion, physics, records
from experiments.benches.bench import CONTACTS, GREASES, IGNORANCES, NAMED, Instrument, find_bench, known, make_bench
from experiments.benches.records import FS, shake
from experiments.benches.shaft import Clamp, Shaft, Strip
from experiments.script import run

STEEL = Shaft(1.0, 0.0086, 210e9, 7850.0, (), None, (0.01,))
EI, RHO_A = STEEL.bending_stiffness, STEEL.mass_per_length
KELVIN_VOIGT = (2e4, 1.0, 0.0, 0.0, 3.0)


@pytest.mark.parametrize("rotation, translation, mass", [(5.0, 100.0, 0.0), (0.3, 20.0, 0.4), (50.0, 2e4, 1.2)])
def test_frequencies_on_an_elastic_clamp(rotation, translation, mass):
    """A beam with kr and kt at x = 0 and a mass at its end: four conditions on sin, cos, sinh, cosh of λx.

    w''(0) = R w'(0), w'''(0) = -T w(0), w''(1) = 0, w'''(1) = -μ λ⁴ w(1), with R = kr l/EI, T = kt l³/EI,
    μ = m/(ρ A l).
    """

    def determinant(z):
        s, c, sh, ch = np.sin(z), np.cos(z), np.sinh(z), np.cosh(z)
        clamp = [[-rotation * z, -(z**2), -rotation * z, z**2], [-(z**3), translation, z**3, translation]]
        end = [[-s, -c, sh, ch], [-c + mass * z * s, s + mass * z * c, ch + mass * z * sh, sh + mass * z * ch]]
        return np.linalg.det(np.array(clamp + end)) / ch**2

    grid = np.linspace(0.2, 14, 4000)
    values = np.array([determinant(z) for z in grid])
    changes = np.flatnonzero(values[:-1] * values[1:] < 0)[:4]
    roots = np.array([scipy.optimize.brentq(determinant, grid[i], grid[i + 1]) for i in changes])
    exact = roots**2 * np.sqrt(EI / RHO_A) / (2 * np.pi)
    shaft = STEEL.replace(clamp=Clamp(rotation * EI, translation * EI), masses=((1.0, mass * RHO_A),) if mass else ())
    np.testing.assert_allclose(shaft.frequencies(4), exact, rtol=1e-5)


@pytest.mark.parametrize("place, length", [(0.7, 0.2), (0.9, -0.2)])
def test_frequencies_of_a_strip_on_a_shaft_that_hardly_moves(place, length):
    """A cantilever's second frequency is 4.694091²/1.875104² of its first (Blevins, 1979, table 8-1)."""
    heavy = STEEL.replace(young_modulus=1e5 * STEEL.young_modulus, density=10 * STEEL.density)
    strips = heavy.replace(strips=(Strip(place, length, 1e-4, 40.0),)).frequencies(2)
    np.testing.assert_allclose(strips, [40.0, 40.0 * (4.694091 / 1.875104) ** 2], rtol=1e-3)


def test_a_short_strip_that_does_not_bend_is_its_mass():
    stiff, lumped = STEEL.replace(strips=(Strip(0.9, -0.01, 0.02, 3e4),)), STEEL.replace(masses=((0.895, 0.02),))
    np.testing.assert_allclose(stiff.frequencies(3), lumped.frequencies(3), rtol=1e-3)


def test_a_clamp_of_more_shaft_gives_as_that_shaft_does():
    clamp = Clamp.longer(EI, 0.006)
    assert 1 / clamp.rotation == pytest.approx(0.006 / EI)  # slope of a free end under a unit moment
    assert 1 / clamp.translation == pytest.approx(0.006**3 / (3 * EI))  # deflection under a unit force


def hole(**changes):
    nothing = {"contact": (1.0, 1.0, 0.0, 0.0, 0.0), "film": (physics.THINNING, 0.0, 1.0, 0.2), "elastic": 0.0}
    base = dataclasses.replace(NAMED["exact"]().holes[0], **nothing, slip=((), ()), offset=0.0)
    return dataclasses.replace(base, **changes)


def bench(*holes, clamp=None):
    parts = {"shaft": STEEL.replace(clamp=clamp), "probes": tuple(Instrument(h.position, 1.0) for h in holes)}
    return dataclasses.replace(NAMED["exact"](), holes=holes, **parts)


def rest(b):
    scheme = motion.scheme(dataclasses.replace(b, accelerometers=(Instrument(1.0, 1.0),)), 1e-4)
    return scheme, *motion.at_rest(scheme, b.bushings())


@pytest.mark.parametrize("side", [1, -1])
def test_static_preload_of_a_shaft_beyond_its_gap(side):
    """A beam pressed by k at x = a: F = k (|o| - gap) / (1 + k a²(3x - a)/(6 EI)), at x = a = 0.6 m."""
    b = bench(hole(position=0.6, length=0.0, gap=3e-4, offset=side * 5e-4, contact=KELVIN_VOIGT))
    scheme, state, bushings = rest(b)
    flexibility = 0.6**3 / (3 * EI)
    force = 2e4 * 2e-4 / (1 + 2e4 * flexibility)
    known = -side * force * np.array([flexibility, 0.6**2 * (3 - 0.6) / (6 * EI)])
    assert (bushings.rest[0], (scheme.accelerometers @ state.q)[0]) == pytest.approx(known, rel=1e-3)


@pytest.mark.slow
def test_a_preloaded_shaft_stays_at_rest():
    b = bench(hole(position=0.6, gap=3e-4, offset=5e-4, contact=KELVIN_VOIGT))
    accelerations, displacements = shake(b, np.zeros(400))
    assert np.abs(accelerations).max() < 1e-6 and np.abs(displacements).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("offset", [1e-4, -1e-4])
def test_contact_begins_at_gap_minus_and_plus_offset(offset):
    """A slow push both ways against stiff stops: the motion is limited to just beyond ±gap - offset."""
    b = bench(hole(position=0.6, length=0.0, gap=3e-4, offset=offset, contact=(1e7, 1.0, 0.0, 0.0, 50.0)))
    push = 1.5 * np.sin(2 * np.pi * 0.25 * np.arange(8192) / FS)  # quasi-static: the first mode is at 6 Hz
    _, moved = shake(b, push)
    assert (moved.max(), moved.min()) == pytest.approx((3e-4 - offset, -3e-4 - offset), abs=5e-6)


def test_maxwell_slip_loop_energy():
    """Each element that slides loses 4 W (X - W/k) in a cycle of amplitude X (Iwan 1966), with Coulomb friction W."""
    stiffness, yields = np.array([1e3, 2e3, 500.0]), np.array([1e-4, 3e-4, 2e-3])
    elements, amplitude = np.array([[stiffness, yields]]), 1e-3
    path = amplitude * np.sin(np.linspace(0, 4 * np.pi, 40001))
    before, after, force = np.zeros((1, 3)), np.zeros((1, 3)), np.zeros(path.size)
    for i in range(1, path.size):
        force[i], _ = physics.slip(path[i] - path[i - 1], 1.0, before, elements, np.array([[0.0, 1.0]]), after, 0)
        before[:] = after
    cycle = slice(20000, None)
    exact = np.sum(4 * stiffness * yields * (amplitude - yields), where=yields < amplitude)
    assert np.trapezoid(force[cycle], path[cycle]) == pytest.approx(exact, rel=1e-6)


def test_sliding_is_harder_at_low_speed():
    """Stribeck: a sliding element pulls k y (1 + s exp(-(v/v_s)²))."""
    elements, stribeck = np.array([[[1e3], [1e-4]]]), np.array([[0.5, 0.01]])
    for speed in (0.0, 0.01, 0.1):
        force, tangent = physics.slip(1.0, speed, np.zeros((1, 1)), elements, stribeck, np.zeros((1, 1)), 0)
        assert (force, tangent) == (pytest.approx(0.1 * (1 + 0.5 * np.exp(-((speed / 0.01) ** 2)))), 0.0)


@pytest.mark.parametrize("kind, limit", [(physics.JOURNAL, 0.0), (physics.THINNING, 0.3)])
def test_film_slopes_are_its_derivatives(kind, limit):
    film = np.array([[kind, 3.0, 1e-3, limit]])
    for x in (-6e-4, 2e-4):
        force, by_place, by_speed = physics.film(x, 0.2, film, 0)
        change = physics.film(x + 1e-9, 0.2, film, 0)[0] - physics.film(x - 1e-9, 0.2, film, 0)[0]
        assert by_place == pytest.approx(change / 2e-9, rel=1e-5) and by_speed == pytest.approx(force / 0.2)
    assert physics.film(0.0, 1.0, film, 0)[0] == 3.0


@pytest.mark.slow
def test_linear_bench_against_its_frequency_response():
    """Springs and dampers alone, k + i ω c at each point on the modes' receptance, under one tone of the base."""
    places, film = (0.5484, 0.7918), (physics.THINNING, 5.0, 1e9, 0.2)
    holes = (hole(position=x, gap=1.0, elastic=4000.0, film=film) for x in places)
    b = bench(*holes, clamp=Clamp.longer(EI, 0.01))
    frequency, n = 32.0, 8192
    response, _ = shake(b, np.sin(2 * np.pi * frequency * np.arange(n) / FS))
    window = slice(n - 2048, n - 512)
    value = 2j * np.mean(response[:, window] * np.exp(-2j * np.pi * frequency * np.arange(n) / FS)[window], axis=1)
    modes, omega = b.shaft.modes(places), 2 * np.pi * frequency
    rows = modes.at(places)
    dynamic = np.diag(modes.omega**2 - omega**2 + 2j * omega * modes.damping * modes.omega)
    q = np.linalg.solve(dynamic + rows.T @ rows * (4000 + 5j * omega), -modes.participation)
    exact = 1 - omega**2 * modes.at([i.position for i in b.accelerometers]) @ q
    np.testing.assert_allclose(value, exact, rtol=2e-3, atol=2e-3 * np.abs(exact).max())


@pytest.mark.slow
def test_step_size():
    """Half of the step changes motion that rattles by less than 1 % of its RMS, and its RMS by less than 0.05 %."""
    base = excitation.random(1.0, FS, rms=4.0, seed=3).value
    (first, coarse), (second, fine) = (shake(NAMED["all"](), base, factor=f) for f in (16, 32))
    scale = fine.std(axis=1)
    assert np.abs(fine).max() > 5e-4  # beyond the gap
    assert np.all(np.abs(fine - coarse).max(axis=1) < 0.01 * scale)
    np.testing.assert_allclose(first.std(axis=1), second.std(axis=1), rtol=5e-4)


def package_law(holes):
    """A family's contact and grease in the package's terms."""
    contacts, greases = [], []
    for h in holes:
        k, power, stiffening, dissipation, dashpot = h.contact
        contacts.append(Cubic(k, stiffening, dashpot) if power == 1.0 else HuntCrossley1975(k, k * dissipation, power))
        _, damping, height, limit = h.film
        film = {"damping": damping, "film_height": height, "film_limit": limit}
        if h.slip[0]:
            greases.append(MaxwellSlip(h.slip[0], tuple(k * y for k, y in zip(*h.slip)), h.elastic, **film))
        else:
            k, beta, gamma, exponent = h.bouc_wen
            shape = {"beta": beta, "gamma": gamma, "exponent": exponent}
            greases.append(Grease(h.elastic + k, elastic_ratio=h.elastic / (h.elastic + k), **shape, **film))
    return ContactLaw(contacts, greases)


@pytest.mark.slow
@pytest.mark.parametrize("family", ["power+bouc-wen", "cubic+maxwell-slip", "linear+linear"])
def test_a_family_moves_as_the_package_says(family):
    """Everything known and drawn at random, two independent simulators: the same motion, rattling."""
    drawn = known(find_bench(f"{family}+2", IGNORANCES))
    b = dataclasses.replace(drawn, probes=tuple(Instrument(h.position, 1.0) for h in drawn.holes))
    base = excitation.random(1.0, FS, rms=6.0, seed=5)
    _, moved = shake(b, base.value)
    other = simulate(b.rig, base, package_law(b.holes), "modal").displacement
    assert np.abs(moved).max() > 2 * b.holes[1].gap
    whole = slice(0, int(0.9 * FS))  # the end of a record rings in the filters
    assert np.all(np.abs(other - moved)[:, whole].max(axis=1) < 0.01 * moved.std(axis=1))
    np.testing.assert_allclose(other[:, whole].std(axis=1), moved[:, whole].std(axis=1), rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("grease", GREASES)
def test_families_lose_energy(contact, grease):
    """After a hit a bench comes to rest."""
    base = np.zeros(3072)
    base[100:112] = 200.0
    _, moved = shake(find_bench(f"{contact}+{grease}+1"), base, factor=8)
    assert np.abs(moved).max() > 3e-4 and np.abs(moved[:, -512:]).max() < 0.4 * np.abs(moved).max()


def test_each_ignorance_alone_is_part_of_all_together():
    known, everything = make_bench(5, ()), make_bench(5)
    assert known.holes[0].gap == known.rig.bushings[0].gap
    assert known.shaft.young_modulus == known.rig.beam.young_modulus and known.shaft.clamp is None
    for word, part in (("gaps", "holes"), ("sensors", "accelerometers"), ("linear", "shaft")):
        assert getattr(make_bench(5, (word,)), part) != getattr(known, part)
    assert make_bench(5, ("linear",)).shaft == everything.shaft
    assert make_bench(5, ("gaps",)).holes[1].gap == everything.holes[1].gap


@pytest.mark.slow
def test_draws_have_the_spread_of_the_priors():
    """Normal, cut at 2 σ: the standard deviation is 0.96 σ, of 300 draws within 8 % (2 standard errors)."""
    benches = [make_bench(seed) for seed in range(300)]
    nominal = benches[0].rig
    spreads = {
        0.03: [b.shaft.young_modulus / nominal.beam.young_modulus for b in benches],
        0.01: [b.accelerometers[2].gain for b in benches],
        0.05: [b.shaft.masses[0][1] / nominal.masses[0].mass for b in benches],
        0.2: [b.holes[1].gap / nominal.bushings[1].gap for b in benches],
        0.3: [b.holes[0].offset / b.holes[0].gap for b in benches],
        2e-3: [b.holes[0].position - nominal.bushings[0].position for b in benches],
    }
    for sigma, drawn in spreads.items():
        assert np.std(drawn) == pytest.approx(0.96 * sigma, rel=0.1)


@pytest.mark.slow
def test_dataset(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("experiments.benches.records.LEVELS", (2.0,))
    taken = {}

    def few(bench, short=False, sine=""):
        base = excitation.random(1.0, FS, rms=2.0, seed=4)
        taken["base"] = base.value
        return [("ramp", "identify", base, "words", None), ("level_2_a", "validate", base, "words", 2.0)]

    monkeypatch.setattr("experiments.benches.records.plans", few)
    assert run(make.main, None, ["all", "--out", str(tmp_path)]) == 0 and "bench all" in capsys.readouterr().out
    dataset, b = Dataset.load(tmp_path), NAMED["all"]()
    assert dataset.rig == b.rig
    truth = tomllib.loads((tmp_path / "truth.toml").read_text(encoding="utf-8"))
    assert truth["bushings"][0]["gap"] == pytest.approx(1.22 * 3e-4)
    assert truth["shaft"]["young_modulus"] == pytest.approx(0.97 * 210e9)
    # Gains and 1 % of noise on what ideal sensors at the true places would read.
    accelerations, displacements = shake(b, taken["base"])
    response = dataset.records[1].response()
    accelerometers = zip(response.acceleration, accelerations, b.accelerometers)
    for value, ideal, real in (*accelerometers, *zip(response.displacement, displacements, b.probes)):
        assert np.sum(value * ideal) / np.sum(ideal**2) == pytest.approx(real.gain, abs=1e-3)
        assert np.std(value - real.gain * ideal) == pytest.approx(0.01 * np.std(ideal), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", records.SINES)
def test_sines_to_identify_from_go_through_the_band_both_ways(kind):
    """Frequencies by the zeros of the records; what validates a bench stays."""
    bench = make_bench(17)
    plans, before = (records.plans(bench, True, sine) for sine in (kind, ""))
    assert [p[0] for p in plans if p[1] == "validate"] == [p[0] for p in before if p[1] == "validate"]
    runs = [p for p in plans if p[1] == "identify"]
    assert [p[4] for p in runs] == [0.5, 1.0, 2.0, 5.0]
    upwards = []
    for _, _, shake_, _, level in runs:
        assert np.sqrt(np.mean(shake_.value**2)) == pytest.approx(level, rel=0.01)
        value = shake_.value
        ups = np.flatnonzero((value[:-1] < 0) & (value[1:] >= 0))
        zeros = (ups + value[ups] / (value[ups] - value[ups + 1])) / FS  # a turn apart
        n = 3 if kind == "swept" else 2  # turns of a linear sweep are a parabola, of a step a line
        begin, end = (np.polyder(np.polyfit(part, range(n), n - 1)) for part in (zeros[:n], zeros[-n:]))
        frequency = np.polyval(begin, 0.0), np.polyval(end, value.size / FS)
        assert sorted(frequency) == pytest.approx([5.0, 220.0], rel=0.1)
        upwards.append(frequency[0] < frequency[1])
    assert set(upwards) == {True, False}


def test_without_probes():
    assert not NAMED["no-probes"]().probes and shake(NAMED["no-probes"](), np.ones(64))[1].shape == (0, 64)


@pytest.mark.parametrize("words", [["nothing"], ["cubic+tar+3"], ["all", "--ignorance", "gaps"]])
def test_unknown_benches_are_named(words, tmp_path, capsys):
    assert run(make.main, None, [*words, "--out", str(tmp_path / "out")]) == 2
    assert "is unknown" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_truth_says_what_a_named_bench_is():
    for name, build in NAMED.items():
        b = build()
        truth = b.truth()
        assert b.name == name == truth["name"] and len(truth["shaft"]["frequencies_in_gap"]) == 5
        assert np.all(np.diff(truth["shaft"]["frequencies_in_gap"]) > 0)


OTHERS = {"vibrometer": "velocity", "strain-gauges": "strain", "probes-alone": "displacement", "load-cell": "force"}


@pytest.mark.parametrize(("name", "quantity"), OTHERS.items())
def test_benches_of_other_sensors_read_what_the_package_predicts(name, quantity):
    """A bench whose shaft crosses no gap, so little is it shaken, beside the rig file that knows all of it."""
    bench = known(find_bench(name))
    base = excitation.random(2.0, FS, (20, 200), rms=0.02, seed=1).value
    read, _ = shake(bench, base)
    assert quantity in {s.quantity for s in bench.rig.sensors}
    greases = (Grease(h.small_motion, h.film[1]) for h in bench.holes)
    bushings = [dataclasses.replace(b, grease=g) for b, g in zip(bench.rig.bushings, greases)]
    rig = bench.rig.replace(bushings=tuple(bushings))
    predicted = simulate(rig, excitation.Excitation(base, FS, "base"), engine="modal").channels
    for one, other, sensor in zip(read, predicted, rig.sensors):
        rests = np.std(other) < 0.1 * np.std(predicted, axis=1).max()  # as a gauge at the free end does
        if sensor.quantity == quantity and quantity != "force" and not rests:  # the grease's force is another
            assert np.corrcoef(one, other)[0, 1] > 0.97 and np.std(one) == pytest.approx(np.std(other), rel=0.25)
        assert one.any()


@pytest.mark.parametrize("name", OTHERS)
def test_benches_of_other_sensors_are_written(tmp_path, name):
    bench = find_bench(name)
    plan = records.plans(bench, short=True)[2]
    plan = (*plan[:2], excitation.random(1.0, FS, (5, 220), rms=1.0, seed=2), *plan[3:])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(records, "plans", lambda bench, short, sine: [plan])
        records.write_bench(bench, tmp_path, True, ("validate",))
    (record,) = Dataset.load(tmp_path).records
    assert record.response().quantities == tuple(s.quantity for s in bench.rig.sensors)


TAKEN = [pytest.param(735, "steps_2", id="probe"), pytest.param(736, "steps_1", id="impacts", marks=pytest.mark.slow)]


@pytest.mark.parametrize("seed, taken", TAKEN)
def test_stepped_sines_are_not_taken_for_clipped(seed, taken):
    """Peaks that repeat, with noise on them, are alike by chance; both records were refused."""
    bench = make_bench(seed)
    (i,) = (i for i, (name, *_) in enumerate(records.plans(bench, True, "stepped")) if name == taken)
    base = records.plans(bench, True, "stepped")[i][2]
    for channel in records.measure_channels(bench, base.value, np.random.default_rng((seed, records.STREAM, i))):
        check_channel(channel.name, channel.value, FS)
