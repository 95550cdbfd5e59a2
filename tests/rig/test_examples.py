"""Numbers of a rig file that nobody gave."""

import pytest

from clearance_mj.core.errors import RigError
from clearance_mj.rig import Rig
from clearance_mj.rig.examples import unknown_examples

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
    """Of a fitted gap and a fitted contact; grease was not fitted, nor was the length."""
    examples = ("beam.length", "bushings.gap", "bushings.contact.stiffness", "bushings.grease.stiffness")
    known = ["bushings[0].gap", "contact stiffness, bushing 1"]
    assert unknown_examples(examples, known) == ("beam.length", "bushings.grease.stiffness")
