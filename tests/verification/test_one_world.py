"""Slots, stops, teeth and round clearances are one: on a line they are equal, and one rig may have all of them.

The other method is the tests' own: finite elements of a shaft that bends in both planes (Euler and Bernoulli's beam,
consistent masses) and twists (linear shapes), in its lowest modes, by Runge and Kutta's method of fourth order at a
fiftieth of the engines' steps. It shares nothing with the package but the numbers of the rig.
"""

import dataclasses

import numpy as np
import pytest
import scipy.linalg

import clearance_mj as cm
from clearance_mj.clearance import AmplitudeLaw, ContactLaw, TimeLaw
from clearance_mj.core.jit import jit
from clearance_mj.engines import Links, simulate_together
from clearance_mj.rig import Bushing, Contact, Friction, Grease, Load, Rig, Sensor, Shaker
from clearance_mj.structure import Disc, Material, Section, Shaft, Support
from tests.conftest import TABLE1

from ..clearance.laws import CONTACTS, FILLINGS
from ..engines.alike import with_bushings
from ..structure.small_matrices import beam_elements

LAWS = [
    *(ContactLaw(contact, FILLINGS[1]) for contact in CONTACTS),
    *(ContactLaw(CONTACTS[2], filling) for filling in FILLINGS),
    TimeLaw([0.0, 0.5], [1e4, 3e4], [3.0, 9.0], FILLINGS[2]),
    AmplitudeLaw([1e-4, 6e-4], [1e4, 3e4], [3.0, 9.0], grease=FILLINGS[1]),
]
RUBBING = with_bushings(TABLE1.with_shape("round"), friction=Friction(0.2))
"""Table 1's rig with round clearances that rub; shaken along z they move on a line, and nothing slides"""


def shaken(duration, rms, kind="base", fs=2048.0, band=(5, 220)):
    return cm.excitation.random(duration, fs, band=band, rms=rms, seed=4, kind=kind)


def largest_difference(a, b):
    """Of two responses, as shares of the largest displacement and force: of slots, and along z of round clearances."""
    of_rows = [
        np.abs(getattr(a, name) - getattr(b, name)[1::2]).max() / np.abs(getattr(a, name)).max()
        for name in ("displacement", "contact_force", "grease_force")
        if getattr(a, name).any()
    ]
    return max(*of_rows, np.abs(a.channels - b.channels).max() / np.abs(a.channels).max())


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law.kind}-{getattr(law, 'grease', None)}"[:60])
def test_round_clearances_on_a_line_are_slots(law):
    slots, rounds = (cm.simulate(rig, shaken(1.0, 8.0), law, engine="modal") for rig in (TABLE1, RUBBING))
    assert slots.contact_share.max() > 1e-3
    for of_rounds in (rounds.displacement, rounds.contact_force, rounds.grease_force):
        assert np.abs(of_rounds[::2]).max() <= 1e-12 * np.abs(of_rounds).max()
    assert largest_difference(slots, rounds) < 1e-9
    np.testing.assert_array_equal(slots.contact_share, rounds.contact_share)


@pytest.mark.parametrize(("rms", "tolerance"), [(0.3, 1e-9), (8.0, 1e-3)])
def test_round_clearances_on_a_line_are_slots_in_links(rms, tolerance):
    law = cm.ConstantLaw(6e3, 12.0, grease=Grease(4e3, 5.0))
    rigs = TABLE1, TABLE1.with_shape("round")
    slots, rounds = (cm.simulate(rig, shaken(0.5, rms), law, engine="links") for rig in rigs)
    assert (slots.contact_share.max() > 1e-3) == (rms > 1)
    assert largest_difference(slots, rounds) < tolerance


# A rig with both kinds: a round bushing, teeth under a mean torque and a stop, on a shaft of steel with a disc.
LENGTH, DIAMETER, ELEMENTS, MODES = 0.8, 0.014, 16, 14  # elements; modes of each plane, and of the twist
E, DENSITY, POISSON, RAYLEIGH = 210e9, 7850.0, 0.3, (2.0, 4e-6)
MASS, INERTIA, POLAR = 0.5, 4e-4, 8e-4  # of the disc at the end: kg, and kg m² about a diameter and the axis
AT_ROUND, AT_STOP, AT_FORCE = 0.4, 0.6, 0.7
ROUND = Bushing(AT_ROUND, 1e-4, 0.0, Grease(500.0, 3.0), Contact(4e4, 8.0), shape="round", offset_y=2e-5)
TEETH = Bushing(f"@{LENGTH}:RX", 1e-3, 0.0, Grease(0.0), Contact(400.0, 0.02))
STOP = Bushing(AT_STOP, 2e-4, 0.0, Grease(200.0, 1.0), Contact(3e4, 6.0), stops="lower")
MIXED = Rig(
    "both kinds", None, (ROUND, TEETH, STOP),
    (Sensor(1, 0.7, quantity="velocity"), Sensor(2, f"@{LENGTH}:RX", quantity="angle")),
    structure=Shaft(
        (Section(LENGTH, DIAMETER),), (Support(0.0, "clamped"),), (Disc(LENGTH, MASS, INERTIA, polar_inertia=POLAR),),
        Material(E, DENSITY, POISSON), RAYLEIGH, theory="euler",
    ),
    gravity=(0.0, 0.0, -9.81), loads=(Load(f"@{LENGTH}:RX", torque=0.6),),
    shaker=Shaker("force", AT_FORCE, direction=(0.0, 0.6, 0.8)),
    shakers=(Shaker("force", f"@{LENGTH}:RX"),),
)  # fmt: skip


def plane_of_elements():
    """Modes of unit mass (dofs, modes) of deflection and slope at the nodes, ω² and the force of a unit weight."""
    nodes, bending = np.linspace(0.0, LENGTH, ELEMENTS + 1), E * np.pi * DIAMETER**4 / 64
    mass, stiffness = beam_elements(nodes, bending, DENSITY * np.pi * DIAMETER**2 / 4)
    mass[-2, -2] += MASS
    mass[-1, -1] += INERTIA
    square, shapes = scipy.linalg.eigh(stiffness[2:, 2:], mass[2:, 2:])
    modes = np.vstack((np.zeros((2, MODES)), shapes[:, :MODES]))
    return modes, square[:MODES], np.tile([1.0, 0.0], ELEMENTS + 1) @ mass @ modes


def twist_of_elements():
    """Modes of the angle at the nodes and their ω²."""
    size, polar = LENGTH / ELEMENTS, np.pi * DIAMETER**4 / 32
    mass, stiffness = np.zeros((2, ELEMENTS + 1, ELEMENTS + 1))
    for i in range(ELEMENTS):
        part = slice(i, i + 2)
        mass[part, part] += DENSITY * polar * size * np.array([[2, 1], [1, 2]]) / 6
        stiffness[part, part] += E / (2 * (1 + POISSON)) * polar / size * np.array([[1, -1], [-1, 1]])
    mass[-1, -1] += POLAR
    square, shapes = scipy.linalg.eigh(stiffness[1:, 1:], mass[1:, 1:])
    return np.vstack((np.zeros((1, MODES)), shapes[:, :MODES])), square[:MODES]


@jit
def clearance_forces(x, v, forces):
    """Rows y and z of the round bushing, then teeth, then stop: contact in the first four, fillings in the others."""
    y, z = x[0] + 2e-5, x[1]
    e = np.sqrt(y * y + z * z)
    push = max(4e4 * (e - 1e-4) + 8.0 * (y * v[0] + z * v[1]) / e, 0.0) if e > 1e-4 else 0.0
    forces[0], forces[1] = push * y / e, push * z / e
    forces[4], forces[5] = 500.0 * x[0] + 3.0 * v[0], 500.0 * x[1] + 3.0 * v[1]
    side, deep = np.sign(x[2]), abs(x[2]) - 1e-3
    forces[2] = side * max(400.0 * deep + 0.02 * side * v[2], 0.0) if deep > 0.0 else 0.0
    forces[6] = 0.0
    forces[3] = min(3e4 * (x[3] + 2e-4) + 6.0 * v[3], 0.0) if x[3] < -2e-4 else 0.0
    forces[7] = 200.0 * x[3] + 1.0 * v[3]


@jit
def faster(q, v, steady, given, square, damping, rows, inputs, x, w, forces):
    x[:], w[:] = rows @ q, rows @ v
    clearance_forces(x, w, forces)
    return steady + inputs.T @ given - square * q - damping * v - rows.T @ (forces[:4] + forces[4:])


@jit
def runge_kutta(q, v, steady, drive, h, square, damping, rows, inputs, every):
    """Rows, velocities and forces at every so many steps; drive (2 n + 1, inputs) at half steps."""
    n = (len(drive) - 1) // 2
    x, w, forces = np.zeros(4), np.zeros(4), np.zeros(8)
    out, coordinates = np.zeros((n // every + 1, 12)), np.zeros((n // every + 1, 2, q.size))
    for i in range(n + 1):
        a = faster(q, v, steady, drive[2 * i], square, damping, rows, inputs, x, w, forces)
        if i % every == 0:
            out[i // every, :4], out[i // every, 4:] = x, forces
            coordinates[i // every, 0], coordinates[i // every, 1] = q, v
        if i == n:
            break
        half, end = drive[2 * i + 1], drive[2 * i + 2]
        v1 = v + h / 2 * a
        b = faster(q + h / 2 * v, v1, steady, half, square, damping, rows, inputs, x, w, forces)
        v2 = v + h / 2 * b
        c = faster(q + h / 2 * v1, v2, steady, half, square, damping, rows, inputs, x, w, forces)
        v3 = v + h * c
        d = faster(q + h * v2, v3, steady, end, square, damping, rows, inputs, x, w, forces)
        q, v = q + h / 6 * (v + 2 * v1 + 2 * v2 + v3), v + h / 6 * (a + 2 * b + 2 * c + d)
    return out, coordinates


DURATION, FS, SUB = 0.5, 4096.0, 32  # s, Hz, steps in a sample
TONES = np.array([(23.0, 10.0, 0.8), (57.0, 9.0, 0.5), (110.0, 6.0, 0.3)])  # Hz, N, N m


def driven(time):
    """Force and torque (n, 2), which grow within 0.05 s: a sum of tones, which is known between the samples, too."""
    phase = 2 * np.pi * TONES[:, 0] * time[:, None]
    grown = np.sin(np.minimum(time / 0.05, 1.0) * np.pi / 2)[:, None] ** 2
    return grown * np.stack((np.sin(phase) @ TONES[:, 1], np.cos(phase) @ TONES[:, 2]), axis=1)


@pytest.fixture(scope="module")
def known():
    """Displacements (4, n), contact forces, fillings' forces, and the sensors (2, n), by the method of this file."""
    modes, square, weight = plane_of_elements()
    twist, of_twist = twist_of_elements()
    n, nodes = 3 * MODES, {x: 2 * round(x / LENGTH * ELEMENTS) for x in (AT_ROUND, AT_STOP, AT_FORCE)}
    rows, inputs = np.zeros((4, n)), np.zeros((2, n))
    along = [slice(0, MODES), slice(MODES, 2 * MODES), slice(2 * MODES, n)]
    for row, plane, shape in ((0, 0, modes[nodes[AT_ROUND]]), (1, 1, modes[nodes[AT_ROUND]]), (2, 2, twist[-1]),
                              (3, 1, modes[nodes[AT_STOP]])):  # fmt: skip
        rows[row, along[plane]] = shape
    inputs[0, along[0]], inputs[0, along[1]] = 0.6 * modes[nodes[AT_FORCE]], 0.8 * modes[nodes[AT_FORCE]]
    inputs[1, along[2]] = twist[-1]
    square = np.concatenate((square, square, of_twist))
    damping = RAYLEIGH[0] + RAYLEIGH[1] * square
    steady = 0.6 * np.concatenate((np.zeros(2 * MODES), twist[-1]))
    steady[along[1]] -= 9.81 * weight
    # At rest: long enough with a heavy damping of all modes.
    h = 1 / (FS * SUB)
    settled = runge_kutta(np.zeros(n), np.zeros(n), steady, np.zeros((2 * 100_000 + 1, 2)), h, square,
                          2 * np.sqrt(square), rows, inputs, 100_000)[1][-1]  # fmt: skip
    assert np.abs(settled[1]).max() < 1e-9
    time = np.arange(2 * round(DURATION * FS) * SUB - 2 * SUB + 1) * h / 2
    out, states = runge_kutta(settled[0], np.zeros(n), steady, driven(time), h, square, damping, rows, inputs, SUB)
    velocity = states[:, 1, along[1]] @ modes[nodes[0.7]]
    return out[:, :4].T, out[:, 4:8].T, out[:, 8:].T, np.stack((velocity, states[:, 0, along[2]] @ twist[-1]))


@pytest.fixture(scope="module")
def pushed():
    parts = driven(np.arange(round(DURATION * FS)) / FS).T
    return cm.excitation.together(*(cm.Excitation(part, FS, "force") for part in parts))


@pytest.mark.parametrize("engine", ["modal", Links(links=32)], ids=["modal", "links"])
def test_both_kinds_move_as_finite_elements_do(engine, known, pushed, measured):
    balance = cm.energy_balance(MIXED, pushed, engine=engine)
    response = balance.response
    assert (response.contact_share > 0.02).all() and (response.contact_share < 0.98).all()
    for name, expected in zip(["displacement", "contact_force", "grease_force", "channels"], known):
        for row, (marched, right) in enumerate(zip(getattr(response, name), expected, strict=True)):
            if not right.any():
                assert not marched.any()
                continue
            error = np.sqrt(np.mean((marched - right) ** 2) / np.mean(right**2))
            what = f"both kinds of clearance, {response.provenance['engine']}: {name} {row}, error over RMS"
            measured.below(what, error, 1e-2, "finite elements, Runge and Kutta's method")
    assert balance.imbalance < 1e-3 and {impact.bushing for impact in balance.impacts} == {0, 1, 2}


def test_eight_of_both_kinds_side_by_side_are_each_alone(pushed):
    """With friction in all, laws over time, and numbers that differ from case to case."""
    cases = []
    for i in range(8):
        rub = Friction(0.1 + 0.05 * i, stiffness=2e4, damping=0.5)
        around = dataclasses.replace(ROUND, gap=ROUND.gap * (1 + 0.1 * i), friction=rub)
        bushings = around, TEETH, dataclasses.replace(STOP, friction=rub)
        law = TimeLaw([0.0, 0.3], [[4e4, 400.0, 3e4], [3e4 + 1e3 * i, 300.0 + 10 * i, 2e4]], [[8.0, 0.02, 6.0]] * 2)
        cases.append((MIXED.replace(bushings=bushings), law))
    together = simulate_together(cases, pushed)
    assert np.ptp([each.contact_force.std(axis=1) for each in together], axis=0).min() > 0.0
    for (rig, law), side_by_side in zip(cases, together):
        alone = cm.simulate(rig, pushed, law, engine="modal")
        assert alone.contact_share.min() > 0.01
        for name in ("channels", "displacement", "contact_force", "grease_force"):
            for row, right in zip(getattr(side_by_side, name), getattr(alone, name), strict=True):
                np.testing.assert_allclose(row, right, rtol=0, atol=1e-9 * np.abs(right).max())
