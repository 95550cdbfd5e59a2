"""clearance-mj identify: a dataset, a universal file and a CSV of one record; figures, parameters, what is refused."""

import dataclasses
import hashlib
import json

import numpy as np
import pytest

from clearance_mj import Dataset, Model, write_dataset, write_uff
from clearance_mj.cli import main
from clearance_mj.estimate import Estimates, Parameter
from clearance_mj.identify import METHODS, Identified, register
from clearance_mj.io.results import load
from clearance_mj.periodic import rattle_maps
from clearance_mj.report import rattling

from ..conftest import SMALL_LAW, record_of
from .conftest import RIG

QUANTITIES = {"acceleration": "acc", "displacement": "disp"}
FIGURES = ("scalogram", "contact_over_time")
FIGURES_OVER_ALL = "contact_over_amplitude"


def write_csv(path, record, digits="%.9g"):
    names = ["base" if c.node == 100 else f"{QUANTITIES[c.quantity]}:{c.node}" for c in record.channels]
    columns = np.column_stack([np.arange(record.size) / record.fs, *(c.value for c in record.channels)])
    np.savetxt(path, columns, ["%.7f", *[digits] * len(names)], ",", header=",".join(["time", *names]), comments="")
    return path


def run(capsys, *arguments):
    """Run, expect success, and return the result and what was said on standard error."""
    assert main(["identify", *map(str, arguments), "--json", "--quiet"]) == 0
    captured = capsys.readouterr()
    return json.loads(captured.out), captured.err


@pytest.fixture(autouse=True)
def coarse_map(monkeypatch):
    """The page's rattle map with few frequencies, levels and harmonics, in this process: maps have their own tests."""
    for name, value in {"FREQUENCIES": 12, "LEVELS": 2, "HARMONICS": 3}.items():
        monkeypatch.setattr(rattling, name, value)
    monkeypatch.setattr(rattle_maps, "workers_to_use", lambda workers: 1)


@pytest.fixture(scope="module")
def ramp(small_dataset):
    return Dataset.load(small_dataset).identify[0]


@pytest.fixture(scope="module")
def csv_file(ramp, tmp_path_factory):
    return write_csv(tmp_path_factory.mktemp("csv") / "ramp.csv", ramp)


def test_dataset_to_model_to_simulation(rig, tmp_path, capsys):
    out, dataset = tmp_path / "found", tmp_path / "dataset"
    write_dataset(dataset, rig, [record_of(rig, "ramp", "identify", 8.0, 1, 8.0, start=0.3)])
    result, said = run(capsys, dataset, "--method", "force-balance", "--figures", "svg", "--out", out)
    assert (said, result["warnings"]) == ("", [])
    model = Model.load(out)
    assert model.rig == Dataset.load(dataset).rig and result["law"] == model.law.to_dict()
    stored = json.loads((out / "law.json").read_text())["provenance"]
    ramp = dataset / "ramp.uff"
    assert stored["inputs"][str(ramp)] == hashlib.sha256(ramp.read_bytes()).hexdigest()
    assert {str(dataset / name) for name in ("rig.toml", "dataset.toml")} < stored["inputs"].keys()
    np.testing.assert_allclose(model.law.k, SMALL_LAW.k[0], rtol=0.05)
    np.testing.assert_allclose(model.law.c, SMALL_LAW.c[0], rtol=0.15)

    figures = {p.stem for p in (out / "figures").iterdir()}
    assert {p.name for p in (out / "figures").iterdir()} == {f"{f}.{end}" for f in figures for end in ("png", "svg")}
    assert figures == {"rattle_map", "restoring_force", *(f"{name}_ramp" for name in FIGURES), FIGURES_OVER_ALL}
    page = (out / "index.html").read_text(encoding="utf-8")
    assert page.index("ouches first from") < page.index("half the gap") < page.rindex("What was found")

    response = tmp_path / "response.nc"
    assert main(["simulate", str(out), "--duration", "1", "--engine", "modal", "--out", str(response)]) == 0
    assert load(response).provenance["law"] == result["law"]


@pytest.fixture
def seen():
    """Datasets that the method "known" is given, which returns the law of the simulation."""
    parameters = (Parameter("contact stiffness", "N/m", 6e3, 1.0, 1e6),
                  Parameter("contact damping", "N s/m", 12.0, 0.1, 100.0))  # fmt: skip
    estimates, datasets = Estimates(parameters, np.array([6e3, 12.0]), np.array([0.01, np.inf]), np.eye(2)), []

    @register("known", "all", lambda rig: 1.0)
    def find(dataset, progress):
        datasets.append(dataset)
        return Identified(model=Model(dataset.rig, SMALL_LAW), estimates=estimates)

    yield datasets
    METHODS.pop("known")


def same_channels(dataset, record):
    (stored,) = dataset.identify
    assert stored.fs == record.fs
    assert [(c.label, c.quantity) for c in stored.channels] == [(c.label, c.quantity) for c in record.channels]
    for a, b in zip(stored.channels, record.channels):
        np.testing.assert_allclose(a.value, b.value, rtol=1e-8)
    return stored


def test_universal_file_and_csv_are_the_record(seen, ramp, csv_file, tmp_path, capsys):
    write_uff(tmp_path / "ramp.uff", ramp)
    for path in (tmp_path / "ramp.uff", csv_file):
        run(capsys, path, "--rig", RIG, "--method", "known", "--no-figures", "--out", tmp_path / "found")
        stored = same_channels(seen.pop(), ramp)
        assert (stored.name, stored.provenance) == ("ramp", {"file": path.name})
    assert not (tmp_path / "found" / "figures").exists()


def test_mapped_columns(seen, ramp, csv_file, tmp_path, capsys):
    header, _, body = csv_file.read_text().partition("\n")
    renamed = header.replace("base", "Input").replace("acc:3", "Accel 3 (m/s²)")
    (tmp_path / "a.csv").write_text(f"{renamed}\n{body}")
    columns = ["--column", "Input=base", "--column", "Accel 3=acc:3"]
    options = ["--rig", RIG, "--method", "known", "--no-figures", "--out", tmp_path / "found"]
    run(capsys, tmp_path / "a.csv", *columns, *options)
    same_channels(seen.pop(), ramp)


def test_what_the_records_do_not_allow_is_said(seen, rig, tmp_path, capsys):
    write_dataset(tmp_path / "data", rig, [record_of(rig, "quiet", "identify", 0.3, 1, 3.0)])
    result, said = run(capsys, tmp_path / "data", "--method", "known", "--out", tmp_path / "found")
    assert said.startswith("clearance-mj: warning: no contact: bushings[0] moves up to 0.0")
    assert said == f"clearance-mj: warning: {result['warnings'][0]}\n"
    page = (tmp_path / "found" / "index.html").read_text(encoding="utf-8")
    assert result["warnings"][0].split(":")[0] in page
    assert "quiet, contact over time: " in page and "contact_over_amplitude" not in page


def test_a_record_without_probes_leaves_the_figures_of_the_others(seen, rig, tmp_path, capsys):
    whole = record_of(rig, "whole", "identify", 8.0, 1, 4.0)
    bare = [c for c in whole.channels if c.quantity == "acceleration"]
    write_dataset(tmp_path / "data", rig, [dataclasses.replace(whole, name="bare", channels=bare), whole])
    run(capsys, tmp_path / "data", "--method", "known", "--out", tmp_path / "found")
    drawn = {p.stem for p in (tmp_path / "found" / "figures").iterdir()}
    assert {f"{name}_whole" for name in FIGURES} < drawn and not {f"{name}_bare" for name in FIGURES} & drawn
    assert "no displacement probe at every bushing" in (tmp_path / "found" / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("where", ["page", "posterior"])
def test_what_was_found_is_kept_where_it_cannot_be_drawn(seen, small_dataset, tmp_path, capsys, monkeypatch, where):
    """A fault of a figure, or of the models drawn from the posterior, costs no result; nothing half-drawn stays."""

    def fails(*_, **__):
        raise ValueError("no such axis")

    if where == "page":
        monkeypatch.setattr("clearance_mj.cli.identify.write_identification", fails)
    else:
        monkeypatch.setattr(Model, "drawn", fails)
    folder = tmp_path / "found"
    assert main(["identify", str(small_dataset), "--method", "known", "--out", str(folder), "--quiet"]) == 2
    captured = capsys.readouterr()
    assert captured.err == f"clearance-mj: {folder}: what was found is kept, and drawing it failed: no such axis\n"
    assert "contact stiffness" in captured.out
    assert {"rig.toml", "law.json", "identified.json"} == {p.name for p in folder.iterdir() if p.is_file()}
    assert Model.load(folder).rig.name == "table1"


def test_refused(small_dataset, ramp, csv_file, tmp_path, refused):
    uff, out = tmp_path / "a.uff", tmp_path / "found"
    write_uff(uff, ramp)
    for given, words in (
        ([csv_file], "which needs its rig too: --rig rig.toml"),
        ([small_dataset, "--rig", RIG], "--rig, --column, --map, --fs and --resample are for the file of"),
        ([csv_file, "--rig", RIG, "--column", "Acel=acc:1"], 'no column "Acel"'),
        ([csv_file, "--rig", RIG, "--column", "acc:1"], "needs HEADER=CHANNEL"),
        ([tmp_path / "no.csv.zip"], "does not exist; a dataset is"), ([tmp_path / "no.csv", "--rig", RIG], "no.csv"),
        ([uff, "--rig", RIG, "--fs", 2048], "a sampling rate is for CSV, Excel, HDF5, LVM, MATLAB, MDF, NetCDF, TDMS"),
        ([small_dataset, "--method", "guess"], 'method "guess" is unknown'),
    ):  # fmt: skip
        assert words in refused("identify", *given, "--out", out)
    assert not out.exists()


def refused_table(csv_file, folder, refused, change):
    """What is said of the record as a table with other lines, where the rig is exact."""
    path = folder / "changed.csv"
    path.write_text(change(csv_file.read_text()))
    return refused("identify", path, "--rig", RIG, "--rig-exact", "--out", folder / "found")


def test_typo_in_a_header(csv_file, tmp_path, refused):
    message = refused_table(csv_file, tmp_path, refused, lambda text: text.replace("disp:6", "dips:6", 1))
    assert message.startswith(f'clearance-mj: {tmp_path / "changed.csv"}: line 1, column 11 "dips:6"')
    assert 'did you mean "disp:6"?' in message


def test_missing_sensor(csv_file, tmp_path, refused):
    cut = lambda text: "\n".join(line.rsplit(",", 3)[0] for line in text.splitlines())  # noqa: E731
    words = "has no acceleration at node 8 along Z, a sensor of the rig"
    assert words in refused_table(csv_file, tmp_path, refused, cut)
