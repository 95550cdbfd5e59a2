"""Targets of a calibration from files, FRFs and the command line."""

import csv
import json

import numpy as np
import pytest

from clearance_mj.beam import linear_frf, mode_shapes, natural_frequencies
from clearance_mj.calibrate import FRFTarget, modal_target, read_frequencies
from clearance_mj.cli import main
from clearance_mj.core.errors import RecordError
from clearance_mj.io.uff import write_uff
from clearance_mj.rig import Rig
from clearance_mj.signals.frf import FRF

from ..conftest import ROOT

RIG = str(ROOT / "models" / "table1_rig.toml")
TABLE1 = ROOT / "data" / "article" / "table1_natural_frequency.csv"


def test_modes_out_of_frfs(rig):
    lines = np.arange(5.0, 220.0, 0.5)
    target = modal_target(FRFTarget(FRF(lines, linear_frf(rig, lines))), 4)
    np.testing.assert_allclose(target.frequency, natural_frequencies(rig, 4), rtol=2e-4)
    expected = mode_shapes(rig, [s.position for s in rig.sensors], 4)
    mac = np.sum(expected * target.shape, axis=0) ** 2
    mac /= np.sum(expected**2, axis=0) * np.sum(target.shape**2, axis=0)
    assert mac.min() > 0.9999
    with pytest.raises(RecordError, match="only 4 of 9 modes"):
        modal_target(FRFTarget(FRF(lines, linear_frf(rig, lines))), 9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mode,hz\n1,9\n", "lacks a column frequency_hz"),
        ("frequency_hz\n9\n8\n", "natural frequencies must be positive and rise, got 9, 8"),
        ("frequency_hz\n-9\n8\n", "must be positive and rise"),
        ("frequency_hz\nnan\n", "must be positive and rise"),
        ("mode,frequency_hz\n2,9\n1,10\n", "mode numbers must be positive and rise"),
        ("mode,frequency_hz\n1.5,9\n", "must be whole"),
        ("frequency_hz,std_hz\n9,0\n", "standard deviations must be > 0 Hz"),
        ("frequency_hz\nnine\n", "must be a heading and rows"),
        ("frequency_hz,mode\n9\n", "must be a heading and rows"),
        ("frequency_hz\n", "must be a heading and rows"),
        ("", "must be a heading and rows"),
    ],
)
def test_bad_frequency_files(tmp_path, text, message):
    path = tmp_path / "modes.csv"
    path.write_text(text)
    with pytest.raises(RecordError, match=message) as error:
        read_frequencies(path)
    assert str(path) in str(error.value)


def test_frequency_file_with_shapes(tmp_path):
    path = tmp_path / "modes.csv"
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([["mode", "frequency_hz", "std_hz", "shape_3", "shape_8"], [2, 40, 0.1, -0.5, 1]])
    target = read_frequencies(path)
    assert (target.mode[0], target.std[0], target.nodes) == (2, 0.1, (3, 8))
    np.testing.assert_array_equal(target.shape, [[-0.5], [1.0]])


def test_command_writes_rig_numbers_and_figure(tmp_path, capsys):
    arguments = ["calibrate", RIG, str(TABLE1), "--free", "masses[0].mass=0.1:2", "--free", "bushings.grease.stiffness"]
    assert main([*arguments, "--starts", "2", "--out", str(tmp_path / "out"), "--json", "--quiet"]) == 0
    result = json.loads(capsys.readouterr().out)
    saved = json.loads((tmp_path / "out" / "calibration.json").read_text())
    assert saved["free"] == result["free"]
    rig = Rig.load(tmp_path / "out" / "rig.toml")
    assert rig.masses[0].mass == result["free"]["masses[0].mass"]["value"]
    assert (tmp_path / "out" / "calibration.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize("fit", ["modes", "frf"])
def test_command_takes_frfs(tmp_path, rig, fit):
    lines = np.arange(5.0, 220.0, 1.0)
    write_uff(tmp_path / "test.uff", FRF(lines, linear_frf(rig, lines)))
    arguments = ["calibrate", RIG, str(tmp_path / "test.uff"), "--free", "masses[0].mass", "--fit", fit]
    assert main([*arguments, "--starts", "1", "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert Rig.load(tmp_path / "out" / "rig.toml").masses[0].mass == pytest.approx(0.434, rel=2e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--free", "beam.colour"], "known: beam.length"),
        (["--free", "bushings[0].position", "--free", "bushings[1].position", "--free", "beam.length", "--free",
          "masses[0].mass", "--free", "beam.diameter"], "5 free parameters need as many data"),
        (["--free", "masses[0].mass", "--starts", "0"], "starts must be 1 to 1000"),
        (["--free", "masses[0].mass", "--std", "1e300"], "must be > 0 Hz, 1e-09 to 1 of the frequency"),
        (["--free", "masses[0].mass", "--std", "1e-308"], "must be > 0 Hz, 1e-09 to 1 of the frequency"),
        (["--free", "masses[0].mass", "--starts", "10000"], "starts must be 1 to 1000"),
        (["--free", "masses[0].mass", "--out", RIG], "is a file; give a folder"),
    ],
)  # fmt: skip
def test_command_refuses_bad_input(tmp_path, capsys, options, message):
    assert main(["calibrate", RIG, str(TABLE1), "--out", str(tmp_path / "out"), *options]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert not (tmp_path / "out").exists()
