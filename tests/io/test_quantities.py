"""Every quantity in files: types of universal files, headers with units, responses, FRFs and records."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import clearance_mj as cm
from clearance_mj.core.quantities import QUANTITIES
from clearance_mj.core.units import UNITS, quantity_of
from clearance_mj.io import formats
from clearance_mj.io.csv_tables import read_csv

TABLE1 = cm.Rig.load(Path(__file__).parents[2] / "models" / "table1_rig.toml")
CODES = {"strain": 3, "displacement": 8, "angle": 8, "velocity": 11, "angular velocity": 11, "acceleration": 12,
         "force": 13}  # fmt: skip
"""Universal File Format, data set 58, record 9, field 1"""
NOISE = np.random.default_rng(4).standard_normal((len(QUANTITIES), 512))
MANY = cm.Response(
    512.0, NOISE[0], NOISE, kind="force", responses=tuple(f"{i + 1}:+Z" for i in range(len(QUANTITIES))),
    reference="200:+Z", quantities=tuple(QUANTITIES),
)  # fmt: skip


def test_a_derivative_that_engines_do_not_compute_is_refused() -> None:
    with pytest.raises(ValueError, match=r"a quantity in m/s³: order is 3, must be 0, 1 or 2"):
        dataclasses.replace(QUANTITIES["acceleration"], unit="m/s³", order=3)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_channel_comes_back_with_its_type(tmp_path: Path, quantity: str) -> None:
    cm.write_uff(tmp_path / "one.uff", [cm.Channel("one", 3, "+RY", quantity, NOISE[0], 512.0)])
    (channel,) = cm.read_uff(tmp_path / "one.uff")
    assert (channel.quantity, channel.label) == (quantity, "3:+RY")
    assert_allclose(channel.value, NOISE[0], rtol=1e-6)
    header = (tmp_path / "one.uff").read_bytes().decode("latin-1").splitlines()
    line = next(i for i, text in enumerate(header) if text.startswith("        17"))  # of the abscissa
    assert int(header[line + 1][:10]) == CODES[quantity]


@pytest.mark.parametrize(
    ("label", "quantity", "size"),
    [("mm/s", "velocity", 1e-3), ("µm", "displacement", 1e-6), ("µm/m", "strain", 1e-6), ("µε", "strain", 1e-6),
     ("microstrain", "strain", 1e-6), ("mrad", "angle", 1e-3), ("deg", "angle", np.pi / 180), ("kN", "force", 1e3)],
)  # fmt: skip
def test_a_header_with_a_unit_says_the_quantity(tmp_path: Path, label: str, quantity: str, size: float) -> None:
    assert quantity_of(label) == (quantity, pytest.approx(size))
    (tmp_path / "log.csv").write_text(f"time [s],CH1 [{label}]\n0.0,1.0\n0.1,2.0\n0.2,3.0\n", encoding="utf-8")
    (channel,) = read_csv(tmp_path / "log.csv")
    assert channel.quantity == quantity
    assert_allclose(channel.value, size * np.array([1.0, 2.0, 3.0]))


@pytest.mark.parametrize("suffix", [".csv", ".mat", ".uff", ".nc"])
def test_a_response_of_every_quantity_comes_back(tmp_path: Path, suffix: str) -> None:
    formats.write(tmp_path / f"all{suffix}", MANY)
    contents = cm.read(tmp_path / f"all{suffix}")
    channels = formats.to_channels(contents) if isinstance(contents, cm.Response) else contents
    assert [c.quantity for c in channels] == ["force", *QUANTITIES]
    assert_allclose([c.value for c in channels[1:]], NOISE, rtol=1e-5)
    if suffix == ".csv":
        header = (tmp_path / "all.csv").read_text(encoding="utf-8").splitlines()[0]
        assert all(f"{known.prefix}:{i + 1} [{next(iter(UNITS[name]))}]" in header
                   for i, (name, known) in enumerate(QUANTITIES.items()))  # fmt: skip
    if suffix == ".nc":
        assert contents == MANY


def test_a_response_of_accelerations_is_written_as_before() -> None:
    plain = cm.Response(512.0, NOISE[0], NOISE[:2])
    assert "acceleration" in plain.to_xarray() and "quantity" not in plain.to_xarray().coords
    assert cm.Response.from_xarray(plain.to_xarray()) == plain


@pytest.mark.parametrize("suffix", [".csv", ".uff", ".nc"])
def test_each_response_of_an_frf_has_its_quantity(tmp_path: Path, suffix: str) -> None:
    frf = cm.estimate_frf(MANY, resolution=8.0, band=(16.0, 200.0), window="hann")
    assert frf.quantity == "several/force"
    assert frf.row_quantities == tuple(f"{name}/force" for name in QUANTITIES)
    assert dict(zip(QUANTITIES, frf.units))["velocity"] == "m/s/N"
    assert dict(zip(QUANTITIES, frf.units))["strain"] == "m/m/N"
    formats.write(tmp_path / f"frf{suffix}", frf)
    contents = cm.read(tmp_path / f"frf{suffix}")
    if isinstance(contents, cm.FRF):  # a universal file holds them one by one
        assert contents.row_quantities == frf.row_quantities
        assert_allclose(contents.functions, frf.functions, rtol=1e-9)
    else:
        assert {part.quantity for part in contents.frfs} == {*frf.row_quantities}


def test_mobility_and_receptance_are_accelerance_over_frequency() -> None:
    """Ewins, Modal Testing, 2nd ed., 2000, section 2.2: receptance α, mobility iωα, accelerance -ω²α."""
    sensors = tuple(cm.Sensor(1, 0.5, quantity=name) for name in ("acceleration", "velocity", "displacement"))
    beam = dataclasses.replace(TABLE1.beam, rayleigh=(40.0, 0.0))
    rig = TABLE1.replace(beam=beam, bushings=(), sensors=sensors, shaker=cm.Shaker("force", 0.5))
    drive = cm.excitation.random(16.0, 2048.0, band=(5, 220), rms=1.0, seed=1, kind="force")
    frf = cm.estimate_frf(cm.simulate(rig, drive, cm.ConstantLaw(0.0, 0.0), "modal"), resolution=1.0, band=(10, 200))
    accelerance, mobility, receptance = frf.functions
    omega = 2 * np.pi * frf.frequency
    assert_allclose(mobility, accelerance / (1j * omega), atol=2e-2 * np.abs(mobility).max())  # leakage of Hann
    assert_allclose(receptance, -accelerance / omega**2, atol=2e-2 * np.abs(receptance).max())


def test_records_hold_each_sensor_in_its_quantity(tmp_path: Path) -> None:
    sensors = (cm.Sensor(1, 0.2), cm.Sensor(1, 0.2, quantity="velocity"), cm.Sensor(2, 0.3, quantity="strain"))
    rig = TABLE1.replace(sensors=sensors)
    shaken = cm.simulate(rig, cm.excitation.random(1.0, 2048.0, (5, 220), 1.0), engine="modal")
    channels = formats.to_channels(shaken, rig)
    record = cm.Record("one", "identify", rig, 2048.0, channels, level=1.0)
    assert record.response().quantities == ("acceleration", "velocity", "strain")
    assert_allclose(record.response().channels, shaken.channels)
    cm.write_dataset(tmp_path / "set", rig, [record])
    (again,) = cm.Dataset.load(tmp_path / "set").records
    assert again.response().quantities == record.response().quantities
    assert_allclose(again.response().channels, shaken.channels, rtol=1e-5, atol=1e-12)
    with pytest.raises(cm.ClearanceError, match="has no strain at node 2 along Z, a sensor of the rig"):
        cm.Record("two", "identify", rig, 2048.0, [c for c in channels if c.quantity != "strain"], level=1.0)


def test_a_figure_has_a_panel_for_each_quantity() -> None:
    labels = [ax.get_ylabel() for ax in MANY.plot().axes]
    assert [label for label in labels if label.startswith(("Strain", "Velocity", "Angle"))] == [
        "Velocity (mm/s)", "Strain (µm/m)", "Angle (mrad)",
    ]  # fmt: skip


def test_one_quantity_out_of_several_and_comparisons_of_all() -> None:
    frf = cm.estimate_frf(MANY, resolution=8.0, band=(16.0, 200.0), window="hann")
    mobility = frf.of_quantity("velocity/force")
    assert (mobility.quantity, mobility.quantities, mobility.unit) == ("velocity/force", (), "m/s/N")
    assert_allclose(mobility.functions, frf.functions[[list(QUANTITIES).index("velocity")]])
    with pytest.raises(cm.ClearanceError, match="not stress/force"):
        frf.of_quantity("stress/force")
    in_mm = dataclasses.replace(frf, value=frf.value * np.arange(1.0, 1 + len(QUANTITIES))[:, None, None])
    same, scaled = cm.compare(frf, frf), cm.compare(in_mm, in_mm)  # no unit of one sensor outweighs the others
    assert_allclose(scaled.csac, same.csac)
    assert_allclose(same.per_sensor["rmse_db"], 0.0, atol=1e-12)
