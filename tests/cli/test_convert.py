"""clearance-mj convert: the same numbers in another format, datasets out of single files, one line for bad input."""

import dataclasses
import json

import numpy as np
import pytest
import scipy.io

from clearance_mj import FRF, Dataset, estimate_frf
from clearance_mj.io import formats
from clearance_mj.io.uff import read_geometry

from ..conftest import ROOT, record_of
from .conftest import RIG


@pytest.fixture(scope="module")
def record(rig):
    return record_of(rig, "ramp", "identify", 2.0, 3, duration=4.0)


@pytest.fixture
def bench(tmp_path, record):
    """The record as a bench's CSV file: columns of its own names, in g and mm."""
    units = {"acceleration": 9.80665, "displacement": 1e-3}
    columns = [np.arange(record.size) / record.fs, *(c.value / units[c.quantity] for c in record.channels)]
    header = ",".join(("t", "Temp", *(f"ch{i}" for i in range(len(record.channels)))))
    columns.insert(1, np.full(record.size, 21.5))
    np.savetxt(tmp_path / "bench.csv", np.stack(columns, 1), "%.17g", ",", header=header, comments="")
    return tmp_path / "bench.csv"


@pytest.fixture
def columns(record):
    names = [f"{'acc' if c.quantity == 'acceleration' else 'disp'}:{c.node}" for c in record.channels]
    units = [{"acceleration": "g", "displacement": "mm"}[c.quantity] for c in record.channels]
    pairs = ["t=time", "Temp=skip", *(f"ch{i}={n} [{u}]" for i, (n, u) in enumerate(zip(names, units)))]
    return [part for pair in pairs for part in ("--column", pair)]


@pytest.mark.parametrize("suffix", [".uff", ".csv", ".mat", ".nc", ".h5"])
def test_a_bench_file_in_every_format(tmp_path, bench, columns, record, suffix, answer):
    out = tmp_path / f"out{suffix}"
    assert answer("convert", bench, out, *columns)["holds"] == f"11 channels, {record.size} samples at 2048 Hz"
    for got, sent in zip(formats.read_channels(out), record.channels, strict=True):
        assert (got.label, got.quantity, got.fs) == (sent.label, sent.quantity, sent.fs)
        scale = np.abs(sent.value).max()
        np.testing.assert_allclose(got.value, sent.value, atol=1e-7 * scale)  # .uff: single precision


def test_matlab_variables(tmp_path, rng, answer):
    x = rng.standard_normal((100, 2))
    scipy.io.savemat(tmp_path / "a.mat", {"Data": x, "Fs": 512.0})
    answer("convert", tmp_path / "a.mat", tmp_path / "a.csv", "--fs", 512, "--column", "Data:1=base", "--column",
        "Data:2=acc:1:-Z [g]")  # fmt: skip
    base, tip = formats.read_channels(tmp_path / "a.csv")
    assert (base.label, tip.label, base.fs) == ("100:+Z", "1:-Z", 512.0)
    np.testing.assert_allclose(tip.value, 9.80665 * x[:, 1], rtol=1e-15)


def test_frfs_of_a_record_with_the_rigs_geometry(tmp_path, record, rig, answer):
    formats.write(tmp_path / "r.uff", list(record.channels))
    said = answer("convert", tmp_path / "r.uff", tmp_path / "h.uff", "--rig", RIG, "--frf", 1, "--band", 5, 220)
    assert said["holds"] == "8 FRFs, acceleration/acceleration to 100:+Z, 216 lines"
    wanted = estimate_frf(record.response(), resolution=1.0, band=(5, 220))
    np.testing.assert_allclose(formats.read_frf(tmp_path / "h.uff").value, wanted.value, rtol=1e-3)
    assert len(read_geometry(tmp_path / "h.uff").nodes) == 1 + len(rig.sensors)


def test_frfs_of_any_two_channels_without_a_rig(tmp_path, rng, answer):
    """A seat that moves twice as far as its rail, two samples late: a gain of 2, and its phase."""
    rail, fs = rng.standard_normal(8192), 1024.0
    seat = 2 * np.roll(rail, 2)
    rows = np.column_stack((np.arange(rail.size) / fs, rail, seat))
    np.savetxt(tmp_path / "car.csv", rows, "%.9g", ",", header="time,rail [m/s2],seat [m/s2]", comments="")
    said = answer("convert", tmp_path / "car.csv", tmp_path / "frf.csv", "--frf", 1, "--band", 5, 100, "--column",
        "rail=base [m/s2]", "--column", "seat=acc:1 [m/s2]")  # fmt: skip
    assert said["holds"] == "1 FRFs, acceleration/acceleration to 100:+Z, 96 lines"
    frf = formats.read_frf(tmp_path / "frf.csv")
    np.testing.assert_allclose(frf.functions[0], 2 * np.exp(-2j * np.pi * frf.frequency * 2 / fs), rtol=0.02)


def test_a_simulated_response(output_of, tmp_path, record, rig, answer):
    formats.write(tmp_path / "r.nc", record.response())
    captured = output_of("convert", tmp_path / "r.nc", tmp_path / "a.uff", "--json")
    assert "left out: displacements (--rig says at which nodes)" in captured.err
    assert json.loads(captured.out)["holds"].startswith("9 channels")
    assert answer("convert", tmp_path / "r.nc", tmp_path / "b.uff", "--rig", RIG)["holds"].startswith("11 channels")
    answer("convert", tmp_path / "r.nc", tmp_path / "h.csv", "--frf", 1)
    assert formats.read_frf(tmp_path / "h.csv").responses == tuple(rig.sensor_labels)


def test_a_base_plate_of_another_number(tmp_path, record, answer):
    """The tutorial's way: a universal file as CSV, whose columns can be mapped, and back."""
    channels = [dataclasses.replace(c, node=12) if c.node == 100 else c for c in record.channels]
    formats.write(tmp_path / "mine.uff", channels)
    answer("convert", tmp_path / "mine.uff", tmp_path / "mine.csv")
    answer("convert", tmp_path / "mine.csv", tmp_path / "ramp.uff", "--column", "acc:12=base")
    got = formats.read_record(tmp_path / "ramp.uff", record.rig, "identify")
    np.testing.assert_array_equal(got.excitation().value, np.float32(record.excitation().value))


def test_one_reference_out_of_several(tmp_path, rng, answer, refused):
    value = rng.standard_normal((2, 30)) + 1j
    both = FRF(np.arange(5.0, 35.0), np.stack((value, value), 1), None, (), ("5:+Z", "7:-Y"), "acceleration/force")
    formats.write(tmp_path / "two.uff", both)
    said = answer("convert", tmp_path / "two.uff", tmp_path / "two.csv")
    assert said["holds"] == "2 FRFs, acceleration/force to 5:+Z, 30 lines; 2 FRFs, acceleration/force to 7:-Y, 30 lines"
    said = answer("convert", tmp_path / "two.csv", tmp_path / "one.uff", "--reference", "7:-Y")
    assert said["holds"] == "2 FRFs, acceleration/force to 7:-Y, 30 lines"
    np.testing.assert_array_equal(formats.read_frf(tmp_path / "one.uff").functions, value)
    said = refused("convert", tmp_path / "two.uff", tmp_path / "x.csv", "--reference", "6:+Z")
    assert "holds FRFs to 5:+Z, 7:-Y; not 6:+Z" in said
    assert "--frf is for time records" in refused("convert", tmp_path / "two.uff", tmp_path / "x.csv", "--frf", 1)
    said = refused("convert", tmp_path / "two.uff", tmp_path / "x", "--rig", RIG, "--reference", "5:+Z")
    assert "a dataset holds time records; --reference" in said


def test_a_dataset_out_of_single_files(tmp_path, bench, columns, record, answer, refused):
    folder, uff = tmp_path / "data", tmp_path / "level 2.uff"
    formats.write(uff, list(record.channels))
    said = answer("convert", bench, folder, "--rig", RIG, *columns)
    assert said["records"] == ["bench"]
    said = answer("convert", uff, "--out", folder, "--role", "validate", "--band", 5, 220)
    dataset = Dataset.load(folder)
    assert [(r.name, r.role, r.band) for r in dataset.records] == [
        ("bench", "identify", None),
        ("level_2", "validate", (5.0, 220.0)),
    ]
    assert said["levels"] == [dataset.records[1].level]
    assert dataset.records[1].level == pytest.approx(np.std(record.excitation().value), rel=5e-3)
    np.testing.assert_allclose(dataset.records[0].response().acceleration, record.response().acceleration, atol=1e-5)
    before = (folder / "dataset.toml").read_text()
    assert 'record name "level_2" is used twice' in refused("convert", uff, folder)
    assert (folder / "dataset.toml").read_text() == before


def test_one_sensor_is_left_out_of_one_record(tmp_path, bench, columns, record, answer, refused):
    """The channel was not recorded, or is in the file and of no use; the other record keeps its own."""
    folder, uff = tmp_path / "data", tmp_path / "dead.uff"
    lacking = [c for c in record.channels if (c.node, c.quantity) != (3, "acceleration")]
    formats.write(uff, lacking)
    answer("convert", bench, folder, "--rig", RIG, *columns)
    assert "a sensor of the rig; leave it out of this record alone with" in refused("convert", uff, folder)
    answer("convert", uff, folder, "--leave-out", "3:+Z")
    flat = dataclasses.replace(record.channels[3], node=3, value=np.ones(record.size))
    formats.write(tmp_path / "flat.uff", [*lacking, flat])
    answer("convert", tmp_path / "flat.uff", "--out", folder, "--leave-out", "3:+Z")
    records = Dataset.load(folder).records
    assert [len(r.response().responses) for r in records] == [8, 7, 7]
    assert "3:+Z" not in records[2].response().responses
    assert "--leave-out are for a dataset folder" in refused("convert", uff, tmp_path / "x.csv", "--leave-out", "3:+Z")


def test_bad_input(tmp_path, bench, record, monkeypatch, refused):
    uff, out = tmp_path / "r.uff", tmp_path / "out"
    formats.write(uff, list(record.channels))
    monkeypatch.chdir(tmp_path)
    cases = {
        ("absent.csv", "b.uff"): "absent.csv: No such file",
        ("absent.uff", "b.csv"): "absent.uff: cannot be read",
        (bench, "out", "--rig", RIG): 'does not say where or what "Temp" and 11 more measured: make a map with',
        (bench, "b.uff", "--column", "t"): "needs HEADER=CHANNEL",
        (bench, "b.uff", "--column", "Time=time"): 'has no column "Time"',
        (uff, "b.wav"): "does not say what its samples are",
        (uff, "b.doc"): 'suffix ".doc" is unknown',
        ("a.wav", "b.uff"): "does not say what its samples are",
        (uff, "b.csv", "--fs", 100): "a sampling rate is for CSV, Excel, HDF5, LVM, MATLAB, MDF, NetCDF, TDMS files",
        (uff, "b.csv", "--role", "identify"): "--role are for a dataset folder",
        (uff, "b.csv", "--band", 5, 220): "--band is for --frf",
        (uff, "b.csv", "--frf", 1, "--kind", "force"): "--frf needs --rig, or one channel that drives",
        (uff, "b.csv", "--frf", 0.001, "--rig", RIG): "shorter than one segment",
        (uff, uff, "b.csv"): "one file is written from one",
        (uff,): "needs a file to read and one to write",
        (tmp_path, "b.csv"): "is a folder",
        (uff, "b.csv", "--rig", "no.toml"): "no.toml",
        (uff, out): "a new dataset needs its rig",
        (uff, out, "--rig", RIG, "--role", "train"): 'role "train" is unknown',
        (uff, out, "--rig", RIG, "--band", 5, 2000): "below twice the band",
        (uff, out, "--rig", RIG, "--frf", 1): "a dataset holds time records",
    }
    for arguments, part in cases.items():
        assert part in refused("convert", *arguments), arguments
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bench.csv", "r.uff"]


def test_orbits_of_a_run_up_out_of_a_csv(tmp_path, answer, refused):
    """Keyphasor, kind, spin and pulses per turn are given; files keep them, and the speed is that of the ramp."""
    fs = 1024.0
    time = np.arange(4096) / fs
    angle = 2 * np.pi * (5.0 * time + 2.5 * time**2 / 2)  # 5 to 15 Hz in 4 s
    probes = 20.0 * np.array((np.cos(angle), np.sin(angle)))  # µm
    rows = np.column_stack((time, *probes, -24.0 + 12.0 * (angle / np.pi % 1.0 < 0.2)))
    np.savetxt(tmp_path / "run.csv", rows, "%.9g", ",", header="t,Probe Y [um],Probe Z [um],KP [V]", comments="")
    given = ["convert", tmp_path / "run.csv", tmp_path / "machine", "--rig", ROOT / "models" / "rotor.toml"]
    for name in ("Probe Y=disp:2:+Y", "Probe Z=disp:2:+Z", "KP=keyphasor"):
        given += ["--column", name]
    given += ["--role", "orbit", "--spin", "5Hz:900rpm:4"]
    assert "run added with role orbit" in answer(*given, "--pulses", 2)["holds"]
    dataset = Dataset.load(tmp_path / "machine")
    assert dataset.source == "run.csv"
    (record,) = dataset.orbits
    assert (record.excitation_kind, record.level, record.spin.pulses) == ("spin", None, 2)
    turning = record.turning()
    middle = (turning.marks[1:] + turning.marks[:-1]) / 2
    # An edge is known within half a sample, of the 68 that the fastest turn has.
    np.testing.assert_allclose(turning.of_turns, 2 * np.pi * (5 + 2.5 * middle), rtol=1 / 68)
    probe = next(c for c in record.channels if c.direction == "+Y")
    np.testing.assert_allclose(probe.value, 1e-6 * probes[0], atol=1e-12)
    for back in ("a.csv", "a.mat"):  # keyphasors have a name in tables
        answer("convert", tmp_path / "machine" / "run.uff", tmp_path / back)
        assert {c.label for c in formats.read(tmp_path / back)} == {"2:+Y", "2:+Z", "400:S"}
    (tmp_path / "map.toml").write_text('[channels]\n"Probe Y"="disp:2:+Y"\n"Probe Z"="disp:2:+Z"\nKP="keyphasor"\n')
    mapped = [*given[:2], *given[3:5], "--role", "orbit", "--map", tmp_path / "map.toml"]
    answer(*mapped, "--spin", "5Hz:15Hz:4", "--pulses", 2, "--out", tmp_path / "other")
    assert "--spin 5Hz:15Hz: " in refused(*mapped[:-2], "--spin", "5Hz:15Hz", "--out", tmp_path / "no")
    assert "give SPEED or FROM:TO:SECONDS" in refused(*mapped[:-2], "--spin", "fast", "--out", tmp_path / "no")
