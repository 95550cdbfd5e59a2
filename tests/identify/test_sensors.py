"""Identification from sensors of several quantities, each by its own gains."""

import dataclasses
from pathlib import Path

import pytest

import clearance_mj as cm
from clearance_mj.core.errors import RecordError
from clearance_mj.identify.records.prepared import prepared
from clearance_mj.io import formats
from clearance_mj.io.dataset import Dataset, Record, write_dataset
from clearance_mj.rig import Rig, Sensor

TABLE1 = Rig.load(Path(__file__).parents[2] / "models" / "table1_rig.toml")
READ = ("acceleration", "velocity", "strain", "displacement", "angle", "acceleration", "velocity", "acceleration")
MIXED = TABLE1.replace(sensors=tuple(dataclasses.replace(s, quantity=q) for s, q in zip(TABLE1.sensors, READ)))


def record(rig: Rig, level: float, seconds: float) -> Record:
    shake = cm.excitation.random(seconds, 2048.0, band=(5, 220), rms=level, seed=int(10 * level))
    channels = formats.to_channels(cm.simulate(rig, shake, cm.ConstantLaw(6e5, 20.0), "modal"), rig)
    return Record(f"level_{level:g}", "identify", rig, 2048.0, channels, level=level, band=(5.0, 220.0))


def test_channels_are_named_after_their_instruments() -> None:
    names = prepared(record(MIXED, 1.0, 2.0)).channels
    assert names[:5] == (
        "accelerometer 1:+Z", "vibrometer 2:+Z", "gauge 3:+Z", "transducer 4:+Z", "inclinometer 5:+RY",
    )  # fmt: skip


def test_a_force_in_a_clearance_is_refused() -> None:
    celled = TABLE1.replace(sensors=(*TABLE1.sensors, Sensor(20, "bushings[0]", quantity="force")))
    with pytest.raises(RecordError, match="leave sensor 20"):
        prepared(record(celled, 1.0, 2.0))


@pytest.mark.slow
def test_the_rig_is_found_from_sensors_of_five_quantities(tmp_path: Path) -> None:
    """The records are of the rig file's rig, which starts 3 % too soft and 5 % too heavy at its tip."""
    records = [record(MIXED, level, 12.0) for level in (0.5, 3.0, 8.0)]
    beam = dataclasses.replace(MIXED.beam, young_modulus=0.97 * MIXED.beam.young_modulus)
    masses = (dataclasses.replace(MIXED.masses[0], mass=1.05 * MIXED.masses[0].mass), *MIXED.masses[1:])
    wrong = MIXED.replace(beam=beam, masses=masses)
    write_dataset(tmp_path / "set", wrong, [dataclasses.replace(r, rig=wrong) for r in records])
    updated = cm.identify.update_rig(Dataset.load(tmp_path / "set"), as_drawn=True).rig
    assert updated.beam.young_modulus == pytest.approx(MIXED.beam.young_modulus, rel=0.01)
    assert updated.masses[0].mass == pytest.approx(MIXED.masses[0].mass, rel=0.01)
