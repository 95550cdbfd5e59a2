"""Sobol indices: known ones of test functions, and of natural frequencies in closed form."""

import csv
from math import log, pi, sqrt

import numpy as np
import xarray as xr

from clearance_mj import Beam, ClearanceError, Rig, Sensor
from clearance_mj.core.runner import Runner
from clearance_mj.statistics.sobol import sobol_indices
from clearance_mj.sweep import Design, Vary, run_sweep
from clearance_mj.sweep.sensitivity import quantities, sensitivity

from ..refusals import assert_refused
from .plans import DESIGN, loaded, small


def test_ishigami():
    """sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1 on (-π, π): Ishigami and Homma, 1990; indices in closed form."""
    x1, x2, x3 = Design("saltelli", 2048).points([Vary(f"rig.x{i}", low=-pi, high=pi) for i in range(3)]).T
    values = np.stack((np.sin(x1) + 7 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1), x2), axis=1)
    first, total, first_interval, total_interval = sobol_indices(values, 3)
    variance = 7**2 / 8 + 0.1 * pi**4 / 5 + 0.1**2 * pi**8 / 18 + 0.5
    s1, s2, s13 = 0.5 * (1 + 0.1 * pi**4 / 5) ** 2, 7**2 / 8, 8 * 0.1**2 * pi**8 / 225
    known_first, known_total = np.array((s1, s2, 0)) / variance, np.array((s1 + s13, s2, s13)) / variance
    for indices, known in ((first, known_first), (total, known_total)):
        np.testing.assert_allclose(indices, [known, (0, 1, 0)], atol=0.01)
    for interval, known in ((first_interval, known_first), (total_interval, known_total)):
        assert np.all(interval[0, 0] - 0.005 <= known) and np.all(known <= interval[1, 0] + 0.005)
    assert np.ptp(first_interval[:, 0], axis=0).max() < 0.2


CANTILEVER = Rig("cantilever", Beam(1.0, 210e9, 7850.0, 0.01), (), (Sensor(1, 0.5),))
LENGTH, MODULUS, DENSITY = (0.92, 1.08), (1e11, 3e11), (2000.0, 9000.0)


def power_of_log_uniform(low, high, power):
    """Mean of x^p and of x^2p where log x is uniform."""
    return [(high**q - low**q) / (q * log(high / low)) for q in (power, 2 * power)]


def power_of_uniform(low, high, power):
    """Mean of x^p and of x^2p where x is uniform."""
    return [(high ** (q + 1) - low ** (q + 1)) / ((q + 1) * (high - low)) for q in (power, 2 * power)]


VARIED = {"length": (*LENGTH, "linear"), "young_modulus": (*MODULUS, "log"), "density": (*DENSITY, "linear")}


def first_frequency(length, modulus, density):
    """Of a uniform cantilever, round, 10 mm: λ₁²/(2π l²) √(E I/(ρ A)), I/A = d²/16."""
    return 1.875104068711961**2 / (2 * pi * length**2) * np.sqrt(modulus / density) * 0.01 / 4


def test_first_frequency_of_a_cantilever():
    """f ∝ l⁻² E^½ ρ^-½: of a product of independent factors with c² = Var/mean², S = c²/(Π(1 + c²) - 1) and
    S_T = c² Π_others(1 + c²) / (Π(1 + c²) - 1)."""
    low, high = DENSITY
    of_density = 2 / (sqrt(high) + sqrt(low)), log(high / low) / (high - low)
    moments = power_of_uniform(*LENGTH, -2), power_of_log_uniform(*MODULUS, 0.5), of_density
    c2 = np.array([square / mean**2 - 1 for mean, square in moments])
    whole = np.prod(1 + c2)
    varied = [Vary(f"rig.beam.{name}", low=low, high=high, scale=scale) for name, (low, high, scale) in VARIED.items()]
    first, total, *_ = sobol_indices(first_frequency(*Design("saltelli", 4096).points(varied).T)[:, None], 3)
    np.testing.assert_allclose(first[0], c2 / (whole - 1), atol=0.005)
    np.testing.assert_allclose(total[0], c2 * whole / (1 + c2) / (whole - 1), atol=0.005)


def test_sweep_of_a_cantilever(tmp_path, answer):
    """The command finds the frequencies, and the indices, of the closed form at the same points."""
    CANTILEVER.save(tmp_path / "rig.toml")
    tables = [
        f'[[vary]]\npath = "rig.beam.{name}"\nlow = {low}\nhigh = {high}\nscale = "{scale}"\n'
        for name, (low, high, scale) in VARIED.items()
    ]
    design = DESIGN.format(samples=32).replace("latin-hypercube", "saltelli")
    plan = tmp_path / "plan.toml"
    plan.write_text('rig = "rig.toml"\n' + design + "".join(tables), encoding="utf-8")
    rows = answer("sweep", plan, "--out", tmp_path / "out", "--quiet", "--workers", 1)["sensitivity"]
    results = xr.open_dataset(tmp_path / "out" / "results.nc", engine="scipy")
    known = first_frequency(*results["parameter"].values.T)
    np.testing.assert_allclose(results["natural_frequency"][:, 0], known, rtol=1e-6)
    first, total, *_ = sobol_indices(known[:, None], 3)
    assert len(rows) == 4 * 3
    np.testing.assert_allclose([row["first_order"] for row in rows[:3]], first[0], rtol=1e-4)
    np.testing.assert_allclose([row["total_order"] for row in rows[:3]], total[0], rtol=1e-4)
    with (tmp_path / "out" / "sensitivity.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == 12
    assert (tmp_path / "out" / "sensitivity.png").read_bytes()[:4] == b"\x89PNG"


def test_peaks_and_rmse_are_among_the_quantities(tmp_path):
    results = run_sweep(loaded(tmp_path, small(4)), tmp_path / "out", Runner(1))
    results["rmse"] = (("case", "compared"), np.arange(8.0).reshape(4, 2))
    by_quantity = quantities(results)
    assert by_quantity["RMSE (dB)"].tolist() == [0.5, 2.5, 4.5, 6.5]
    heights = 20 * np.log10(results["peak_magnitude"].values[:, 1])
    np.testing.assert_allclose(by_quantity["height of peak 2 (dB)"], heights)
    assert_refused(ClearanceError, 'need the cases of a design with method "saltelli"', sensitivity, results, 4)


def test_case_without_results_is_named():
    results = xr.Dataset(
        {"natural_frequency": (("case", "mode"), np.ones((12, 1))), "error": ("case", ["", "too stiff"] + 10 * [""])},
        {"case": np.arange(12), "varied": ["rig.a"]},
    )
    assert_refused(ClearanceError, "1 have no results, first case 1: too stiff", sensitivity, results, 4)
