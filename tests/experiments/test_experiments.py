"""The scripts of the figures and tables run alone and write what they say."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.article import ITEMS

EXPERIMENTS = Path(__file__).parent.parent / "experiments"


def test_every_item_has_its_script():
    scripts = {path.stem for path in EXPERIMENTS.glob("*.py")}
    assert set(ITEMS) <= scripts


@pytest.mark.parametrize("name", ["figure_02", "figure_04"])
def test_a_script_runs_alone(name, tmp_path):
    script = EXPERIMENTS / f"{name}.py"
    command = [sys.executable, script, "--out", tmp_path, "--quick"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
    with (tmp_path / f"{name}.csv").open(encoding="utf-8") as file:
        assert len(list(csv.reader(file))) > 10


def test_a_script_ends_with_status_2_on_bad_input(tmp_path):
    command = [sys.executable, EXPERIMENTS / "figure_02.py", "--snr", "3"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 2
    assert not list(tmp_path.iterdir())
