"""Identities and promises that hold for all rigs, laws, FRFs and records, tried on examples that hypothesis invents.

Those of the random excitation, of ragged blocks, of H1 <= Hv <= H2, of complex scale factors and the bounds of the
criteria are beside the tests of their modules, as are files with changed bytes; `tests/fuzz` has many more of these.
"""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from clearance_mj import beam
from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, TimeLaw, load_law
from clearance_mj.clearance.contact import CONTACTS
from clearance_mj.engines import simulate
from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker
from clearance_mj.signals import excitation
from clearance_mj.signals.excitation import Excitation
from clearance_mj.signals.frf import estimate_frf
from clearance_mj.signals.response import Response

from .clearance.test_law import values

FS = 512.0
positive = st.floats(1e-6, 1e6)
fractions = st.floats(0.01, 0.99)
text = st.text(max_size=20)


# Rigs.


@st.composite
def greases(draw):
    beta = draw(st.just(0.0) | st.floats(1e-3, 1e8))
    return Grease(
        stiffness=draw(st.floats(0, 1e6)),
        damping=draw(st.floats(0, 1e3)),
        elastic_ratio=draw(st.floats(0, 1)) if beta > 0 else 1.0,
        amplitude=draw(positive),
        beta=beta,
        gamma=beta * draw(st.floats(-0.9, 1)),
        exponent=draw(st.floats(1, 4)),
        film_height=draw(st.none() | positive),
        film_limit=draw(st.floats(1e-3, 1)),
    )


@st.composite
def rigs(draw):
    """Any rig: round or rectangular, with 0 to 3 bushings side by side, sensors, masses, and any shaker."""
    length = draw(st.floats(0.1, 10))
    round_ = draw(st.booleans())
    section = {"diameter": draw(positive)} if round_ else {"width": draw(positive), "height": draw(positive)}
    bushings = []
    n = draw(st.integers(0, 3))
    for i in range(n):
        room = length / n  # each bushing has its own part of the shaft
        wide = draw(st.floats(0.01, 0.9)) * room
        middle = i * room + wide / 2 + draw(st.floats(0.01, 0.09)) * room
        contact = Contact(draw(positive), draw(st.floats(0, 1e3)))
        bushings.append(Bushing(middle, draw(positive), wide, draw(greases()), contact))
    nodes = draw(st.lists(st.integers(1, 99) | st.integers(201, 10**9 - 1), min_size=1, max_size=4, unique=True))
    kind = draw(st.sampled_from(["base", "force"]))
    optional = st.none() if kind == "base" else st.nothing()
    return Rig(
        name=draw(st.text(min_size=1, max_size=20)),
        beam=Beam(length, draw(positive), draw(positive), **section, rayleigh=draw(st.tuples(positive, positive))),
        bushings=tuple(bushings),
        sensors=tuple(Sensor(node, draw(fractions) * length, draw(st.floats(0, 10))) for node in nodes),
        masses=tuple(
            PointMass(draw(fractions) * length, draw(positive), draw(text)) for _ in range(draw(st.integers(0, 2)))
        ),
        shaker=Shaker(kind, draw(optional | fractions.map(lambda part: part * length))),
        description=draw(text),
    )


def through_a_file(thing, load):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file"
        thing.save(path)
        return load(path)


@settings(max_examples=60, deadline=None)
@given(rigs())
def test_any_rig_comes_back_from_its_file(rig):
    assert through_a_file(rig, Rig.load) == rig


"""γ may be; β may not, and the error is about γ, which it bounds"""


# Laws.


@st.composite
def laws(draw, bushings=2):
    """Any law for a number of bushings."""
    rows = draw(st.integers(1, 5))
    abscissa = np.cumsum(draw(st.lists(st.floats(1e-3, 1e3), min_size=rows, max_size=rows)))
    value = st.floats(0, 1e9)
    table = st.lists(st.lists(value, min_size=bushings, max_size=bushings), min_size=rows, max_size=rows)
    grease = draw(st.none() | greases() | st.lists(greases(), min_size=bushings, max_size=bushings))
    match draw(st.sampled_from(["constant", "time", "amplitude", "contact"])):
        case "constant":
            return ConstantLaw(draw(table)[0], draw(value), grease)
        case "time":
            return TimeLaw(abscissa, draw(table), draw(table), grease)
        case "amplitude":
            return AmplitudeLaw(abscissa, draw(table), draw(table), draw(positive), grease)
    names = draw(st.lists(st.sampled_from(sorted(CONTACTS)), min_size=bushings, max_size=bushings))
    models = []
    for name in names:
        stiffness, other = draw(positive), draw(st.floats(0.05, 1))
        numbers = (1 + other, draw(value), draw(positive)) if name == "adams-impact" else (other,)
        models.append(CONTACTS[name](stiffness, *numbers))
    return ContactLaw(models, grease)


@settings(max_examples=80, deadline=None)
@given(laws())
def test_any_law_comes_back_from_its_file(law):
    again = through_a_file(law, load_law)
    assert again == law and again.to_dict() == law.to_dict()
    for one, other in zip(law.table(2), again.table(2)):
        np.testing.assert_array_equal(one, other)


@settings(max_examples=80, deadline=None)
@given(laws(), st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=20))
def test_a_law_stays_between_its_rows_and_is_never_negative(law, points):
    table = law.table(2)
    for j in range(2):
        rows = table.parameters[:, j]
        interpolated_values = np.array([values(law, 2, abs(at))[:, j] for at in [*points, *table.abscissa]])
        assert np.all(
            (interpolated_values >= rows.min(axis=0) * (1 - 1e-12))
            & (interpolated_values <= rows.max(axis=0) * (1 + 1e-12))
        )
        assert np.all(interpolated_values >= 0)
        np.testing.assert_array_equal(interpolated_values[-len(rows) :], rows)  # at a row, the row


# Criteria.


# Spectra.


def response_of(drive, taps):
    """Circular filters of a drive of one period: their FRF at its lines is that of the taps."""
    spectrum = np.fft.rfft(drive)
    output = [np.fft.irfft(spectrum * np.fft.rfft(row, drive.size), drive.size) for row in taps]
    return np.stack(output)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 6))
def test_frfs_are_linear_in_the_response(seed, n):
    """H1 of the sum of two responses is the sum of their H1s, whatever the noise; H1 of the excitation itself is 1."""
    rng = np.random.default_rng(seed)
    drive, a, b = rng.standard_normal(512 * n), rng.standard_normal((2, 512 * n)), rng.standard_normal((2, 512 * n))
    rows = np.vstack((a, b, a + 3 * b, drive))
    h = estimate_frf(Response(FS, drive, rows), "H1", resolution=4.0, band=(8, 200)).value
    np.testing.assert_allclose(h[4:6], h[:2] + 3 * h[2:4], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(h[6], 1, rtol=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_all_estimators_find_a_filter_without_noise(seed):
    """A periodic multisine through circular filters: no leakage with segments of its period and no window."""
    period = 128
    shake = excitation.multisine(4 * period / FS, FS, (8, 200), 1.0, seed, period=period / FS)
    taps = np.random.default_rng(seed).standard_normal((2, 5))
    output = response_of(shake.value, taps)
    expected = np.fft.rfft(taps, period)
    for estimator in ("H1", "H2", "Hv"):
        frf = estimate_frf(Response(FS, shake.value, output), estimator, FS / period, band=(12, 196), window="boxcar")
        lines = np.rint(frf.frequency * period / FS).astype(int)
        np.testing.assert_allclose(frf.functions, expected[:, lines], rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(frf.coherence, 1, rtol=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(16, 300))
def test_parseval_of_a_single_segment(seed, n):
    """Without window or average H is Y/X at every line, so that |H X|² over all lines is the power over time."""
    rng = np.random.default_rng(seed)
    drive, output = rng.standard_normal(n), rng.standard_normal((2, n))
    frf = estimate_frf(Response(FS, drive, output), resolution=FS / n, overlap=0.0, window="boxcar")
    power = np.abs(frf.functions * np.fft.rfft(drive)) ** 2 / n**2
    power[:, 1 : None if n % 2 else -1] *= 2  # lines above fs / 2 mirror those below
    np.testing.assert_allclose(power.sum(axis=1), np.mean(output**2, axis=1), rtol=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.1, 10))
def test_parseval_of_a_multisine(seed, rms):
    """Its lines share the power: m of them have the amplitude rms √(2/m) each."""
    shake = excitation.multisine(1.0, FS, (8, 200), rms, seed, period=0.5)
    amplitude = 2 * np.abs(np.fft.rfft(shake.value)) / shake.value.size
    lines = amplitude[amplitude > 1e-9 * rms]
    np.testing.assert_allclose(lines, rms * np.sqrt(2 / lines.size), rtol=1e-9)
    assert np.sum(lines**2) / 2 == pytest.approx(np.mean(shake.value**2), rel=1e-12)


# The linear model.


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10_000))
def test_the_linear_model_is_reciprocal_and_its_response_is_linear(seed):
    """Maxwell-Betti between two points with a static shape each, on rigs of any size; and the engine, without contact.

    A drive twice as large, and of the other sign, moves a shaft that stays in its gap twice as far, the other way.
    """
    rng = np.random.default_rng(seed)
    at = np.sort(rng.uniform(0.2, 1.0, 2))
    grease = Grease(rng.uniform(1e2, 1e4), rng.uniform(0, 5))
    places = [Bushing(x * 0.95, 1e-1, 1e-3, grease, Contact(1e4)) for x in at if at[1] - at[0] > 0.01]
    assume(len(places) == 2)
    shaft = Beam(1.0, 7e10, 2700.0, rng.uniform(0.01, 0.03), rayleigh=(1.0, 1e-6))

    def rig(push, measure):
        return Rig("any", shaft, tuple(places), (Sensor(1, measure),), shaker=Shaker("force", push))

    a, b = (place.position for place in places)
    frequency = np.linspace(5, 220, 100)
    there, back = (beam.linear_frf(rig(*pair), frequency, n_modes=16)[0] for pair in ((a, b), (b, a)))
    np.testing.assert_allclose(there, back, rtol=0, atol=1e-6 * np.abs(there).max())
    push = rng.standard_normal(200)
    once, twice = (
        simulate(rig(a, b), Excitation(factor * push, 1024.0, "force"), ConstantLaw(1e4, 1.0), "modal").acceleration
        for factor in (1.0, -2.0)
    )
    np.testing.assert_allclose(twice, -2 * once, rtol=1e-9, atol=1e-9 * np.abs(once).max())
