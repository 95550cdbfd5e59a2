"""Shares of a production. Truth: closed forms of one mass between stops, rattle maps of the same designs."""

import dataclasses
import re
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import norm

import clearance_mj as cm
from clearance_mj import ClearanceError, LawError, RigError, periodic, wear
from clearance_mj.periodic.level_branches import level_branches
from clearance_mj.periodic.map_rows import solver_at
from clearance_mj.rig import Grease, Tolerance
from clearance_mj.signals.excitation import stepped_sine
from clearance_mj.tolerance import Limit, Noise, Runner, Scatter, Sines, draw_designs, production, random_production
from clearance_mj.tolerance.rattling import branches_of
from clearance_mj.tolerance.scattered import Correlation, Scattered
from clearance_mj.tolerance.sines import settings_of

from ..conftest import ROOT, TABLE1
from ..periodic.jeffcott import FREQUENCY, jeffcott, unbalanced
from ..refusals import assert_refused
from .oscillator import DAMPING, GAP, STIFFNESS, oscillator

LOW = 5.0  # Hz, far below the resonance of 15.9 Hz
SPREAD, ALONE = 0.08, Runner(1)
LOGNORMAL = Scatter((Scattered("bushings.gap", std="8 %", distribution="lognormal"),))
WITHIN = Scatter((Scattered("bushings.gap", within="0.1 mm"),))
EXAMPLE = Scatter.load(ROOT / "models" / "scatter" / "table1.toml")


def needed(frequency: float, gap: float = GAP) -> float:
    """The force that fills a gap, N."""
    omega = 2 * np.pi * frequency
    return gap * abs(STIFFNESS - omega**2 + 1j * DAMPING * omega)


def test_the_share_that_touches_is_that_of_the_gaps_that_a_force_fills():
    """Gaps lognormal: P = Φ(ln(F/F_needed)/σ), of 512 Sobol' points, whose share misses it by less than 1/512."""
    levels = needed(LOW) * np.exp(np.array([-0.1, 0.0, 0.1]))
    outcome = production(oscillator(), LOGNORMAL, Sines(levels, [LOW]), 512, runner=ALONE)
    assert_allclose(outcome.contact[:, 0], norm.cdf(np.array([-0.1, 0.0, 0.1]) / np.log1p(SPREAD)), atol=2 / 512)
    assert_allclose(outcome.over_level("contact"), outcome.contact[:, 0])
    assert_allclose(outcome.first_contact, needed(LOW, outcome.values[:, 0]), rtol=1e-6)
    assert not outcome.unknown.any() and not outcome.exceeding.any()


def test_raised_from_rest_a_design_touches_where_the_free_vibration_fills_its_gap():
    """Closed form, also above the resonance at 15.9 Hz, where a second vibration touches at lower levels."""
    levels, frequency = needed(18.0) * np.array([0.8, 0.95, 1.05]), 18.0
    outcome = production(oscillator(), LOGNORMAL, Sines(levels, [frequency]), 32, runner=ALONE)
    fills = needed(frequency, outcome.values[:, 0])
    assert_allclose(outcome.first_from_rest, fills, rtol=1e-6)
    assert_allclose(outcome.from_rest[:, 0], [np.mean(fills <= level) for level in levels])
    assert np.all(outcome.first_contact < 0.8 * fills) and outcome.contact[0, 0] > outcome.from_rest[0, 0]


def test_shares_from_rest_are_those_of_marches_whose_level_is_raised_slowly():
    """Table 1's example at 45 Hz and 6 m/s²: both designs can touch, and one of them does from rest."""
    model, (frequency, level) = cm.Model(TABLE1), (45.0, 6.0)
    outcome = production(model, EXAMPLE, Sines([level], [frequency]), 3, runner=ALONE)
    sine = stepped_sine(8.0, 8192.0, frequency, level, "base")
    slowly = dataclasses.replace(sine, value=sine.value * np.minimum(1, np.arange(sine.value.size) / 5 / sine.fs))
    designs = EXAMPLE.draw(model, 3)
    marched = [designs.model(i).simulate(slowly, "modal").contact_force[:, -8192:].any() for i in (1, 2)]
    assert marched == [True, False] == (outcome.first_from_rest <= level)[1:].tolist()
    assert outcome.contact[0, 0] == 1.0 and outcome.from_rest[0, 0] == pytest.approx(2 / 3)


@pytest.mark.parametrize("quantity, limit, exact", [
    ("contact_force", 20.0, 1e-2), ("penetration", 2e-4, 2e-3), ("displacement", 1.2e-3, 2e-3),
    ("acceleration", 30.0, 2e-3),
])  # fmt: skip
def test_levels_at_a_limit_are_those_of_the_branch_over_the_level(quantity, limit, exact):
    """`follow_response_over_level`, with its shorter steps, comes to the limit at the same level.

    It has the contact's force by its harmonics, whose largest value is not quite that of the samples.
    """
    model, frequency = oscillator(), 18.0
    solver = solver_at(model, "force", 1.0, 2 * np.pi * frequency, 21, 1024, 8)
    (level_branch,) = level_branches(solver, np.array([2 * np.pi * frequency]), 40.0, [quantity])
    level = level_branch.first_level(level_branch.values[0], limit)
    branch = periodic.follow_response_over_level(model, frequency, (1.0, level), 21, 1024, stability=False)
    name = "clearance_displacement" if quantity in ("penetration", "displacement") else quantity
    reached = branch.amplitude(name)[-1, 0] - (GAP if quantity == "penetration" else 0.0)
    assert reached == pytest.approx(limit, rel=exact)


def test_a_design_does_what_its_rattle_map_says(measured):
    """Near Table 1, around two resonances: contact, two or more vibrations, contact force over a limit."""
    levels, frequencies, limit = np.linspace(0.8, 8, 6), np.linspace(8, 54, 24), 3.0
    scatter = Scatter(
        (Scattered("bushings.gap", within="0.06 mm"), Scattered("bushings.contact.stiffness", std="10 %"),
         Scattered("beam.young_modulus", std="2 %"))
    )  # fmt: skip
    model = cm.Model(TABLE1)
    outcome = production(model, scatter, Sines(levels, frequencies, f"contact_force > {limit} N"), 1, runner=ALONE)
    of_map = periodic.map_rattle(scatter.draw(model, 1).model(0), levels, frequencies, workers=1)
    known = of_map.rattles[0], of_map.vibrations[0] > 1, of_map.contact_force.max(axis=(0, 1, -1)) > limit
    for name, cells in zip(("contact", "several", "exceeding"), known):
        missed = np.abs(getattr(outcome, name) - cells).mean()
        measured.below(f"production: cells of a design unlike its rattle map, {name}", missed, 2e-3, "rattle map")


def test_a_shaft_in_space_touches_at_the_level_of_its_free_circle():
    """Jeffcott: unbalance times e ω²/|1 - ω² + i c ω| = gap; above it the rub goes on below that level."""
    model, speeds = cm.Model(unbalanced(jeffcott())), np.array([0.7, 0.9])
    scatter = Scatter((Scattered("bushings.gap", within="10 %", distribution="uniform"),))
    outcome = production(model, scatter, Sines([1.0, 4.0], speeds * FREQUENCY / (2 * np.pi)), 2, runner=ALONE)
    free = 0.2 * speeds**2 / np.hypot(1 - speeds**2, 0.1 * speeds)
    gaps = outcome.values[:, 0] / 1e-4
    assert_allclose(outcome.first_contact, gaps / free.max(), rtol=1e-4)
    assert_array_equal(outcome.contact[1], [np.mean(gaps / each < 4.0) for each in free])


SLIDES = Grease(STIFFNESS / 2, 5.0, elastic_ratio=0.6, beta=1e6, gamma=1e6)  # it yields at 0.7 of the gap
SAGS = jeffcott(damping=0.2, gravity=(0.0, 0.0, -9.81 * 0.02))


@pytest.mark.parametrize("model, levels", [
    (oscillator(bushings=(dataclasses.replace(oscillator().rig.bushings[0], grease=SLIDES),)), (2.0, 4.0, 8.0, 12.0)),
    (cm.Model(SAGS), (0.1, 0.2, 0.4, 0.8)),
], ids=["grease that slides", "shaft that sags"])  # fmt: skip
def test_vibrations_that_begin_at_rest_are_those_of_the_rattle_map(model, levels):
    """Where the way to the wall is not known in closed form, or rest is off the middle."""
    frequencies = np.linspace(7.0, 20.0, 14)
    of_map = periodic.map_rattle(model, levels, frequencies, n_harmonics=9, workers=1)
    settings = settings_of(model, Sines(levels, frequencies, "penetration > 1 um", n_harmonics=9))
    cells = [branch.crossings(np.array(levels)) for branch in branches_of(settings, model)]
    count, depth = (np.array([each[i] for each in cells]).T for i in (0, 1))
    assert_array_equal(count > 1, of_map.vibrations[0] > 1)
    assert_array_equal(depth > 0, of_map.rattles[0])
    assert of_map.rattles.any() and not of_map.rattles.all()
    assert_allclose(depth, np.nanmax(of_map.penetration, axis=(0, 1, -1)), rtol=0.02, atol=2e-3 * depth.max())


def test_a_branch_that_long_steps_lose_is_followed_with_shorter_ones(monkeypatch):
    """Design 588 of the example's thousand: at 5 Hz steps of 0.15 leave the fold at 1.77 m/s² back towards rest."""
    levels, model = np.linspace(0.2, 10.0, 50), cm.Model(TABLE1)
    settings = settings_of(model, Sines(levels, [5.0, 220.0], "contact_force > 3 N"))
    design = EXAMPLE.draw(model, 1000).model(588)
    followed_branches, _ = branches_of(settings, design)
    for name, value in {"SHARES": (1.0,), "BENT": 0.002, "LONGEST": 0.02}.items():
        monkeypatch.setattr(f"clearance_mj.periodic.level_branches.{name}", value)
    known, _ = branches_of(settings, design)
    assert followed_branches.complete and known.complete
    assert_array_equal(followed_branches.crossings(levels)[0], known.crossings(levels)[0])
    at_limit, known_at_limit = (each.first_level(each.values[1], 3.0) for each in (followed_branches, known))
    assert at_limit == pytest.approx(known_at_limit, rel=1e-3)


def test_any_number_of_workers_finds_the_same_and_goes_on_where_it_stopped(tmp_path):
    asked = WITHIN, Sines([5.0, 9.0, 12.0], [LOW, 14.0], "contact_force > 5 N")
    alone = production(oscillator(), *asked, n_designs=20, runner=Runner(1, kept=tmp_path))
    with ThreadPoolExecutor(2) as pool:
        assert production(oscillator(), *asked, n_designs=20, runner=Runner(executor=pool)) == alone
    kept = sorted(tmp_path.glob("*.npz"))
    assert len(kept) == 20  # one by one, as they are few
    kept[0].unlink()
    written = {path: path.stat().st_mtime_ns for path in kept[1:]}
    assert production(oscillator(), *asked, n_designs=20, runner=Runner(1, kept=tmp_path)) == alone
    assert all(path.stat().st_mtime_ns == time for path, time in written.items())
    more = production(oscillator(), *asked, n_designs=24, runner=ALONE)
    assert_array_equal(more.first_contact[:20], alone.first_contact)


def test_another_version_of_a_plugin_is_computed_anew(tmp_path, monkeypatch):
    """The grease is that of a file outside of the package, which changes between two calls."""
    plugin = ModuleType("own_grease")
    plugin.__file__ = str(tmp_path / "own_grease.py")
    monkeypatch.setitem(sys.modules, plugin.__name__, plugin)
    monkeypatch.setattr(Grease, "__module__", plugin.__name__)
    asked = WITHIN, Sines([9.0], [LOW])
    for count, text in enumerate(("stiff = 1", "stiff = 1", "stiff = 2")):
        Path(plugin.__file__).write_text(text)
        production(oscillator(), *asked, n_designs=1, runner=Runner(1, kept=tmp_path))
        assert len([*tmp_path.glob("*.npz")]) == max(count, 1)


def test_scatter_is_by_default_the_rig_files_own():
    model = oscillator(tolerances=(Tolerance("bushings[0].gap", "3 %"), Tolerance("sensors.gain", "1 %")))
    outcome = production(model, None, Sines([9.0], [LOW]), 64, runner=ALONE)
    assert outcome.names == ("bushings[0].gap",) and outcome.values.std() == pytest.approx(0.03 * GAP, rel=0.02)


def test_two_workers_of_a_cluster_find_the_same_as_this_process():
    """Of sines, of random excitation and of lives, bit by bit."""
    distributed = pytest.importorskip("distributed")
    noise = Noise(cm.PSD([5.0, 50.0], [0.1, 0.1], "force"), [2.0], 3.0)
    worn = dataclasses.replace(TABLE1.bushings[1], wear=1e-12)
    rig = TABLE1.replace(bushings=(TABLE1.bushings[0], worn), tolerances=(Tolerance("bushings.gap", "2 %"),))
    sine = wear.Sine(9.25, 2.0, n_harmonics=5)
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        on_workers = [
            (
                production(oscillator(), WITHIN, Sines([5.0, 9.0, 12.0], [LOW, 14.0]), 20, runner=runner),
                repr(random_production(WITHIN.draw(oscillator(), 9), noise, runner=runner)),
                wear.predict_lives(cm.Model(rig), sine, "0.35 mm", n=3, accuracy=0.05, runner=runner),
            )
            for runner in (ALONE, Runner(scheduler=cluster.scheduler_address))
        ]
    assert on_workers[0] == on_workers[1]


def test_of_several_tolerances_of_a_number_the_last_one_counts():
    given = (
        Tolerance("bushings.gap", "5 %"), Tolerance("bushings[1].gap", "2 %"), Tolerance("bushings[1].offset", "1 um"),
    )  # fmt: skip
    scatter_of_rig = Scatter.of_rig(TABLE1.replace(tolerances=given))
    assert [(each.of, each.std) for each in scatter_of_rig.numbers] == [
        ("bushings[0].gap", "5 %"), ("bushings[1].gap", "2 %"), ("bushings[1].offset", "1 um"),
    ]  # fmt: skip
    assert draw_designs(cm.Model(TABLE1.replace(tolerances=given)), None, 4).values.shape == (4, 3)
    exact = Scatter.of_rig(TABLE1.replace(tolerances=(given[0], Tolerance("bushings[1].gap", "0 %"))))
    assert [each.of for each in exact.numbers] == ["bushings[0].gap"]


def test_a_posterior_is_a_scatter_too():
    gaps = GAP * np.array([0.8, 0.9, 1.0, 1.1])
    model = dataclasses.replace(oscillator(), posterior=lambda n, seed: [oscillator().with_gap(g) for g in gaps[:n]])
    outcome = production(model, "posterior", Sines([needed(LOW, 0.95e-3)], [LOW]), 4, runner=ALONE)
    assert outcome.contact[0, 0] == 0.5 and outcome.names == ()
    with pytest.raises(LawError, match="no posterior"):
        production(oscillator(), "posterior", Sines([9.0], [LOW]), runner=ALONE)


def test_what_cannot_be_is_one_line():
    model, gap = oscillator(), Scattered("bushings[0].gap", within="0.1 mm")
    for what, words in (
        (lambda: Scatter(()), "nothing scatters"),
        (lambda: Scattered("bushings[0].gap", std="0.1"), "has no unit"),
        (lambda: Scattered("bushings[0].gap"), "either std or within"),
        (lambda: Scattered("bushings[0].gap", std="0.1 mm", distribution="lognormal"), "of a share of the value"),
        (lambda: Scatter((Scattered("bushings[0].gap", within="1.2 mm"),)).draw(model, 4), "reaches from -0.0002"),
        (lambda: Scatter((gap, gap)).draw(model, 4), "scatters twice"),
        (lambda: Scatter((gap,), (Correlation(("bushings[0].gap", "bushings[1].gap"), 0.5),)).draw(model, 4),
         "does not"),
        (lambda: production(model, Scatter((gap,)), Sines([1.0], [LOW], "force > 3 N")), "unknown"),
        (lambda: production(model, Scatter((gap,)), Sines([1.0], [LOW], "acceleration@7:+Z > 3 g")), "the rig has"),
        (lambda: production(model, Scatter((gap,)), Sines([1.0], [LOW]), 0), "designs must be"),
        (lambda: production(model, None, Sines([1.0], [LOW])), "nothing scatters"),
        (lambda: Limit("penetration", -1.0), "must be > 0"),
    ):  # fmt: skip
        assert_refused((ClearanceError, RigError), words, what)


def test_correlations_that_contradict_each_other_are_refused():
    paths = [f"bushings[0].{name}" for name in ("contact.stiffness", "contact.damping", "gap")]
    numbers = tuple(Scattered(path, std="5 %") for path in paths)
    pairs = tuple(Correlation((paths[i], paths[j]), r) for i, j, r in ((0, 1, 0.9), (1, 2, 0.9), (0, 2, -0.9)))
    with pytest.raises(ClearanceError, match=r"no correlation matrix .its smallest eigenvalue is -0.8"):
        Scatter(numbers, pairs).draw(oscillator(), 4)


def test_drawn_numbers_have_the_correlation_that_was_asked():
    numbers = (Scattered("bushings[0].gap", std="5 %"), Scattered("bushings[0].contact.stiffness", std="10 %"))
    pair = Correlation(tuple(number.of for number in numbers), -0.7)
    values = Scatter(numbers, (pair,)).draw(oscillator(), 1024).values
    assert np.corrcoef(values.T)[0, 1] == pytest.approx(-0.7, abs=0.01)


def test_a_limit_that_no_design_reaches_is_said():
    outcome = production(oscillator(), WITHIN, Sines([9.0, 12.0], [LOW], "contact_force > 1 kN"), 8, runner=ALONE)
    (note,) = outcome.notes
    assert re.search(r"no design reaches that up to 12 N; the largest is [\d.e-]+ N$", note)
