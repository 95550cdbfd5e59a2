"""The scripts of the figures run alone and write what they say."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest

EXPERIMENTS = Path(__file__).parent.parent / "experiments"


@pytest.mark.parametrize("name", ["figure_02", "figure_03", "figure_04"])
def test_figures_of_the_identification(name, tmp_path):
    script = EXPERIMENTS / f"{name}.py"
    command = [sys.executable, script, "--out", tmp_path, "--seeds", "1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
    with (tmp_path / f"{name}.csv").open(encoding="utf-8") as file:
        assert len(list(csv.reader(file))) > 10
