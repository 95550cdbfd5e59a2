"""Numbers of a rig file that nobody gave."""

import numpy as np
import pytest
from scipy.stats import norm

from clearance_mj.core.errors import RigError
from clearance_mj.identify import identify
from clearance_mj.io.dataset import Dataset
from clearance_mj.report import html
from clearance_mj.rig import Rig, Tolerance
from clearance_mj.rig.examples import unknown_examples
from clearance_mj.tolerance import Scatter

from ..conftest import ROOT

TABLE_1 = Rig.load(ROOT / "models" / "table1_rig.toml")


def test_they_stay_in_the_file_until_their_names_are_deleted(tmp_path):
    rig = TABLE_1.replace(examples=("beam.length", "bushings.gap"))
    rig.save(tmp_path / "rig.toml")
    assert Rig.load(tmp_path / "rig.toml") == rig
    assert "examples  beam.length, bushings.gap" in " ".join(str(rig).split(" " * 12))
    TABLE_1.save(tmp_path / "own.toml")
    assert "examples" not in (tmp_path / "own.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", ["beam.lenght.x", "bushings[7].gap", "shaker.kind"])
def test_a_name_of_no_number_is_refused(path):
    with pytest.raises(RigError, match=r"examples\[0\]"):
        TABLE_1.replace(examples=(path,))


def test_what_records_tell_is_no_example_any_more():
    """Of a gap, modal damping and a contact that were fitted; grease was not, nor was the length."""
    fitted = "beam.rayleigh", "bushings.gap", "bushings.contact.stiffness"
    examples = "beam.length", "bushings.grease.stiffness", *fitted
    known = ["bushings[0].gap", "beam.damping_ratios[2]", "contact stiffness, bushing 1"]
    assert unknown_examples(examples, known) == ("beam.length", "bushings.grease.stiffness")


def test_identification_says_what_the_records_do_not_tell():
    """The nominal law is the rig file's own: all examples stay, in the model and among the warnings."""
    known = Dataset.load(ROOT / "data" / "table1_rig")
    rig = known.rig.replace(examples=("beam.length", "bushings.contact.stiffness"))
    identified = identify(Dataset(rig, known.records, known.path), "nominal")
    (words,) = (words for words in identified.warnings if "nobody gave" in words)
    assert words.startswith("of the rig file, 2 numbers are examples") and "beam.length, bushings.contact" in words
    assert identified.rig.examples == rig.examples


def test_pages_name_them():
    """In a banner, escaped, that a rig without examples has not."""
    banner = html.examples(TABLE_1.replace(examples=("masses.mass",)))
    assert banner.startswith('<p class="banner">1 number is an example that nobody gave') and "masses.mass" in banner
    assert html.examples(TABLE_1) == ""


def test_wide_tolerances_scatter_by_a_factor():
    """230 % of a stiffness is a factor 3.3 to each side, never below zero; 20 % of a gap stays normal."""
    tolerances = (
        Tolerance("bushings.contact.stiffness", "230 %"), Tolerance("bushings.gap", "20 %"),
        Tolerance("bushings.offset", "30 %"),
    )  # fmt: skip
    wide, narrow, offset = Scatter.of_rig(TABLE_1.replace(tolerances=tolerances)).numbers
    assert (wide.distribution, narrow.distribution, offset.distribution) == ("lognormal", "normal", "normal")
    shares = np.array([norm.cdf(-1), 0.5, norm.cdf(1)])
    assert wide.quantile(shares, 1e4) == pytest.approx([1e4 / 3.3, 1e4, 3.3e4], rel=1e-3)
