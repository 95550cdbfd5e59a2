"""Files by suffix: the same records and FRFs through every format; formats that say too little are refused."""

import dataclasses
import gzip

import numpy as np
import pytest
import scipy.io
import xarray as xr

from clearance_mj import FRF, Channel, RecordError, Response
from clearance_mj.io import formats, results
from clearance_mj.io.channels import NOWHERE
from clearance_mj.io.csv_tables import read_csv
from clearance_mj.signals import Modes, join_references

from .refusals import assert_refused

FS, N = 2048.0, 64
SUFFIXES = (".uff", ".csv", ".mat", ".nc", ".h5")  # of records and FRFs
RECORD_SUFFIXES = (*SUFFIXES, ".lvm", ".tdms", ".mf4")


def described(channels):
    return [(c.name, c.label, c.quantity, c.unit, c.fs, c.start) for c in channels]


@pytest.fixture
def channels(rng):
    places = [("base", 100, "+Z", "acceleration"), ("acc:3:-Z", 3, "-Z", "acceleration"), ("force", 200, "+Z", "force")]
    places += [("disp:6", 6, "+Z", "displacement"), ("vel:4:+RX", 4, "+RX", "velocity"), ("force:9:S", 9, "S", "force")]
    return [Channel(*place, rng.standard_normal(N).astype(np.float32), FS, 0.25) for place in places]


@pytest.fixture
def frf(rng):
    value = rng.standard_normal((2, 30)) + 1j * rng.standard_normal((2, 30))
    return FRF(np.geomspace(5, 220, 30), value, rng.random((2, 30)), ("1:+Z", "2:-X"), "100:+Z")


@pytest.mark.parametrize("suffix", RECORD_SUFFIXES)
def test_channels_through_every_format(tmp_path, channels, suffix):
    formats.write(tmp_path / f"a{suffix}", channels)
    got = formats.read(tmp_path / f"a{suffix}")
    assert described(got) == described(channels)
    np.testing.assert_array_equal([c.value for c in got], [c.value for c in channels])


RAW_SUFFIXES = (".csv", ".mat", ".nc", ".h5", ".lvm", ".tdms", ".mf4")


@pytest.mark.parametrize("suffix", RAW_SUFFIXES)
def test_raw_channels_through_every_format(tmp_path, rng, suffix):
    """Under their own names, with separators and letters of any language in them, nowhere, in their unit."""
    kinds = [("Accel 3", "acceleration", ""), ("Kanal, ä (Trigger)", "force", ""), ("T1", "unknown", "°C")]
    kinds += [("no unit", "unknown", "")]
    if suffix in (".csv", ".mat", ".nc", ".h5"):  # others have no room for a unit that is said to be none
        kinds.append(("a [b]", "unknown", ""))
    sent = [Channel(name, *NOWHERE, quantity, rng.standard_normal(N), FS, 0.25, unit) for name, quantity, unit in kinds]
    path = tmp_path / f"a{suffix}"
    formats.write(path, sent)
    got = formats.read(path)
    assert described(got) == described(sent)
    np.testing.assert_array_equal([c.value for c in got], [c.value for c in sent])


def test_raw_names_that_a_table_would_read_as_others(tmp_path):
    for name in ("base", "acc:3", "Time"):
        with pytest.raises(RecordError, match=f'channel "{name}" would be read as another from a table; rename it'):
            formats.write(tmp_path / "a.csv", [Channel(name, *NOWHERE, "unknown", np.ones(3), FS)])


def test_raw_channels_make_no_record(tmp_path, channels, rig):
    raw = [dataclasses.replace(c, name=f"CH{i}", node=0, direction="S") for i, c in enumerate(channels)]
    formats.write(tmp_path / "a.nc", raw)
    said = (
        r'a\.nc: .*has no acceleration at node 100 along Z, .*; its file does not say where or what "CH0" and 5 more '
        r'measured: make a map with clearance-mj map FILE --rig RIG, or give each, such as --column "CH0=acc:1 \[g\]"'
    )
    assert_refused(said, formats.read_record, tmp_path / "a.nc", rig, "identify")


def matrix(rng, coherence=True):
    """FRFs of a test with two shakers and a hammer: other responses and another order to each reference."""
    return join_references(parts(rng, coherence))


def parts(rng, coherence=True):
    """One for each reference."""
    responses = {"5:+Z": ("1:+Z", "2:-X", "5:+Z"), "7:-Z": ("5:+Z", "2:-X"), "200:+Z": ("9:+Z",)}
    all_parts = []
    for reference, labels in responses.items():
        value = rng.standard_normal((len(labels), 30)) + 1j * rng.standard_normal((len(labels), 30))
        known = rng.random(value.shape) if coherence else None
        all_parts.append(FRF(np.geomspace(5, 220, 30), value, known, labels, (reference,), "acceleration/force"))
    return all_parts


@pytest.mark.parametrize("coherence", [True, False])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_frfs_through_every_format(tmp_path, rng, frf, suffix, coherence):
    sent, path = matrix(rng, coherence), tmp_path / f"a{suffix}"
    formats.write(path, frf)
    assert formats.read_frf(path) == frf
    formats.write(path, sent)
    assert formats.read_frf(path) == sent
    one = formats.read_frf(path, reference="7:-Z")
    assert one == sent.to_reference("7:-Z")
    assert (one.responses, one.reference) == (("2:-X", "5:+Z"), "7:-Z")
    assert_refused(r"holds FRFs to 5:\+Z, 7:-Z, 200:\+Z; not 1:\+Z", formats.read_frf, path, reference="1:+Z")


def test_columns_name_response_and_reference(tmp_path, rng):
    formats.write(tmp_path / "a.csv", matrix(rng, coherence=False))
    header = (tmp_path / "a.csv").read_text().split("\n")[0]
    names = [cell.split(" ")[0] for cell in header.split(",")[1::2]]
    assert names == ["acc:1/force:5", "acc:2:-X/force:5", "acc:5/force:5", "acc:2:-X/force:7:-Z", "acc:5/force:7:-Z",
                     "acc:9/force"]  # fmt: skip


def test_labelled_array_of_several_references(rng):
    """The dimensions that neighbouring tools use; nan where a pair was not measured."""
    sent = matrix(rng)
    ds = results.with_parts(sent.to_xarray())
    assert ds["value"].dims == ("response", "reference", "frequency", "part")
    assert dict(ds.sizes) == {"response": 4, "reference": 3, "frequency": 30, "part": 2}
    picked = ds["value"].sel(response="2:-X", reference="7:-Z").values
    np.testing.assert_array_equal(picked[:, 0] + 1j * picked[:, 1], sent.value[1, 1])
    assert np.isnan(ds["value"].sel(response="9:+Z", reference="5:+Z")).all()


def test_coherence_to_some_references_only(tmp_path, rng):
    """nan where it is unknown; MATLAB's matrix has no place for that."""
    first, *others = parts(rng)
    sent = join_references([dataclasses.replace(first, coherence=None), *others])
    assert sent.to_reference("5:+Z").coherence is None and sent.to_reference("7:-Z").coherence is not None
    for suffix in (".uff", ".csv", ".nc"):
        formats.write(tmp_path / f"a{suffix}", sent)
        assert formats.read_frf(tmp_path / f"a{suffix}") == sent
    assert_refused("only some references have a coherence", formats.write, tmp_path / "a.mat", sent)


def test_references_that_do_not_fit_together_are_read_one_by_one(tmp_path, rng):
    """A universal file may hold other lines or quantities to each reference: two files in one."""
    first, second, _ = parts(rng)
    moved = dataclasses.replace(second, quantity="displacement/force")
    for other, part in ((second.within((10, 100)), "are not on the same lines"), (moved, "needs one quantity")):
        assert_refused(part, join_references, [first, other])
        formats.write(tmp_path / "a.uff", first)
        formats.write(tmp_path / "b.uff", other)
        (tmp_path / "both.uff").write_bytes((tmp_path / "a.uff").read_bytes() + (tmp_path / "b.uff").read_bytes())
        assert formats.read(tmp_path / "both.uff").frfs == (first, other)
        with pytest.raises(RecordError, match=r'both.uff: holds several "frf"; choose one of "frf 1" \(FRFs accel'):
            formats.read_frf(tmp_path / "both.uff")
        assert formats.read_frf(tmp_path / "both.uff", what="frf 2") == other
        for frf in (first, other):
            assert formats.read_frf(tmp_path / "both.uff", reference=frf.reference) == frf


def response(rng, rig):
    shape = (len(rig.sensors), N)
    motion = {name: rng.standard_normal((2, N)) for name in ("displacement", "contact_force", "grease_force")}
    return Response(FS, rng.standard_normal(N), rng.standard_normal(shape), **motion,
                    responses=tuple(rig.sensor_labels))  # fmt: skip


@pytest.mark.parametrize("suffix", [".nc", ".h5"])
def test_modes_are_labelled_arrays(tmp_path, rng, suffix):
    shape = rng.standard_normal((3, 2)) + 1j * rng.standard_normal((3, 2))
    sent = Modes(np.array([9.25, 39.75]), np.array([0.01, 0.02]), shape, ("1:+Z", "2:-X", "8:+Z"))
    formats.write(tmp_path / f"m{suffix}", sent)
    assert formats.read(tmp_path / f"m{suffix}") == sent


def test_responses_become_channels(tmp_path, rng, rig):
    resp = response(rng, rig)
    formats.write(tmp_path / "a.csv", resp, rig)
    got = {(c.label, c.quantity): c.value for c in formats.read_channels(tmp_path / "a.csv")}
    np.testing.assert_array_equal(got["100:+Z", "acceleration"], resp.excitation)
    np.testing.assert_array_equal(got["8:+Z", "acceleration"], resp.acceleration[7])
    np.testing.assert_array_equal(got[rig.probe_labels[1], "displacement"], resp.displacement[1])
    assert len(formats.to_channels(resp)) == 1 + len(rig.sensors)
    named = {c.name: c for c in formats.read(tmp_path / "a.csv")}
    for name in ("contact", "grease"):
        force = named[f"{name} force {rig.probe_labels[1]}"]
        np.testing.assert_array_equal(force.value, getattr(resp, f"{name}_force")[1])
        assert (force.quantity, force.placed) == ("force", False)
    formats.write(tmp_path / "a.mat", resp)
    columns = [str(c) for c in scipy.io.loadmat(tmp_path / "a.mat", simplify_cells=True)["columns"]]
    assert columns[-2:] == ["grease force 1 [N]", "grease force 2 [N]"]
    formats.write(tmp_path / "a.nc", resp)
    np.testing.assert_array_equal(formats.read(tmp_path / "a.nc").contact_force, resp.contact_force)


def test_other_tools_open_our_hdf5(tmp_path, channels):
    h5py = pytest.importorskip("h5py")
    formats.write(tmp_path / "a.h5", channels)
    with h5py.File(tmp_path / "a.h5") as file:
        np.testing.assert_array_equal(file["value"], [c.value for c in channels])
    assert list(xr.load_dataset(tmp_path / "a.h5", engine="h5netcdf")["units"].values)[:3] == ["m s-2", "m s-2", "N"]


def test_hdf5_without_the_package(tmp_path, frf, monkeypatch):
    monkeypatch.setattr(results.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RecordError, match=r'HDF5 needs the package h5netcdf: pip install "clearance-mj\[hdf5\]"'):
        formats.write(tmp_path / "a.h5", frf)
    assert not list(tmp_path.iterdir())
    (tmp_path / "a.nc").write_bytes(b"\x89HDF\r\n\x1a\n")
    assert_refused("HDF5 needs", formats.read, tmp_path / "a.nc")


@pytest.mark.parametrize("suffix", [".wav", ".WAV", ".flac", ".npy", ".raw", ".dat"])
def test_plain_time_series_are_refused_with_a_hint(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"RIFF")
    assert_refused(r'does not say what its samples are.*"time,base \[g\],acc:1 \[g\]"', formats.read, path)


@pytest.mark.parametrize("name", ["a", "a.numbers", "a.gz"])
def test_unknown_suffixes(tmp_path, name, frf):
    for call in (lambda: formats.read(tmp_path / name), lambda: formats.write(tmp_path / name, frf)):
        assert_refused(r"suffix .* is unknown; use \.uff", call)


def test_tables_cannot_hold_everything(tmp_path, channels, frf):
    other = Channel("b", 1, "+Z", "acceleration", np.ones(3), FS)
    for suffix in (".csv", ".mat", ".nc"):
        with pytest.raises(RecordError, match=r"3 samples at 2048 Hz.* a table needs one time, \.uff does not"):
            formats.write(tmp_path / f"a{suffix}", [*channels, other])
    for suffix in (".csv", ".mat"):
        with pytest.raises(RecordError, match=r"files cannot take modes; use \.uff"):
            formats.write(tmp_path / f"a{suffix}", Modes(np.ones(1), np.ones(1), np.ones((2, 1))))
    assert_refused("compressed files are read, not written", formats.write, tmp_path / "a.csv.gz", channels)
    assert_refused('two channels would be columns "base', formats.write, tmp_path / "a.csv", [channels[0], channels[0]])
    value = frf.value.copy()
    value[0, 0, 3] = np.nan
    assert_refused(r"not finite at 7\.39", formats.write, tmp_path / "a.csv", FRF(frf.frequency, value))
    assert not list(tmp_path.iterdir())


def test_wrong_kind_of_file(tmp_path, channels, frf):
    formats.write(tmp_path / "a.nc", channels)
    formats.write(tmp_path / "h.nc", frf)
    assert_refused(r"a\.nc: holds time records, needs FRFs", formats.read_frf, tmp_path / "a.nc")
    assert_refused(r"h\.nc: holds FRFs, needs time records", formats.read_channels, tmp_path / "h.nc")
    with pytest.raises(
        RecordError, match="is written by clearance_mj: it names its channels and says their rate itself"
    ):
        formats.read(tmp_path / "h.nc", fs=10.0)
    with pytest.raises(
        RecordError, match="a sampling rate is for CSV, Excel, HDF5, LVM, MATLAB, MDF, NetCDF, TDMS files"
    ):
        formats.read("models/table1_rig.toml", fs=10.0)


# FRFs in CSV, as people write them


def csv(tmp_path, header, *rows):
    (tmp_path / "h.csv").write_text("\n".join((header, *rows)) + "\n")
    return tmp_path / "h.csv"


def test_magnitude_and_phase(tmp_path):
    header = "frequency [kHz];acc:1/force magnitude [g/N];acc:1/force phase [deg];acc:1/force coherence"
    got = read_csv(csv(tmp_path, header, "0.01;2;90;1", "0.02;3;-180;0.5"))
    np.testing.assert_allclose(got.frequency, [10, 20])
    np.testing.assert_allclose(got.functions, [[2j * 9.80665, -3 * 9.80665]], atol=1e-14)
    np.testing.assert_array_equal(got.coherence[0], [[1, 0.5]])


def test_columns_without_a_header_are_mapped_by_number(tmp_path):
    path = csv(tmp_path, "10,1,2", "20,3,4", "30,5,6")
    got = read_csv(path, {"1": "frequency", "2": "disp:1/force real [mm/N]", "3": "disp:1/force imag [mm/N]"})
    np.testing.assert_allclose(got.functions, [[1e-3 + 2e-3j, 3e-3 + 4e-3j, 5e-3 + 6e-3j]])
    assert_refused(r'line 1: has numbers where .* names are expected; .*"1=time"', read_csv, path)


@pytest.mark.parametrize("header, part", [
    ("frequency,acc:1/force real,acc:2/force imag", r"response 1:\+Z has real; needs real and imag"),
    ("frequency,acc:1/force real,acc:1/force real", "real of 1:.* comes twice"),
    ("frequency,acc:1/force magnitude,acc:1/force phase", r"a phase needs its unit, \[deg\] or \[rad\]"),
    ("frequency,acc:1/force [ft/N],acc:2/force", 'unit "ft/N" of acceleration/force is unknown'),
    ("acc:3/force coherence,acc:1/force real,acc:1/force imag", 'needs one column "frequency", has 0'),
    ("time,acc:1/force real,acc:1/force imag", '"time" is of a time record'),
    ("frequency,frequency,acc:1/force", 'needs one column "frequency", has 2'),
    ("frequency,acc:1/force,acc:2/force coherence", r"response 2:\+Z has no values"),
])  # fmt: skip
def test_headers_of_frfs_that_cannot_be_used(tmp_path, header, part):
    with pytest.raises(RecordError, match=part) as caught:
        read_csv(csv(tmp_path, header, "1,2,3", "2,3,4"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("file, name", [
    ("lev_0.5.csv", "lev_0.5"), ("lev_0.7.csv.gz", "lev_0.7"), ("run.UFF", "run"), ("a b.csv", "a_b"),
])  # fmt: skip
def test_a_record_is_named_after_its_file(tmp_path, rig, file, name):
    """Without its suffix, and nothing else: lev_0.5 and lev_0.7 are two records."""
    channels = formats.read_channels("data/table1_rig/level_0.5_a.uff", rig=rig)
    formats.write(tmp_path / file.removesuffix(".gz"), channels)
    if file.endswith(".gz"):
        (tmp_path / file).write_bytes(gzip.compress((tmp_path / file.removesuffix(".gz")).read_bytes()))
    assert formats.read_record(tmp_path / file, rig, "identify").name == name
