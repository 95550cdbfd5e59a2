"""A gap of which the records say nothing is the rig file's: everything that shows or takes the model says so."""

import json
from dataclasses import replace

import numpy as np
import pytest

from clearance_mj import Model
from clearance_mj.cli import main
from clearance_mj.estimate import Estimates, Parameter
from clearance_mj.identify.forces.restoring import possible_forces, restoring_force
from clearance_mj.identify.registry import Identified
from clearance_mj.io.dataset import Dataset
from clearance_mj.report.identification import write_identification
from clearance_mj.report.identification_figures import draw_forces
from clearance_mj.study import IdentifiedModel

from ..conftest import record_of
from ..studies import study_of


@pytest.fixture
def bench_fit(rig):
    """The first gap with its prior's standard deviation, 0.2, the second with a tenth of that."""
    parameters = [Parameter(f"bushings[{j}].gap", "m", 3e-4, 1e-5, 1e-2, 0.2) for j in range(2)]
    estimates = Estimates.of(parameters, np.array([3e-4, 3e-4]), np.diag([0.2**2, 0.02**2]))
    return Identified(model=Model(rig), estimates=estimates)


def test_page_and_figure_show_no_interval_of_it(bench_fit, rig, tmp_path):
    record = record_of(rig, "quiet", "identify", 0.3, 3)
    write_identification(bench_fit, Dataset(rig, (record,)), tmp_path, tmp_path)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count("<td>not seen</td>") == 1
    assert "288.5" in page and "312.0" in page  # 300 µm times exp(±1.96 × 0.02)
    (force,) = possible_forces([record], restoring_force)
    first, _, second, _ = draw_forces(bench_fit, [force]).figure.axes
    assert first.get_title(loc="left").startswith("bushing 1: gap not seen, offset ")
    assert second.get_title(loc="left").startswith("bushing 2: gap 300 ± 12 µm, offset ")
    assert len(first.patches) == 0 < len(second.patches)  # walls
    both = Estimates.of(bench_fit.estimates.parameters, np.array([3e-4, 3e-4]), 0.2**2 * np.eye(2))
    figures = (draw_forces(each, [force]).figure for each in (bench_fit, replace(bench_fit, estimates=both)))
    keys = [[text.get_text() for text in figure.legends[0].get_texts()] for figure in figures]
    assert keys == [["measured", "law", "walls, 95 % interval"], ["measured", "law"]]


def test_a_model_that_is_predicted_with_says_it_unless_a_gap_is_given(bench_fit, tmp_path, capsys):
    folder = tmp_path / "found"
    bench_fit.model.save(folder)
    given = ["simulate", str(folder), "--duration", "0.5", "--engine", "modal", "--out", str(tmp_path / "a.nc")]
    words = "found: no record showed bushings[0].gap; contact is predicted with the rig file's number"

    def said(*more):
        assert main([*given, *more]) == 0
        return words in capsys.readouterr().err

    assert not said()
    (folder / "identified.json").write_text(json.dumps(bench_fit.to_dict()))
    assert said() and not said("--gap", "0.2mm")
    (folder / "identified.json").write_text("[]")  # another program's
    assert not said()


def test_a_new_rig_that_turns_leads_on_to_its_critical_speeds(tmp_path, capsys):
    path = tmp_path / "rotor.toml"
    assert main(["new", "rotor", "--spin", "900rpm", "--out", str(path)]) == 0
    assert capsys.readouterr().out.endswith(f"next: clearance-mj campbell {path}: its critical speeds\n")


def test_a_study_shows_no_vibrations_that_rest_on_it(bench_fit, rig):
    records = [record_of(rig, name, role, 0.3, 3) for name, role in (("quiet", "identify"), ("check", "validate"))]
    law = IdentifiedModel("bench", bench_fit.model, parameters=bench_fit.parameters)
    shown = study_of(Dataset(rig, tuple(records)), (law,)).periodic
    assert shown.map is None and "no record to identify shows bushings[0].gap, on which" in shown.missing
