"""The section on loudness: what the study's records and laws sound like, with players at one full scale."""

import base64
import dataclasses
import importlib.util
import re

import numpy as np
import pandas as pd
import pytest

from clearance_mj import Dataset, Model, Plate
from clearance_mj.core.cache import ResultCache
from clearance_mj.report import ReportWriter
from clearance_mj.report.sections.loudness import loudness
from clearance_mj.sound import Sound, radiate, read_wav
from clearance_mj.sound import loudness as loudness_of
from clearance_mj.study import IdentifiedModel
from clearance_mj.study.heard import StudySounds
from tests.studies import study_of

from .conftest import LAW, RIG, record

PLATE = Plate(sensor=3, area=0.5, distance=1.0)


def study_with(plate, cache=None):
    rig = RIG.replace(plate=plate)
    records = [record("ramp", "identify", seed=9)] + [record(f"level_{v}", "validate", v, v) for v in (1, 4)]
    records = tuple(dataclasses.replace(r, rig=rig) for r in records)
    laws = (IdentifiedModel("constant", Model(rig, LAW), "rig file and the records to identify"),)
    return study_of(Dataset(rig, records), laws, engines=("modal",), cache=cache)


@pytest.fixture(scope="module")
def heard(tmp_path_factory):
    pytest.importorskip("mosqito")
    folder = tmp_path_factory.mktemp("heard")
    study = study_with(PLATE, ResultCache(folder / "cache"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("clearance_mj.study.heard.METHOD", "stationary")  # in no time
        yield study, loudness(study, ReportWriter(folder)), folder


def test_the_test_is_as_loud_as_its_record(heard):
    study, _, folder = heard
    rows = pd.read_csv(folder / "tables" / "loudness.csv")
    assert list(zip(rows["law"], rows["level"])) == [("test", 1), ("test", 4), ("constant", 1), ("constant", 4)]
    response = study.dataset.validate[0].response()
    excerpt = radiate(response, study.dataset.rig).faded(0.02)  # a record of one second is its own excerpt
    assert rows["sound_pressure_level_db"][0] == pytest.approx(excerpt.level, abs=1e-6)
    assert rows["loudness_n5_sone"][0] == pytest.approx(loudness_of(excerpt, "stationary").n5, rel=1e-6)


def test_players_hold_what_was_heard_at_one_full_scale(heard, tmp_path):
    study, markup, _ = heard
    addresses = re.findall(r'<audio[^>]* src="data:audio/wav;base64,([^"]*)"', markup)
    assert len(addresses) == 4
    sounds = []
    for address in addresses:
        (tmp_path / "one.wav").write_bytes(base64.b64decode(address))
        sounds.append(read_wav(tmp_path / "one.wav"))
    assert len({sound.full_scale for sound in sounds}) == 1
    over_level = StudySounds(study).over_level
    expected = [over_level[name].sound[i] for i in (0, 1) for name in ("test", "constant")]  # a row for each level
    for player, sound in zip(sounds, expected):
        assert isinstance(sound, Sound)
        assert player.value.std() == pytest.approx(sound.pressure.std(), rel=0.05)


def test_another_study_takes_it_from_the_cache(heard, monkeypatch):
    study, _, _ = heard
    first = StudySounds(study).over_level
    monkeypatch.setattr("clearance_mj.study.heard.loudness_of_each", lambda *_, **__: pytest.fail("computed again"))
    assert np.array_equal(StudySounds(study_with(PLATE, study.cache)).over_level["constant"].n5, first["constant"].n5)


def test_nothing_without_a_plate_and_a_line_without_mosqito(tmp_path, monkeypatch):
    assert loudness(study_with(None), ReportWriter(tmp_path)) == ""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *_: None)
    said = loudness(study_with(PLATE), ReportWriter(tmp_path))
    assert (
        said
        == '<p class="note">No loudness: loudness needs the package mosqito: pip install "clearance-mj[sound]".</p>\n'
    )
