"""The numbers of a study as files: laws, every FRF, summary."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..core.files import replacing, to_json, write_text
from ..core.provenance import made_from
from ..io.results import with_parts
from ..periodic.summaries import of_branch, of_map
from ..signals.frf import FRF
from ..statistics.intervals import CONFIDENCE
from ..version import __version__
from .matrices import matrix_rows
from .periodic import amplitude_error
from .study import Study
from .turning import TurningComparison

__all__ = ["study_summary", "write_results"]


def write_results(study: Study, folder: Path) -> None:
    """Write ``laws/``, ``results.nc`` (FRFs of test and models) and ``summary.json``.

    A law with a separate rig stands next to its rig file: ``laws/bench.json``, ``laws/bench_rig.toml``.

    Parameters
    ----------
    study : Study
        The study.
    folder : Path
        Folder that is written to.
    """
    provenance = made_from([study.dataset.path] if study.dataset.path else [], "study")
    for law in study.laws:
        write_text(folder / "laws" / f"{law.name}.json", to_json(law.law.to_dict() | {"provenance": provenance}))
        if law.finds_rig:
            law.rig.copied(folder / "laws" / "structure").save(folder / "laws" / f"{law.name}_rig.toml")
    models = [_dataset(c.frf).expand_dims(law=[c.law], engine=[c.engine], record=[c.record.name]) for c in study.cases]
    tests = [_dataset(frf).expand_dims(record=[name]) for name, frf in study.tests.items()]
    # Records may have different bands: lines that one lacks are nan.
    together: dict[str, Any] = {"join": "outer", "compat": "no_conflicts", "combine_attrs": "override"}
    every = together | {"data_vars": "all", "coords": "different"}
    combined = xr.combine_by_coords(models, **every).rename(value="model", coherence="model_coherence")
    measured = xr.concat(tests, "record", **every).rename(value="test", coherence="test_coherence")
    origin = {"rig": json.dumps(study.dataset.rig.to_dict()), "version": __version__}
    combined = xr.merge((combined, measured), **together).assign_attrs(origin, provenance=json.dumps(provenance))
    with replacing(folder / "results.nc") as temporary:
        combined.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
    write_text(folder / "summary.json", to_json(study_summary(study) | {"provenance": provenance}))


def _dataset(frf: FRF) -> xr.Dataset:
    """Return FRFs with a coherence, of nan where records have one segment only."""
    dataset = with_parts(frf.to_xarray())
    nothing = xr.full_like(dataset["value"].isel(part=0, drop=True), np.nan).assign_attrs(units="1")
    return dataset if "coherence" in dataset else dataset.assign(coherence=nothing)


def study_summary(study: Study) -> dict:
    """Return laws, rows and statistics of a study as plain data.

    Parameters
    ----------
    study : Study
        The study.
    """
    return {
        "version": __version__, "dataset": str(study.dataset.path), "rig": study.dataset.rig.name,
        "synthetic": study.is_synthetic,
        "laws": [
            {"name": k.name, "knows": k.prior_information, "simulated_on": k.simulated_on,
             "rig": k.rig.to_dict() if k.finds_rig else None, "law": k.law.to_dict(),
             "parameters": list(k.parameters), "families": list(k.families), "warnings": list(k.warnings)}
            for k in study.laws
        ],
        "left_out": [{"method": name, "why": why} for name, why in study.left_out.items()],
        "modes_left_out": [
            part.columns | {"level": level, "why": why}
            for part in study.parts
            for level, modes in part.level_modes.items()
            for why in modes.left_out
        ],
        "best_law": study.best_law, "identified_from": [r.name for r in study.dataset.identify],
        "validated_on": [r.name for r in study.dataset.validate],
        "results": study.rows(), "confidence": CONFIDENCE, "seed_scatter": study.scatter_rows(),
        "statistics": [
            part.columns
            | {"law": c.law, "engine": c.engine, "record": c.record.name, "level": c.record.level, **c.statistics}
            for part in study.parts
            for c in part.simulated()
        ],
        "periodic": _periodic_summary(study),
    } | _in_space(study)  # fmt: skip


def _in_space(study: Study) -> dict:
    """Return the further results of a study in space: FRF matrices, orbits and run-ups."""
    if not study.dataset.rig.moves_across:
        return {}
    turning = TurningComparison(study)
    return {"frf_matrices": matrix_rows(study), "orbits": turning.orbit_rows(), "run_ups": turning.run_up_rows()}


def _periodic_summary(study: Study) -> dict:
    periodic = study.periodic
    return {
        "law": periodic.law,
        "missing": periodic.missing,
        "branches": [of_branch(branch) for branch in periodic.branches],
        "rattle_map": periodic.map and of_map(periodic.map),
        "stepped_sines": [
            {"record": name}
            | {key: getattr(steps, key).tolist() for key in ("frequency", "level", "upwards", "acceleration")}
            | {"missed": amplitude_error(periodic.branches, steps).tolist() if periodic.branches else None}
            for name, steps in study.sine_steps.items()
        ],
    }
