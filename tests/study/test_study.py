"""The study on a small dataset: what it leaves, what it keeps after an interrupt, what it refuses."""

import dataclasses
import json
from unittest import mock

import numpy as np
import pytest
import scipy.stats
import xarray as xr

from clearance_mj import Dataset, Model, Rig, estimate_frf, report, simulate, write_dataset
from clearance_mj.clearance import ConstantLaw, nominal_law
from clearance_mj.cli import main
from clearance_mj.core import cache
from clearance_mj.core.errors import ClearanceError, RecordError
from clearance_mj.core.output_folder import WORK
from clearance_mj.estimate import Estimates, Parameter
from clearance_mj.identify import METHODS as METHODS_BY_NAME
from clearance_mj.identify import Identified
from clearance_mj.identify.laws.law_misfit import DecayMisfit, LawMisfit, Stretch
from clearance_mj.identify.records.checks import IdentifiabilityWarning
from clearance_mj.identify.registry import Method
from clearance_mj.report import report_study
from clearance_mj.structure import Clamp
from clearance_mj.study import IdentifiedModel
from clearance_mj.study import study as study_module
from tests.studies import study_of

from ..conftest import SMALL_LAW, TABLE1, record_of

METHODS = ("nominal", "constant")
FEW = TABLE1.replace(sensors=tuple(s for s in TABLE1.sensors if s.node in (3, 6, 7, 8)))


@pytest.fixture(scope="module")
def brief(tmp_path_factory):
    """A dataset folder with records of a few seconds and four sensors: two levels with two seeds to validate."""
    folder = tmp_path_factory.mktemp("data") / "brief"
    records = [record_of(FEW, "ramp", "identify", 9.0, 1, 5.0, start=0.3)]
    records += [record_of(FEW, f"level_{v}_{s}", "validate", v, 10 * v + s, 4.0) for v in (1, 4) for s in (1, 2)]
    write_dataset(folder, FEW, records)
    return folder


@pytest.fixture(scope="module")
def finished(brief, tmp_path_factory):
    out = tmp_path_factory.mktemp("out") / "study"
    return report_study(brief, out, ("modal",), METHODS, progress=False), out


def test_files_of_a_finished_study(finished):
    _, out = finished
    names = {p.name for p in out.iterdir()}
    assert {"report.html", "summary.json", "results.nc", "laws", "figures", "tables"} <= names
    assert not [p for p in out.parent.iterdir() if p != out]


def test_rows_against_a_simulation_made_here(finished, brief):
    """RMSE of the nominal law at one level: simulated, estimated and averaged by hand."""
    study, _ = finished
    errors = []
    dataset = Dataset.load(brief)
    for record in (r for r in dataset.validate if r.level == 4):
        response = simulate(dataset.rig, record.excitation(), nominal_law(dataset.rig), "modal")
        model, test = (estimate_frf(each, resolution=0.5) for each in (response, record.response()))
        db = 20 * np.log10(np.abs(model.value) / np.abs(test.value))
        errors.append(np.mean(np.sqrt(np.mean(db**2, axis=-1))))
    row = next(r for r in study.rows() if (r["level"], r["law"], r["engine"]) == (4, "nominal", "modal"))
    assert row["rmse_db"] == pytest.approx(np.mean(errors), rel=1e-9)


def test_fitted_constants_predict_better_than_the_datasheet(finished):
    """The records were simulated with constants, which the fit can find and the datasheet does not hold."""
    study, _ = finished
    rows = {(r["level"], r["law"], r["engine"]): r for r in study.rows()}
    for level in (1, 4):
        assert rows[level, "constant", "modal"]["rmse_db"] < 0.5 * rows[level, "nominal", "modal"]["rmse_db"]


def test_summary_and_netcdf_hold_the_same_frfs(finished):
    study, out = finished
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["identified_from"], summary["synthetic"], len(summary["results"])) == (["ramp"], True, 2 * (2 + 1))
    case = study.cases[-1]
    with xr.open_dataset(out / "results.nc", engine="scipy") as data:
        kept = data.model.sel(law=case.law, engine=case.engine, record=case.record.name).squeeze()
        kept = kept.transpose("response", "frequency", "part")
        np.testing.assert_array_equal(kept.values[..., 0] + 1j * kept.values[..., 1], case.frf.functions)
        assert json.loads(data.attrs["rig"])["name"] == "table1"


def not_again(*_):
    """In place of a method that must not run again; of this file too, as the cache looks at the code."""
    raise AssertionError("identified again")


@pytest.fixture
def quick(monkeypatch):
    """A study whose fit and report cost nothing: for tests of what surrounds them."""
    monkeypatch.setitem(METHODS_BY_NAME, "constant", Method("all", lambda *_: Identified(model=Model(FEW, SMALL_LAW))))
    monkeypatch.setattr(report, "write_report", lambda _, folder, progress: (folder / "report.html").write_text("-"))


def test_interrupted_study_goes_on_where_it_stopped(brief, tmp_path, monkeypatch, quick):
    done = []

    def interrupted(*case):
        if len(done) == 3:
            raise KeyboardInterrupt
        done.append(case)
        return simulate(*case)

    monkeypatch.setattr(study_module, "simulate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        report_study(brief, tmp_path / "out", ("modal",), METHODS, workers=1, progress=False)
    assert [p.name for p in (tmp_path / "out").iterdir()] == [WORK]
    assert len(list((tmp_path / "out" / WORK / "cache").glob("*.nc"))) == 3

    done = counted(monkeypatch)
    monkeypatch.setitem(METHODS_BY_NAME, "constant", Method("all", not_again))
    report_study(brief, tmp_path / "out", ("modal",), METHODS, progress=False)
    assert len(done) == 2 * 4 - 3 and (tmp_path / "out" / "report.html").exists()


def counted(monkeypatch):
    """Simulations from here on, as (rig, excitation, law, engine)."""
    done = []
    monkeypatch.setattr(study_module, "simulate", lambda *a: done.append(a) or simulate(*a))
    return done


def test_a_second_study_computes_only_what_is_new(brief, tmp_path, monkeypatch, quick):
    done = counted(monkeypatch)
    first = report_study(brief, tmp_path / "out", ("modal",), METHODS, progress=False)
    assert len(done) == 2 * 4

    done.clear()
    monkeypatch.setitem(METHODS_BY_NAME, "constant", Method("all", not_again))
    again = report_study(brief, tmp_path / "out", ("modal",), METHODS, progress=False)
    assert not done and json.dumps(again.rows()) == json.dumps(first.rows())
    for one, other in zip(first.cases, again.cases):
        np.testing.assert_array_equal(one.frf.value, other.frf.value)
        assert one.statistics == other.statistics

    report_study(brief, tmp_path / "out", ("modal", "links"), METHODS, progress=False)
    assert [engine for *_, engine in done] == ["links"] * 8


def test_a_changed_record_is_simulated_again_and_identified_from_only_if_it_was_before(
    brief, tmp_path, monkeypatch, quick
):
    done, dataset = counted(monkeypatch), Dataset.load(brief)
    report_study(brief, tmp_path / "out", ("modal",), METHODS, progress=False)
    records = list(dataset.records)
    i = next(i for i, r in enumerate(records) if r.name == "level_4_2")
    louder = [dataclasses.replace(c, value=1.01 * c.value) for c in records[i].channels]
    records[i] = dataclasses.replace(records[i], channels=louder)
    write_dataset(tmp_path / "changed", dataset.rig, records)

    done.clear()
    monkeypatch.setitem(METHODS_BY_NAME, "constant", Method("all", not_again))
    report_study(tmp_path / "changed", tmp_path / "out", ("modal",), METHODS, progress=False)
    assert {excitation.description["record"] for _, excitation, *_ in done} == {"level_4_2"} and len(done) == 2
    assert len(list((tmp_path / "out" / WORK / "cache").glob("*.nc"))) == 2 * 4, "what is out of date is dropped"


def test_changed_code_keeps_nothing(brief, tmp_path, monkeypatch, quick):
    done = counted(monkeypatch)
    report_study(brief, tmp_path / "out", ("modal",), ("nominal",), progress=False)
    monkeypatch.setattr(cache, "code", lambda: "another version")
    report_study(brief, tmp_path / "out", ("modal",), ("nominal",), progress=False)
    assert len(done) == 2 * 4


def test_a_study_replaces_an_older_one_only_when_it_is_whole(brief, tmp_path, monkeypatch, quick):
    """And it leaves alone what somebody else put into its folder or beside it."""
    out = tmp_path / "out"
    foreign = ("figures/photo.png", "tables/raw.csv", "thesis.tex", "../out.old/report.html", "../out.partial/lock")
    for name in foreign:
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(name)
    report_study(brief, out, ("modal",), ("nominal",), progress=False)
    (out / "figures" / "annotated.png").write_text("annotated")
    before = (out / "summary.json").read_bytes()

    with mock.patch.object(study_module, "simulate", side_effect=MemoryError), pytest.raises(MemoryError):
        report_study(brief, out, ("modal",), METHODS, progress=False)
    assert (out / "summary.json").read_bytes() == before
    report_study(brief, out, ("modal",), METHODS, progress=False)
    assert (out / "laws" / "constant.json").exists()
    assert [(out / name).read_text() for name in foreign] == list(foreign)
    assert (out / "figures" / "annotated.png").read_text() == "annotated"


def test_a_report_of_an_earlier_version_is_not_replaced(brief, tmp_path):
    """It has no manifest: nothing says whether somebody changed it. Nothing is simulated before that is said."""
    (tmp_path / "report.html").write_text("old")
    with pytest.raises(ClearanceError, match=r"report\.html is there and not listed as written by this version"):
        report_study(brief, tmp_path, ("modal",), METHODS, progress=False)
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_dataset_without_validation_records(brief, tmp_path):
    dataset = Dataset.load(brief)
    write_dataset(tmp_path / "data", dataset.rig, dataset.identify)
    with pytest.raises(RecordError, match='no record has role "validate"'):
        report_study(tmp_path / "data", tmp_path / "out", ("modal",), METHODS, progress=False)
    assert not (tmp_path / "out").exists()


def test_one_record_of_one_segment(brief, tmp_path, quick):
    """It has no coherence."""
    dataset = Dataset.load(brief)
    short = record_of(dataset.rig, "short", "validate", 1.0, 3, duration=2.0)
    write_dataset(tmp_path / "data", dataset.rig, [short])
    report_study(tmp_path / "data", tmp_path / "out", ("modal",), ("nominal",), progress=False)
    with xr.open_dataset(tmp_path / "out" / "results.nc", engine="scipy") as labelled:
        assert np.isnan(labelled["model_coherence"]).all() and np.isfinite(labelled["model"]).all()
    made = json.loads((tmp_path / "out" / "summary.json").read_text())["provenance"]
    assert str(tmp_path / "data" / "short.uff") in made["inputs"]


@pytest.mark.filterwarnings("error::FutureWarning")
def test_records_of_several_bands_go_into_one_file(brief, tmp_path, quick):
    """Lines that a record does not have are nan."""
    dataset = Dataset.load(brief)
    records = [dataclasses.replace(r, band=(5.0, 150.0)) if r.level == 4 else r for r in dataset.records]
    write_dataset(tmp_path / "data", dataset.rig, records)
    report_study(tmp_path / "data", tmp_path / "out", ("modal",), ("nominal",), progress=False)
    with xr.open_dataset(tmp_path / "out" / "results.nc", engine="scipy") as labelled:
        finite = np.isfinite(labelled["test"]).all(["response", "reference", "part"])
        levels = {r.name: r.level for r in dataset.validate}
        for name in levels:
            last = labelled["frequency"].values[finite.sel(record=name).values][-1]
            assert last == (150.0 if levels[name] == 4 else 220.0)


def test_unknown_engine_is_refused_before_any_work(brief, tmp_path):
    with pytest.raises(ClearanceError, match='engine "warp" is unknown; known: links, mjx, modal'):
        report_study(brief, tmp_path / "out", ("warp",), progress=False)


def test_warnings_of_an_identification_stay_with_its_law(brief, tmp_path, monkeypatch):
    """They are given again where the law comes from the cache."""
    runs = []

    def run(dataset, words):
        runs.append(words)
        return Identified(model=Model(TABLE1, SMALL_LAW), warnings=("one bushing never touches",))

    monkeypatch.setitem(METHODS_BY_NAME, "new", Method("nothing", run))
    for _ in range(2):
        with pytest.warns(IdentifiabilityWarning, match="one bushing never touches"):
            (law,) = study_module.Study(Dataset.load(brief), ["new"], ["modal"], cache.ResultCache(tmp_path)).laws
        assert law.warnings == ("one bushing never touches",)
    assert len(runs) == 1


def as_it_stands(rig):
    """The rig with a clamp that gives, a shaft off centre, another modulus, and sensors that are 2 % and 2 mm wrong."""
    beam = dataclasses.replace(
        rig.beam, young_modulus=0.97 * rig.beam.young_modulus, clamp=Clamp(rotation=3e3), rayleigh=(0.0, 0.0),
        damping_ratios=(0.01, 0.006, 0.004, 0.003),
    )  # fmt: skip
    first, second = rig.bushings
    sensors = (dataclasses.replace(s, gain=1.02, position=s.position - 2e-3) for s in rig.sensors)
    bushings = dataclasses.replace(first, gap=1.2 * first.gap, offset=6e-5), dataclasses.replace(second, offset=-4e-5)
    return rig.replace(beam=beam, bushings=bushings, sensors=tuple(sensors))


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A dataset whose rig file knows nothing of the bench that was shaken, and that bench."""
    folder, rig = tmp_path_factory.mktemp("data") / "bench", as_it_stands(TABLE1)
    records = [record_of(rig, name, role, 2.0, 3, 4.0) for name, role in (("noise", "identify"), ("level", "validate"))]
    write_dataset(folder, TABLE1, [dataclasses.replace(r, rig=TABLE1) for r in records])
    return folder, rig


@pytest.fixture
def finding(bench, monkeypatch):
    """Methods "told", which finds the law alone, and "bench", which finds the bench too."""
    offset = Parameter("bushings[0].offset", "m", 0.0, -2e-4, 2e-4, 9e-5, "linear")
    estimates = Estimates.of([offset], [6e-5], np.array([[1e-12]]))
    others = [Model(bench[1], ConstantLaw(k, 12.0, grease=SMALL_LAW.grease)) for k in (5e3, 7e3)]
    both = Identified(model=Model(bench[1], SMALL_LAW, lambda n, seed: others), estimates=estimates)
    alone = Identified(model=Model(TABLE1, SMALL_LAW))
    monkeypatch.setitem(METHODS_BY_NAME, "told", Method("rig file", lambda *_: alone))
    monkeypatch.setitem(METHODS_BY_NAME, "bench", Method("both", lambda *_: both, finds_rig=True))


def test_a_law_is_simulated_on_the_rig_that_was_identified_with_it(bench, finding):
    """The records are those of the bench, on the modal engine: all of clamp, gains, places and offset is in them.

    Other engines miss them by what the engines differ, the rig file's rig by far more.
    """
    engines = ("modal", "links")
    study = study_module.Study(Dataset.load(bench[0]), ("bench", "told"), engines)
    error = {(c.law, c.engine): c.comparison.summary()["rmse_db"] for c in study.cases}
    assert error["bench", "modal"] < 1e-3  # the file holds single precision
    assert max(error["bench", engine] for engine in engines) < 0.15
    assert min(error["told", engine] for engine in engines) > 1.0
    assert study.best_law == "bench", "though it is not the last"


def test_what_identify_found_is_taken_over(brief, tmp_path, monkeypatch, quick, answer):
    """By content: in the same records, and by the method of that name; from another file it is found anew."""
    answer("identify", brief, "--method", "constant", "--no-figures", "--quiet", "--out", tmp_path / "identified")
    monkeypatch.setitem(METHODS_BY_NAME, "constant", Method("all", not_again))
    given = ("study", brief, "--methods", "constant", "--engines", "modal", "--quiet", "--out", tmp_path / "out")
    assert answer(*given, "--identified", tmp_path / "identified")["taken_over"] == ["constant"]
    assert (tmp_path / "out" / "report.html").exists()
    with pytest.raises(AssertionError, match="identified again"):
        main([*map(str, given), "--identified", str(tmp_path / "none"), "--out", str(tmp_path / "other")])


def test_rig_and_drawn_laws_come_out_of_the_cache(bench, finding, tmp_path, monkeypatch):
    """The band is that of the laws that were drawn, each on its rig."""
    results = cache.ResultCache(tmp_path)
    first = study_module.Study(Dataset.load(bench[0]), ("bench",), ("modal",), results)
    assert first.cases and first.bands
    done = counted(monkeypatch)
    again = study_module.Study(Dataset.load(bench[0]), ("bench",), ("modal",), results)
    assert again.law("bench").to_dict() == first.law("bench").to_dict()
    assert again.law("bench").rig == bench[1] and json.dumps(again.rows()) == json.dumps(first.rows())
    band, _ = again.bands["bench"]
    assert not done
    record = again.main_record
    for drawn, model in zip(band.drawn, again.law("bench").drawn):
        frf = estimate_frf(model.simulate(record.excitation(), "modal"), resolution=0.5)
        np.testing.assert_allclose(drawn, np.abs(frf.value), rtol=1e-3)


def test_what_a_law_missed_widens_its_band_from_the_cache_too(bench, finding, tmp_path):
    """Missed by 1 dB, with no random error to speak of: ±1.96 dB beside the drawn laws."""
    dataset, edges = Dataset.load(bench[0]), np.array([5.0, 50.0, 220.0])
    missed = np.full((8, 2), 1.0)
    missed[0, 0] = np.nan  # a band that the record does not have
    stretch = Stretch("noise", 0.0, 5.0, 2.0, missed, np.full((8, 2), 1e-6))
    decay = DecayMisfit("hammer", 0.5, 2.0, 60.0, np.zeros((8, 2)))
    misfit = LawMisfit(tuple(dataset.rig.sensor_labels), "m/s²", edges, (stretch,), (decay,))
    bench_law = study_module.Study(dataset, ("bench",), ("modal",)).law("bench")
    stored = json.dumps(dataclasses.replace(bench_law, misfit=misfit).to_dict())
    law = IdentifiedModel.from_dict(json.loads(stored), TABLE1)
    kept = {"engines": ["modal"], "cache": cache.ResultCache(tmp_path)}
    plain, first, again = (study_of(dataset, [of], **kept).bands["bench"][0] for of in (bench_law, law, law))
    wide = np.sqrt(first.half_width_db[1:] ** 2 - plain.half_width_db[1:] ** 2)
    np.testing.assert_allclose(wide, scipy.stats.norm.ppf(0.975), rtol=1e-4)
    np.testing.assert_array_equal(again.missed, first.missed)


def test_files_of_a_rig_that_was_identified(bench, finding, tmp_path, monkeypatch, answer):
    """They go into a simulation as they are; the summary says which rig a law belongs to."""
    monkeypatch.setattr(report, "write_report", lambda study, folder, progress: None)
    report_study(bench[0], tmp_path / "out", ("modal",), ("told", "bench"), progress=False)
    laws = tmp_path / "out" / "laws"
    assert sorted(p.name for p in laws.iterdir()) == ["bench.json", "bench_rig.toml", "told.json"]
    assert Rig.load(laws / "bench_rig.toml") == bench[1]
    plain, of_bench = json.loads((tmp_path / "out" / "summary.json").read_text())["laws"]
    assert plain["rig"] is None and of_bench["rig"]["beam"]["clamp"] == {"rotation": 3e3}
    assert (plain["simulated_on"], of_bench["simulated_on"]) == ("the rig file’s rig", "the rig identified with it")
