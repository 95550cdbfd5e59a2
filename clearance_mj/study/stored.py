"""A study's entries in the result cache: laws, cases and FRF bands, as files."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ..clearance.law import Law
from ..core.cache import ResultCache, digest, load_arrays, save_arrays
from ..io.dataset import Record
from ..io.results import with_parts, without_parts
from ..model import Model
from ..periodic import Branch, Jump, RattleMap, SpecialPoint
from ..rig import Rig
from ..signals.comparison import Comparison, compare
from ..signals.frf import FRF
from ..statistics.frf_bands import Band
from .identified import IdentifiedModel
from .periodic import PeriodicVibrations

__all__ = ["arrays", "band", "case", "law", "periodic", "record_digest"]


CaseResult = tuple[FRF, Comparison, dict]
"""The model's FRFs, their comparison with the test's, and `contact_statistics`."""


def record_digest(record: Record) -> str:
    """Return the digest of everything that a law or a case takes from a record."""
    response = record.response()
    signals = response.excitation, response.channels, response.displacement, response.spin
    samples = [hashlib.sha256(np.ascontiguousarray(a).tobytes()).hexdigest() for a in signals if a is not None]
    facts = (record.name, record.fs, record.excitation_kind, record.band, record.level, record.tested_rig.content())
    return digest(*facts, *samples)


def law(
    cache: ResultCache | None, name: str, inputs: object, rig: Rig, compute: Callable[[], IdentifiedModel]
) -> IdentifiedModel:
    """Return an identified law from the cache, or compute it; ``rig`` is the rig file's."""

    def save(identified: IdentifiedModel, path: Path) -> None:
        path.write_text(json.dumps(identified.to_dict()))

    def load(path: Path) -> IdentifiedModel:
        return IdentifiedModel.from_dict(json.loads(path.read_text()), rig)

    return compute() if cache is None else cache.get(name, inputs, compute, save, load, ".json")


def case(
    cache: ResultCache | None, name: str, inputs: object, test: FRF, compute: Callable[[], CaseResult]
) -> CaseResult:
    """Return the results of a case from the cache, or compute them."""

    def save(result: CaseResult, path: Path) -> None:
        frf, comparison, statistics = result
        per_mode = {key: column.tolist() for key, column in comparison.per_mode.items()}
        kept = json.dumps({"statistics": statistics, "per_mode": per_mode})
        _to_netcdf(with_parts(frf.to_xarray()).assign_attrs(kept=kept), path)

    def load(path: Path) -> CaseResult:
        with xr.open_dataset(path, engine="scipy") as data:
            frf, kept = FRF.from_xarray(without_parts(data.load())), json.loads(data.attrs["kept"])
        return frf, compare(test, frf, pd.DataFrame(kept["per_mode"])), kept["statistics"]

    return compute() if cache is None else cache.get(name, inputs, compute, save, load)


def band(
    cache: ResultCache | None, name: str, inputs: object, compute: Callable[[], tuple[Band, np.ndarray]]
) -> tuple[Band, np.ndarray]:
    """Return an FRF band and a random error from the cache, or compute them."""
    lines = ("response", "reference", "frequency")

    def save(result: tuple[Band, np.ndarray], path: Path) -> None:
        kept = {"drawn": (("draw", *lines), result[0].drawn), "error": (lines, result[1])}
        if result[0].missed is not None:
            kept["missed"] = lines, result[0].missed
        if result[0].contact is not None:
            kept["contact"] = ("law", "clearance"), result[0].contact
        _to_netcdf(with_parts(result[0].fitted.to_xarray()).assign(kept), path)

    def load(path: Path) -> tuple[Band, np.ndarray]:
        with xr.open_dataset(path, engine="scipy") as data:
            missed, contact = (data[name].values if name in data else None for name in ("missed", "contact"))
            fitted = FRF.from_xarray(without_parts(data.load()))
            return Band(fitted, data["drawn"].values, missed=missed, contact=contact), data["error"].values

    return compute() if cache is None else cache.get(name, inputs, compute, save, load)


def periodic(
    cache: ResultCache | None, name: str, inputs: object, rig: Rig, law: Law, compute: Callable[[], PeriodicVibrations]
) -> PeriodicVibrations:
    """Return the periodic vibrations of a rig with a law from the cache, or compute them."""

    def save(result: PeriodicVibrations, path: Path) -> None:
        parts: list[Branch | RattleMap] = [*result.branches, *([result.map] if result.map else [])]
        fields = [{f.name: getattr(part, f.name) for f in dataclasses.fields(part)} for part in parts]
        arrays: dict[str, Any] = {}
        others = []
        for i, values in enumerate(fields):
            arrays |= {f"{i}.{key}": value for key, value in values.items() if isinstance(value, np.ndarray)}
            others.append({k: v for k, v in values.items() if not isinstance(v, np.ndarray | Model)})
        kept = {"law": result.law, "missing": result.missing, "map": result.map is not None, "parts": others}
        with path.open("wb") as file:
            np.savez(file, kept=json.dumps(kept, default=dataclasses.asdict), **arrays)

    def load(path: Path) -> PeriodicVibrations:
        parts: list[dict[str, Any]] = []
        with np.load(path) as data:
            kept = json.loads(str(data["kept"]))
            for i, values in enumerate(kept["parts"]):
                values |= {key.partition(".")[2]: data[key] for key in data if key.startswith(f"{i}.")}
                parts.append({k: tuple(v) if isinstance(v, list) else v for k, v in values.items()})
        rattle = None
        if kept["map"]:
            values = parts.pop()
            rattle = RattleMap(Model(rig, law), **values | {"jumps": tuple(Jump(*jump) for jump in values["jumps"])})
        for values in parts:
            values["special"] = tuple(SpecialPoint(**point) for point in values["special"])
        branches = tuple(Branch(Model(rig, law), **values) for values in parts)
        return PeriodicVibrations(kept["law"], branches, rattle, kept["missing"])

    return compute() if cache is None else cache.get(name, inputs, compute, save, load, ".npz")


def arrays(
    cache: ResultCache | None, name: str, inputs: object, compute: Callable[[], dict[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """Return named arrays from the cache, or compute them."""
    return compute() if cache is None else cache.get(name, inputs, compute, save_arrays, load_arrays, ".npz")


def _to_netcdf(data: xr.Dataset, path: Path) -> None:
    data.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")
