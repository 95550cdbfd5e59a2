"""clearance-mj compare: FRFs from two places, however they were written, are compared as what they are."""

import dataclasses
import json

import numpy as np
import pytest

from clearance_mj import FRF, Response, estimate_frf
from clearance_mj.cli import main
from clearance_mj.core.output_folder import WORK
from clearance_mj.io import formats
from clearance_mj.signals import convert_quantity

POLES_HZ, DAMPING = np.array([12.5, 40.0, 90.0]), 0.02
SHAPE = np.array([[1.0, 0.8, 1.0], [0.7, -0.4, -1.2], [0.3, -1.1, 0.8]])


def structure(frequency, shift=1.0, scale=1.0):
    """Accelerance Σ -ω² φφ_1 / (ω_r² - ω² + 2jζω_rω) of three modes at 200:+Z."""
    omega, omega_r = 2 * np.pi * frequency, 2 * np.pi * shift * POLES_HZ[:, None]
    value = -scale * (SHAPE * SHAPE[0] @ (omega**2 / (omega_r**2 - omega**2 + 2j * DAMPING * omega_r * omega)))
    return FRF(frequency, value, None, ("1:+Z", "2:+Z", "3:+Z"), "200:+Z", "acceleration/force")


@pytest.fixture
def measured(tmp_path):
    formats.write(tmp_path / "test.uff", structure(np.arange(5.0, 120.0, 0.5)))
    return tmp_path / "test.uff"


def disguised(frf):
    """Receptances, a sensor the other way round, one more sensor, in another order."""
    frf = convert_quantity(frf, "displacement/force")
    value = np.stack((frf.value[2], -frf.value[0], frf.value[1], frf.value[0]))
    return dataclasses.replace(frf, value=value, responses=("3:+Z", "1:-Z", "2:+Z", "9:+X"))


@pytest.mark.parametrize("suffix", [".uff", ".csv", ".mat", ".nc", ".h5"])
def test_the_same_structure_from_another_place(tmp_path, measured, suffix, answer):
    formats.write(tmp_path / f"model{suffix}", disguised(structure(np.arange(2.0, 150.0, 0.25))))
    got = answer("compare", "--modes", 3, measured, tmp_path / f"model{suffix}")
    assert (got["rmse_db"], got["frac"]) == (pytest.approx(0, abs=1e-8), pytest.approx(1, abs=1e-9))
    assert (got["csac"], got["csf"], got["mac"]) == pytest.approx((1, 1, 1), abs=1e-9)
    assert (got["quantity"], got["lines"], got["band"]) == ("acceleration/force", 230, [5, 119.5])
    assert (got["only_test"], got["only_model"]) == ([], ["9:+X"])
    np.testing.assert_allclose(got["per_mode"]["model_hz"], POLES_HZ, rtol=1e-3)


def test_measures_and_modes_of_a_known_difference(tmp_path, measured, answer):
    """Twice the level: 20 lg 2 = 6.02 dB, MRE 1, CSF = 2·2/(1 + 4) = 0.8, and all shapes are the same."""
    formats.write(tmp_path / "model.csv", structure(np.arange(5.0, 120.0, 0.5), scale=2.0))
    got = answer("compare", "--modes", 3, measured, tmp_path / "model.csv")
    assert got["rmse_db"] == pytest.approx(20 * np.log10(2))
    assert (got["mre"], got["csf"], got["frac"], got["csac"]) == pytest.approx((1, 0.8, 1, 1))
    formats.write(tmp_path / "model.csv", structure(np.arange(5.0, 120.0, 0.5), shift=1.03))
    got = answer("compare", "--modes", 3, measured, tmp_path / "model.csv")
    np.testing.assert_allclose(got["per_mode"]["relative_error"], 0.03, rtol=0.02)
    assert np.diag(got["mac_matrix"]["mac"]) == pytest.approx(1, abs=1e-3)


def test_modes_are_looked_for_in_accelerations(tmp_path, answer):
    """A test that measured receptances is compared in receptances, but has the same modes."""
    frf = convert_quantity(structure(np.arange(5.0, 120.0, 0.5)), "displacement/force")
    formats.write(tmp_path / "test.uff", frf)
    got = answer("compare", "--modes", 3, tmp_path / "test.uff", tmp_path / "test.uff")
    assert got["quantity"] == "displacement/force"
    np.testing.assert_allclose(got["per_mode"]["test_hz"], POLES_HZ, rtol=1e-3)


def test_columns_and_units_by_a_map(tmp_path, measured, answer):
    """The bench's table in g per kN."""
    frf = structure(np.arange(5.0, 120.0, 0.5))
    parts = [frf.frequency, *(p / 9.80665 * 1e3 for v in frf.functions for p in (np.abs(v),))]
    table = np.stack([*parts, *[np.degrees(np.angle(v)) for v in frf.functions]], axis=1)
    np.savetxt(tmp_path / "m.csv", table, "%.17g", ",", header="f,m1,m2,m3,p1,p2,p3", comments="")
    columns = ["f=frequency"]
    for i in (1, 2, 3):
        columns += [f"m{i}=acc:{i}/force magnitude [g/kN]", f"p{i}=acc:{i}/force phase [deg]"]
    options = [part for column in columns for part in ("--model-column", column)]
    got = answer("compare", "--modes", 3, measured, tmp_path / "m.csv", *options)
    assert got["rmse_db"] == pytest.approx(0, abs=1e-8)


def test_folder_of_figures_and_numbers(output_of, tmp_path, measured):
    formats.write(tmp_path / "model.csv", disguised(structure(np.arange(2.0, 150.0, 0.25), shift=1.02)))
    out = tmp_path / "out"
    captured = output_of("compare", measured, tmp_path / "model.csv", "--out", out, "--band", "10", "100")
    assert "warning: only the model has 9:+X: left out" in captured.err
    assert "interpolated onto" in captured.err
    assert "mode 1: 12.5 Hz, model 12.75 Hz (+2 %)" in captured.out
    names = {"frf_1.png", "correlation.png", "sensors.png", "mac.png", "comparison.json", "comparison.html"}
    assert {p.name for p in out.iterdir()} - {WORK} == names
    assert all(p.stat().st_size > 5000 for p in out.glob("*.png"))
    written = json.loads((out / "comparison.json").read_text())
    assert written["band"] == [10, 100]
    page = (out / "comparison.html").read_text(encoding="utf-8")
    assert all(f'id="figure-{name}"' in page for name in ("frf_1", "correlation", "sensors", "mac"))
    assert page.count('<script type="application/json">') == 2, "FRFs and agreement over frequency"
    assert page.count('class="note"') == len(written["notes"]) and len(written["notes"]) == 4


def test_bad_input(tmp_path, measured, small_dataset, monkeypatch, refused):
    monkeypatch.chdir(tmp_path)
    frf = structure(np.arange(5.0, 120.0, 0.5))
    changed = {
        "reference.uff": {"references": ("5:+Z",)}, "far.uff": {"frequency": frf.frequency + 500},
        "base.uff": {"quantity": "acceleration/acceleration"}, "dofs.uff": {"responses": ("1:+X", "2:+X", "3:+X")},
    }  # fmt: skip
    for name, fields in changed.items():
        formats.write(tmp_path / name, dataclasses.replace(frf, **fields))
    (tmp_path / "file").write_text("")
    cases = {
        ("reference.uff",): "no reference is common; the test has 200:+Z, the model 5:+Z",
        ("far.uff",): "bands do not overlap",
        ("base.uff",): "over a force",
        ("dofs.uff",): "no response is common",
        ("absent.uff",): "absent.uff: cannot be read",
        ("absent.csv",): "absent.csv: No such file",
        ("a.wav",): "does not say what its samples are",
        (sorted(small_dataset.glob("*.uff"))[0],): "holds time records, needs FRFs",
        (measured, "--band", "500", "600"): "no line between 500 and 600 Hz",
        (measured, "--modes", "-1"): "n_modes must be >= 1",
        (measured, "--out", "file"): "is a file; give a folder",
        (measured, "--model-column",
         "a=b"): "names of columns are for CSV, Excel, HDF5, LVM, MATLAB, MDF, NetCDF, TDMS files",
        (measured, "--test-column", "a"): '--test-column "a": needs HEADER=CHANNEL',
    }  # fmt: skip
    for (model, *options), part in cases.items():
        assert part in refused("compare", measured, model, *options), model


# One response, one line, several references


def test_one_common_response(output_of, tmp_path, measured, answer):
    """Twice the level at one sensor: 20 lg 2 dB, MRE 1, FRAC 1, CSF 4/5; CSAC and MAC would be 1 of anything."""
    frf = structure(np.arange(5.0, 120.0, 0.5), scale=2.0)
    formats.write(tmp_path / "one.uff", dataclasses.replace(frf, responses=("1:+Z", "2:+X", "3:+X")))
    got = answer("compare", "--modes", 3, measured, tmp_path / "one.uff")
    assert (got["rmse_db"], got["mre"], got["frac"], got["csf"]) == pytest.approx((20 * np.log10(2), 1, 1, 0.8))
    assert got["csac"] is got["mac"] is None
    assert got["per_mode"]["mac"] == [None] * 3 and np.isnan(np.array(got["mac_matrix"]["mac"], dtype=float)).all()
    np.testing.assert_allclose(got["per_mode"]["relative_error"], 0, atol=1e-6)
    assert "CSAC and MAC of one response are 1 by definition: undefined" in got["notes"]
    out = tmp_path / "out"
    said = output_of("compare", measured, tmp_path / "one.uff", "--modes", "3", "--out", out).out
    assert "CSAC undefined, CSF 0.8" in said and "MAC undefined" in said
    assert {p.name for p in out.iterdir()} - {WORK} == {
        "frf_1.png", "correlation.png", "sensors.png", "comparison.json", "comparison.html",
    }  # fmt: skip


def test_one_common_line(output_of, tmp_path, measured, answer):
    formats.write(tmp_path / "model.csv", structure(np.arange(5.0, 120.0, 0.5), scale=2.0))
    got = answer("compare", "--modes", 3, measured, tmp_path / "model.csv", "--band", "20", "20")
    assert (got["lines"], got["rmse_db"], got["csf"]) == (1, pytest.approx(20 * np.log10(2)), pytest.approx(0.8))
    assert got["csac"] == pytest.approx(1)  # shapes over three responses can differ
    assert got["frac"] is None and got["per_mode"]["mode"] == []
    assert any("they need 18 common lines, there are 1" in note for note in got["notes"])
    arguments = ["compare", str(measured), str(tmp_path / "model.csv"), "--band", "20", "20"]
    assert "FRAC of one line is 1 by definition" in output_of(*arguments, "--out", tmp_path / "out").err


NODES = (1, 2, 3)
LINES = np.arange(5.0, 120.0, 0.5)


def matrix(references, responses, shapes):
    """Accelerance of the three modes between any of three nodes; ``shapes`` has a row for each mode."""
    omega, omega_r = 2 * np.pi * LINES, 2 * np.pi * POLES_HZ[:, None]
    modal = -(omega**2) / (omega_r**2 - omega**2 + 2j * DAMPING * omega_r * omega)
    rows, columns = ([i - 1 for i in nodes] for nodes in (responses, references))
    value = np.einsum("mo,mi,mf->oif", shapes[:, rows], shapes[:, columns], modal)
    labels = [tuple(f"{i}:+Z" for i in nodes) for nodes in (responses, references)]
    return FRF(LINES, value, None, *labels, "acceleration/force")


MODES = SHAPE.T  # a row for each mode


@pytest.mark.parametrize("suffix", [".uff", ".csv", ".mat", ".nc", ".h5"])
def test_several_references(tmp_path, suffix, answer, refused):
    """Two shakers here; a hammer at all nodes, in another order, in a file of another kind there."""
    formats.write(tmp_path / "test.uff", matrix((3, 1), NODES, MODES))
    formats.write(tmp_path / f"model{suffix}", matrix((1, 2, 3), (2, 3, 1), MODES))
    got = answer("compare", "--modes", 3, tmp_path / "test.uff", tmp_path / f"model{suffix}")
    assert got["per_sensor"]["sensor"] == [f"{i}:+Z/{j}:+Z" for j in (3, 1) for i in NODES]
    assert got["rmse_db"] == pytest.approx(0, abs=1e-8)
    assert (got["frac"], got["csac"], got["csf"], got["mac"]) == pytest.approx((1, 1, 1, 1))
    assert got["only_model"] == [f"{i}:+Z/2:+Z" for i in (2, 3, 1)]
    formats.write(tmp_path / "other.uff", matrix((2,), NODES, MODES))
    assert "no reference is common" in refused("compare", tmp_path / "test.uff", tmp_path / "other.uff")
    np.testing.assert_allclose(got["per_mode"]["test_hz"], POLES_HZ, rtol=1e-3)


@pytest.mark.parametrize("responses, power, rtol", [((3,), 1, 1e-3), (NODES, 2, 2e-3)])
def test_mac_over_pairs_of_responses_and_references(tmp_path, answer, responses, power, rtol):
    """A hammer that roves, one accelerometer: the MAC of the shapes, |φᵀψ|² / (φᵀφ ψᵀψ); of all pairs its square."""
    other = MODES + np.array([[0.0, 0.3, 0.0], [0.0, 0.0, 0.4], [0.2, 0.0, 0.0]])
    for name, shapes in (("test", MODES), ("model", other)):
        formats.write(tmp_path / f"{name}.uff", matrix(NODES, responses, shapes))
    got = answer("compare", "--modes", 3, tmp_path / "test.uff", tmp_path / "model.uff")
    wanted = [((a @ b) ** 2 / (a @ a * (b @ b))) ** power for a, b in zip(MODES, other)]
    np.testing.assert_allclose(got["per_mode"]["mac"], wanted, rtol=rtol)


def estimated(rng, seconds=40.0, coherence=0.8):
    """FRFs of a gain of 2 with noise behind it."""
    x, noise = rng.standard_normal((2, int(256 * seconds)))
    response = Response(256.0, x, np.array([2.0 * (x + np.sqrt(1 / coherence - 1) * noise)] * 2), band=(5, 100))
    return estimate_frf(response, resolution=1.0)


def test_an_rmse_stands_beside_what_random_errors_and_a_repeat_make(rng, tmp_path, answer, capsys):
    """Test, model and repeat are one system: all of the RMSE is random error, and it is said by how much."""
    for name in ("test", "model", "repeat"):
        formats.write(tmp_path / f"{name}.nc", estimated(rng))
    files = [tmp_path / f"{name}.nc" for name in ("test", "model")]
    got = answer("compare", *files, "--repeat", tmp_path / "repeat.nc")
    assert got["rmse_db"] == pytest.approx(got["random_both_db"], rel=0.15)
    assert got["repeat_db"] == pytest.approx(got["random_both_db"], rel=0.15)
    assert got["random_both_db"] == pytest.approx(np.sqrt(2) * got["random_db"], rel=0.1)
    assert main([*map(str, ("compare", *files, "--repeat", tmp_path / "repeat.nc"))]) == 0
    said = (
        f"RMSE {got['rmse_db']:.4g} dB; a repeat of the test misses it by {got['repeat_db']:.3g} dB; the random error"
    )
    assert said in capsys.readouterr().out


def test_a_random_error_that_is_not_known_is_said_and_not_invented(rng, tmp_path, answer):
    """Universal files have no place for the number of averages."""
    formats.write(tmp_path / "test.uff", estimated(rng))
    got = answer("compare", tmp_path / "test.uff", tmp_path / "test.uff")
    assert got["random_db"] is None and got["random_both_db"] is None
    assert got["beside"] == "the random error of the test's FRFs is not known: there is no number of averages"


def test_a_mode_that_the_model_lacks_is_said_in_words(tmp_path, measured, output_of):
    """The third mode of the test, at 90 Hz."""
    frf = structure(np.arange(5.0, 120.0, 0.5))
    omega, pole = 2 * np.pi * frf.frequency, 2 * np.pi * POLES_HZ[2]
    third = -np.outer(SHAPE[:, 2] * SHAPE[0, 2], omega**2 / (pole**2 - omega**2 + 2j * DAMPING * pole * omega))
    formats.write(tmp_path / "model.uff", dataclasses.replace(frf, value=frf.value - third[:, None]))
    said = output_of("compare", measured, tmp_path / "model.uff", "--modes", "3").out
    assert "mode 3: 90 Hz; not compared: not found in the model's FRFs between 62.3 and 120 Hz" in said
    assert "nan" not in said
