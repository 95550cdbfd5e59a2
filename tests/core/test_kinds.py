"""Arguments of the wrong kind: one line that says which kind, and how one comes by it."""

import re

import pytest

import clearance_mj as cm
from clearance_mj.core.kinds import ArgumentError, checks_kinds

from ..refusals import assert_refused

RIG, LAW = cm.Rig.load("models/table1_rig.toml"), cm.ConstantLaw(1e4, 1.0)
NOISE = cm.excitation.random(0.1, 2048.0)


@pytest.mark.parametrize("call, words", [
    (lambda: cm.simulate(RIG, 5, LAW), "excitation must be an Excitation, such as cm.excitation.random(...); got int"),
    (lambda: cm.simulate("rig.toml", NOISE), "model must be a Rig, such as cm.Rig.load(\"rig.toml\") or a Model"),
    (lambda: cm.simulate(RIG, NOISE, 5), "law must be a Law, such as cm.ConstantLaw(k, c); got int 5"),
    (lambda: next(cm.simulate_blocks(RIG, 5)), "excitation must be an Excitation"),
    (lambda: cm.simulate_batch(RIG, [5]), "excitation must be an Excitation"),
    (lambda: cm.energy_balance(RIG, 5), "excitation must be an Excitation"),
    (lambda: cm.Model(RIG, "law.json"), "law must be a Law"),
    (lambda: cm.estimate_frf(NOISE), "resp must be a Response, such as cm.simulate(...) or record.response() returns"),
    (lambda: cm.compare(5, 6), "test_frf must be an FRF, such as cm.estimate_frf(response) returns"),
    (lambda: cm.beam.natural_frequencies("rig.toml", 3), "rig must be a Rig"),
    (lambda: cm.identify.identify("data"), "dataset must be a Dataset, such as cm.Dataset.load(\"folder\")"),
    (lambda: cm.identify.fit_bench(RIG), "dataset must be a Dataset"),
    (lambda: cm.identify.twin("run.uff"), "record must be a Record"),
    (lambda: cm.periodic.follow_backbone(RIG), "model must be a Model, such as cm.Model(rig, law)"),
    (lambda: cm.statistics.contact_statistics(NOISE), "response must be a Response"),
])  # fmt: skip
def test_public_calls(call, words):
    assert_refused(ArgumentError, re.escape(words), call)


def test_it_is_both_kinds_of_error():
    """For those who catch the house's errors, and for those who catch Python's."""
    assert issubclass(ArgumentError, cm.ClearanceError) and issubclass(ArgumentError, TypeError)


def test_only_what_is_listed_is_looked_at():
    @checks_kinds
    def add(rig: "Rig | None", number: "float", law: "Law" = LAW) -> "float":  # noqa: F821
        return number

    assert add(None, "a text") == "a text" and add(rig=RIG, number=2.0, law=LAW) == 2.0
    assert_refused(ArgumentError, "law must be a Law", add, None, 1.0, law=None)
