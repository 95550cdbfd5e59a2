"""What tests of commands share."""

import csv

import numpy as np
import pytest

from clearance_mj import ConstantLaw, Record, write_dataset
from clearance_mj.cli import main
from clearance_mj.signals.excitation import level_ramp
from experiments.benches.bench import NAMED
from experiments.benches.records import FS, measure_channels

from ..conftest import ROOT

RIG = ROOT / "models" / "table1_rig.toml"
LAW = ConstantLaw(7.8e3, 4.0)


@pytest.fixture
def law(tmp_path):
    LAW.save(tmp_path / "law.json")
    return tmp_path / "law.json"


@pytest.fixture
def output_of(capsys):
    """Run the command line, expect success, and return what it wrote to standard output and standard error."""

    def run(*arguments):
        assert main([*map(str, arguments)]) == 0
        return capsys.readouterr()

    return run


def measured_bench(folder, seconds, end_rms, **more):
    """Write a dataset of a bench with one bushing, of foreign physics: a ramp of levels from 0.3 m/s² on."""
    bench = NAMED["one-bushing"]()
    base = level_ramp(seconds, FS, (5.0, 220.0), start_rms=0.3, end_rms=end_rms, seed=4).value
    channels = measure_channels(bench, base, np.random.default_rng(4))
    write_dataset(folder, bench.rig, [Record("ramp", "identify", bench.rig, FS, channels, band=(5.0, 220.0), **more)])
    return folder


def csv_rows(path):
    """Rows of a table as dictionaries of texts."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))
