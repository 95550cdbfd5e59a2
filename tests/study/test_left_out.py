"""A study leaves out the methods that its records do not allow, before it computes, and says so."""

import dataclasses
import json

import pytest

from clearance_mj import Dataset, Model, RecordError, report, write_dataset
from clearance_mj.identify import METHODS as METHODS_BY_NAME
from clearance_mj.identify import Identified
from clearance_mj.identify.records.checks import IdentifiabilityWarning
from clearance_mj.identify.registry import Method
from clearance_mj.report import report_study
from clearance_mj.study import study as study_module

from ..conftest import SMALL_LAW, TABLE1


@pytest.fixture
def quick(monkeypatch):
    """A study whose fit and report cost nothing."""
    constant = Method("all", lambda *_: Identified(model=Model(TABLE1, SMALL_LAW)))
    monkeypatch.setitem(METHODS_BY_NAME, "constant", constant)
    monkeypatch.setattr(report, "write_report", lambda study, folder, progress: None)


def not_again(*_):
    """In place of a simulation that must not run."""
    raise AssertionError("simulated")


def without_probes(path, folder):
    dataset = Dataset.load(path)
    channels = ([c for c in r.channels if c.quantity == "acceleration"] for r in dataset.records)
    bare = [dataclasses.replace(r, channels=kept) for r, kept in zip(dataset.records, channels)]
    write_dataset(folder, dataset.rig, bare)
    return folder


def test_methods_that_the_records_do_not_allow_are_left_out_before_anything_is_computed(
    small_dataset, tmp_path, monkeypatch, quick
):
    """Where none is named: no law over amplitude without probes; what fails later is left out and said too."""

    def fails(*_):
        raise RecordError("its channels do not fit")

    monkeypatch.setitem(METHODS_BY_NAME, "bench", Method("both", fails, finds_rig=True))
    data = without_probes(small_dataset, tmp_path / "data")
    with pytest.warns(IdentifiabilityWarning, match='method "amplitude" is left out of the study: it needs a displ'):
        study = study_module.Study(Dataset.load(data), engines=("modal",))
    assert list(study.left_out) == ["amplitude"]
    with pytest.warns(IdentifiabilityWarning, match='method "bench" is left out of the study: its channels do not'):
        report_study(data, tmp_path / "out", ("modal",), progress=False)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert [law["name"] for law in summary["laws"]] == ["nominal", "constant"]
    assert [each["method"] for each in summary["left_out"]] == ["amplitude", "bench"]
    assert summary["left_out"][0]["why"].endswith("none at bushings[0] (displacement at node 6), "
                                                  "bushings[1] (displacement at node 7)")  # fmt: skip


def test_a_method_that_was_named_and_cannot_be_had_is_refused_at_once(small_dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(study_module, "simulate", not_again)
    data = without_probes(small_dataset, tmp_path / "data")
    with pytest.raises(RecordError, match=r'method "ridge": it needs a displ.*; these records allow nominal, const'):
        report_study(data, tmp_path / "out", ("modal",), ("nominal", "ridge"), progress=False)
    assert not (tmp_path / "out").exists()
