"""FRF matrices of a study in space: FRFs to a base or force along y and along z, at one level and spin, together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..signals.comparison import compare
from ..signals.correlation import rmse_db
from ..signals.directional import DirectionalFRF, directional_frfs
from ..signals.frf import FRF
from ..signals.references import join_references
from .study import Study

__all__ = ["FRFMatrices", "anisotropy", "matrices_of", "matrix_rows"]

REPEAT = ("repeat", "rig")


@dataclass(frozen=True, eq=False)
class FRFMatrices:
    """FRF matrices of test, repeat and laws at one level and spin."""

    kind: str
    """of the excitation, "base" or "force" """
    spin_rpm: float
    """rev/min"""
    level: float
    """RMS, m/s² or N"""
    test: FRF
    """(n_sensors, 2, n_f) to y and to z"""
    repeat: FRF | None
    """of the second records of both directions"""
    models: dict[str, FRF]
    """by law, on the study's main engine"""

    @property
    def frfs(self) -> dict[str, FRF]:
        """FRFs of "repeat", if there is one, "test" and each law."""
        return ({} if self.repeat is None else {REPEAT[0]: self.repeat}) | {"test": self.test} | self.models

    @property
    def directional(self) -> dict[str, DirectionalFRF]:
        """Directional FRFs of "test", "repeat", if there is one, and each law."""
        return {name: directional_frfs(frf) for name, frf in self.frfs.items()}


def matrices_of(study: Study) -> list[FRFMatrices]:
    """Return the FRF matrices of every level and spin at which the rig was driven along y and along z.

    Parameters
    ----------
    study : Study
        Of a rig in space.
    """
    pairs: dict[tuple[str, float], dict[str, Study]] = {}
    for part in study.parts:
        if part.condition:
            pairs.setdefault((part.condition.kind, part.condition.speed), {})[part.condition.direction] = part
    results = []
    for (kind, speed), along in pairs.items():
        if set(along) >= {"y", "z"}:
            y, z = along["y"], along["z"]
            results += [_matrices(kind, speed, level, (y, z)) for level in sorted(set(y.levels) & set(z.levels))]
    return results


def _matrices(kind: str, speed: float, level: float, parts: tuple[Study, ...]) -> FRFMatrices:
    of_record = [[part.test(record) for record in part.records(level)] for part in parts]
    repeat = join_references([tests[1] for tests in of_record]) if all(tests[1:] for tests in of_record) else None
    engine = parts[0].main_engine
    models = {law: join_references([part.case(law, engine, level).frf for part in parts]) for law in parts[0].methods}
    return FRFMatrices(kind, speed, level, join_references([tests[0] for tests in of_record]), repeat, models)


def matrix_rows(study: Study) -> list[dict[str, Any]]:
    """Return a row per level, spin and law: measures of the whole matrix, and of its directional FRFs.

    ``normal_db`` and ``reverse_db`` are RMSE of the magnitudes of normal and reverse directional FRFs, means over the
    nodes; ``anisotropy`` and ``anisotropy_test`` are the RMS of the reverse over that of the normal ones.

    Parameters
    ----------
    study : Study
        Of a rig in space.
    """
    rows = []
    for matrices in matrices_of(study):
        directional = matrices.directional
        test = directional.pop("test")
        for law, model in directional.items():
            summary = compare(matrices.test, matrices.frfs[law]).summary()
            engine = REPEAT[1] if law == REPEAT[0] else study.main_engine
            head = {"spin_rpm": matrices.spin_rpm, "level": matrices.level, "law": law, "engine": engine}
            rows.append(head | {key: summary[key] for key in ("rmse_db", "frac", "csac", "csf", "mre", "random_db")} | {
                "normal_db": float(np.mean(rmse_db(test.normal, model.normal))),
                "reverse_db": float(np.mean(rmse_db(test.reverse, model.reverse))),
                "anisotropy_test": anisotropy(test), "anisotropy": anisotropy(model),
            })  # fmt: skip
    return rows


def anisotropy(frf: DirectionalFRF) -> float:
    """Return the RMS of the reverse directional FRFs over that of the normal ones: 0 where y and z are alike.

    Parameters
    ----------
    frf : DirectionalFRF
        Of test or model.
    """
    return float(np.sqrt(np.mean(np.abs(frf.reverse) ** 2) / np.mean(np.abs(frf.normal) ** 2)))
