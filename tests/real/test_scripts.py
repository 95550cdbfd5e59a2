"""The experiments with real records run alone, and say what is missing."""

import os

import pytest

from experiments.real import brb, cantilever, damper, dropbear, f16, surgical_tool

from ..conftest import ROOT
from ..processes import run


def refused(script, tmp_path, monkeypatch, capsys, folder, *arguments):
    """What a script says that ends with status 2, of a folder that the environment names."""
    monkeypatch.setenv("CLEARANCE_REAL_DATA", str(tmp_path / folder))
    with pytest.raises(SystemExit) as stopped:
        script.main([*arguments, "--out", str(tmp_path / "out")])
    assert stopped.value.code == 2
    return capsys.readouterr().err


@pytest.mark.parametrize(("folder", "words"), [("nowhere", "CLEARANCE_REAL_DATA"), ("", ": No such file")])
@pytest.mark.parametrize("script", [brb, dropbear, damper, cantilever, f16, surgical_tool])
def test_without_the_data(script, folder, words, tmp_path, monkeypatch, capsys):
    assert words in refused(script, tmp_path, monkeypatch, capsys, folder)
    assert folder == "" or not (tmp_path / "out").exists()


def test_folder_by_name(tmp_path, monkeypatch, capsys):
    """A folder on the command line goes before that of the environment."""
    error = refused(brb, tmp_path, monkeypatch, capsys, "nowhere", str(tmp_path))
    assert f"{tmp_path / 'HammerImpact.mat'}: No such file" in error


def test_runs_alone(tmp_path, real_data):
    environment = os.environ | {"CLEARANCE_REAL_DATA": str(real_data)}
    done = run("-m", "experiments.real.cantilever", "--out", tmp_path, env=environment, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "cantilever.png").read_bytes()[:4] == b"\x89PNG"
    assert len((tmp_path / "cantilever.csv").read_text().splitlines()) == 4
