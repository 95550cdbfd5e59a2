"""A method from one file outside of the package: known to the library, the command line, the study and its report."""

import importlib
import sys

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.cli.options import load_plugin
from clearance_mj.core.cache import ResultCache
from clearance_mj.identify import METHODS, get_method
from clearance_mj.study import Study

PLUGIN = '''"""Contact of the datasheet on a linear grease whose stiffness a probe and an accelerometer give."""
import numpy as np
from functools import partial
from clearance_mj import ConstantLaw
from clearance_mj.identify import Identified, fitted_model, register
from clearance_mj.estimate.parameter import Parameter
from clearance_mj.estimate.estimates import Estimates
from clearance_mj.rig import Grease
def softened(rig, stiffness):
    contacts = [b.contact for b in rig.bushings]
    grease = Grease(float(stiffness), rig.bushings[0].grease.damping)
    return ConstantLaw([c.stiffness for c in contacts], [c.damping for c in contacts], grease=grease)
@register("half-grease", "the rig file only: half of its grease, to a tenth", shortest=lambda rig: 1.0)
def half_grease(dataset, progress=None):
    """Take half of the datasheet's grease."""
    stiffness = 0.5 * dataset.rig.bushings[0].grease.stiffness
    parameter = Parameter("grease stiffness", "N/m", stiffness, 0.1 * stiffness, 10 * stiffness)
    estimates = Estimates.of([parameter], [stiffness], np.array([[0.1**2]]))
    return Identified(model=fitted_model(dataset.rig, partial(softened, dataset.rig), estimates), estimates=estimates)
'''


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    path = tmp_path / "half_grease.py"
    path.write_text(PLUGIN, encoding="utf-8")
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield path
    METHODS.pop("half-grease", None)
    sys.modules.pop("half_grease", None)


def test_on_the_command_line_and_in_the_library(plugin, small_dataset, tmp_path, answer):
    options = ["--plugin", plugin, "--method", "half-grease", "--out", tmp_path / "found", "--no-figures", "--quiet"]
    (row,) = answer("identify", small_dataset, *options)["parameters"]
    dataset = cm.Dataset.load(small_dataset)
    half = 0.5 * dataset.rig.bushings[0].grease.stiffness
    assert (row["name"], row["value"], row["std"]) == ("grease stiffness", half, pytest.approx(0.1 * half))
    law = cm.identify.law(dataset, method="half-grease")
    assert law.grease[0].stiffness == cm.Model.load(tmp_path / "found").law.grease[0].stiffness == half
    drawn = [model.law.grease[0].stiffness for model in cm.Model.load(tmp_path / "found").draw(64)]
    assert np.std(np.log(drawn)) == pytest.approx(0.1, rel=0.3)
    assert get_method("half-grease").prior_information.startswith("the rig file only")


@pytest.mark.slow
def test_in_a_study_and_its_report(plugin, small_dataset, tmp_path, answer):
    options = ["--plugin", plugin, "--engines", "modal", "--methods", "nominal,half-grease", "--figures", "pdf"]
    rows = answer("study", small_dataset, *options, "--out", tmp_path / "out", "--quiet")["results"]
    assert {row["law"] for row in rows} >= {"nominal", "half-grease"}
    figures = tmp_path / "out" / "figures"
    assert {path.stem for path in figures.glob("*.pdf")} == {path.stem for path in figures.glob("*.png")} != set()
    assert "half of its grease, to a tenth" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert (tmp_path / "out" / "laws" / "half-grease.json").is_file()


def test_an_edited_plugin_is_not_answered_from_the_cache(plugin, small_dataset, tmp_path):
    dataset, cache = cm.Dataset.load(small_dataset), ResultCache(tmp_path / "cache")
    fresh = dataset.rig.bushings[0].grease.stiffness

    def contact_ratio():
        return Study(dataset, ["half-grease"], cache=cache).law("half-grease").law.grease[0].stiffness / fresh

    load_plugin(plugin)
    assert contact_ratio() == contact_ratio() == 0.5 and len(list(cache.folder.glob("*.json"))) == 1
    plugin.write_text(PLUGIN.replace("stiffness = 0.5 *", "stiffness = 0.125 *"), encoding="utf-8")
    importlib.reload(sys.modules["half_grease"])
    assert contact_ratio() == 0.125


def test_a_file_that_cannot_be_used(small_dataset, tmp_path, refused):
    assert "none.py: no such file" in refused("identify", small_dataset, "--plugin", tmp_path / "none.py")
