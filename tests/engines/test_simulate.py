"""The one way in to all engines: what a response holds, batches, refusals, divergence."""

import dataclasses
import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

from clearance_mj.clearance import AmplitudeLaw, ConstantLaw, ContactLaw, HuntCrossley, TimeLaw
from clearance_mj.core.errors import ClearanceError, ExcitationError, LawError, RigError, SimulationError
from clearance_mj.engines import Links, Modal, batch, get_engine, simulate, simulate_batch, simulate_each
from clearance_mj.engines.base import step_factor
from clearance_mj.rig import Bushing, Contact, Grease, Rig, Sensor, Shaker
from clearance_mj.signals.excitation import Excitation
from clearance_mj.structure import ModalStructure

from ..conftest import TABLE1 as RIG
from ..structures import chain, stepped
from .alike import HISTORIES

BARE = RIG.replace(name="bare", bushings=())
LAW = ConstantLaw(2e4, 3.0)
FS = 2048.0
ENGINES = ["links", "modal"]


def noise(duration=0.25, rms=6.0, seed=0, **fields):
    """Tones of 5 to 220 Hz, faded in over 20 ms."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration * FS)) / FS
    tones = np.cos(2 * np.pi * np.outer(t, rng.uniform(5, 220, 40)) + rng.uniform(0, 2 * np.pi, 40)).sum(axis=1)
    return Excitation(rms * np.sqrt(2 / 40) * tones * np.minimum(t / 0.02, 1) ** 2, FS, **fields)


def outputs(response):
    return [getattr(response, name) for name in HISTORIES]


def assert_equal(computed, expected):
    for one, other in zip(outputs(computed), outputs(expected)):
        np.testing.assert_array_equal(one, other)


def test_response(engine):
    """Shapes, labels of the sensors in the rig's order, and the inputs it carries."""
    excitation = noise(band=(5.0, 220.0), description={"generator": "tones", "seed": 0})
    response = simulate(RIG, excitation, LAW, engine)
    assert [v.shape for v in outputs(response)] == [(8, 512), (2, 512), (2, 512), (2, 512)]
    assert response.responses == tuple(f"{node}:+Z" for node in range(1, 9))
    assert (response.fs, response.kind, response.band, response.reference) == (FS, "base", (5.0, 220.0), "100:+Z")
    np.testing.assert_array_equal(response.excitation, excitation.value)
    np.testing.assert_array_equal(response.time, np.arange(512) / 2048)
    inputs = response.provenance
    assert inputs["engine"] == engine
    assert inputs["settings"] == dataclasses.asdict(get_engine(engine))
    assert Rig.from_dict(inputs["rig"]) == RIG
    assert inputs["law"] == LAW.to_dict()
    assert inputs["excitation"] == {"generator": "tones", "seed": 0}
    # A whole number of steps in a sample, none longer than the engine allows.
    assert 1 / (FS * inputs["step"]) == pytest.approx(round(1 / (FS * inputs["step"])), abs=1e-9)
    assert inputs["step"] <= get_engine(engine).largest_step(RIG, LAW)


def test_response_says_what_the_rig_file_does_not():
    """The theory that "auto" took, of each shaft; what modes that are left out cost."""
    provenance = simulate(stepped(), noise(0.05), ConstantLaw(8e3, 5.0), "modal").provenance
    assert provenance["bending_theory"] == ["euler"] and "truncation" not in provenance
    modes = ModalStructure((20.0, 90.0, 200.0), (0.01,), ("1:+Z",), ((0.5, 0.4, 0.3),))
    bushing = Bushing("1:+Z", 3e-4, 0.0, Grease(0.0), Contact(1e5))
    rig = Rig("modes", None, (bushing,), (Sensor(1, "1:+Z"),), shaker=Shaker("force", "1:+Z"), structure=modes)
    (lost,) = simulate(rig, noise(0.05, kind="force"), ConstantLaw(1e5, 0.0), "modal").provenance["truncation"]
    assert lost["stiffness_error"] == pytest.approx(1e5 * lost["missing"]) and lost["missing"] > 0
    assert "bending_theory" not in simulate(RIG, noise(0.05), LAW, "modal").provenance


def test_a_base_that_moves_no_mass(engine):
    rig = (stepped if engine == "links" else chain)(shaker=Shaker(direction=(0.0, 1.0, 0.0)))
    words = r"along \(0.0, 1.0, 0.0\), which moves no mass .*; give another shaker.direction"
    with pytest.raises(RigError, match=words):
        simulate(rig, noise(0.05), ConstantLaw(1e4, 1.0), engine)


def test_sensors_keep_the_order_of_the_rig():
    """In MuJoCo they are listed along the shaft."""
    shuffled = RIG.replace(sensors=RIG.sensors[::-1])
    for engine in ENGINES:
        there, back = (simulate(rig, noise(0.05), LAW, engine).acceleration for rig in (RIG, shuffled))
        np.testing.assert_allclose(back[::-1], there, rtol=1e-9, atol=1e-9)


def test_step_factor():
    assert [step_factor(2048, step) for step in (1 / 2048, 0.9999 / 2048, 1e-4, 1.0)] == [1, 2, 5, 1]


def test_batch(engine):
    """Bit-identical on one thread, on two, and by itself; in the order of the cases."""
    cases = [(LAW, 0), (ConstantLaw([1e4, 3e4], [1.0, 0.0]), 1), (LAW, 2), (TimeLaw([0, 0.1], [1e4, 4e4], [0, 9]), 3)]
    cases += [(AmplitudeLaw([1e-4, 1e-3], [5e3, 4e4], [1, 3]), 4), (ContactLaw(HuntCrossley(1e6, 0.7)), 5)]
    laws, excitations = [law for law, _ in cases], [noise(0.1, 20.0, seed) for _, seed in cases]
    one = simulate_batch(RIG, excitations, laws, engine, workers=1)
    two = simulate_batch(RIG, excitations, laws, engine, workers=2)
    each = simulate_each(RIG, excitations, laws, engine, workers=3)
    alone = [simulate(RIG, excitation, law, engine) for excitation, law in zip(excitations, laws)]
    for expected, *others, excitation in zip(alone, one, two, each, excitations, strict=True):
        assert np.any(expected.contact_force)
        np.testing.assert_array_equal(expected.excitation, excitation.value)
        for other in others:
            assert_equal(other, expected)


def test_batch_on_an_executor_that_is_given():
    """Bit-identical in another process; the pool is left open."""
    excitations = [noise(0.05, seed=s) for s in (1, 2, 3)]
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        responses = simulate_batch(RIG, excitations, LAW, "modal", workers=2, executor=pool)
        assert pool.submit(int, "3").result() == 3
    for a, b in zip(responses, simulate_batch(RIG, excitations, LAW, "modal"), strict=True):
        assert_equal(a, b)


def test_batch_spreads_single_values():
    """One rig and one law for all excitations; many rigs for one excitation."""
    responses = simulate_batch(RIG, [noise(0.05, seed=s) for s in (1, 2)], LAW, "modal")
    assert [r.provenance["law"] for r in responses] == [LAW.to_dict()] * 2
    responses = simulate_batch([RIG, BARE], noise(0.05), LAW, "modal")
    assert [r.provenance["rig"]["name"] for r in responses] == ["table1", "bare"]
    assert len(simulate_batch(RIG, noise(0.05), LAW, Modal(4))) == 1


def test_each_runs_only_a_few_cases_ahead(monkeypatch):
    """However slowly responses are taken and however many cases there are; what was begun is all that is run."""
    begun = []
    monkeypatch.setattr(batch, "simulate", lambda rig, excitation, law, engine: begun.append(law) or law)
    laws = [ConstantLaw(1e4 + i, 0.0) for i in range(100)]
    responses = simulate_each(RIG, noise(0.05), laws, workers=2)
    for i, law in enumerate(laws[:20]):
        assert next(responses) is law
        time.sleep(0.005)
        assert len(begun) <= i + 2 * batch.CASES_PER_THREAD
    responses.close()
    assert begun == laws[: len(begun)]
    assert len(begun) < 30


BLOW = np.append(np.zeros(299), 1e308)
REFUSED = [
    (RIG, noise(0.05, kind="force"), LAW, ExcitationError, "rig 'table1' has no shaker.position"),
    (RIG, noise(0.05), ConstantLaw([1e4] * 3, 1.0), LawError, "the law holds k and c for 3 bushings, the rig has 2"),
    # Before it takes hours: no step could be fine enough.
    (RIG, noise(0.05), ConstantLaw([1e4, 1e12], 3.0), (LawError, SimulationError), r"rig 'table1': .*bushings\[1\]"),
    (BARE, Excitation(np.zeros(20), 2.0), LAW, ClearanceError, "rig 'bare'"),
    # Nothing that is not a number leaves, however late it came up: steps whose interpolation overshoots all numbers.
    (RIG, Excitation(BLOW, FS), LAW, SimulationError, "rig 'table1'"),
    (BARE, Excitation(np.full(200, 1.7e308), FS), LAW, SimulationError, "rig 'bare'.* at the tip"),
]


@pytest.mark.parametrize(("rig", "excitation", "law", "error", "message"), REFUSED)
def test_refusals(rig, excitation, law, error, message, engine):
    with pytest.raises(error, match=message):
        simulate(rig, excitation, law, engine)


@pytest.mark.parametrize(("excitations", "laws", "engine", "error", "message"), [
    ([noise(0.05)] * 2, [LAW] * 3, "links", ClearanceError, r"differ in number: \[2, 3\]"),
    ([noise(0.05), noise(0.05, 1e9)], LAW, "modal", SimulationError, "rig 'table1': the modal simulation diverged"),
    (noise(0.05), LAW, "fem", ClearanceError, 'engine "fem" is unknown; known: links, mjx, modal'),
])  # fmt: skip
def test_refusals_of_batches(excitations, laws, engine, error, message):
    with pytest.raises(error, match=message):
        simulate_batch(RIG, excitations, laws, engine, workers=2)


def test_the_engine_mjx_says_what_it_needs(monkeypatch):
    monkeypatch.setitem(sys.modules, "jax", None)
    missing = r"simulations of engine mjx need the package jax, .*: pip install clearance-mj\[mjx\] brings it"
    with pytest.raises(ClearanceError, match=missing):
        simulate(RIG, noise(0.05), LAW, "mjx")


@pytest.mark.parametrize("value", [[0.0, np.nan, 1.0], [0.0, np.inf], np.zeros(0), np.zeros((3, 2)), np.nan])
def test_an_excitation_is_finite(value):
    with pytest.raises(ExcitationError):
        Excitation(np.array(value), FS)


@pytest.mark.parametrize("level", [1e7, 1e150, 1e300])
def test_divergence(engine, level):
    """Far out of range: an error that says which rig, when and where."""
    where = r"at t = 0\.0\d{5} s at bushings\[[01]\] \(x = 0\.(5484|7918) m\)"
    with pytest.raises(SimulationError, match=f"rig 'table1': the {engine} simulation diverged {where}"):
        simulate(RIG, noise(0.1, level), LAW, engine)


def test_unstable_step():
    """Beyond the limit 2/ω explicit springs blow up; their own limit is safety = 1 (mujoco.md)."""
    with pytest.raises(SimulationError, match=r"rig 'table1'.*bushings\["):
        simulate(RIG, noise(0.1), LAW, Links(20, safety=2.0))


def test_the_end_of_a_record(engine):
    """A record whose excitation falls silent is the beginning of a longer one."""
    value = np.concatenate((noise(0.1, 2.0).value, np.zeros(100)))
    short, long = (simulate(RIG, Excitation(v, FS), LAW, engine) for v in (value[:-60], value))
    error = 1e-6 * np.abs(long.displacement).max()
    np.testing.assert_allclose(short.displacement, long.displacement[:, :-60], atol=error)


def test_rest(engine):
    """No excitation, no motion."""
    for value in outputs(simulate(RIG, Excitation(np.zeros(64), FS), LAW, engine)):
        np.testing.assert_array_equal(value, 0)


def test_force_of_a_shaken_rig():
    """A rig with a place for the shaker takes both kinds of excitation."""
    rig = RIG.replace(shaker=Shaker("force", 0.3))
    by_force = simulate(rig, noise(0.05, kind="force"), LAW, "modal")
    assert (by_force.kind, by_force.reference) == ("force", "200:+Z")
    assert simulate(rig, noise(0.05), LAW, "modal").reference == "100:+Z"


@pytest.mark.parametrize(("make", "name"), [
    (lambda: Links(0), "links"), (lambda: Links(1), "links"), (lambda: Links(2.5), "links"),
    (lambda: Links(20, safety=0.0), "safety"), (lambda: Modal(-1), "modes"),
    (lambda: Modal(8, resolution=0.0), "resolution"),
])  # fmt: skip
def test_impossible_settings(make, name):
    with pytest.raises(ClearanceError, match=name):
        simulate(RIG, noise(0.05), LAW, make())


def test_progress_over_the_seconds_of_the_record(monkeypatch, capsys):
    monkeypatch.setattr("clearance_mj.engines.simulation.DELAY", 0.0)
    push = Excitation(np.ones(2048), 1024.0)
    quiet, with_progress = simulate(RIG, push, LAW, "modal"), simulate(RIG, push, LAW, "modal", progress=True)
    np.testing.assert_array_equal(quiet.acceleration, with_progress.acceleration)
    assert "simulating: 100%" in (words := capsys.readouterr().err) and "2.0/2.0" in words
