"""A study's records of a shaft's turning alone: orbits at one speed and run-ups, compared with the laws'."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..io.dataset import Record
from ..rotors.whirling import Whirl
from ..signals.orbits import Orbits
from .conditions import Condition, conditions_of
from .orbit_measures import compare_orbits, compare_run_ups, onset_of_contact
from .study import Study
from .whirl_in_test import PlacedWhirl, measured_whirl, run_out_of, simulated_whirl, slow_roll_of, without_run_out

__all__ = ["TurningComparison"]

REPEAT = ("repeat", "rig")
"""law and engine of rows that compare a repeat of a test with the test"""


class TurningComparison:
    """Motions of a study's laws and of its validation records of turning alone.

    Parameters
    ----------
    study : Study
        Of a rig in space.
    """

    def __init__(self, study: Study):
        self.study, self.engine = study, study.main_engine
        self._tests: dict[str, Whirl] = {}

    @functools.cached_property
    def slow_roll(self) -> Record | None:
        """The record of a slow turning, which is subtracted from all others; None if none turns slowly enough."""
        return slow_roll_of(self.study.dataset.records)

    @functools.cached_property
    def run_out(self) -> np.ndarray | None:
        """Run-out of the probes; None if no record turns slowly enough."""
        return None if self.slow_roll is None else run_out_of(measured_whirl(self.slow_roll))

    @functools.cached_property
    def groups(self) -> dict[Condition, tuple[Record, ...]]:
        """Records by how the shaft turned; those after the first are its repeats."""
        return conditions_of([r for r in self.study.turned if not r.missing_probes])

    @property
    def speeds(self) -> dict[Condition, tuple[Record, ...]]:
        """Records at constant speed, by rising speed."""
        steady = {c: records for c, records in self.groups.items() if c.spin and not c.spin.rate}
        return dict(sorted(steady.items(), key=lambda item: abs(item[0].speed)))

    @property
    def run_ups(self) -> dict[Condition, tuple[Record, ...]]:
        """Records whose speed changes."""
        return {c: records for c, records in self.groups.items() if c.spin and c.spin.rate}

    def test(self, record: Record) -> Whirl:
        """Return the motion that a record's probes show, from where the shaft rests, without run-out.

        Parameters
        ----------
        record : Record
            A validation record of kind "spin".
        """
        if record.name not in self._tests:
            whole, turning = measured_whirl(record), record.turning()
            assert turning is not None
            moved = whole if self.run_out is None else without_run_out(whole, self.run_out)
            first, last = turning.marks[0] - 1 / record.fs, turning.marks[-1] + 1 / record.fs
            self._tests[record.name] = moved.between(first, last)
        return self._tests[record.name]

    def placed(self, law: str, record: Record) -> PlacedWhirl:
        """Return the motion of a law less that of its slow turning, as for the test.

        Parameters
        ----------
        law : str
            Its name.
        record : Record
            A validation record of kind "spin".
        """
        placed = self._simulate(law, record)
        if self.slow_roll:
            slow = run_out_of(self._simulate(law, self.slow_roll).motion)
            placed = dataclasses.replace(placed, motion=without_run_out(placed.motion, slow))
        return placed

    def _simulate(self, law: str, record: Record) -> PlacedWhirl:
        study, key = self.study, (law, self.engine, record.name)
        if key not in study.motions:
            study.motions[key] = simulated_whirl(law, study.law(law).model, record, self.engine, study.cache)
        return study.motions[key]

    def orbit_rows(self) -> list[dict[str, Any]]:
        """Return a row per record, bushing and law of `compare_orbits`, of the repeat too."""
        rows = []
        for head, j, gap, test, model, placed in self._compared_pairs(self.speeds):
            errors = compare_orbits(test, model)
            contact_share = np.nan if placed is None else placed.contact_share[j]
            rows.append(head | errors | {"middle_over_gap": errors["middle_m"] / gap, "contact_share": contact_share})
        return rows

    def run_up_rows(self) -> list[dict[str, Any]]:
        """Return a row per run-up, bushing and law of `compare_run_ups`, of the repeat too.

        The onset of contact of the test is where its motion reaches the wall that the law has.
        """
        rows = []
        for head, j, gap, test, model, placed in self._compared_pairs(self.run_ups):
            onsets = {"onset_test_rpm": test, "onset_model_rpm": model}
            onset = {k: onset_of_contact(o, placed.rest[j], gap) if placed else np.nan for k, o in onsets.items()}
            rows.append(head | compare_run_ups(test, model) | onset)
        return rows

    def _compared_pairs(
        self, groups: dict[Condition, tuple[Record, ...]]
    ) -> Iterator[tuple[dict[str, Any], int, float, Orbits, Orbits, PlacedWhirl | None]]:
        """Yield head of the row, bushing, gap, orbits of the test and of the repeat or law, and the law's motion."""
        for condition, records in groups.items():
            for j, bushing in enumerate(self.study.dataset.rig.bushings):
                head = {"record": records[0].name, "spin_rpm": condition.speed, "bushing": j + 1}
                first = self.test(records[0]).orbits(j)
                for other in records[1:2]:
                    again = self.test(other).orbits(j)
                    yield head | dict(zip(("law", "engine"), REPEAT)), j, bushing.gap, first, again, None
                for law in self.study.methods:
                    for record in records:
                        placed = self.placed(law, record)
                        motion = placed.motion
                        test, model = self.test(record).orbits(j), motion.orbits(j)
                        of_law = head | {"record": record.name, "law": law, "engine": self.engine}
                        yield of_law, j, motion.rig.bushings[j].gap, test, model, placed
