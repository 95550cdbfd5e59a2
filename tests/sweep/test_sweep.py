"""Sweeps: plans and designs, results against simulations made here, what is refused."""

import itertools
import json
import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from clearance_mj import ClearanceError, Dataset, Grease, beam, estimate_frf, excitation, rmse_db, write_uff
from clearance_mj.clearance import ConstantLaw, nominal_law
from clearance_mj.cli import main
from clearance_mj.core.cache import file_lock
from clearance_mj.core.plain_numbers import find_numbers, replace_numbers
from clearance_mj.core.runner import Runner
from clearance_mj.engines import Modal, simulate
from clearance_mj.structure import Clamp
from clearance_mj.sweep import Design, Plan, Vary, run, run_sweep

from .plans import EXCITATION, OUTPUTS, finished, loaded, small, text, varied

GRID = varied("rig.bushings[1].gap", [2e-4, 4e-4])
GRID += '[[vary]]\npath = "rig.bushings.grease.stiffness"\nlow = 2000\nhigh = 8000\ncount = 3\nscale = "log"\n'
ALONE = Runner(1)


def test_a_plan_of_an_identified_rig_and_its_law(rig, tmp_path):
    """The folder of both; the rig's own numbers vary, clamp and offset among them."""
    bushings = tuple(replace(b, offset=5e-5) for b in rig.bushings)
    identified_rig = rig.replace(beam=replace(rig.beam, clamp=Clamp(rotation=3e3)), bushings=bushings)
    law = ConstantLaw(6e3, 12.0, grease=Grease(4000.0, 5.0))
    (tmp_path / "found").mkdir()
    identified_rig.save(tmp_path / "found" / "rig.toml")
    law.save(tmp_path / "found" / "law.json")
    ranges = varied("rig.beam.clamp.rotation", [3e3, 1e5]), varied("rig.bushings[0].offset", [-5e-5, 5e-5])
    plan = loaded(tmp_path, text(EXCITATION, OUTPUTS, *ranges, rig="found"))
    assert plan.law == law
    case = plan.case(1)
    assert case[0] == identified_rig
    response = simulate(*(case[i] for i in (0, 2, 1)), "modal")
    np.testing.assert_array_equal(plan.evaluate(1)["displacement_rms"], response.displacement.std(axis=1))


# Paths and designs.


def test_paths():
    data = {"a": [{"b": 1.0, "c": {}}, {"b": 2.0}], "k": [[1.0, 2.0], [3.0, 4.0]]}
    assert find_numbers(data, "a[1].b") == [("a", 1, "b")]
    assert find_numbers(data, "a.b") == [("a", 0, "b"), ("a", 1, "b")]
    assert find_numbers(data, "k[1]") == [("k", 1, 0), ("k", 1, 1)]
    assert replace_numbers(data, {("k", 1, 0): 9.0})["k"] == [[1.0, 2.0], [9.0, 4.0]] and data["k"][1][0] == 3.0


def test_grid_is_every_combination():
    numbers = [Vary("rig.a", values=(1.0, 2.0)), Vary("rig.b", low=1, high=100, count=3, scale="log")]
    np.testing.assert_allclose(Design("grid").points(numbers), list(itertools.product((1, 2), (1, 10, 100))))


def test_latin_hypercube_has_one_case_in_each_slice():
    numbers = [Vary("rig.a", low=-1, high=3), Vary("rig.b", low=1, high=16, scale="log")]
    a, b = Design("latin-hypercube", 8, seed=3).points(numbers).T
    for place in ((a + 1) * 2, np.log2(b) * 2):
        assert sorted(np.floor(place).astype(int)) == list(range(8))


def test_saltelli_design_exchanges_one_column_at_a_time():
    a, b, *mixed = np.split(Design("saltelli", 4).points([Vary(f"rig.{n}", low=0, high=1) for n in "abc"]), 5)
    for i, block in enumerate(mixed):
        np.testing.assert_array_equal(block[:, i], b[:, i])
        np.testing.assert_array_equal(np.delete(block, i, axis=1), np.delete(a, i, axis=1))


# Results.


def test_grid_against_simulations_made_here(rig, tmp_path):
    results = run_sweep(loaded(tmp_path, text(EXCITATION, OUTPUTS, GRID)), tmp_path / "out", ALONE)
    assert list(results["varied"].values) == ["rig.bushings[1].gap", "rig.bushings.grease.stiffness"]
    np.testing.assert_allclose(results["parameter"], list(itertools.product((2e-4, 4e-4), (2000, 4000, 8000))))
    base = excitation.random(1.0, 1024.0, rms=2.0)
    for case, (gap, stiffness) in enumerate(results["parameter"].values.tolist()):
        first, second = (replace(b, grease=replace(b.grease, stiffness=stiffness)) for b in rig.bushings)
        rig_here = rig.replace(bushings=(first, replace(second, gap=gap)))
        response = simulate(rig_here, base, ConstantLaw(7.8e3, 4.0, grease=Grease(stiffness, damping=3.0)), "modal")
        row = results.isel(case=case)
        frf = estimate_frf(response, resolution=2.0)
        np.testing.assert_array_equal(row["frf"].values[0] @ (1, 1j), frf.functions[6])
        np.testing.assert_array_equal(row["acceleration_rms"], response.acceleration.std(axis=1))
        np.testing.assert_allclose(row["natural_frequency"], beam.natural_frequencies(rig_here, 4), rtol=1e-9)
        np.testing.assert_array_equal(row["contact_share"], response.contact_share)


def test_store_is_self_describing(tmp_path):
    run_sweep(loaded(tmp_path, text(EXCITATION, OUTPUTS, GRID)), tmp_path / "out", ALONE)
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"lock", "plan.json", "results.nc", "results.nc.sha256"}
    stored = xr.open_dataset(tmp_path / "out" / "results.nc", engine="scipy")
    assert stored["frf"].dims == ("case", "kept", "frequency", "part")
    assert (stored["frf"].attrs["units"], stored["natural_frequency"].attrs["units"]) == ("1", "Hz")
    assert (list(stored["kept"].values), list(stored["part"].values)) == (["7:+Z"], ["real", "imag"])
    assert json.loads(stored.attrs["plan"])["engine"] == {"name": "modal", "modes": 8, "resolution": 1.0}


def test_peaks(tmp_path):
    """The height between two lines of a resonance is at least that of the lines; its place within half a line."""
    plan = loaded(tmp_path, text(EXCITATION, "[outputs]\nresolution = 2\npeaks = [[20, 70]]", GRID))
    results = run_sweep(plan, tmp_path / "out", ALONE)
    assert list(results["band"].values) == ["20-70 Hz"]
    magnitude = np.sqrt((results["frf"] ** 2).sum("part").mean("kept")).sel(frequency=slice(20, 70))
    lines = magnitude["frequency"].values[magnitude.argmax("frequency")]
    assert np.all(np.abs(results["peak_frequency"].values[:, 0] - lines) <= 1.0)
    over_grid = results["peak_magnitude"].values[:, 0] / magnitude.max("frequency").values
    assert np.all((over_grid >= 1) & (over_grid < 1.5))


@pytest.mark.parametrize("kind", ["record", "FRF"])
def test_rmse_against_a_reference(small_dataset, tmp_path, kind):
    """A record drives the cases itself, and its own FRF is what they are compared with."""
    record = Dataset.load(small_dataset).validate[0]
    test = estimate_frf(record.response(), resolution=2.0, band=(10, 200))
    if kind == "record":
        path, tables = small_dataset / f"{record.name}.uff", ()
    else:
        path, tables = tmp_path / "test.uff", (EXCITATION.replace("1024", "2048"),)
        write_uff(path, test)
    outputs = "[outputs]\nresolution = 2\nband = [10, 200]"
    plan = loaded(tmp_path, text(*tables, outputs, GRID, head=f'reference = "{path}"'))
    results = run_sweep(plan, tmp_path / "out", ALONE)
    rig, law, drive = plan.case(3)
    model = estimate_frf(simulate(rig, drive, law, "modal"), resolution=2.0, band=(10, 200))
    np.testing.assert_allclose(results["rmse"].values[3], rmse_db(test.functions, model.functions), rtol=1e-6)
    if kind == "record":
        np.testing.assert_array_equal(drive.value, record.excitation().value)


def test_law_and_its_grease_vary(rig, tmp_path):
    ConstantLaw([5e3, 6e3], [3.0, 4.0], grease=Grease(2000.0, 2.0)).save(tmp_path / "law.json")
    ranges = varied("law.k[1]", [1e4]), varied("law.grease.stiffness", [5000])
    plan = loaded(tmp_path, text(EXCITATION, OUTPUTS, *ranges, head='law = "law.json"'))
    _, law, _ = plan.case(0)
    assert (law.k.tolist(), law.c.tolist(), law.grease[0].stiffness) == ([5e3, 1e4], [3.0, 4.0], 5000.0)
    greased = rig.replace(bushings=tuple(replace(b, grease=law.grease[0]) for b in rig.bushings))
    np.testing.assert_allclose(plan.evaluate(0)["natural_frequency"], beam.natural_frequencies(greased, 4))


def test_left_out_field_and_whole_numbers_vary(tmp_path):
    vary = '[[vary]]\npath = "rig.bushings.grease.film_height"\nlow = 1e-3\nhigh = 2e-3\ncount = 2\n'
    rig, law, drive = loaded(tmp_path, text(EXCITATION, OUTPUTS, vary, varied("excitation.seed", [0, 5]))).case(3)
    assert [b.grease.film_height for b in rig.bushings] == [2e-3, 2e-3]
    assert law.k.tolist() == nominal_law(rig).k.tolist()
    np.testing.assert_array_equal(drive.value, excitation.random(1.0, 1024.0, rms=2.0, seed=5).value)


def test_case_without_results_says_why(tmp_path):
    """A contact of 1e13 N/m needs too many steps: that case alone has no results."""
    stiffnesses = varied("rig.bushings.contact.stiffness", [8e3, 1e13])
    results = run_sweep(loaded(tmp_path, text(EXCITATION, OUTPUTS, stiffnesses)), tmp_path / "out", ALONE)
    assert results["error"].values[0] == "" and "steps per sample" in results["error"].values[1]
    assert np.isnan(results["acceleration_rms"].values[1]).all()
    assert np.isfinite(results["acceleration_rms"].values[0]).all()


# What waits on disk, and going on.


def interrupted_after(monkeypatch, count):
    """Let a sweep be interrupted when so many cases have been computed; returns those that were asked for."""
    asked, evaluate_all = [], Plan.evaluate_all

    def watched(plan, cases):
        for case in cases:
            if len(asked) == count:
                raise KeyboardInterrupt
            asked.append(case)
            yield from evaluate_all(plan, [case])

    monkeypatch.setattr(Plan, "evaluate_all", watched)
    return asked


@pytest.mark.parametrize("size", [1, 3])
def test_finished_cases_are_not_computed_again(tmp_path, monkeypatch, size):
    """Of each case alone, and of three at a time, in a shuffled order; what comes of it is the same to the last bit."""
    monkeypatch.setattr(run, "MOST_FILES", 12 // size)
    plan, out = loaded(tmp_path, small(12)), tmp_path / "out"
    alone = run_sweep(plan, tmp_path / "alone", ALONE)
    with monkeypatch.context() as patch:
        first = interrupted_after(patch, 5)
        with pytest.raises(KeyboardInterrupt):
            run_sweep(plan, out, ALONE)
    kept = 5 // size
    assert finished(out) == kept and first != sorted(first)
    asked = interrupted_after(monkeypatch, 12)
    results = run_sweep(plan, out, ALONE)
    assert sorted([*asked, *first[: kept * size]]) == list(range(12))
    xr.testing.assert_identical(results, alone)
    asked.clear()
    assert run_sweep(plan, out, ALONE).identical(results) and asked == []


@pytest.mark.parametrize("damage", [lambda data: data[:-8], lambda data: bytes(len(data)), lambda data: b""])
def test_a_torn_file_of_a_case_does_not_count(tmp_path, monkeypatch, damage):
    plan, out = loaded(tmp_path, small(4)), tmp_path / "out"
    alone = run_sweep(plan, tmp_path / "alone", ALONE)
    with monkeypatch.context() as patch:
        first = interrupted_after(patch, 3)
        with pytest.raises(KeyboardInterrupt):
            run_sweep(plan, out, ALONE)
    torn = next((out / "cases").glob("*.npz"))
    torn.write_bytes(damage(torn.read_bytes()))
    assert finished(out) == 2
    asked = interrupted_after(monkeypatch, 4)
    results = run_sweep(plan, out, ALONE)
    assert len(asked) == 2 and set(asked) & set(first)
    xr.testing.assert_identical(results, alone)


def test_killed_between_results_and_the_end(tmp_path):
    """What waited goes, what a kill tore too, and what somebody else put there stays."""
    plan, out = loaded(tmp_path, small(4)), tmp_path / "out"
    results = run_sweep(plan, out, ALONE)
    (out / "cases").mkdir()
    for name in ("sweep_0123456789abcdef.npz", ".sweep_0123456789abcdef.npz.0a1b2c3d.npz"):
        (out / "cases" / name).write_bytes(b"left over")
    assert run_sweep(plan, out, ALONE).identical(results) and not (out / "cases").exists()
    (out / "cases").mkdir()
    (out / "cases" / "notes.txt").write_text("mine")
    run_sweep(plan, out, ALONE)
    assert (out / "cases" / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("damage", [lambda d: b"", lambda d: d[:300], lambda d: d[:-9] + bytes([d[-9] ^ 1]) + d[-8:]])
def test_damaged_results_are_computed_anew(tmp_path, damage):
    plan, out = loaded(tmp_path, small(2)), tmp_path / "out"
    first = run_sweep(plan, out, ALONE)
    path = out / "results.nc"
    path.write_bytes(damage(path.read_bytes()))
    xr.testing.assert_identical(run_sweep(plan, out, ALONE), first)


def test_another_plan_in_the_same_folder(tmp_path):
    run_sweep(loaded(tmp_path, small(4)), tmp_path / "out", ALONE)
    other = loaded(tmp_path, small(4).replace("high = 5e-4", "high = 6e-4"))
    with pytest.raises(ClearanceError, match=r"holds a sweep of another plan \(vary\[0\]\.high\); give another folder"):
        run_sweep(other, tmp_path / "out", ALONE)


def test_two_sweeps_into_one_folder(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    with (
        file_lock(out / "lock", "sweep"),
        pytest.raises(ClearanceError, match=r"another sweep .process .* is writing there"),
    ):
        run_sweep(loaded(tmp_path, small(4)), out, ALONE)


def test_one_case_has_no_figure(tmp_path, capsys):
    plan, out = tmp_path / "plan.toml", tmp_path / "out"
    plan.write_text(text(varied("rig.beam.length", [1.1])), encoding="utf-8")
    assert main(["sweep", str(plan), "--out", str(out), "--quiet", "--workers", "1"]) == 0
    assert "(1 cases)" in capsys.readouterr().out and not (out / "sweep.png").exists()


def test_command(tmp_path, answer):
    plan, out = tmp_path / "plan.toml", tmp_path / "out"
    plan.write_text(small(6), encoding="utf-8")
    assert answer("sweep", plan, "--out", out, "--quiet", "--workers", 1)["cases"] == 6
    assert (out / "sweep.png").read_bytes()[:4] == b"\x89PNG"
    page = (out / "sweep.html").read_text(encoding="utf-8")
    shown = [json.loads(text) for text in re.findall(r'<script type="application/json">(.*?)</script>', page)]
    assert [cell["title"] for cell in shown[1]["cells"]] == ["7:+Z"], "results, and FRFs of the sensor that was kept"
    assert xr.open_dataset(out / "results.nc", engine="scipy").sizes["case"] == 6
    assert Modal(modes=4) == loaded(tmp_path, small(6)).engine
