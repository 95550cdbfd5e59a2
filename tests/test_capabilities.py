"""What acts on which clearance: each cell of docs/capabilities.md is run, and held to what it names.

``python -m tests.test_capabilities`` writes the page, which a test compares. All rigs have the same clamped shaft with
a disc at its end, whose statics are closed forms (Gere & Timoshenko, Mechanics of Materials, 1997).
"""

import dataclasses
import functools
import math
from types import SimpleNamespace

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.clearance.along import forces_along
from clearance_mj.clearance.record import clearance_records
from clearance_mj.engines import simulate_together, static_equilibrium
from clearance_mj.engines.links import Links
from clearance_mj.report.clip import clip
from clearance_mj.report.figures.rig_figure import rig_drawing
from clearance_mj.rig import (
    Bushing,
    Contact,
    Friction,
    Grease,
    Load,
    OilFilm,
    Order,
    Rig,
    Sensor,
    Shaker,
    Spin,
    Unbalance,
)
from clearance_mj.rotors import unbalance_response
from clearance_mj.structure import Disc, Material, Section, Shaft, Support
from tests.conftest import ROOT
from tests.identify import capability_rows as identification_rows
from tests.periodic import capability_rows
from tests.tolerance import capability_rows as population_rows

PAGE = ROOT / "docs" / "capabilities.md"
LENGTH, DIAMETER, MASS, POLAR, FS = 0.8, 0.014, 0.5, 8e-4, 4096.0
STEEL = Material(210e9, 7850.0)
SHAFT = Shaft(
    (Section(LENGTH, DIAMETER),), (Support(0.0, "clamped"),), (Disc(LENGTH, MASS, 4e-4, polar_inertia=POLAR),), STEEL,
    (40.0, 4e-6), theory="euler",
)  # fmt: skip
RIGID = STEEL.young_modulus * np.pi * DIAMETER**4 / 64  # N m²
TWISTED = STEEL.young_modulus / (2 * (1 + STEEL.poisson_ratio)) * np.pi * DIAMETER**4 / 32  # N m²
WEIGHT = 9.81 * STEEL.density * np.pi * DIAMETER**2 / 4  # N/m
GREASE, NONE, CONTACT = Grease(500.0, 3.0), Grease(0.0), Contact(4e4, 8.0)
SLOT = Bushing(0.6, 2e-4, 0.0, GREASE, CONTACT, offset=2e-5)
STOP = Bushing(0.6, 2e-4, 0.0, GREASE, CONTACT, stops="lower")
TEETH = Bushing(f"@{LENGTH}:RX", 1e-3, 0.0, NONE, Contact(400.0, 0.02))
ROUND = Bushing(0.4, 1e-4, 0.0, GREASE, CONTACT, shape="round", offset_y=2e-5)
FILM = dataclasses.replace(ROUND, length=0.01, grease=NONE, film=OilFilm(5e-4, cavitated=False, asperities=2e-5))
TORQUE = (Load(TEETH.position, torque=0.6),)
ALONG_Z, ACROSS = Shaker("force", 0.7), Shaker("force", 0.7, direction=(0.0, 0.6, 0.8))
BENDING = Sensor(1, 0.7, quantity="displacement"), Sensor(2, 0.7, quantity="velocity")
TWIST = Sensor(1, TEETH.position, quantity="angle"), Sensor(2, TEETH.position, quantity="angular velocity")


def of_shaft(bushings, sensors=BENDING, shaker=ALONG_Z, **more):
    return Rig("column", None, bushings, sensors, structure=SHAFT, shaker=shaker, **more)


DOWN = {"gravity": (0.0, 0.0, -9.81)}
COLUMNS = {
    "slot": of_shaft((SLOT,), **DOWN),
    "one-sided stop": of_shaft((STOP,), **DOWN),
    "teeth with mean torque": of_shaft((TEETH,), TWIST, Shaker("force", TEETH.position), loads=TORQUE),
    "round": of_shaft((ROUND,), shaker=ACROSS, **DOWN),
    "round turning with film": of_shaft(
        (FILM,), shaker=ACROSS, spin=Spin(100.0), unbalances=(Unbalance(0.8, 1e-4),),
        loads=(Load(FILM.position, force=(0.0, 0.0, -0.3)),),
    ),
    "both kinds in one rig": of_shaft(
        (ROUND, TEETH, STOP), shaker=ACROSS, shakers=(Shaker("force", TEETH.position),), loads=TORQUE, **DOWN
    ),
}  # fmt: skip


def pushes(rig, duration=0.25):
    """A random force along the shaker, N, and on teeth a torque of a thirtieth, N m."""
    noise = cm.excitation.random(duration, FS, band=(10, 150), rms=15.0, seed=6, kind="force")
    torque = dataclasses.replace(noise, value=noise.value[::-1] / 30)
    parts = [torque if shaker.position == TEETH.position else noise for shaker in rig.inputs]
    return parts[0] if len(parts) == 1 else cm.excitation.together(*parts)


@functools.lru_cache(maxsize=32)
def balanced(rig, engine):
    return cm.energy_balance(rig, pushes(rig), engine=engine)


def differ(a, b, names=("channels", "displacement", "contact_force", "grease_force")):
    """Largest RMS of differences of two responses' rows over the RMS of the row."""
    rows = [(x, y) for name in names for x, y in zip(getattr(a, name), getattr(b, name), strict=True) if x.any()]
    return max(np.sqrt(np.mean((x - y) ** 2) / np.mean(x**2)) for x, y in rows)


def by_modes(rig):
    modal, links = (balanced(rig, engine).response for engine in ("modal", "links"))
    assert modal.contact_share.min() > 0.01
    assert differ(modal, links) < 1e-2


def by_links(rig):
    assert differ(balanced(rig, "links").response, cm.simulate(rig, pushes(rig), engine=Links(safety=0.3))) < 1e-2


def in_lanes(rig):
    factors = (0.9, 1.0, 1.1, 1.2)
    cases = [(rig.with_gap(f"x{f}"), cm.ConstantLaw([f * b.contact.stiffness for b in rig.bushings],
              [b.contact.damping for b in rig.bushings])) for f in factors]  # fmt: skip
    for (case, law), together in zip(cases, simulate_together(cases, pushes(rig))):
        alone = cm.simulate(case, pushes(rig), law, engine="modal")
        for name in ("channels", "displacement", "contact_force", "grease_force"):
            right = getattr(alone, name)
            np.testing.assert_allclose(getattr(together, name), right, rtol=0, atol=1e-9 * np.abs(right).max())


def energies_of_modes(rig):
    assert balanced(rig, "modal").imbalance < 1e-3


def energies_of_links(rig):
    links, modal = balanced(rig, "links"), balanced(rig, "modal")
    assert links.imbalance < 1e-3
    assert links.lost[-1] == pytest.approx(modal.lost[-1], rel=1e-2)


def law_of(bushing, r, v, spin=0.0):
    """Force of one clearance at r (d,) from the unloaded shaft with velocity v, written out; of oil by quadrature."""
    middle = np.array([bushing.offset_y, bushing.offset])[-r.size :]
    place, distance = r + middle, np.linalg.norm(r + middle)
    n = place / distance if distance else np.zeros(r.size)
    touches = distance > bushing.gap and not (bushing.stops == "lower" and place[-1] > 0)
    push = bushing.contact.stiffness * (distance - bushing.gap) + bushing.contact.damping * (n @ v)
    force = max(push, 0.0) * n if touches else 0.0 * n
    if bushing.film is None:
        return force + bushing.grease.stiffness * r + bushing.grease.damping * v
    angle = np.linspace(0, 2 * np.pi, 4000, endpoint=False)
    cos, sin = np.cos(angle), np.sin(angle)
    film = bushing.gap - place[0] * cos - place[1] * sin
    film = np.maximum(film, bushing.film.asperities)
    closing = -v[0] * cos - v[1] * sin + spin / 2 * (place[0] * sin - place[1] * cos)
    pressure = -bushing.film.viscosity * bushing.length**3 * closing / film**3 * DIAMETER / 2 * 2 * np.pi / angle.size
    return force + np.array([np.sum(pressure * cos), np.sum(pressure * sin)])


def along_a_motion(rig):
    """A motion to 1.3 gaps, or 0.7 in oil above its asperities, whose two coordinates have different frequencies."""
    time, spin = np.arange(2000) * 1e-5, rig.spin.speed if rig.spin else 0.0
    for j, bushing in enumerate(rig.bushings):
        omega, size = 2 * np.pi * np.array([[90.0, 140.0]])[:, -bushing.n_coordinates :], bushing.gap
        size *= 0.35 if bushing.film else 0.9 * math.sqrt(3 - bushing.n_coordinates)
        x, v = size * np.sin(time[:, None] * omega), size * omega * np.cos(time[:, None] * omega)
        records = clearance_records(SimpleNamespace(bushings=rig.bushings, linear=rig.linear), datasheet(rig), 1e-5)
        forces = forces_along(records, j, *(np.repeat(part[:, None], 3, axis=1) for part in (x, v)), spin)
        known = np.array([law_of(bushing, *each, spin) for each in zip(x, v)])
        np.testing.assert_allclose(forces, known, rtol=0, atol=1e-6 * np.abs(known).max())


def datasheet(rig):
    return cm.ConstantLaw([b.contact.stiffness for b in rig.bushings], [b.contact.damping for b in rig.bushings])


def influence(at, of):
    """Deflection of the cantilever at one place under a unit force at another, m/N."""
    a, b = min(at, of), max(at, of)
    return a**2 * (3 * b - a) / (6 * RIGID)


def at_rest(rig):
    """Displacements are those of the shaft under its weight, its load and the forces of the laws there.

    Its damping does not turn with it, which would press it to the side.
    """
    rig = rig.replace(structure=dataclasses.replace(SHAFT, rayleigh=(40.0, 0.0)))
    rest, spin = static_equilibrium(rig), rig.spin.speed if rig.spin else 0.0
    places = [LENGTH if b == TEETH else b.position for b in rig.bushings]
    forces = [law_of(b, rest.displacement[rows], np.zeros(b.n_coordinates), spin)
              for b, rows in zip(rig.bushings, rig.clearance_rows)]  # fmt: skip
    for bushing, x, force, rows in zip(rig.bushings, places, forces, rig.clearance_rows):
        np.testing.assert_allclose((rest.contact_force + rest.grease_force)[rows], force, rtol=1e-5, atol=1e-9)
        if bushing == TEETH:
            known = np.array([(0.6 - force[0]) * LENGTH / TWISTED])
        else:
            others = [(at, f) for b, at, f in zip(rig.bushings, places, forces) if b != TEETH]
            known = np.zeros(2)
            if rig.loads and rig.spin:
                known[1] -= 0.3 * influence(x, FILM.position)
            if rig.gravity:
                known[1] -= WEIGHT * x**2 * (6 * LENGTH**2 - 4 * LENGTH * x + x**2) / (24 * RIGID)
                known[1] -= 9.81 * MASS * influence(x, LENGTH)
            for at, f in others:
                known[2 - f.size :] -= influence(x, at) * f
            known = known[2 - bushing.n_coordinates :]
        np.testing.assert_allclose(rest.displacement[rows], known, rtol=1e-5, atol=1e-5 * bushing.gap)


def impacts(rig):
    """Of rigs without weight, which would lay the shaft onto its walls."""
    rig = rig.replace(gravity=None)
    modal, links = (sorted(balanced(rig, engine).impacts, key=lambda i: i.peak_force)[::-1][:4] for engine in
                    ("modal", "links"))  # fmt: skip
    assert modal
    for one, other in zip(modal, links, strict=True):
        assert (one.bushing, one.side) == (other.bushing, other.side)
        assert one.peak_force == pytest.approx(other.peak_force, rel=2e-2)
        assert one.impulse == pytest.approx(other.impulse, rel=2e-2)


def friction(rig):
    bushings = tuple(
        dataclasses.replace(b, friction=Friction(0.2, stiffness=2e4, damping=0.5)) if b != TEETH else b
        for b in rig.bushings
    )
    rubbing = rig.replace(bushings=bushings, shaker=ACROSS)
    modal, links = balanced(rubbing, "modal"), balanced(rubbing, "links")
    assert max(modal.imbalance, links.imbalance) < 1e-3
    lost = modal.friction[:, -1]
    assert all(loss > 0 for loss, b in zip(lost, bushings) if b.friction)
    np.testing.assert_allclose(links.friction[:, -1], lost, rtol=2e-2)


def sensors(rig):
    """The integral of the second sensor, a velocity, is what the first one reads."""
    for engine in ("modal", "links"):
        place, velocity = balanced(rig, engine).response.channels
        moved = np.concatenate(([0.0], np.cumsum(velocity[1:] + velocity[:-1]) / (2 * FS)))
        np.testing.assert_allclose(moved, place - place[0], atol=1e-2 * np.ptp(place))


def driven_by_turning(rig):
    """In the gaps: unbalance as the linear response of `unbalance_response`; an order's torque in closed form."""
    gap, speed, duration = 0.1, 60.0, 0.5
    bushings = tuple(dataclasses.replace(b, gap=gap, grease=NONE, film=None) for b in rig.bushings)
    turned = rig.replace(
        bushings=bushings, gravity=None, loads=(), spin=Spin(speed), unbalances=(Unbalance(0.7, 1e-4),),
        orders=(Order(LENGTH, 2.0, torque=0.1),), shakers=(), shaker=ACROSS,
    )  # fmt: skip
    response = cm.simulate(turned, cm.Excitation(np.zeros(round(duration * FS)), FS, "force"), engine="modal")
    planes = {}
    if TEETH.position != rig.bushings[0].position:
        known = unbalance_response(turned, np.array([speed - 1, speed, speed + 1]))
        planes = dict(zip(known.planes, np.abs(known.motion[:, np.argmin(np.abs(known.speed - speed))])))
    wave = 2 * speed * math.sqrt(STEEL.density * TWISTED / (np.pi * DIAMETER**4 / 32)) / (
        TWISTED / (np.pi * DIAMETER**4 / 32)
    )  # fmt: skip
    angle = 0.1 / (TWISTED * wave / math.tan(wave * LENGTH) - POLAR * (2 * speed) ** 2)
    for label, x in zip(turned.probe_labels, response.displacement):
        times = response.time[response.time.size // 2 :]
        order = 2 if "R" in label else 1
        base = [f(k * speed * times) for k in (1, 2) for f in (np.cos, np.sin)]
        fitted = np.linalg.lstsq(np.stack([*base, np.ones(times.size)], axis=1), x[-times.size :], rcond=None)[0]
        fitted_order = np.hypot(*fitted[2 * order - 2 : 2 * order])
        assert fitted_order == pytest.approx(angle if order == 2 else planes[label], rel=1e-2)


def pictures(rig):
    """A side view is drawn; lifts of the shaft in its clearances are the recorded displacements."""
    assert len(rig_drawing(rig).figure.axes[0].patches) > 2
    response = balanced(rig, "modal").response
    shown = clip(rig, response, 0.05, 0.1, slow=60.0)
    for bushing, rows in zip(rig.bushings, rig.clearance_rows):
        if bushing == TEETH:
            continue
        samples = np.round(shown.time * FS).astype(int)
        lift = shown.lift_at(bushing.position).reshape(samples.size, -1)[:, -bushing.n_coordinates :]
        np.testing.assert_allclose(lift.T, response.displacement[rows][:, samples], atol=1e-3 * bushing.gap)


ROWS = {
    "simulate, `modal`": (by_modes, "`links`, 1 % of RMS"),
    "simulate, `links`": (by_links, "`links` at half the step, 1 % of RMS"),
    "simulate many cases at once, `modal`": (in_lanes, "each case alone, 1e-9"),
    "energies, `modal`": (energies_of_modes, "residual of the energy balance, 1e-3"),
    "energies, `links`": (energies_of_links, "residual of the energy balance, 1e-3; losses of `modal`, 1 %"),
    "force along a motion": (along_a_motion, "formulas of the laws, 1e-6"),
    "static equilibrium under weight and loads": (at_rest, "statics of a cantilever in closed form, 1e-5"),
    "impacts": (impacts, "peak and impulse of `links`, 2 %"),
    "friction": (friction, "residual of the energy balance, 1e-3; losses of `links`, 2 %"),
    "sensors": (sensors, "integral of the velocity, 1 %"),
    "unbalance and orders of the spin": (driven_by_turning, "linear response, 1 %"),
    "drawing and animation": (pictures, "recorded displacements, 1e-3 of the gap"),
    **capability_rows.ROWS,
    **identification_rows.ROWS,
    **population_rows.ROWS,
}
"""Of each capability the check and the known answer or other method"""
SLIDING = "the model has angles only, while tooth flanks slide along the line of action and back beyond the pitch point"
REASONS = {
    (
        "friction",
        "teeth with mean torque",
    ): SLIDING,
    (
        "life under a sine",
        "teeth with mean torque",
    ): SLIDING,
    ("sound of a plate", "teeth with mean torque"): "torsion of a shaft moves no plate",
    ("backbone", "round turning with film"): "free vibration in oil that rotates is a whirl (`follow_whirl`), "
    "not an oscillating mode",
}
"""Cells that mean nothing, and why"""
SLOW = {("level of first contact", "round turning with film"), ("periodic response over frequency", "slot")}
SLOW_ROWS = *capability_rows.SLOW, *identification_rows.SLOW, *population_rows.SLOW
SLOW |= {(row, column) for row in SLOW_ROWS for column in COLUMNS}
CELLS = [
    pytest.param(*cell, marks=pytest.mark.slow if cell in SLOW else ())
    for row in ROWS for column in COLUMNS if (cell := (row, column)) not in REASONS
]  # fmt: skip


def page():
    """The page: which analysis takes which clearance, what it is compared with, and the exceptions."""
    lines = [
        "# Capabilities", "",
        "Which analysis takes which kind of clearance. `tests/test_capabilities.py` runs every cell with a ✓ and",
        "compares it with the reference of its row, within the given tolerance. A cell with a – is an analysis that",
        "has no meaning for that clearance, as the last table explains. `python -m tests.test_capabilities` writes",
        "this page.", "",
        f"| analysis | reference, tolerance | {' | '.join(COLUMNS)} |", f"|---|---|{':---:|' * len(COLUMNS)}",
    ]  # fmt: skip
    for row, (_, reference) in ROWS.items():
        cells = ("–" if (row, column) in REASONS else "✓" for column in COLUMNS)
        lines.append(f"| {row} | {reference} | {' | '.join(cells)} |")
    lines += ["", "| analysis | clearance | why it has no meaning |", "|---|---|---|"]
    lines += [f"| {row} | {column} | {reason} |" for (row, column), reason in REASONS.items()]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("row", "column"), CELLS, ids=lambda name: name.replace(" ", "-"))
def test_cell(row, column):
    ROWS[row][0](COLUMNS[column])


def test_the_page_says_what_is_run():
    assert PAGE.read_text(encoding="utf-8") == page(), "python -m tests.test_capabilities writes it anew"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
