"""Energy balance: every engine's balance closes, and single impacts, hysteresis and damping lose what closed forms say.

Closed forms are those of a ball: a point mass at the tip of a shaft that weighs and resists next to nothing, thrown
against a bushing by a half sine.
"""

import dataclasses
import math

import numpy as np
import pytest
from scipy.special import gamma

from clearance_mj import Links, Modal, energy_balance, linear_model
from clearance_mj import clearance as models
from clearance_mj.rig import Beam, Bushing, Contact, Grease, PointMass, Rig, Sensor, Shaker
from clearance_mj.signals.excitation import Excitation, hammer, random

from ..conftest import TABLE1
from .modal_mj import ModalMujoco

RIG = TABLE1.replace(shaker=Shaker("base", 0.9))
MASS, SPEED, WALL = 1.0, 0.1, 5e-3  # kg, m/s, m to the wall
STIFFNESS = 1e4  # N/m
OMEGA = math.sqrt(STIFFNESS / MASS)


def ball(gap=WALL, grease=None) -> Rig:
    """A mass at the tip of a shaft of 1 g and 0.05 N/m, both ends of a bushing around it."""
    area, inertia = np.pi * 0.01**2 / 4, np.pi * 0.01**4 / 64
    beam = Beam(length=1.0, diameter=0.01, young_modulus=0.05 / 3 / inertia, density=1e-3 / area, rayleigh=(0.0, 0.0))
    bushing = Bushing(1.0 - 5e-7, gap, 1e-6, grease or Grease(0.0), Contact(1.0))
    return Rig("ball", beam, (bushing,), (Sensor(1, 1.0),), (PointMass(1.0, MASS, "ball"),), Shaker("force", 1.0))


def thrown(law, engine, duration=0.2):
    """The ball's response and balance, and its first impact, that of both ends together: sums of force and loss."""
    push = hammer(duration, 4096.0, np.pi / 2 * MASS * SPEED / 0.01, 0.01, [0.01], kind="force")
    balance = energy_balance(ball(), push, law, engine)
    first = [i for i in balance.impacts if i.time == min(j.time for j in balance.impacts if j.end == i.end)]
    assert sorted(i.end for i in first) == ["a", "b"]
    return balance.response, balance, first


def kelvin_voigt(ratio):
    """Restitution and time in the wall of a contact whose force ends when it would pull."""
    b, w = ratio * OMEGA, OMEGA * math.sqrt(1 - ratio**2)
    release = (math.pi - math.atan2(2 * b * w, w**2 - b**2)) / w
    depth = math.exp(-b * release) / w * math.sin(w * release)
    out = -math.exp(-b * release) * (math.cos(w * release) - b / w * math.sin(w * release))
    return out, release + depth / out


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.3])
def test_kelvin_voigt_impact(engine, ratio, measured):
    response, balance, impacts = thrown(models.ConstantLaw(STIFFNESS, 2 * ratio * MASS * OMEGA), engine)
    end = impacts[0]
    restitution, duration = kelvin_voigt(ratio)
    what = f"{engine}, Kelvin-Voigt impact, ζ = {ratio}"
    assert end.v_in == pytest.approx(SPEED, rel=2e-3)
    measured.equal(f"{what}: restitution", end.restitution, restitution, "closed form", rel=5e-3)
    measured.equal(f"{what}: time in the wall, s", end.duration, duration, "closed form", rel=5e-3)
    momentum = MASS * (end.v_in + end.v_out)
    impulse, source = sum(i.impulse for i in impacts), "change of momentum"
    measured.equal(f"{what}: impulse, N s", impulse, momentum, source, rel=1e-3)
    lost = MASS * (end.v_in**2 - end.v_out**2) / 2
    lost_energy = balance.contact_loss[0, round((end.time + end.duration) * response.fs) + 1]
    assert sum(i.loss for i in impacts) == pytest.approx(lost_energy, rel=1e-9)
    allowed = {"abs": 1e-3 * MASS * SPEED**2 / 2}
    measured.equal(f"{what}: energy lost, J", lost_energy, lost, "change of kinetic energy", **allowed)
    if ratio == 0:
        peak = sum(i.peak_force for i in impacts)
        measured.equal(f"{what}: peak force, N", peak, end.v_in * math.sqrt(STIFFNESS * MASS), "v √(km)", rel=1e-3)


def test_impulses_are_those_of_the_forces_that_the_engine_reports(engine):
    """The law says them to the balance; the engine's own contact force, integrated, agrees over all impacts."""
    response, balance, _ = thrown(models.ConstantLaw(STIFFNESS, 20.0), engine, 0.5)
    assert {i.side for i in balance.impacts} == {"upper", "lower"}
    impulse = sum(i.impulse if i.side == "upper" else -i.impulse for i in balance.impacts)
    force = response.contact_force[0]
    assert force[-1] == pytest.approx(0, abs=1e-6)
    assert impulse == pytest.approx(np.sum(force) / response.fs, rel=1e-3)


DAMPED = [(models.HuntCrossley(1e6, 0.7), 0.7), (models.Flores(1e6, 0.5), 0.4704)]


@pytest.mark.parametrize(("model", "restitution"), DAMPED)
def test_hertz_damped_impact(engine, model, restitution, measured):
    """Restitution from κ(1 + e) = ln[(1 + κ)/(1 - κe)]."""
    _, _, impacts = thrown(models.ContactLaw(model), engine)
    end, what = impacts[0], f"{engine}, {type(model).__name__} impact"
    measured.equal(f"{what}: restitution", end.restitution, restitution, "energy, κ(1 + e) = ln …", rel=2e-3)
    lost, lost_energy = MASS * (end.v_in**2 - end.v_out**2) / 2, sum(i.loss for i in impacts)
    measured.equal(f"{what}: energy lost, J", lost_energy, lost, "change of kinetic energy", rel=2e-3)


def test_hertz_impact(engine, measured):
    """Johnson, Contact Mechanics, 1985, section 11.4: deepest (5 m v²/(4 K))^(2/5), 2.9432 deepest/v long."""
    end, other = thrown(models.ContactLaw(models.HuntCrossley(1e6, 1.0)), engine)[2]
    deepest = (5 / 4 * MASS * end.v_in**2 / 1e6) ** 0.4
    duration = 0.8 * math.sqrt(math.pi) * gamma(0.4) / gamma(0.9) * deepest / end.v_in
    what, source = f"{engine}, Hertz impact without loss", "closed form"
    measured.equal(f"{what}: restitution", end.restitution, 1.0, source, rel=1e-3)
    measured.equal(f"{what}: time in the wall, s", end.duration, duration, source, rel=2e-3)
    measured.equal(f"{what}: peak force, N", end.peak_force + other.peak_force, 1e6 * deepest**1.5, source, rel=2e-3)


def test_work_of_a_law_that_stiffens_a_compressed_contact(engine, measured):
    """K doubles when the ball stands still in the wall: it gains as much as the spring held, and leaves √2 faster."""
    still = thrown(models.ConstantLaw(STIFFNESS, 0.0), engine)[2][0].time + math.pi / OMEGA / 2
    law = models.TimeLaw([0.0, still, still + 1e-6, 1.0], STIFFNESS * np.array([1.0, 1.0, 2.0, 2.0]), np.zeros(4))
    _, balance, impacts = thrown(law, engine)
    what, source = f"{engine}, K doubled at the deepest point", "½ ΔK δ²"
    held = MASS * impacts[0].v_in ** 2 / 2
    measured.equal(f"{what}: work of the law, J", balance.law_work[0, -1], held, source, rel=2e-2)
    measured.equal(f"{what}: restitution", impacts[0].restitution, math.sqrt(2), source, rel=1e-2)
    measured.below(f"{what}: imbalance", balance.imbalance, 1e-2, source)


@pytest.mark.parametrize(("exponent", "reversal", "energy"), [(1, 3, 7.04011), (2, 1, 0.463088)])
def test_bouc_wen_loops(engine, exponent, reversal, energy, measured):
    """verification.md's steady loops, in mm: the ball in grease that it hardly feels, pushed to and fro at 5 Hz."""
    scale, stiffness, frequency, fs = 1e-3, 0.01, 5.0, 1024.0
    shape_factor = 0.5 / scale**exponent
    grease = Grease(stiffness, 0.0, elastic_ratio=0.0, beta=shape_factor, gamma=shape_factor, exponent=float(exponent))
    time = np.arange(round(2.4 * fs)) / fs
    w = 2 * np.pi * frequency
    rise = np.where(time < 1.2, np.sin(np.pi / 2 * time / 1.2) ** 2, 1.0)
    push = Excitation(reversal * scale * (MASS * w**2 - 0.05) * rise * np.sin(w * time), fs, "force")
    balance = energy_balance(ball(10.0, grease), push, models.ConstantLaw(0.0, 0.0), engine)
    start, end = np.interp(time[-1] - np.array([2 / frequency, 0]), balance.time, balance.hysteresis[0])
    loop_energy = (end - start) / 2 / (stiffness * scale**2)
    what = f"{engine}, Bouc-Wen loop, n = {exponent}, X = {reversal}: energy of a cycle"
    measured.equal(what, loop_energy, energy, "integrated loop", rel=3e-3)


def test_damping_of_a_linear_rig(engine, measured):
    """Steady vibration at 32 Hz: every damper takes π ω c X² in a cycle, X of the linear equations."""
    greases = tuple(Grease(4369.0, c) for c in (6.0, 3.0))
    damped = RIG.replace(beam=dataclasses.replace(RIG.beam, rayleigh=(30.0, 1e-5)))
    fs, w = 2048.0, 2 * np.pi * 32
    time = np.arange(round(1.25 * fs)) / fs
    balance = energy_balance(damped, Excitation(0.5 * np.sin(w * time), fs), models.ConstantLaw(0, 0, greases), engine)
    ritz = linear_model(damped, 16)
    at = ritz.shapes([b.position for b in damped.bushings])
    k, c = np.diag(ritz.omega**2) + 4369.0 * at.T @ at, np.diag(ritz.damping) + (at.T * [6.0, 3.0]) @ at
    q = np.linalg.solve(k + 1j * w * c - w**2 * np.eye(ritz.size), -0.5 * ritz.participation)
    shaft = np.pi * w * np.sum(ritz.damping * np.abs(q) ** 2)
    film = np.pi * w * np.array([6.0, 3.0]) * np.abs(at @ q) ** 2
    put_in = np.pi * 0.5 * ritz.participation @ q.imag
    cycle, source = round(fs / 32), "π ω c X²"

    def of_a_cycle(lost):
        return (lost[..., -1] - lost[..., -1 - 4 * cycle]) / 4

    what = f"{engine}, linear rig at 32 Hz: energy of a cycle"
    measured.equal(f"{what}, shaft's damping, J", of_a_cycle(balance.damping), shaft, source, rel=1e-2)
    measured.equal(f"{what}, input, J", of_a_cycle(balance.input), put_in, source, rel=1e-2)
    for j in range(2):
        measured.equal(f"{what}, damper of bushing {j + 1}, J", of_a_cycle(balance.film)[j], film[j], source, rel=1e-2)


RESIDUAL = ": residual, share of the input"
SLUDGE = Grease(4369.0, 4.0, 0.5, 1.0, 1.2e7, 0.8e7, 2.0, film_height=7e-4)
STRIBECK = models.MaxwellSlip((2500.0, 1000.0, 500.0), (0.2, 0.3, 0.1), 800.0, 4.0, 7e-4, 0.2, 1.4, 0.01)
LAWS = {
    "Kelvin-Voigt": models.ConstantLaw(2e4, 3.0),
    "hard Kelvin-Voigt": models.ConstantLaw(3e5, 12.0),
    "damper alone": models.ConstantLaw(0.0, 5.0),
    "Hunt-Crossley": models.ContactLaw(models.HuntCrossley(8e5, 0.6)),
    "Hunt-Crossley, n = 1": models.ContactLaw(models.HuntCrossley(2e4, 0.5, exponent=1.0)),
    "Hunt-Crossley 1975": models.ContactLaw(models.HuntCrossley1975(8e5, 1.2e6)),
    "linear and cubic": models.ContactLaw((models.Cubic(1e4, 2e10, 3.0, 2.0), models.Cubic(2e4, 1e10, 3.0))),
    "Maxwell-slip": models.ConstantLaw(2e4, 3.0, models.MaxwellSlip((2500.0, 1000.0), (0.3, 0.4), 800.0, 4.0, 7e-4)),
    "Maxwell-slip, Stribeck": models.ConstantLaw(2e4, 3.0, STRIBECK),
    "over time": models.TimeLaw([0.0, 0.2, 0.4], [1e4, 4e4, 5e3], [3.0, 9.0, 0.0]),
    "over amplitude": models.AmplitudeLaw([2e-4, 8e-4, 3e-3], [5e3, 4e4, 1e4], [3.0, 1.0, 9.0], release=0.02),
    "Bouc-Wen and squeeze film": models.ContactLaw(models.HuntCrossley(8e5, 0.6), grease=SLUDGE),
}


def shaken(law, engine, kind="base", level=8.0):
    balance = energy_balance(RIG, random(0.45, 2048, rms=level, seed=1, kind=kind), law, engine)
    assert min(balance.summary()["impacts"]) >= 10
    return balance


IN_BOTH = ("Kelvin-Voigt", "Maxwell-slip, Stribeck", "over amplitude", "Bouc-Wen and squeeze film")
"""Laws that are tried quickly in both engines that step with MuJoCo: one of each kind"""
CASES = [
    pytest.param(engine, law, marks=pytest.mark.slow if engine == "modal-mj" and law not in IN_BOTH else ())
    for engine in ("links", "modal", "modal-mj") for law in LAWS
]  # fmt: skip


@pytest.mark.parametrize(("engine", "law"), CASES)
def test_balance(engine, law, measured):
    balance = shaken(LAWS[law], engine)
    assert np.all(np.diff(balance.hysteresis) >= 0) and np.all(np.diff(balance.damping) > -1e-9)
    measured.below(f"{engine}, {law}{RESIDUAL}", balance.imbalance, 5e-3, "conservation of energy")


def test_balance_under_a_force(engine, measured):
    imbalance = shaken(LAWS["Kelvin-Voigt"], engine, "force", 6.0).imbalance
    measured.below(f"{engine}, force, Kelvin-Voigt{RESIDUAL}", imbalance, 5e-3, "conservation of energy")


def test_balance_with_adhesion(measured):
    imbalance = shaken(models.ContactLaw(models.KelvinVoigt(2e4, 20.0, adhesion=True)), "modal").imbalance
    measured.below(f"modal, adhesion{RESIDUAL}", imbalance, 5e-3, "conservation of energy")


@pytest.mark.parametrize("engine", [Links(8), Modal(), ModalMujoco()], ids=lambda engine: engine.name)
def test_what_the_residual_is(engine, measured):
    """A spring of a bushing end takes ½ k/2 (δ₁ d₀ - δ₂ d₃) from the motion where steps straddle the gap's edge.

    δ is the depth of the step inside and d the distance of the one outside; with evenly spread phases the mean is
    k h²/24 (v_in² - v_out²) for each impact.
    """
    balance = energy_balance(RIG, random(0.6, 2048, rms=20.0, seed=1), models.ConstantLaw(3e6, 20.0), engine)
    h = balance.response.provenance["step"]
    expected = 3e6 * h**2 / 24 * sum(i.v_in**2 - i.v_out**2 for i in balance.impacts)
    what = f"{engine.name}, k = 3e6 N/m: residual, J"
    measured.equal(what, balance.residual[-1], expected, "k h²/24 Σ(v_in² - v_out²)", rel=0.3)
