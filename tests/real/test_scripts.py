"""The experiments with real records run alone, and say what is missing."""

import os
from pathlib import Path

import pytest

from experiments.real import brb, cantilever, damper, dropbear, f16, surgical_tool

from ..processes import run

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("script", [brb, dropbear, damper, cantilever, f16, surgical_tool])
def test_without_the_data(script, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("CLEARANCE_REAL_DATA", str(tmp_path / "nowhere"))
    with pytest.raises(SystemExit) as stopped:
        script.main(["--out", str(tmp_path / "out")])
    assert stopped.value.code == 2 and "CLEARANCE_REAL_DATA" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("script", [brb, dropbear, damper, cantilever, f16, surgical_tool])
def test_folder_without_the_files(script, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("CLEARANCE_REAL_DATA", str(tmp_path))
    with pytest.raises(SystemExit) as stopped:
        script.main(["--out", str(tmp_path / "out")])
    assert stopped.value.code == 2 and ": No such file" in capsys.readouterr().err


def test_folder_by_name(tmp_path, monkeypatch, capsys):
    """A folder on the command line goes before that of the environment."""
    monkeypatch.setenv("CLEARANCE_REAL_DATA", str(tmp_path / "nowhere"))
    with pytest.raises(SystemExit) as stopped:
        brb.main([str(tmp_path), "--out", str(tmp_path / "out")])
    assert stopped.value.code == 2
    assert f"{tmp_path / 'HammerImpact.mat'}: No such file" in capsys.readouterr().err


def test_runs_alone(tmp_path, real_data):
    environment = os.environ | {"CLEARANCE_REAL_DATA": str(real_data)}
    done = run("-m", "experiments.real.cantilever", "--out", tmp_path, env=environment, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "cantilever.png").read_bytes()[:4] == b"\x89PNG"
    assert len((tmp_path / "cantilever.csv").read_text().splitlines()) == 4
