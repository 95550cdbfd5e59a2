"""The model of the page, without any web in it: settings in, the numbers of figures out."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..engines import get_engine
from ..engines.simulation import Simulation
from ..io.dataset import Dataset
from ..model import Model
from ..report.style import sensor_title
from ..signals.correlation import csac, rmse_db
from ..signals.frf import FRF, estimate_frf
from ..signals.response import Response
from . import figures
from .control import Control, Value
from .controls import NONE, RECORD, build_model, checked_values, controls
from .excite import make_excitation, record_named
from .figures import Numbers

__all__ = ["Session", "SettingResult", "Watch"]

Watch = Callable[[float], None]  # receives the fraction done, 0 to 1; an error that it raises ends the computation
SEGMENTED = ("burst random", "multisine", "impacts")
"""excitations of which every segment holds a period, so that no window is needed"""


@dataclass(frozen=True, eq=False)
class SettingResult:
    """Results of a setting."""

    values: dict[str, Value]  #: the setting
    model: Model  #: with these values
    response: Response  #: of the simulation
    frf: FRF | None  #: estimated from it; None under a single sine or nothing

    @property
    def seen(self) -> Response:
        """The response with displacements as they are drawn: in space from the middles of the bushings."""
        return figures.places(self.model.rig, self.response)


class Session:
    """The settings and results of one user; sessions of one rig have no changing state in common.

    Parameters
    ----------
    model : Model
        The identified model.
    dataset : Dataset, optional
        Records to lay over the figures and to drive the rig with.

    Raises
    ------
    ClearanceError
        If the law does not fit the rig.
    """

    def __init__(self, model: Model, dataset: Dataset | None = None) -> None:
        model.law.table(len(model.rig.bushings))
        self.model, self.rig, self.dataset = model, model.rig, dataset
        self.controls: dict[str, Control] = {c.name: c for c in controls(model, dataset)}
        self.shown: SettingResult | None = None

    @property
    def identified(self) -> dict[str, Value]:
        """The setting in which rig and law were given."""
        return {name: control.value for name, control in self.controls.items()}

    def setting(self, changes: Mapping[str, Any]) -> dict[str, Value]:
        """Return the identified setting with changes.

        Parameters
        ----------
        changes : mapping
            New values of controls by their names.

        Raises
        ------
        ClearanceError
            For a name that no control has, or a value that it cannot have.
        """
        return self.identified | checked_values(self.controls, changes)

    def simulated(self, values: Mapping[str, Value], watch: Watch = lambda share: None) -> SettingResult:
        """Return response and FRFs of a setting, by `simulate` and `estimate_frf` with its rig, law and excitation.

        Parameters
        ----------
        values : mapping
            Values of the controls, as `setting` returns them.
        watch : callable
            Receives the fraction that is done.

        Raises
        ------
        ClearanceError
            For impossible values, or a simulation that diverges.
        """
        model = build_model(self.model, values)
        excitation = make_excitation(model.rig, values, self.dataset)
        response = Simulation(model.rig, excitation, model.law, get_engine(str(values["engine"]))).whole(watch)
        return SettingResult(dict(values), model, response, _estimate_frf(response, values))

    def show(self, values: Mapping[str, Value], watch: Watch = lambda share: None) -> Numbers:
        """Simulate a setting and return the numbers of all figures.

        Parameters
        ----------
        values, watch
            As in `simulated`, whose errors it raises.
        """
        began = time.perf_counter()
        shown = self.simulated(values, watch)
        rig, response = shown.model.rig, shown.response
        numbers = Numbers({"values": shown.values, "kind": response.kind, "duration": response.duration})
        numbers.add(figures.spectrum(response) if shown.frf is None else figures.frf_numbers(shown.frf))
        numbers.add(figures.history(shown.seen))
        numbers.add(figures.motion(rig, shown.seen))
        numbers.add(figures.shaft(rig, response))
        self.shown, step, natural = shown, response.provenance["step"], figures.frequencies_in_gap(shown.model)
        numbers.facts |= {"natural": natural, "step": step, "seconds": time.perf_counter() - began}
        return numbers

    def window(self, first: float, last: float) -> Numbers:
        """Return the displacements of the last simulation between two times, s, as finely as can be drawn.

        Parameters
        ----------
        first, last : float
            First and last moment, s.
        """
        return Numbers() if self.shown is None else figures.history(self.shown.seen, first, last)

    def overlay(self, name: str, resolution: float) -> Numbers:
        """Return the FRFs of a record of the dataset, and how near those of the last simulation are to them.

        Parameters
        ----------
        name : str
            Name of the record.
        resolution : float
            Distance of the lines, Hz.

        Raises
        ------
        ClearanceError
            If the dataset has no record of this name, or it is too short.
        """
        test = self.record_frf(name, resolution)
        numbers = figures.frf_numbers(test, "test_")
        rows = {label: i for i, label in enumerate(test.responses)}
        order = [rows.get(label, -1) for label in self.rig.sensor_labels]
        for key in ("test_magnitude", "test_phase", "test_coherence"):
            if key in numbers.arrays:
                numbers.arrays[key] = np.where(np.array(order)[:, None] < 0, np.nan, numbers.arrays[key][order])
        numbers.facts["record"] = name
        model = self.shown.frf if self.shown else None
        same = model is not None and (model.responses, model.reference) == (test.responses, test.reference)
        if model is not None and same and np.array_equal(model.frequency, test.frequency):
            pair = test.value[:, 0], model.value[:, 0]
            numbers.facts["agreement"] = {"rmse_db": rmse_db(*pair).tolist(), "csac": float(np.mean(csac(*pair)))}
        return numbers

    def record_frf(self, name: str, resolution: float) -> FRF:
        """Return the FRFs of a record of the dataset; a ClearanceError says why not.

        Parameters
        ----------
        name, resolution
            As in `overlay`.
        """
        return _of_record(self.dataset, name, resolution)

    def described(self) -> dict[str, Any]:
        """Return what a page needs once: the controls and the names of everything; plain data."""
        return {
            "rig": self.rig.name, "description": self.rig.description, "law": self.model.law.kind,
            "controls": [vars(control) for control in self.controls.values()],
            "sensors": [sensor_title(self.rig, i) for i in range(len(self.rig.sensors))],
            "clearances": [f"clearance {i + 1}, {b.where}" for i, b in enumerate(self.rig.bushings)],
            "rows": figures.names(self.rig), "orbits": figures.orbits(self.rig),
            "records": [r.name for r in self.dataset.records] if self.dataset else [], "record_prefix": RECORD,
        }  # fmt: skip


def _estimate_frf(response: Response, values: Mapping[str, Value]) -> FRF | None:
    if values["excitation"] in ("sine", NONE):
        return None
    resolution = float(values["resolution"])
    if values["excitation"] in SEGMENTED:
        return estimate_frf(response, resolution=resolution, overlap=0.0, window="boxcar")
    return estimate_frf(response, resolution=resolution)


@functools.lru_cache(maxsize=64)
def _of_record(dataset: Dataset | None, name: str, resolution: float) -> FRF:
    return estimate_frf(record_named(dataset, name).response(), resolution=resolution)
