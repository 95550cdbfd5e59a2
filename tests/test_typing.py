"""A user's script passes a type checker in strict mode, and what is wrong in one is found."""

import re

import pytest

from .conftest import ROOT
from .processes import run

pytest.importorskip("mypy")
RIGHT = """
from pathlib import Path
from typing import assert_type

import matplotlib.figure
import numpy as np
import xarray as xr

import clearance_mj as cm


def first_look(rig_file: Path) -> float:
    rig = cm.Rig.load(rig_file)
    assert_type(rig.bushings[0].gap, float)
    assert_type(cm.beam.natural_frequencies(rig, 4), np.ndarray)
    law = cm.ConstantLaw(k=2e4, c=3.0, grease=cm.Grease(stiffness=4e3, damping=3.0))
    noise = cm.excitation.random(16.0, 2048.0, band=(5, 220), rms=2.0, seed=0)
    assert_type(noise, cm.Excitation)
    response = cm.simulate(rig, noise, law, engine=cm.Modal())
    assert_type(response, cm.Response)
    frf = cm.estimate_frf(response)
    assert_type(frf.value, np.ndarray)
    assert_type(frf.references, tuple[str, ...])
    for figure in (response.plot(), frf.plot([0], other=frf), law.plot(rig), cm.compare(frf, frf).plot()):
        assert_type(figure, matplotlib.figure.Figure)
    assert_type(noise.to_xarray(), xr.Dataset)
    return cm.compare(frf, frf).summary()["rmse_db"]


def identified(folder: Path) -> cm.Law:
    dataset = cm.Dataset.load(folder)
    records = [record for record in dataset.validate if record.level == 2]
    assert_type(records[0], cm.Record)
    law = cm.identify.law(dataset, method="amplitude")
    cm.estimate_frf(records[0].response()).within((10, 100)).plot()
    branch = cm.periodic.follow_response(cm.Model(dataset.rig, law), 1.0, (8.0, 14.0))
    branch.plot("acceleration", rows=[7]).savefig("response.png")
    return law
"""
WRONG = """
import clearance_mj as cm

rig = cm.Rig.load(3)
rig.gap
noise = cm.excitation.random(16.0, "2048")
cm.simulate(rig, cm.ConstantLaw(1, 2), noise)
cm.estimate_frf(cm.simulate(rig, noise, cm.ConstantLaw(1, 2))).plot(rows="all")
"""


@pytest.mark.slow
def test_scripts_are_checked_strictly(tmp_path):
    (tmp_path / "right.py").write_text(RIGHT, encoding="utf-8")
    (tmp_path / "wrong.py").write_text(WRONG, encoding="utf-8")
    command = ("-m", "mypy", "--strict", "--follow-imports=silent", "--config-file=", "right.py", "wrong.py")
    done = run(*command, patience=600, cwd=tmp_path, env={"MYPYPATH": str(ROOT)})
    matches = re.findall(r"^(\w+)\.py:(\d+): error: .*\[([\w-]+)\]$", done.stdout, re.MULTILINE)
    expected = [("4", "arg-type"), ("5", "attr-defined"), ("6", "arg-type"), ("7", "arg-type"), ("7", "arg-type")]
    assert [*matches] == [("wrong", *each) for each in [*expected, ("8", "arg-type")]], done.stdout
