"""What tests of commands share."""

import csv

import pytest

from clearance_mj import ConstantLaw
from clearance_mj.cli import main

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


def csv_rows(path):
    """Rows of a table as dictionaries of texts."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))
