"""Sensors of every quantity: what they read is what closed forms, other sensors and the clearances' own rows say."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import clearance_mj as cm
from clearance_mj.engines import simulate_together
from clearance_mj.linear import linear_model
from clearance_mj.rig import Rig, Sensor, Shaker
from clearance_mj.structure import Material, Section, Shaft, Support

TABLE1 = Rig.load(Path(__file__).parents[2] / "models" / "table1_rig.toml")
NOISE = cm.excitation.random(1.0, 2048.0, band=(5, 220), rms=6.0, seed=3)
LAW = cm.ConstantLaw(2e6, 20.0)
FS, PERIOD = 2048.0, 1024
X = 0.3
AT_ONE_PLACE = (
    Sensor(20, X, quantity="acceleration"), Sensor(20, X, quantity="velocity"),
    Sensor(20, X, quantity="displacement", relative_to="ground"), Sensor(21, X, quantity="acceleration",
    relative_to="base"), Sensor(21, X, quantity="velocity", relative_to="base"), Sensor(21, X, quantity="displacement"),
)  # fmt: skip
FORCES = (Sensor(30, "bushings[0]", quantity="force"), Sensor(31, "7:+Z", quantity="force", gain=2.0))
MIDDLES = tuple(Sensor(40 + j, b.position, quantity="displacement") for j, b in enumerate(TABLE1.bushings))
MIXED = TABLE1.replace(sensors=(*TABLE1.sensors, *AT_ONE_PLACE, *FORCES, *MIDDLES))


def rows(response: cm.Response, sensors: tuple[Sensor, ...]) -> np.ndarray:
    """The channels of some sensors."""
    known = list(zip(response.responses, response.quantities))
    return response.channels[[known.index((s.label, s.quantity)) for s in sensors]]


def in_the_gap(*sensors: Sensor) -> Rig:
    """The damped shaft of Table 1 without bushings."""
    return TABLE1.replace(bushings=(), sensors=sensors, beam=dataclasses.replace(TABLE1.beam, rayleigh=(40.0, 0.0)))


def steady(rig: Rig, engine: str, harmonics: int = 100) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Angular frequencies, spectra of excitation and channels in the last but one of 40 periods, and the step."""
    phases = np.random.default_rng(1).uniform(0, 2 * np.pi, harmonics)
    time = np.arange(40 * PERIOD) / FS
    omega = 2 * np.pi * FS / PERIOD * np.arange(2, harmonics + 2)
    value = np.cos(np.outer(time, omega) + phases).sum(axis=1) / np.sqrt(harmonics)
    response = cm.simulate(rig, cm.Excitation(value, FS, rig.shaker.kind), cm.ConstantLaw(0.0, 0.0), engine)
    period = np.vstack((response.excitation, response.channels))[:, -2 * PERIOD : -PERIOD]
    spectra = np.fft.rfft(period)[:, 2 : harmonics + 2]
    return omega, spectra[0], spectra[1:], response.provenance["step"]


@pytest.mark.parametrize("engine", ["modal", "links"])
def test_accelerations_are_what_they_are_without_other_sensors(engine: str) -> None:
    alone, mixed = (cm.simulate(rig, NOISE, LAW, engine) for rig in (TABLE1, MIXED))
    assert alone.quantities == ("acceleration",) * 8
    assert alone.acceleration is alone.channels
    assert_array_equal(mixed.acceleration[:8], alone.acceleration)
    assert_array_equal(mixed.contact_force, alone.contact_force)


@pytest.mark.parametrize("engine", ["modal", "links"])
def test_force_and_displacement_in_a_clearance_are_the_clearances_own(engine: str) -> None:
    response = cm.simulate(MIXED, NOISE, LAW, engine)
    assert response.contact_force is not None and response.contact_force.any()
    whole = response.contact_force + response.grease_force
    assert_allclose(rows(response, FORCES), [whole[0], 2 * whole[1]], rtol=0, atol=1e-12)
    assert_allclose(rows(response, MIDDLES), response.displacement, rtol=0, atol=1e-15)


@pytest.mark.parametrize("engine", ["modal", "links"])
@pytest.mark.parametrize("kind", ["base", "force"])
def test_motions_are_derivatives_of_each_other(engine: str, kind: str) -> None:
    sensors = AT_ONE_PLACE if kind == "base" else (*AT_ONE_PLACE[:2], *AT_ONE_PLACE[3:])
    free = in_the_gap(*sensors).replace(shaker=Shaker(kind, None if kind == "base" else 0.5))
    omega, drive, channels, h = steady(free, engine)
    by_time = dict(zip(((s.quantity, s.moves_with_base) for s in sensors), channels))
    for against in (False, True):
        acceleration, velocity = by_time["acceleration", against], by_time["velocity", against]
        of_steps = (omega * h / 2) / np.tan(omega * h / 2)  # (q₊ - q₋)/(2h) over (q₊ - 2q + q₋)/h², times iω
        off = np.abs(acceleration * of_steps / (1j * omega) - velocity).max()
        assert off < 1e-6 * np.abs(velocity).max()
    displacement = by_time["displacement", True]
    off = np.abs(by_time["velocity", True] / (1j * np.sin(omega * h) / h) - displacement).max()
    assert off < 1e-6 * np.abs(displacement).max()
    of_base = by_time["acceleration", False] - by_time["acceleration", True]
    expected_base = drive if kind == "base" else 0 * drive
    assert np.abs(of_base - expected_base).max() < 5e-4 * np.abs(drive).max()  # of interpolation and decimation
    low, wanted = omega < 2 * np.pi * 80, [s.quantity != "displacement" or s.moves_with_base for s in sensors]
    gains = linear_model(free).channel_gains(np.zeros((0, linear_model(free).size)), kind, omega[low])[:, :-1, -1].T
    for seen, gain in zip((channels / drive)[:, low][wanted], gains[wanted]):
        assert_allclose(seen, gain, atol=6e-2 * np.abs(gain).max())


def test_the_base_moves_by_the_running_integral_of_its_acceleration() -> None:
    """A point of a rigid part of the base, u = ∬ a from rest: here of one sine, a ω⁻² (ωt - sin ωt)."""
    omega, time = 2 * np.pi * 20.0, np.arange(2048) / 2048.0
    held = TABLE1.replace(bushings=(), sensors=AT_ONE_PLACE)
    response = cm.simulate(held, cm.Excitation(np.sin(omega * time), 2048.0, "base"), cm.ConstantLaw(0.0, 0.0), "modal")
    of_base = response.channels[:3] - response.channels[3:]
    inside = slice(100, 1900)  # the filters look ahead of the beginning and beyond the end
    exact = np.sin(omega * time), (1 - np.cos(omega * time)) / omega, time / omega - np.sin(omega * time) / omega**2
    for got, closed in zip(of_base, exact):
        assert_allclose(got[inside], closed[inside], atol=2e-4 * np.abs(closed).max())


def test_lanes_read_what_one_simulation_reads() -> None:
    stiffer = cm.ConstantLaw(3e6, 20.0)
    for rig in (MIXED, MIXED.with_shape("round")):
        single = [cm.simulate(rig, NOISE, law, "modal") for law in (LAW, stiffer)]
        for one, other in zip(single, simulate_together([(rig, LAW), (rig, stiffer)], NOISE)):
            size = np.abs(one.channels).max(axis=1, keepdims=True)
            assert_allclose(other.channels / size, one.channels / size, atol=1e-6)
            assert other.quantities == one.quantities


@pytest.mark.parametrize("engine", ["modal", "links"])
def test_in_space_sensors_read_what_they_read_in_the_plane(engine: str) -> None:
    turned = [dataclasses.replace(s, node=s.node + 50, direction=(0.0, 0.6, 0.8)) for s in (*FORCES, *MIDDLES)]
    space = MIXED.with_shape("round").replace(sensors=(*MIXED.sensors, *turned))
    plane, in_space = (cm.simulate(rig, NOISE, LAW, engine) for rig in (MIXED, space))
    size = np.abs(plane.channels).max(axis=1, keepdims=True)
    limit, part = (1e-6, slice(None)) if engine == "modal" else (2e-2, slice(900))  # links: until contact is chaotic
    assert_allclose((in_space.channels[: len(size)] / size)[:, part], (plane.channels / size)[:, part], atol=limit)
    assert_allclose(rows(in_space, tuple(turned)), 0.8 * rows(in_space, (*FORCES, *MIDDLES)), atol=1e-6)


@pytest.mark.parametrize("engine", ["modal", "links"])
def test_a_probe_reads_the_sag_of_a_shaft_that_rests(engine: str) -> None:
    heavy = MIXED.with_shape("round").replace(gravity=(0.0, 0.0, -9.81))
    response = cm.simulate(heavy, cm.Excitation(np.zeros(256), 2048.0, "base"), LAW, engine)
    assert np.abs(response.displacement).max() > 1e-4
    assert_allclose(rows(response, MIDDLES), response.displacement[1::2], rtol=1e-6)
    whole = (response.contact_force + response.grease_force)[1::2]
    assert_allclose(rows(response, FORCES), [whole[0], 2 * whole[1]], atol=1e-9)


STEEL = Material(210e9, 7850.0)
SPRINGS = Support(0.0, "elastic", 2e5, 30.0, 80.0), Support(0.6, "elastic", 1e5, 0.0, 0.0)
STANDING = Rig(
    "on springs", None, (),
    (Sensor(1, 0.0, quantity="force"), Sensor(2, 0.0, quantity="displacement"),
     Sensor(3, 0.0, quantity="velocity", relative_to="base"), Sensor(4, 0.6, quantity="force")),
    structure=Shaft((Section(0.6, 0.02),), SPRINGS, (), STEEL, theory="euler"),
)  # fmt: skip


@pytest.mark.parametrize("engine", ["modal", "links"])
def test_force_in_a_support_is_that_of_its_spring_and_damper(engine: str) -> None:
    force, w, speed, _ = cm.simulate(STANDING, NOISE, cm.ConstantLaw(0.0, 0.0), engine).channels
    assert np.abs(80.0 * speed).max() > 0.05 * np.abs(force).max()
    assert_allclose(force, 2e5 * w + 80.0 * speed, atol=1e-9 * np.abs(force).max())


def test_forces_of_the_supports_carry_what_the_base_accelerates() -> None:
    """Newton's second law at low frequency: both forces together are -m a, with the mass m of the shaft."""
    model = linear_model(STANDING)
    gains = model.channel_gains(np.zeros((0, model.size)), "base", np.array([2 * np.pi * 0.5]))[0, :, -1]
    assert_allclose(gains[0] + gains[3], -STANDING.total_mass, rtol=1e-4)


LENGTH, WIDTH, HEIGHT, AT = 1.0, 0.02, 0.01, 0.3
INERTIA = WIDTH * HEIGHT**3 / 12
GAUGES = (
    Sensor(1, 1e-3, quantity="strain"), Sensor(2, AT, quantity="strain"), Sensor(3, AT, quantity="strain", fibre=0.002),
    Sensor(4, AT, quantity="angle"), Sensor(5, LENGTH, quantity="displacement"),
)  # fmt: skip
BAR = cm.Beam(LENGTH, 210e9, 7850.0, width=WIDTH, height=HEIGHT, damping_ratios=(1e-4,))
CANTILEVER = Rig("cantilever", BAR, (), GAUGES, shaker=Shaker("force", LENGTH))
PLATE, CLAMP = Section(LENGTH, width=WIDTH, height=HEIGHT), Support(0.0, "clamped")
SHAFT = Shaft((PLATE,), (CLAMP,), (), STEEL, damping_ratios=(1e-4,), theory="euler")
AS_SHAFT = CANTILEVER.replace(beam=None, structure=SHAFT)


def gains_of(rig: Rig, frequency: float) -> np.ndarray:
    """What the sensors read per newton at a frequency, Hz."""
    model = linear_model(rig)
    return model.channel_gains(np.zeros((0, model.size)), "force", np.array([2 * np.pi * frequency]))[0, :-1, -1]


@pytest.mark.parametrize("rig", [CANTILEVER, AS_SHAFT], ids=["beam", "shaft"])
def test_strain_and_angle_under_a_static_force(rig: Rig) -> None:
    """At x from the clamp ε = 6 F (L - x)/(b h² E) of the upper fibre, and w' = F (L x - x²/2)/(E I)."""
    strain = -6 * (LENGTH - np.array([1e-3, AT])) / (WIDTH * HEIGHT**2 * 210e9)
    angle = -(LENGTH * AT - AT**2 / 2) / (210e9 * INERTIA)  # RY lowers what lies ahead
    closed_form = [*strain, 0.4 * strain[1], angle, LENGTH**3 / (3 * 210e9 * INERTIA)]
    assert_allclose(gains_of(rig, 1e-4).real, closed_form, rtol=1e-6)


@pytest.mark.parametrize("rig", [CANTILEVER, AS_SHAFT], ids=["beam", "shaft"])
def test_strain_at_resonance_is_that_of_the_mode(rig: Rig) -> None:
    """Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1: y''(0) L²/λ² = y(L) in size."""
    root = 1.8751040687
    frequency = root**2 / (2 * np.pi * LENGTH**2) * np.sqrt(210e9 * INERTIA / (7850.0 * WIDTH * HEIGHT))
    strain, *_, tip = gains_of(rig.replace(sensors=(Sensor(1, 1e-6, quantity="strain"), GAUGES[-1])), frequency)
    assert_allclose(strain / tip, -HEIGHT / 2 * root**2 / LENGTH**2, rtol=2e-3)


@pytest.mark.parametrize("engine", ["modal", "links"])
def test_strain_and_angle_over_time_are_those_of_the_gains(engine: str) -> None:
    rig = in_the_gap(GAUGES[1], GAUGES[3])
    omega, drive, channels, _ = steady(rig, engine)
    model, low = linear_model(rig), omega < 2 * np.pi * 60
    gains = model.channel_gains(np.zeros((0, model.size)), "base", omega[low])[:, :-1, -1].T
    for seen, gain in zip((channels / drive)[:, low], gains):
        assert_allclose(seen, gain, atol=3e-2 * np.abs(gain).max())


def test_a_twist_is_read_at_its_point() -> None:
    """A tube of length L, clamped, under a torque T at its end turns by T L/(G J)."""
    tube = Shaft((Section(0.5, 0.03),), (CLAMP,), (), STEEL, theory="euler")
    sensors, shaker = (Sensor(1, "@0.5:RX", quantity="angle"),), Shaker("force", "@0.5:RX")
    twisted = Rig("tube", None, (), sensors, shaker=shaker, structure=tube)
    assert twisted.sensor_labels == ["1:+RX"]
    polar, shear = np.pi * 0.03**4 / 32, 210e9 / 2.6
    assert_allclose(gains_of(twisted, 1e-2).real, [0.5 / (shear * polar)], rtol=1e-6)


@pytest.mark.parametrize("engine", ["modal", "links"])
def test_an_angular_velocity_is_the_derivative_of_the_angle(engine: str) -> None:
    """Of steady vibrations: iω θ, by the scheme's i sin(ωh)/h; about y as about every axis that is named."""
    rig = in_the_gap(Sensor(1, X, quantity="angle"), Sensor(1, X, quantity="angular velocity"))
    assert rig.sensor_labels == ["1:+RY", "1:+RY"]
    omega, _, (angle, rate), h = steady(rig, engine)
    assert_allclose(rate, 1j * np.sin(omega * h) / h * angle, atol=1e-6 * np.abs(rate).max())
