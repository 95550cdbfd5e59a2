"""Sounds of a study's rig: excerpts of the validation records and of laws under them, and their loudness."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence

import numpy as np

from ..engines import simulate
from ..identify.records.in_test import in_test
from ..io.dataset import Record
from ..sound import Loudness, LoudnessOverLevel, Sound, has_mosqito, loudness_of_each, radiate
from ..sound.zwicker import Field, Method
from . import stored
from .study import Study

__all__ = ["StudySounds"]

EXCERPT = 1.5  # s, from the middle of a record: loudness takes about 2 s for each of its seconds
ENGINE = "modal"  # the cheapest
METHOD: Method = "time-varying"
FIELD: Field = "free"
TEST = "test"


class StudySounds:
    """Sounds and loudness over level of the test and of the laws that are shown where there is little room.

    Parameters
    ----------
    study : Study
        Of a rig with a plate; the main part of one in space.
    """

    def __init__(self, study: Study):
        self.study = study.main_part

    @property
    def missing(self) -> str:
        """Reason why there is no sound; "" if there is."""
        return "" if has_mosqito() else 'loudness needs the package mosqito: pip install "clearance-mj[sound]"'

    @property
    def names(self) -> tuple[str, ...]:
        """The test, the law that others are compared with, and the best."""
        return tuple(dict.fromkeys((TEST, self.study.base_law, self.study.best_law)))

    @functools.cached_property
    def over_level(self) -> dict[str, LoudnessOverLevel]:
        """Excerpts of the first record of every level, and their loudness, by name."""
        records = [self.study.records(level)[0] for level in self.study.levels]
        return {name: self._loudness_of(name, records) for name in self.names}

    def _loudness_of(self, name: str, records: Sequence[Record]) -> LoudnessOverLevel:
        def compute() -> dict[str, np.ndarray]:
            sounds = [self._excerpt(name, record) for record in records]
            return dict(_named_arrays(sounds, loudness_of_each(sounds, METHOD, FIELD, workers=1)))

        rig = self.study.dataset.rig
        inputs: list[object] = [rig.content(), EXCERPT, METHOD, FIELD, *map(stored.record_digest, records)]
        if name != TEST:
            inputs += [ENGINE, *self.study.law(name).model.content()]
        kept = stored.arrays(self.study.cache, f"heard_{name}", inputs, compute)
        label = f"{name}, plate at sensor {rig.plate.sensor}" if rig.plate else name
        sounds = [Sound(kept[f"pressure_{i}"], record.fs, label) for i, record in enumerate(records)]
        heard = [Loudness(METHOD, FIELD, kept[f"sone_{i}"], kept[f"specific_{i}"]) for i in range(len(records))]
        return LoudnessOverLevel(tuple(self.study.levels), tuple(sounds), tuple(heard), self.study.unit)

    def _excerpt(self, name: str, record: Record) -> Sound:
        rig, response = self.study.dataset.rig, record.response()
        if name != TEST:
            model = in_test(self.study.law(name).model, record.tested_rig, record.turning())
            response = simulate(model, record.excitation(), None, ENGINE)
        start = max(0.0, (record.duration - EXCERPT) / 2)
        return radiate(response, rig, rig.plate).between(start, start + EXCERPT).faded()


def _named_arrays(sounds: Sequence[Sound], loudness: Sequence[Loudness]) -> Iterator[tuple[str, np.ndarray]]:
    for i, (sound, heard) in enumerate(zip(sounds, loudness)):
        yield f"pressure_{i}", sound.pressure
        yield f"sone_{i}", heard.sone
        yield f"specific_{i}", heard.specific.astype(np.float32)
