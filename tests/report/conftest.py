"""A small study with analytic FRFs: three sensors, two levels, two laws, two engines, two seeds of each level."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.estimate import Estimates, Parameter
from clearance_mj.report import write_report
from clearance_mj.signals import random_db
from clearance_mj.signals.correlation import csac_per_sensor, csf_per_sensor
from clearance_mj.study import IdentifiedModel, StudyCase
from clearance_mj.study.periodic import PeriodicVibrations
from tests import studies
from tests.store import kept
from tests.studies import study_of

FREQUENCY = np.arange(5.0, 220.5, 0.5)
BUSHING = {"gap": 3e-4, "length": 0.012, "grease": cm.Grease(4000.0, 3.0), "contact": cm.Contact(7.8e3, 4.0)}
RIG = cm.Rig(name="small <rig>", beam=cm.Beam(1.0, 210e9, 7850.0, diameter=0.0086),
             bushings=(cm.Bushing(0.6, **BUSHING),), sensors=(cm.Sensor(1, 0.3), cm.Sensor(2, 0.6), cm.Sensor(3, 1.0)),
             masses=(cm.PointMass(1.0, 0.4, "boss"),))  # fmt: skip
MODES, DAMPING = np.array([9.0, 40.0, 93.0, 188.0]), 0.02
SHAPES = np.array([[0.3, 0.7, 1.0], [0.9, 0.6, -1.0], [-0.8, 1.0, 0.9], [1.0, -0.4, 0.7]])
N, FS = 512, 512.0


def frf(shift=1.0, scale=1.0) -> cm.FRF:
    """Base acceleration to absolute acceleration: H = 1 + ω² Σ φ/(ω_n² - ω² + 2jζω_nω)."""
    terms = [
        np.outer(shape, FREQUENCY**2 / ((f * shift) ** 2 - FREQUENCY**2 + 2j * DAMPING * f * shift * FREQUENCY))
        for f, shape in zip(MODES, SHAPES)
    ]
    return cm.FRF(FREQUENCY, scale * (1 + sum(terms)), np.full((3, FREQUENCY.size), 0.9), averages=20.0)


def compared(test, model, test_shift, model_shift) -> cm.Comparison:
    """What `compare` returns, with the modes as they are known: looking for them takes a second."""
    t, m = test.functions, model.functions
    variants = csac_per_sensor(t, m), csf_per_sensor(t, m)
    per_sensor = {"sensor": test.responses, "mre": cm.mre(t, m), "rmse_db": cm.rmse_db(t, m), "frac": cm.frac(t, m)}
    per_sensor |= {"csac": variants[0].mean(axis=1), "csf": variants[1].mean(axis=1)}
    per_sensor["random_db"] = np.sqrt(np.mean(random_db(test)[:, 0] ** 2, axis=1))
    per_mode = {
        "mode": np.arange(1, 5), "test_hz": MODES * test_shift, "model_hz": MODES * model_shift,
        "relative_error": np.full(4, abs(model_shift / test_shift - 1)), "mac": np.array([0.99, 0.98, 0.97, 0.96]),
        "test_damping": np.full(4, DAMPING), "model_damping": np.full(4, DAMPING),
    }  # fmt: skip
    return cm.Comparison(FREQUENCY, cm.csac(t, m), cm.csf(t, m), *variants, per_sensor, per_mode)


def record(name, role, level=None, seed=1, source="synthetic: virtual test rig, not measured") -> cm.Record:
    noise = np.random.default_rng(seed).standard_normal
    channels = [cm.Channel(f"acceleration {node}", node, "+Z", "acceleration", noise(N), FS) for node in (1, 2, 3, 100)]
    channels.append(cm.Channel("probe 2", 2, "+Z", "displacement", 1e-4 * noise(N), FS))
    provenance = {"source": source, "command": "python -m experiments.testrig"}
    return cm.Record(name, role, RIG, FS, channels, "base", "random & loud", level, seed, (5.0, 220.0), provenance)


def statistics(level, step):
    return {"displacement_rms": [1e-5 * level], "displacement_peak": [4e-5 * level], "contact_share": [0.01 * level],
            "contact_peak": [2.0 * level], "step": step}  # fmt: skip


LAW = cm.ConstantLaw(8.1e3, 4.0)


@cache
def under_sines() -> PeriodicVibrations:
    """Of the fitted law, with few harmonics and frequencies: it folds at 4 m/s²."""
    model, levels, settings = cm.Model(RIG, LAW), (1.0, 4.0), {"n_harmonics": 9}
    branches = tuple(cm.periodic.follow_response(model, v, (5.0, 90.0), stability=False, **settings) for v in levels)
    of_map = levels, np.linspace(5.0, 90.0, 86)
    return PeriodicVibrations("constant", branches, cm.periodic.map_rattle(model, *of_map, workers=1, **settings), "")


def make_study(offset=0.0, floors=(1.0, 4.0), source="synthetic: virtual test rig, not measured"):
    """``offset`` detunes the fitted law; a level has a second record if it is in ``floors``."""
    records, shifts, floor = [record("ramp", "identify", seed=9, source=source)], {}, {}
    for i, (level, shift) in enumerate({1.0: 0.97, 4.0: 0.94}.items()):
        for j, small in enumerate((1.0, 1.002) if level in floors else (1.0,)):
            name = f"level_{level:g}_{'ab'[j]}"
            records.append(record(name, "validate", level, 10 * i + j, source))
            shifts[name] = shift * small
        if level in floors:
            first, second = shift, shift * 1.002
            floor[level] = compared(frf(first), frf(second), first, second)
    dataset, tests = cm.Dataset(RIG, tuple(records)), {name: frf(shift) for name, shift in shifts.items()}
    fitted = Parameter("contact stiffness", "N/m", 8e3, 1.0, 1e6), Parameter("grease damping", "N s/m", 2.0, 0.1, 1e2)
    parameters = Estimates.of(fitted, np.array([8.1e3, 2.5]), np.diag([0.05**2, 0.2**2])).rows()
    laws = (
        IdentifiedModel("nominal", cm.Model(RIG, cm.ConstantLaw(7.8e3, 4.0)), "rig file only"),
        IdentifiedModel("constant", cm.Model(RIG, LAW), "rig file and the records to identify", parameters=parameters),
    )
    cases = []
    for law, shift in (("nominal", 1.0), ("constant", 0.955 + offset)):
        for engine, small, step in (("links", 1.0, 2e-5), ("modal", 1.001, 5e-5)):
            model = frf(shift * small, 1.05)
            for r in dataset.validate:
                comparison = compared(tests[r.name], model, shifts[r.name], shift * small)
                cases.append(StudyCase(law, engine, r, model, comparison, statistics(r.level, step)))
    return study_of(dataset, laws, cases, tests, repeatability=floor, bands={}, periodic=under_sines())


def changed(study, **changes):
    """A study with other laws, cases or tests."""
    names = ("laws", "cases", "tests", "engines", "repeatability", "bands", "periodic")
    return study_of(study.dataset, **({name: getattr(study, name) for name in names} | changes))


def assert_drawn_within(image):
    """A picture is not blank, and nothing reaches the edge of the canvas."""
    assert image.std() > 0.02, "blank"
    assert np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]]).min() == 1


def assert_units(figure, units, least=1):
    """Every label of an axis ends with a unit."""
    labels = [text for ax in figure.axes for text in (ax.get_xlabel(), ax.get_ylabel()) if text]
    assert len(labels) >= least and all(re.search(rf"\(({units})\)$", text) for text in labels), labels


@pytest.fixture(scope="session")
def study():
    return make_study()


@pytest.fixture(scope="session")
def build():
    """Make studies that differ from `study`."""
    return make_study


@pytest.fixture(scope="session")
def folder(study, tmp_path_factory):
    """The report of `study`, drawn once for all files that read it."""
    made_from = [Path(file).read_text(encoding="utf-8") for file in (__file__, studies.__file__)]
    with kept(
        tmp_path_factory, "report", made_from, lambda folder: write_report(study, folder, progress=False)
    ) as folder:
        yield folder
