"""Errors of users that no other test makes: each tried on purpose, each answered in one line."""

import dataclasses
import inspect
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.io

from clearance_mj import calibrate, report
from clearance_mj.clearance import AmplitudeLaw
from clearance_mj.cli import main
from clearance_mj.core import errors, tasks
from clearance_mj.core.checks import even_rate
from clearance_mj.core.errors import ClearanceError, RecordError, SimulationError
from clearance_mj.core.runner import Runner
from clearance_mj.engines import simulate_blocks
from clearance_mj.identify.laws import output_error
from clearance_mj.identify.methods import force_balance
from clearance_mj.io import formats
from clearance_mj.io.channels import require_one_time
from clearance_mj.io.columns import frf_names
from clearance_mj.io.dataset import Dataset, write_dataset
from clearance_mj.io.lvm import read_lvm
from clearance_mj.io.uff import read_uff, write_uff
from clearance_mj.placement import Candidates
from clearance_mj.signals.alignment import align
from clearance_mj.signals.correlation import csac
from clearance_mj.signals.excitation import random
from clearance_mj.signals.frf import FRF, estimate_frf
from clearance_mj.signals.references import join_references
from clearance_mj.signals.response import Response
from clearance_mj.sweep import Design, Vary, run
from clearance_mj.sweep.case import Outputs
from experiments.article import Inputs
from experiments.real.records import read_dropbear
from experiments.testrig import Truth, integrator, simulate_rig

from .conftest import ROOT, record_of
from .io.uff_by_hand import by_hand
from .sweep.plans import DESIGN, EXCITATION, GAP, OUTPUTS, loaded, small, text

RIG = str(ROOT / "models" / "table1_rig.toml")
FIVE = np.arange(5.0, 10.0)


def frf(frequency=FIVE, value=1.0, **fields):
    return FRF(frequency, np.full((2, len(frequency)), value, dtype=complex), **fields)


def test_every_error_is_of_one_family():
    """One except clause catches what bad input causes."""
    error_classes = [c for _, c in inspect.getmembers(errors, inspect.isclass)]
    assert len(error_classes) > 5 and all(issubclass(c, ClearanceError) for c in error_classes)


# Values that are impossible


IMPOSSIBLE = {
    "negative amplitude": (lambda: AmplitudeLaw([-1e-4, 1e-4], [[1e4], [1e4]], [[1], [1]]), "amplitude must be .*>= 0"),
    "no shape": (
        lambda: calibrate.ModalTarget(np.ones(1), np.ones(1), np.ones(1), np.zeros((2, 1)), (1, 2)),
        "a shape is not finite or zero at every sensor",
    ),
    "candidates of several sizes": (lambda: Candidates(FIVE, np.ones((5, 2)), np.eye(4)), r"covariance \(5, 5\), got"),
    "candidates that are nan": (lambda: Candidates(FIVE, np.full((5, 2), np.nan), np.eye(5)), "must be finite"),
    "unknown drive": (
        lambda: estimate_frf(Response(64.0, FIVE, np.ones((1, 5)), kind="wind"), resolution=16.0),
        'kind "wind" of the excitation is unknown; use base, force',
    ),
    "few lines to interpolate": (
        lambda: align(frf(np.array([5.0, 6.0])), frf(np.array([5.0, 5.5, 6.0]))),
        "interpolation needs at least 4 lines, there are 3",
    ),
    "quantity of no column": (lambda: frf_names(frf(quantity="stress/force")), 'quantity "stress/force" is unknown'),
    "no channels": (lambda: require_one_time([]), "there is no channel"),
    "one instant": (lambda: even_rate(np.zeros(1), 1e-15), "needs two samples to tell its time step"),
    "csac of one": (lambda: csac(np.ones((1, 3)), np.ones((1, 3))), "needs at least 2, got 1"),
    "scale": (lambda: Vary("rig.a", low=1, high=2, scale="cubic"), 'vary.scale "cubic" is unknown; use linear or log'),
    "values twice": (lambda: Vary("rig.a", values=(1.0, 1.0)), r"each once; got \[1.0, 1.0\]"),
    "values and count": (lambda: Vary("rig.a", values=(1.0, 2.0), count=3), "count and scale go with low and high"),
    "samples of a grid": (lambda: Design("grid", samples=4), "design.samples is not for a grid"),
    "no samples": (lambda: Design("latin-hypercube", samples=0), r"design.samples must be in 1\.\."),
    "negative seed": (lambda: Design("sobol", samples=4, seed=-1), "design.seed must be >= 0, got -1"),
    "count of a sample": (
        lambda: Design("sobol", samples=4).points([Vary("rig.a", low=1, high=2, count=3)]),
        "vary rig.a: count is for a grid; sobol takes design.samples",
    ),
    "too many cases": (
        lambda: Design("grid").points([Vary(f"rig.{i}", low=0, high=1, count=10**4) for i in range(4)]),
        "too many",
    ),
    "natural frequencies": (lambda: Outputs(natural_frequencies=21), "natural_frequencies must be <= 20, got 21"),
    "no excitation": (lambda: next(simulate_blocks(None, [], None)), "there is no piece of an excitation"),
    "worker with other code": (
        lambda: tasks._with_same_code("other", abs, -1),
        "a worker of the cluster runs another version of clearance_mj",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_impossible_values(name):
    make, part = IMPOSSIBLE[name]
    with pytest.raises(ClearanceError, match=part) as caught:
        make()
    assert "\n" not in str(caught.value)


# Files


def nested(depth):
    """Cells of cells of cells: at some depth they are made to exhaust the stack."""
    cell = np.empty(1, dtype=object)
    cell[0] = nested(depth - 1) if depth else np.ones(3)
    return cell


DROPBEAR = "\n".join(["", "", "", "", "", "Time\tLow G Accel\tPinLoc", "", "", "", "0\t1\t2"])
HALF_COHERENT = "frequency,acc:1/force,acc:1/force coherence,acc:2/force\n1,2,3,4\n2,3,4,5\n"
END = "***End_of_Header***\t\n"
NO_STEP = f"LabVIEW Measurement\t\nSeparator\tTab\nX_Columns\tNo\n{END}Channels\t1\nX0\t0\n{END}"
SHORT_TEXT = by_hand(["".join(f"{v:13.5E}" for v in range(n)) for n in (6, 5)])
FILES = {
    "a.txt": (DROPBEAR, read_dropbear, r"a\.txt: one sample is no record"),
    "a.csv": (HALF_COHERENT, formats.read, r"has no coherence of 2:\+Z; needs that of all functions or none"),
    "h.csv": (frf(), lambda path: formats.read(path, fs=100.0), "holds FRFs, which have no sampling rate"),
    "a.lvm": (f"{NO_STEP}X_Value\tUntitled\n\t1.0\n\t2.0\n", read_lvm, "header needs Delta_X, a number"),
    "a.uff": (SHORT_TEXT.decode(), read_uff, "data set 1: holds 11 numbers, 12 samples need 12"),
    "two.mat": (
        {"time": FIVE, "acc_1": FIVE},
        lambda path: formats.read(path, fs=10.0),
        "has a variable of time; needs",
    ),
    "deep.mat": ({"x": nested(60)}, formats.read, r"holds cells more than \d+ deep"),
}


@pytest.mark.parametrize("name", FILES)
def test_files_that_cannot_be_used(tmp_path, name):
    content, read, part = FILES[name]
    if isinstance(content, str):
        (tmp_path / name).write_text(content)
    elif isinstance(content, dict):
        scipy.io.savemat(tmp_path / name, content)
    else:
        formats.write(tmp_path / name, content)
    with pytest.raises(RecordError, match=part):
        read(tmp_path / name)


def mode_set(definition=(1, 3, 3, 8, 5, 3), values=(-1.0, 99.0), body=None):
    """One data set 55: eight header records, then node and its complex components."""
    line6 = "".join(f"{number:10d}" for number in definition)
    numbers = "".join(f"{v:13.5E}" for v in (*values, 0, 0, 0, 0))
    header = ["NONE"] * 5 + [line6, f"{2:10d}{6:10d}{0:10d}{1:10d}", numbers]
    body = [f"{1:10d}", "".join(f"{v:13.5E}" for v in range(6))] if body is None else body
    return "\n".join(["    -1", "    55", *header, *body, "    -1", ""])


@pytest.mark.parametrize(
    ("sets", "part"),
    [
        ([mode_set((1, 3, 3, 8, 1, 3))], "mode shape of data type 1; needs 2 or 4"),
        ([mode_set((1, 2, 3, 8, 5, 3), (-5.0, 1.0))], "natural frequency -5 Hz must be >= 0 and finite"),
        ([mode_set(body=[f"{1:10d}"])], "mode shape needs 2 records per node, has 1"),
        ([mode_set((1, 1, 3, 8, 5, 3))], r"holds data sets 55 \(data at nodes\) only; there is no function, mode or"),
        ([mode_set(body=[])], "mode shape without a node"),
    ],
)  # fmt: skip
def test_modes_of_a_universal_file(tmp_path, sets, part):
    (tmp_path / "m.uff").write_text(mode_set())
    assert read_uff(tmp_path / "m.uff").frequency == pytest.approx([np.hypot(1, 99) / (2 * np.pi)])
    (tmp_path / "m.uff").write_text("".join(sets))
    with pytest.raises(RecordError, match=part):
        read_uff(tmp_path / "m.uff")


def test_file_of_a_dataset_that_cannot_be_read(tmp_path):
    (tmp_path / "dataset.toml").mkdir()
    with pytest.raises(RecordError, match=r"dataset\.toml: cannot be read \(Is a directory\)"):
        Dataset.load(tmp_path)


def test_targets_of_a_calibration(tmp_path):
    with pytest.raises(RecordError, match=r"absent\.csv: cannot be read \(No such file"):
        calibrate.read_frequencies(tmp_path / "absent.csv")
    write_uff(tmp_path / "zero.uff", frf(value=0.0))
    with pytest.raises(RecordError, match="an FRF is zero or not finite at a line; cut it off with a band"):
        calibrate.read_frf(tmp_path / "zero.uff")
    write_uff(tmp_path / "two.uff", join_references([frf(references=(r,)) for r in ("1:+Z", "2:+Z")]))
    with pytest.raises(RecordError, match=r"holds FRFs to 1:\+Z, 2:\+Z, calibration needs FRFs to one reference"):
        calibrate.read_frf(tmp_path / "two.uff")


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("calibrate", RIG, "modes.csv", "--free", "beam.length=a:b"), "is not PATH or PATH=LOW:HIGH"),
        (("place", RIG, "--modes", "1,x"), "is not a list such as 1,2,3"),
    ],
)
def test_options_that_do_not_parse(capsys, arguments, part):
    with pytest.raises(SystemExit) as stopped:
        main(list(arguments))
    assert stopped.value.code == 2
    assert part in capsys.readouterr().err


def test_convert(tmp_path, small_dataset, refused):
    formats.write(tmp_path / "h.uff", frf())
    said = refused("convert", tmp_path / "h.uff", tmp_path / "g.csv", "--frf", 1)
    assert "holds FRFs already; --frf is for time records" in said
    (tmp_path / "other.toml").write_text((ROOT / "models" / "table1_rig.toml").read_text().replace("table1", "other"))
    record = next(small_dataset.glob("*.uff"))
    said = refused("convert", record, small_dataset, "--rig", tmp_path / "other.toml")
    assert f"is another rig than that of the dataset {small_dataset}" in said


# Records from which nothing can be identified


def test_contact_too_short_to_identify_its_stiffness(small_dataset, monkeypatch):
    parameters = force_balance.contact_parameters

    def short(*arguments):
        contact_fit = parameters(*arguments)
        return dataclasses.replace(contact_fit, k=np.full_like(contact_fit.k, np.nan))

    monkeypatch.setattr(force_balance, "contact_parameters", short)
    with pytest.raises(RecordError, match="contact is too short in every record"):
        force_balance.force_balance_law(Dataset.load(small_dataset))


def test_records_too_short_to_fit(rig):
    with pytest.raises(RecordError, match=r"must last \d+ s or more, the longest lasts 2 s"):
        output_error.evidence([record_of(rig, "short", "identify", 1.0, 1, 2.0)])


def test_test_rig_that_diverges(rig, monkeypatch):
    monkeypatch.setattr(integrator, "march", lambda *arguments: 100)
    with pytest.raises(SimulationError, match=r"the bushings' forces did not converge at 0\.\d+ s"):
        simulate_rig(rig, Truth(), random(1.0, 2048.0, band=(5, 220), rms=1.0, seed=0), 0)


# Studies and the article's items


def study_of(tmp_path, simulated, **changes):
    """A dataset of one record of two seconds."""
    record = dataclasses.replace(record_of(simulated, "level", "validate", 1.0, 1, 2.0), **changes)
    write_dataset(tmp_path / "data", record.rig, [record])
    return tmp_path / "data"


def test_rig_without_bushings(tmp_path, rig):
    data = study_of(tmp_path, rig, rig=dataclasses.replace(rig, bushings=()))
    with pytest.raises(RecordError, match="the rig has no bushings, so there is no clearance to study"):
        report.report_study(data, tmp_path / "out")
    with pytest.raises(RecordError, match="the article's rig has two bushings, sensors 1 to 8 and a shaken base"):
        Inputs(data).study  # noqa: B018


def test_study_of_a_record_without_level(tmp_path, rig):
    with pytest.raises(RecordError, match='record "level" has no level; validation records need one'):
        report.report_study(study_of(tmp_path, rig, level=None), tmp_path / "out")


def test_study_into_a_file(tmp_path, rig):
    (tmp_path / "file").write_text("")
    with pytest.raises(ClearanceError, match=r"--out .*file is a file; give a folder"):
        report.report_study(study_of(tmp_path, rig), tmp_path / "file")


# Sweeps


PLANS = {
    "no rig": (GAP, 'rig is missing: rig = "rig.toml"'),
    "no TOML": ("rig = ", "not valid TOML"),
    "no duration": (text(EXCITATION.replace("duration = 1", ""), DESIGN.format(samples=4), GAP), "duration is missing"),
}


@pytest.mark.parametrize("name", PLANS)
def test_impossible_plans(tmp_path, name):
    content, part = PLANS[name]
    with pytest.raises(ClearanceError, match=part):
        loaded(tmp_path, content)


LINES = np.arange(6.0, 220.5, 2.0)
REFERENCES = {
    "other excitation": (
        {"references": ("200:+Z",)},
        r"its FRFs are to 200:\+Z, the plan's excitation is of kind base",
    ),
    "no sensor": ({"responses": ("1:+Z", "99:+Z")}, r"its response 99:\+Z is no sensor of the rig"),
    "other lines": ({"frequency": LINES + 0.5}, r"its lines .* are not the sweep's"),
    "zero": ({"value": 0.0}, "its FRFs are zero or not finite at a line; cut it off with outputs.band"),
}


@pytest.mark.parametrize("name", REFERENCES)
def test_references_of_a_sweep(tmp_path, name):
    changes, part = REFERENCES[name]
    write_uff(tmp_path / "test.uff", frf(**{"frequency": LINES} | changes))
    with pytest.raises(ClearanceError, match=f"reference: {part}"):
        loaded(tmp_path, text(EXCITATION, DESIGN.format(samples=4), OUTPUTS, GAP, head='reference = "test.uff"'))


def test_reference_that_does_not_fit_the_plan(tmp_path):
    write_uff(tmp_path / "test.uff", frf(LINES))
    with pytest.raises(ClearanceError, match=r"the reference holds FRFs, so the plan needs an \[excitation\]"):
        loaded(tmp_path, text(DESIGN.format(samples=4), OUTPUTS, GAP, head='reference = "test.uff"'))
    write_uff(tmp_path / "test.uff", join_references([frf(LINES, references=(r,)) for r in ("100:+Z", "200:+Z")]))
    with pytest.raises(ClearanceError, match=r"holds FRFs to 100:\+Z, 200:\+Z; a sweep needs them to one reference"):
        loaded(tmp_path, text(EXCITATION, DESIGN.format(samples=4), OUTPUTS, GAP, head='reference = "test.uff"'))


def test_excitation_that_does_not_tell_its_band(tmp_path):
    hits = "duration = 1\nfs = 1024\npeak = 10\nwidth = 0.004\ntimes = [0.1]\n"
    with pytest.raises(ClearanceError, match=r"outputs\.band is missing: this excitation does not tell its band"):
        loaded(tmp_path, text(f'[excitation]\ngenerator = "hammer"\n{hits}', DESIGN.format(samples=4), OUTPUTS, GAP))


def test_sweep_larger_than_a_file_holds(tmp_path, monkeypatch):
    monkeypatch.setattr(run, "LARGEST", 1000)
    with pytest.raises(ClearanceError, match=r"of 4 cases takes .* more than a netCDF file can hold"):
        run.run_sweep(loaded(tmp_path, small(4)), tmp_path / "out", Runner(1))


@pytest.mark.parametrize(
    ("lost", "part"),
    [("killed", "a case kills its workers"), ("closed", "lost .*; run the same command again to go on")],
)
def test_cluster_that_is_lost(monkeypatch, lost, part):
    distributed = pytest.importorskip("distributed")
    error = distributed.KilledWorker("case", SimpleNamespace(address="w"), 3) if lost == "killed" else OSError("closed")

    class Client:
        loop = None

        def __init__(self, *_, **__): ...
        def __enter__(self):
            return self

        def __exit__(self, *_): ...
        def map(self, *_, **__):
            return []

    def fails(*_, **__):
        raise error

    monkeypatch.setattr(distributed, "Client", Client)
    monkeypatch.setattr(distributed, "as_completed", fails)
    with pytest.raises(ClearanceError, match=f"--scheduler tcp://x: {part}"):
        list(tasks.run_tasks(abs, [1], scheduler="tcp://x"))
