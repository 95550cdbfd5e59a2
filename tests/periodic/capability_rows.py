"""Rows of docs/capabilities.md about periodic vibrations: what each analysis is held to, on the rig of any column.

References share nothing with harmonic balance where there is one: marches by the modal engine, linear responses. Other
rows hold two analyses to each other that come to one vibration by different ways.
"""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj import linear_model, periodic
from clearance_mj.engines import static_equilibrium
from clearance_mj.rig import Contact, Grease, Sensor, Spin
from experiments.periodic.drawn import Vibration, compared, marches
from experiments.periodic.drawn_rigs import Drawn, everywhere

MODES, HARMONICS, SAMPLES = 3, 31, 1024
KINDS = ("slot", "stop", "teeth", "round", "film", "both")
DRIVEN = dict.fromkeys(KINDS, (15.0, 25.0)) | {"teeth": (0.3, 100.0), "film": (40.0, 40.0)}
"""By kind of clearance level, N or N m, and frequency, Hz, at which contact comes and goes, or slides along the wall"""
FOLDED = dict.fromkeys(KINDS, (0.5, (24.0, 8.0))) | {"teeth": (0.05, (250.0, 90.0))}
"""Level and range of frequencies in which a lightly damped shaft without weight jumps"""
DOUBLED = {"slot": (6.5, 14.5), "stop": (20.0, 9.0), "teeth": (0.6, 290.0), "both": (8.0, 15.0), "film": (15.0, 22.25)}
"""Level and frequency at which marches of the lightly damped shaft come to twice the excitation's period"""

FINER = {"film": {"harmonics": 61, "samples": 2048}}
"""Of doubled vibrations in oil, which miss a march by 0.15 % with 31 harmonics"""


def kind_of(rig):
    turns = ["RX" in str(bushing.position) for bushing in rig.bushings]
    if any(turns):
        return "teeth" if all(turns) else "both"
    (bushing,) = rig.bushings
    return "film" if bushing.film else "round" if bushing.is_round else "slot" if bushing.stops == "both" else "stop"


def excited(rig, **changes):
    """The rig under its shaker alone, with probes that know every mode."""
    length = rig.structure.sections[0].length
    sensors = everywhere(length, rig.moves_across)
    if kind_of(rig) in ("teeth", "both"):
        angles = tuple(Sensor(31 + i, f"@{length * (i + 1) / 4}:RX", quantity="angle") for i in range(4))
        sensors = angles if kind_of(rig) == "teeth" else (*sensors, *angles)
    return rig.replace(**{"sensors": sensors, "unbalances": (), "shakers": (), **changes})


def lively(rig, **changes):
    """The rig whose shaft is lightly damped."""
    return excited(rig, structure=dataclasses.replace(rig.structure, rayleigh=(5.0, 1e-6)), **changes)


def weightless(rig):
    """What teeth keep is their torque, or nothing that folds or comes free is left of them."""
    return {"gravity": None} if kind_of(rig) in ("teeth", "both") else {"gravity": None, "loads": ()}


def followed(rig, level, ends, harmonics=HARMONICS, samples=SAMPLES, **settings):
    return periodic.follow_response(cm.Model(rig), level, ends, harmonics, samples, n_modes=MODES, **settings)


def stays(branch, i):
    """A stable point stays when it is marched, an unstable one leaves: see `experiments.periodic.drawn`."""
    comparison = compared(Drawn("", branch.model, abs(branch.level[i, 0]), branch.frequency[i]), 0, branch, i)
    assert comparison is not None, "its transient lasts for too long"
    assert comparison.passes, f"{comparison.off:.1e} after {comparison.periods} periods"


def steadiest(branch, points):
    """The point whose transients die out soonest."""
    return int(min(points, key=lambda i: abs(branch.multipliers[i, 0])))


def ends_and_middle(branch):
    return 0, branch.frequency.size // 2, branch.frequency.size - 1


def over_frequency(rig):
    level, frequency = DRIVEN[kind_of(rig)]
    branch = followed(excited(rig), level, (frequency, 1.02 * frequency))
    assert branch.contact_force.any(axis=(1, 2)).all() and branch.stable.all()
    for i in ends_and_middle(branch):
        stays(branch, i)


def over_level(rig):
    (level, frequency), rig = DRIVEN[kind_of(rig)], excited(rig)
    ends, settings = (0.02 * level, level), {"n_modes": MODES, "stability": False}
    branch = periodic.follow_response_over_level(cm.Model(rig), frequency, ends, HARMONICS, SAMPLES, **settings)
    ends_at(branch, rig, level, frequency)


def ends_at(branch, rig, level, frequency):
    """The last point is the response of a rig."""
    known = followed(rig, level, (frequency, 1.001 * frequency), stability=False)
    for name in ("displacement", "clearance_displacement", "contact_force"):
        right = getattr(known, name)[0]
        np.testing.assert_allclose(getattr(branch, name)[-1], right, rtol=0, atol=1e-6 * np.abs(right).max())


def follows_over(rig, over, ends, changed):
    """Over loads, gaps or spin a response comes to that of the changed rig."""
    (level, frequency), settings = DRIVEN[kind_of(rig)], {"n_modes": MODES, "stability": False}
    branch = periodic.follow_response_over(cm.Model(rig), over, ends, frequency, level, HARMONICS, SAMPLES, **settings)
    assert not branch.ended
    ends_at(branch, changed, level, frequency)


def over_loads(rig):
    rig, factor = excited(rig), 1.1
    loads = tuple(
        dataclasses.replace(load, **{name: tuple(factor * np.array(value)) if name == "force" else factor * value})
        for load in rig.loads for name in ("force", "torque") if (value := getattr(load, name))
    )  # fmt: skip
    gravity = rig.gravity and tuple(factor * np.array(rig.gravity))
    follows_over(rig, "load", (1.0, factor), rig.replace(loads=loads, gravity=gravity))


def over_gaps(rig):
    rig = excited(rig)
    follows_over(rig, "gap", (1.0, 0.9), rig.with_gap([0.9 * bushing.gap for bushing in rig.bushings]))


def over_spin(rig):
    rig = excited(rig, spin=Spin(100.0))
    follows_over(rig, "spin", (100.0, 140.0), rig.replace(spin=Spin(140.0)))


def along_backbone(rig):
    """Without damping a free vibration goes on: from the state of a point, marched for two periods."""
    springs = [(Grease(b.grease.stiffness), Contact(b.contact.stiffness)) for b in rig.bushings]
    bushings = tuple(dataclasses.replace(b, grease=g, contact=c) for b, (g, c) in zip(rig.bushings, springs))
    shaft = dataclasses.replace(rig.structure, rayleigh=(0.0, 0.0))
    free = excited(rig, bushings=bushings, gravity=None, loads=(), structure=shaft)
    gap, mode = rig.bushings[0].gap, 3 if kind_of(rig) == "teeth" else 1  # others do not turn it
    sums = [(2 if rig.moves_across else 1) * n for n in (HARMONICS, SAMPLES)]
    curve = periodic.follow_backbone(cm.Model(free), mode, (0.2 * gap, 2 * gap), *sums, n_modes=MODES)
    assert not curve.contact_force[0].any() and curve.contact_force[-1].any()
    inside = linear_model(free, MODES).filled([b.grease.stiffness for b in bushings], [0.0] * len(bushings))
    frequencies = np.sqrt(np.linalg.eigvalsh(inside.elastic())) / (2 * np.pi)
    assert np.abs(frequencies / curve.frequency[0] - 1).min() < 1e-6
    np.testing.assert_allclose(curve.damping, 0, atol=1e-6)
    still, moved = np.zeros((curve.frequency.size, 1), dtype=complex), curve.clearance_displacement
    vibration = Vibration(curve.model, "force", 1, MODES, curve.frequency, still, curve.displacement, moved)
    for i in ends_and_middle(curve):
        assert min(next(marches(vibration, i, resolution, 2)) for resolution in (0.1, 0.02)) < 1e-3


def first_contact(rig):
    """Without weight and loads where the linear response just reaches the wall; what rests on a wall touches it at 0.

    In oil, which is not linear, where marches begin to touch.
    """
    model = cm.Model(excited(rig))
    frequencies = np.array([60.0, 150.0] if kind_of(rig) == "teeth" else [5.0, 20.0, 60.0])
    settings = {"n_harmonics": HARMONICS, "n_modes": MODES}
    if static_equilibrium(model.rig).contact_force.any():
        np.testing.assert_array_equal(periodic.find_first_contact(model, frequencies, **settings).value, 0.0)
    free = excited(rig, gravity=None, loads=())
    contacts = periodic.find_first_contact(cm.Model(free), frequencies, **settings).value
    if kind_of(rig) == "film":
        for frequency, level in zip(frequencies, contacts):
            assert [touched(free, fraction * level, frequency) for fraction in (0.99, 1.01)] == [False, True]
        return
    greases = np.transpose([(b.grease.stiffness, b.grease.damping) for b in rig.bushings])
    linear, angle = linear_model(free, MODES).filled(*greases), 2 * np.pi * np.arange(4096) / 4096
    for frequency, level in zip(frequencies, contacts):
        omega = 2 * np.pi * frequency
        moved = linear.at_bushings @ np.linalg.solve(linear.dynamic(omega), linear.input("force"))
        reached = []
        for bushing, rows in zip(rig.bushings, rig.clearance_rows):
            place = level * (moved[rows, None] * np.exp(1j * angle)).real
            place += np.array([bushing.offset_y, bushing.offset])[-len(place) :, None]
            far = np.linalg.norm(place, axis=0) if bushing.stops == "both" else -place[0]
            reached.append(far.max() / bushing.gap)
        assert max(reached) == pytest.approx(1.0, rel=1e-6)


def touched(rig, level, frequency, periods=60):
    """Whether a march touches after so many periods."""
    count = 400
    time = np.arange(count * periods) / (count * frequency)
    push = cm.Excitation(level * np.cos(2 * np.pi * frequency * time), count * frequency, "force")
    return bool(cm.simulate(rig, push, engine=cm.Modal(MODES, 0.1)).contact_force[:, -5 * count :].any())


def folds_over_level(rig):
    """The uppermost fold of the branch at a level a fifth larger."""
    level, ends = FOLDED[kind_of(rig)]
    jumps = lively(rig, **weightless(rig))
    branch, known = (followed(jumps, ratio * level, ends, samples=4 * SAMPLES, stability=False) for ratio in (1.0, 1.2))
    fold, other = (max((p for p in b.special if p.kind == "fold"), key=lambda p: p.frequency) for b in (branch, known))
    curve = periodic.follow_folds(branch, fold, 1.2 * level)
    assert not curve.ended and curve.frequency[-1] == pytest.approx(other.frequency, rel=1e-4)


def doubled(rig):
    """Where marches come to twice the excitation's period; in round clearances they do not, and no branch doubles."""
    kind, light = kind_of(rig), lively(rig)
    level, frequency = DOUBLED.get(kind, DRIVEN[kind])
    branch = followed(light, level, (0.8 * frequency, 1.25 * frequency), **FINER.get(kind, {}))
    points = [point for point in branch.special if point.kind == "period doubling"]
    if kind not in DOUBLED:
        assert not points
        stays(branch, int(np.abs(branch.frequency - frequency).argmin()))
        return
    for point in points:
        twice = periodic.follow_doubled(branch, point)
        assert twice.periods == 2
        at = [i for i in np.flatnonzero(twice.stable) if abs(twice.frequency[i] / frequency - 1) < 0.05]
        if at:
            stays(twice, steadiest(twice, at))
            return
    pytest.fail("no doubled branch is stable where marches come to one")


def isolas(rig):
    """Where marches of random states come to, on branches that are known or found: these stay when they are marched."""
    kind, light = kind_of(rig), lively(rig)
    level, frequency = DOUBLED.get(kind, DRIVEN[kind])
    branch = followed(light, level, (0.9 * frequency, 1.1 * frequency), **FINER.get(kind, {}))
    isolas = periodic.find_isolas(branch, n_starts=4, frequencies=[frequency], workers=1)
    assert np.isclose(isolas.basins.sum(), 1)
    if kind not in DOUBLED:
        assert not isolas.branches and isolas.basins[0, -1] == 0
        return
    (new,) = (each for each in isolas.branches if each.periods == 2)
    at = [i for i in np.flatnonzero(new.stable) if abs(new.frequency[i] / frequency - 1) < 0.05]
    stays(new, steadiest(new, at))


def rattle_map(rig):
    """A cell beside the branch that comes to it from below."""
    level, frequency = DRIVEN[kind_of(rig)]
    ends = frequency, 1.02 * frequency
    settings = {"n_harmonics": HARMONICS, "n_samples": SAMPLES, "n_modes": MODES, "workers": 1}
    rattle = periodic.map_rattle(cm.Model(excited(rig)), (level,), ends, **settings)
    known = followed(excited(rig), level, ends, stability=False)
    assert rattle.rattles.all()
    np.testing.assert_allclose(rattle.displacement[0, 0, 0, -1], known.excursion()[-1], rtol=1e-3, atol=1e-9)


ROWS = {
    "periodic response over frequency": (over_frequency, "time integration by `modal`, 0.1 %"),
    "periodic response over level": (over_level, "branch over frequency, 1e-6"),
    "periodic response over loads": (over_loads, "branch over frequency, 1e-6"),
    "periodic response over gaps": (over_gaps, "branch over frequency, 1e-6"),
    "periodic response over the spin": (over_spin, "branch over frequency, 1e-6"),
    "backbone": (along_backbone, "linear mode, 1e-6; free time integration by `modal`, 0.1 %"),
    "level of first contact": (first_contact, "level at which the linear response reaches the wall, 1e-6"),
    "folds over level": (folds_over_level, "fold of the branch at another level, 1e-4"),
    "branches of doubled period": (doubled, "time integration by `modal`, 0.1 %"),
    "isolas and basins": (isolas, "time integration by `modal`, 0.1 %"),
    "rattle map": (rattle_map, "branch over frequency, 0.1 %"),
}
SLOW = ("periodic response over loads", "periodic response over gaps", "periodic response over the spin", "backbone",
        "folds over level", "branches of doubled period", "isolas and basins")  # fmt: skip
"""Rows of which a cell takes longer than 2 s."""
