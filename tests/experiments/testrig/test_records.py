from dataclasses import replace

import numpy as np
import pytest

from clearance_mj import Dataset, excitation, write_dataset
from experiments.testrig import RIGS, Truth
from experiments.testrig.records import digitise, plans, take

from ...conftest import ROOT, TABLE1

DATA = ROOT / "data" / "table1_rig"


def test_table1_is_the_rig_of_the_models():
    assert RIGS["table1"]().rig == TABLE1


def test_regenerating_a_record_gives_the_same_bytes(rig, tmp_path):
    plan = replace(plans()[2], excitation=excitation.random(1.5, 2048.0, (5.0, 220.0), rms=5.0, seed=4, kind="base"))
    for folder in ("one", "two"):
        write_dataset(tmp_path / folder, rig, [take(plan, rig, Truth())])
    for file in ("rig.toml", "dataset.toml", "level_0.5_a.uff"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


@pytest.mark.slow
def test_a_record_of_the_dataset_can_be_taken_again(rig, tmp_path):
    """To the last bit on the machine that made it; elsewhere libraries may round the excitation differently."""
    plan = plans()[1]
    assert plan.name == "hammer"
    again, kept = take(plan, rig, Truth()), {r.name: r for r in Dataset.load(DATA).records}["hammer"]
    for new, old in zip(again.channels, kept.channels, strict=True):
        assert (new.name, new.node, new.quantity) == (old.name, old.node, old.quantity)
        assert np.abs(new.value - old.value).max() < 1e-4 * np.abs(old.value).max()


def test_dataset_holds_the_planned_records(rig):
    data = Dataset.load(DATA)
    assert data.rig == rig
    kept, planned = ([(r.name, r.role, r.level, r.seed) for r in each] for each in (data.records, plans()))
    assert kept == planned and len({p.seed for p in plans()}) == len(plans())
    for record in data.records:
        assert "synthetic" in record.provenance["source"]
        assert [c.node for c in record.channels] == [100, 1, 2, 3, 4, 5, 6, 7, 8, 6, 7]
        assert all("synthetic" in c.name for c in record.channels)


def test_dataset_is_small():
    sizes = [file.stat().st_size for file in DATA.iterdir()]
    assert max(sizes) < 4e6 and sum(sizes) <= 30e6


def test_noise_is_one_percent_of_the_signal():
    signal = 3 * np.sin(np.arange(200_000) * 0.1)
    value, _ = digitise(signal, 0.01, np.random.default_rng(3))
    assert np.std(value - signal) / np.std(signal) == pytest.approx(0.01, rel=0.01)


def test_single_precision_holds_every_code():
    signal = np.random.default_rng(1).standard_normal(100_000)
    value, full_scale = digitise(signal, 0.01, np.random.default_rng(2))
    assert np.array_equal(value.astype(np.float32).astype(float), value)
    codes = value / full_scale * 2**23
    assert np.array_equal(codes, np.rint(codes))
    assert np.abs(value).max() < full_scale <= 2 * np.abs(value).max() and np.log2(full_scale) % 1 == 0


def test_quantisation_is_half_a_step():
    signal = np.linspace(-1.9, 1.9, 10_001)
    value, full_scale = digitise(signal, 0.0, np.random.default_rng(0))
    assert full_scale == 2.0 and np.abs(value - signal).max() <= full_scale / 2**24
