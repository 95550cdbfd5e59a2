"""clearance-mj listen: files at one full scale, numbers as the Python calls find them, bad input in one line."""

import importlib.util
import json

import numpy as np
import pytest
import scipy.stats
import tomli_w

from clearance_mj import Model, Plate, Rig
from clearance_mj.signals import road_psd
from clearance_mj.signals.excitation import from_psd, random
from clearance_mj.sound import audible_sound, loudness, loudness_over_level, radiate, read_wav
from clearance_mj.tolerance import Scatter

from ..rig.rig_changes import TABLES
from .conftest import RIG, csv_rows

QUICK = ["--duration", 1.5, "--fs", 4096, "--workers", 1, "--quiet"]
OF_PLATE = ["--sensor", 8, "--area", 0.1, "--distance", 1]
PLATE = Plate(sensor=8, area=0.1, distance=1.0)


def noise(level):
    return random(1.5, 4096.0, band=(5, 220), rms=level, seed=0)


def test_two_designs_have_one_full_scale(tmp_path, answer):
    pytest.importorskip("mosqito")
    out = tmp_path / "out"
    given = [*QUICK, *OF_PLATE, "--levels", "1,4", "--against-gap", "x0.5", "--method", "stationary", "--out", out]
    printed = answer("listen", RIG, *given)
    stored = json.loads((out / "loudness.json").read_text(encoding="utf-8"))
    assert printed == stored | {"out": str(out)}
    names = ["A_1.wav", "A_4.wav", "B_1.wav", "B_4.wav"]
    assert [file.rpartition("/")[2] for file in stored["files"]] == names
    wavs = [read_wav(out / name) for name in names]
    assert {(wav.unit, wav.full_scale) for wav in wavs} == {("Pa", wavs[0].full_scale)}
    assert 0.5 < max(np.abs(wav.value).max() for wav in wavs) / wavs[0].full_scale <= 1
    model = Model(Rig.load(RIG))
    for name, design in (("A", model), ("B", model.with_gap("x0.5"))):
        loudness = loudness_over_level(design, noise(1.0), (1, 4), PLATE, method="stationary")
        rows = [row for row in stored["loudness"] if row["design"] == name]
        assert [row["loudness_n5_sone"] for row in rows] == pytest.approx(loudness.n5, rel=1e-9)
        assert [row["sound_pressure_level_db"] for row in rows] == pytest.approx(loudness.pressure_level, abs=1e-6)
    assert [row["level"] for row in csv_rows(out / "loudness.csv")] == ["1.0", "4.0", "1.0", "4.0"]
    assert (out / "loudness.png").stat().st_size > 10_000


def test_the_loudness_of_a_road_has_an_interval_over_noises_and_designs(tmp_path, answer):
    """Each noise and design as the calls have it; Student's interval of the mean by SciPy."""
    pytest.importorskip("mosqito")
    scatter = tmp_path / "gap.toml"
    scatter.write_text('[[scatter]]\nof = "bushings.gap"\nwithin = "0.1 mm"\n', encoding="utf-8")
    road = ("--road", "C", "--speed", 80, "--at", "body")
    given = [*QUICK, *OF_PLATE, *road, "--levels", 2, "--realisations", 3, "--method", "stationary"]
    designs = Scatter.load(scatter).draw(Model(Rig.load(RIG)), 3)
    for more, models in (([], [Model(Rig.load(RIG))] * 3), (["--scatter", scatter], map(designs.model, range(3)))):
        result = answer("listen", RIG, *given, *more, "--out", tmp_path / f"out{len(more)}")
        rows = [{key: float(value) for key, value in row.items() if "sone" in key} for row in result["loudness"]]
        n5 = []
        for seed, model in enumerate(models):
            noise = from_psd(road_psd("C", 80 / 3.6, at="body").scaled(2.0), 1.5, 4096.0, seed)
            n5.append(loudness(audible_sound(model.simulate(noise, "modal"), model.rig, PLATE), "stationary").n5)
        assert [row["loudness_n5_sone"] for row in rows] == pytest.approx(n5, rel=1e-9)
        low, high = scipy.stats.t.interval(0.95, 2, np.mean(n5), scipy.stats.sem(n5))
        known = {"mean_n5_sone": np.mean(n5), "mean_n5_low_sone": max(low, 0), "mean_n5_high_sone": high}
        assert all({key: row[key] for key in known} == pytest.approx(known) for row in rows)
        assert [file.rpartition("/")[2] for file in result["files"]] == ["A_2.wav"]  # one is to be audible_sound


def test_a_rig_with_a_plate_needs_no_options_and_another_file_is_b(tmp_path, answer):
    files = [tmp_path / "a.toml", tmp_path / "b.toml"]
    for file, area in zip(files, (0.1, 0.4)):
        file.write_text(tomli_w.dumps(TABLES | {"plate": {"sensor": 8, "area": area, "distance": 1.0}}))
    given = [*QUICK, "--levels", 0.01, "--method", "none", "--full-scale", 1, "--out", tmp_path / "out"]
    result = answer("listen", files[0], "--against", files[1], *given)
    assert "loudness" not in result
    a, b = (read_wav(file).value for file in result["files"])
    assert b == pytest.approx(2 * a, abs=2**-22)  # four times the area is twice the pressure


def test_accelerations_and_records(tmp_path, answer, small_dataset):
    """A record of a dataset in the place of a simulation; its accelerations come back in m/s²."""
    record = small_dataset / "level_4_1.uff"
    given = [*OF_PLATE, "--record", record, "--record", record, "--method", "none", "--quiet"]
    result = answer("listen", RIG, *given, "--what", "acceleration", "--out", tmp_path / "a")
    assert [file.rpartition("/")[2] for file in result["files"]] == ["A_level_4_1.wav", "A_level_4_1_2.wav"]
    wav = read_wav(result["files"][0])
    assert wav.unit == "m/s2" and wav.name == "acceleration 8:+Z"
    from clearance_mj.io.formats import read_record

    response = read_record(record, Rig.load(RIG), "validate").response()
    assert wav.value.std() == pytest.approx(response.acceleration[7].std(), rel=0.01)
    result = answer("listen", RIG, *given, "--out", tmp_path / "s")
    audible_sound = radiate(response, Rig.load(RIG), PLATE).pressure
    assert read_wav(result["files"][0]).value.std() == pytest.approx(audible_sound.std(), rel=0.01)


@pytest.mark.parametrize("arguments, words", [
    ([], 'rig "table1" has no [plate]: give --sensor, --area and --distance'),
    ([*OF_PLATE, "--sensor", 99], "plate.sensor 99 is no accelerometer's node"),
    ([*OF_PLATE, "--area", 0], "area must be > 0, got 0"),
    ([*OF_PLATE, "--duration", 0.5], "--duration 0.5: must be at least 1 s"),
    ([*OF_PLATE, "--full-scale", 0], "full_scale must be > 0, got 0"),
    ([*OF_PLATE, "--full-scale", 1e-3], "beyond the full scale of 0.001 Pa; give full_scale="),
    ([*OF_PLATE, "--against", "none.toml"], "none.toml"),
    ([*OF_PLATE, "--road", "C"], "--road needs --speed"),
    ([*OF_PLATE, "--road", "C", "--speed", 80, "--sine", 20], "give --sine, or --psd or --road, one of them"),
    ([*OF_PLATE, "--realisations", 0], "--realisations 0: must be 1 to 1000"),
    ([*OF_PLATE, "--record", "x.uff", "--against-gap", "x0.5"], "--record is measured: give no --against"),
])  # fmt: skip
def test_refusals(tmp_path, refused, arguments, words):
    out = tmp_path / "out"
    assert words in refused("listen", RIG, *QUICK, "--levels", 1, "--method", "none", "--out", out, *arguments)
    assert not out.exists()


def test_without_mosqito_it_says_what_to_install(tmp_path, refused, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *_: None)
    words = refused("listen", RIG, *QUICK, *OF_PLATE, "--out", tmp_path / "out")
    assert 'pip install "clearance-mj[sound]"; or give --method none' in words
