"""Results in NetCDF: round trips, the labels that other tools see, and damage."""

import dataclasses

import numpy as np
import pytest
import scipy.io
import xarray as xr

from clearance_mj import FRF, ClearanceError, RecordError, Response
from clearance_mj.io.results import load, save, with_parts, without_parts

from .refusals import assert_refused

RNG = np.random.default_rng(5)


def frf(n=3, n_f=7, **changes):
    value = RNG.standard_normal((n, n_f)) + 1j * RNG.standard_normal((n, n_f))
    whole = FRF(5 + 0.5 * np.arange(n_f), value, RNG.random((n, n_f)), ("3:+Z", "12:-X", "7:+Z")[:n], "100:+Z")
    return dataclasses.replace(whole, **changes)


def response(n=20, **changes):
    def noise(*shape):
        return RNG.standard_normal(shape)

    whole = Response(
        fs=2048.0,
        excitation=noise(n),
        channels=noise(3, n),
        displacement=noise(2, n),
        contact_force=noise(2, n),
        grease_force=noise(2, n),
        band=(5.0, 220.0),
        responses=("3:+Z", "12:+Z", "7:+Z"),
        provenance={"rig": {"name": "täble"}, "seed": 3, "law": None, "gap": 3e-4, "levels": [0.1, 2]},
    )
    return dataclasses.replace(whole, **changes)


def assert_same(a, b):
    assert type(a) is type(b)
    for f in dataclasses.fields(a):
        one, other = getattr(a, f.name), getattr(b, f.name)
        if isinstance(one, np.ndarray):
            assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes()), f.name
        else:
            assert one == other, f.name


HOLES = np.array([[np.nan, complex(-0.0, np.inf), 1e-320]])


@pytest.mark.parametrize("sent", [
    frf(), frf(coherence=None), frf(quantity="acceleration/force", references=("200:+Z",)), frf(n=1, n_f=1),
    FRF([1.0, 2.0, 4.0], HOLES), response(),
    response(displacement=None, contact_force=None, grease_force=None, band=None),
    response(responses=(), provenance={}, kind="force", reference="200:+Z"), response(n=1),
])  # fmt: skip
def test_comes_back_bit_for_bit(tmp_path, sent):
    save(tmp_path / "a.nc", sent)
    assert_same(load(tmp_path / "a.nc"), sent)


def test_frf_is_labelled():
    """Dimensions, labels and the real/imag pair of a stored FRF; units as UDUNITS writes them."""
    sent = frf(quantity="acceleration/force")
    ds = with_parts(sent.to_xarray())
    assert ds["value"].dims == ("response", "reference", "frequency", "part")
    assert ds["coherence"].dims == ("response", "reference", "frequency")
    assert ds["value"].attrs == {"units": "(m s-2)/(N)", "long_name": "acceleration/force"}
    assert ds["frequency"].attrs["units"] == "Hz"
    picked = ds["value"].sel(response="12:-X", reference="100:+Z", frequency=6.5)
    assert complex(picked.sel(part="real"), picked.sel(part="imag")) == sent.value[1, 0, 3]
    assert frf().to_xarray()["value"].attrs["units"] == "1"


def test_response_is_labelled():
    sent = response()
    ds = sent.to_xarray()
    units = {name: ds[name].attrs["units"] for name in ds.variables if "units" in ds[name].attrs}
    assert units == {"excitation": "m s-2", "acceleration": "m s-2", "displacement": "m", "contact_force": "N",
                     "grease_force": "N", "time": "s"}  # fmt: skip
    assert ds["acceleration"].sel(response="12:+Z").isel(time=4) == sent.acceleration[1, 4]
    assert ds["time"].values[3] == 3 / 2048
    assert response(kind="force").to_xarray()["excitation"].attrs["units"] == "N"


def test_scipy_opens_the_file_alone(tmp_path):
    """An independent NetCDF reader, and the format: "CDF" and 2 for 64-bit offsets (NetCDF classic format)."""
    sent = response()
    save(tmp_path / "a.nc", sent)
    assert (tmp_path / "a.nc").read_bytes()[:4] == b"CDF\x02"
    with scipy.io.netcdf_file(tmp_path / "a.nc", mmap=False) as file:
        np.testing.assert_array_equal(file.variables["acceleration"][:], sent.acceleration)
        assert (file.variables["acceleration"].units, file.fs) == (b"m s-2", 2048.0)


def test_other_engines_open_the_file(tmp_path):
    pytest.importorskip("netCDF4")
    sent = frf()
    save(tmp_path / "a.nc", sent)
    with xr.open_dataset(tmp_path / "a.nc", engine="netcdf4") as ds:
        assert_same(FRF.from_xarray(without_parts(ds.load())), sent)


def test_same_object_same_bytes(tmp_path):
    sent = response()
    save(tmp_path / "a.nc", sent)
    save(tmp_path / "b.nc", sent)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


def test_file_is_replaced_whole_or_not_at_all(tmp_path, monkeypatch):
    sent = frf()
    save(tmp_path / "a.nc", sent)

    def fail(*_, **__):
        raise OSError("disk full")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", fail)
    with pytest.raises(ClearanceError, match=r"cannot be written \(disk full\)"):
        save(tmp_path / "a.nc", frf())
    assert_same(load(tmp_path / "a.nc"), sent)
    assert [p.name for p in tmp_path.iterdir()] == ["a.nc"]


@pytest.mark.parametrize("obj, part", [
    ({"value": 1}, "cannot write dict; needs an FRF, a Response"),
    (np.zeros(3), "cannot write ndarray; needs an FRF, a Response"),
    (response(provenance={"law": np.zeros(3)}), "provenance is not plain data"),
    (response(kind="shock"), 'kind "shock" is unknown; use base or force'),
])  # fmt: skip
def test_objects_that_are_no_results(tmp_path, obj, part):
    assert_refused(f"a.nc: {part}", save, tmp_path / "a.nc", obj)
    assert not list(tmp_path.iterdir())


def refused(path, part):
    with pytest.raises(RecordError) as caught:
        load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and "\n" not in message and part in message, message


def test_files_that_are_no_results(tmp_path):
    refused(tmp_path / "absent.nc", "no such file")
    refused(tmp_path, "no such file")
    for name, content in (("empty.nc", b""), ("text.nc", b"frequency,value\n" * 9), ("zeros.nc", bytes(99))):
        (tmp_path / name).write_bytes(content)
        refused(tmp_path / name, "not a whole NetCDF file of results")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="scipy")
    words = "holds no results of clearance_mj; needs the attribute clearance_mj = frf or response"
    refused(tmp_path / "other.nc", words)


@pytest.mark.parametrize("sent, change, part", [
    (frf(), lambda ds: ds.drop_vars("value"), 'needs "value" over (response, reference, frequency)'),
    (frf(), lambda ds: ds.drop_vars("response"), 'needs labels along "response"'),
    (frf(), lambda ds: ds.isel(part=[0]), "needs two parts, real and imaginary, got 1"),
    (frf(), lambda ds: ds.isel(reference=[0, 0]), "needs different references, got 100:+Z, 100:+Z"),
    (frf(), lambda ds: ds.assign_coords(response=["3:+Z", "tip", "7:+Z"]), '"tip" must be a node'),
    (frf(), lambda ds: ds.isel(frequency=[1, 0]), "frequencies of an FRF must rise"),
    (frf(), lambda ds: ds.assign_attrs(clearance_mj="response"), 'holds no "acceleration"'),
    (response(), lambda ds: ds.drop_vars("acceleration"), 'holds no "acceleration"'),
    (response(), lambda ds: ds.drop_vars("excitation"), 'needs "excitation" over (time)'),
    (response(), lambda ds: ds.assign_attrs(provenance="{"), "its provenance is not JSON"),
    (response(), lambda ds: ds.assign_attrs(fs="fast"), "could not convert"),
    (response(), lambda ds: ds.drop_attrs().assign_attrs(clearance_mj="response"), '"provenance" is missing'),
])  # fmt: skip
def test_incomplete_results(tmp_path, sent, change, part):
    save(tmp_path / "a.nc", sent)
    change(xr.load_dataset(tmp_path / "a.nc", decode_times=False)).to_netcdf(tmp_path / "b.nc", engine="scipy")
    refused(tmp_path / "b.nc", part)


def test_wrong_kind_of_dataset():
    assert_refused('holds "response", needs "frf"', FRF.from_xarray, response().to_xarray())
    assert_refused('holds "frf", needs "response"', Response.from_xarray, frf().to_xarray())
