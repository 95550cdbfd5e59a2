"""Results of a sweep as labelled arrays: every result over the cases, and what each case was."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr

from ..core.provenance import made_from
from ..version import __version__
from .plan import Plan
from .store import Table

__all__ = ["labelled"]

_RESULTS: dict[str, tuple[tuple[str, ...], dict[str, str]]] = {
    "natural_frequency": (
        ("mode",), {"units": "Hz", "long_name": "natural frequency of the linear rig within the gap"}
    ),
    "acceleration_rms": (("response",), {"units": "m s-2"}),
    "displacement_rms": (("bushing",), {"units": "m"}),
    "contact_share": (("bushing",), {"units": "1", "long_name": "share of the steps in contact, beyond the gap"}),
    "peak_frequency": (
        ("peak",), {"units": "Hz", "long_name": "frequency of the highest peak, root mean square over the sensors"}
    ),
    "peak_magnitude": (("peak",), {"long_name": "highest peak in the band, root mean square over the sensors"}),
    "rmse": (("compared",), {"units": "dB", "long_name": "RMSE of the FRF against the reference"}),
    "frf": (("kept", "frequency", "part"), {"long_name": "frequency response function, real and imaginary part"}),
}  # fmt: skip
"""Dimensions beside the case, and attributes"""


def labelled(plan: Plan, table: Table) -> xr.Dataset:
    """Return a finished table with names, units and labels."""
    rows = table.rows()
    variables: dict[str, Any] = {
        name: (("case", *_RESULTS[name][0]), rows[name], _attributes(plan, name)) for name in plan.shapes
    }
    variables["parameter"] = (("case", "varied"), plan.points, {"long_name": "values of the varied parameters, SI"})
    variables["error"] = ("case", [text.decode(errors="ignore") for text in rows["error"]])
    coordinates = {
        "case": np.arange(len(plan.points), dtype=np.int32),
        "varied": plan.paths,
        "mode": np.arange(1, plan.outputs.natural_frequencies + 1, dtype=np.int32),
    }
    attributes = {"clearance_mj": "sweep", "version": __version__, "plan": json.dumps(plan.to_dict())}
    attributes["provenance"] = json.dumps(made_from(plan.files, "sweep"))
    return xr.Dataset(variables, coordinates | _labels(plan), attributes)


def _labels(plan: Plan) -> dict:
    if (observer := plan.observer) is None:
        return {}
    responses = plan.rig.sensor_labels
    labels = {
        "response": responses,
        "bushing": np.arange(len(plan.rig.bushings), dtype=np.int32),
        "band": ("peak", [f"{low:g}-{high:g} Hz" for low, high in observer.peaks]),
    }
    if observer.reference is not None:
        labels["compared"] = [responses[row] for row in observer.compared]
    if observer.kept:
        labels |= {"kept": [responses[row] for row in observer.kept], "part": ["real", "imag"]}
        labels["frequency"] = ("frequency", observer.frequency, {"units": "Hz"})
    return labels


def _attributes(plan: Plan, name: str) -> dict:
    attributes = _RESULTS[name][1]
    if name not in ("peak_magnitude", "frf"):
        return attributes
    excitation = plan.case(0)[2]
    return {"units": "1" if excitation is not None and excitation.kind == "base" else "m s-2 N-1", **attributes}
