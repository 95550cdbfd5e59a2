"""Comparison of a model's FRFs with a test's: over frequency, by sensor and by mode."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import RecordError
from ..core.kinds import checks_kinds
from ..core.overview import HasOverview, Overview, few, span
from . import labelled
from .arrays import ArrayData
from .compared_modes import mode_table, paired_modes
from .correlation import csac, csac_per_sensor, csf, csf_per_sensor, frac, mre, rmse_db
from .ema import NO_MODES, Modes
from .frf import FRF
from .frf_error import random_db, why_unknown

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Comparison", "compare", "compare_modes"]

RMSE_REFERENCES = ("random_db", "random_both_db", "repeat_db")
"""Columns by sensor to judge the RMSE by: that of random errors alone, and of a repeat of the test."""
SENSOR_MEASURES = ("csac_per_sensor", "csf_per_sensor")  # measures by sensor and line
TABLES = (("per_sensor", "response", "sensor"), ("per_mode", "mode", "mode"))
"""Field, its dimension, and the column that labels it."""


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(HasOverview, ArrayData):
    """Agreement of the FRFs of a test and a model, over frequency, by sensor and by mode.

    With several references each measured pair of response and reference counts as a sensor, as in `FRF.functions`.
    """

    frequency: np.ndarray
    """(n_f,) Hz"""
    csac: np.ndarray
    """(n_f,), nan of one sensor"""
    csf: np.ndarray
    """(n_f,)"""
    csac_per_sensor: np.ndarray
    """(n_sensors, n_f) windowed variant"""
    csf_per_sensor: np.ndarray
    """(n_sensors, n_f) windowed variant"""
    per_sensor: pd.DataFrame
    """n_sensors rows of sensor (its label), mre, rmse_db, frac; csac and csf: means over the lines of the variant;
    nan for frac and csac where there is one line; random_db: RMSE by the random error of the test alone,
    random_both_db: by those of test and model under independent excitations, repeat_db: of a repeat of the test; nan
    where that is not known"""
    per_mode: pd.DataFrame
    """n_modes rows of mode (from 1), test_hz, model_hz, relative_error, mac, test_damping, model_damping and why; a
    mode without a partner, or hardly extracted, has nan in place of values not there or not compared, and the reason
    in words; rows for which no mode was found are nan; the MAC of one response is nan"""
    random_db: np.ndarray | None = None
    """(n_sensors, n_f) RMS of 20 lg of the test's estimated over its true magnitude that its random error alone makes;
    None: not known"""
    random_words: str = ""
    """source of the random error, or why it is not known"""

    def __post_init__(self) -> None:
        super().__post_init__()
        by_sensor, by_mode = _frame(self.per_sensor), _frame(self.per_mode)
        unknown = {name: np.nan for name in RMSE_REFERENCES if name not in by_sensor}
        words = {} if "why" in by_mode else {"why": ""}
        self._set(per_sensor=by_sensor.assign(**unknown), per_mode=by_mode.assign(**words))

    def summary(self) -> dict[str, float]:
        """Return the means and modes in one flat dict.

        mre, rmse_db, frac, random_db, random_both_db, repeat_db: means over the sensors; csac, csf: over the lines;
        csac_per_sensor, csf_per_sensor: over both; relative_error, mac: over the modes that have a partner;
        mode_1_test_hz and so on for each mode.
        """
        by_sensor = ("mre", "rmse_db", "frac", *RMSE_REFERENCES)
        means = {name: np.mean(self.per_sensor[name].to_numpy()) for name in by_sensor}
        means |= {name: np.mean(getattr(self, name)) for name in ("csac", "csf", *SENSOR_MEASURES)}
        paired = self.per_mode[np.isfinite(self.per_mode["relative_error"])]
        for name in ("relative_error", "mac"):
            means[name] = np.mean(paired[name].to_numpy()) if len(paired) else np.nan
        for name in self.per_mode.columns.drop(["mode", "why"]):
            means |= {f"mode_{mode}_{name}": v for mode, v in zip(self.per_mode["mode"], self.per_mode[name])}
        return {name: float(value) for name, value in means.items()}

    def beside(self) -> str:
        """Return in words what to judge the RMSE by: that of a repeat of the test, and of random errors alone."""
        mean, sentences = self.summary(), list[str]()
        if np.isfinite(mean["repeat_db"]):
            sentences.append(f"a repeat of the test misses it by {mean['repeat_db']:.3g} dB")
        if np.isfinite(mean["random_db"]):
            both = f", those of test and model {mean['random_both_db']:.3g} dB if their excitations are independent"
            known = np.isfinite(mean["random_both_db"])
            sentences.append(
                f"the random error of the test's FRFs alone would be {mean['random_db']:.3g} dB{both if known else ''} "
                f"({self.random_words})"
            )
        else:
            sentences.append(f"the random error of the test's FRFs is {self.random_words or 'not known'}")
        return "; ".join(sentences)

    def _overview(self) -> Overview:
        mean = self.summary()
        sensors = list(self.per_sensor["sensor"])
        facts = {
            "lines": f"{self.frequency.size}: {span(self.frequency, 'Hz')}",
            "sensors": few(sensors),
            "by sensor": f"RMSE {mean['rmse_db']:.3g} dB, MRE {mean['mre']:.3g}, FRAC {mean['frac']:.3f} (means)",
            "by line": f"CSAC {mean['csac']:.3f}, CSF {mean['csf']:.3f} (means)",
            "beside RMSE": self.beside(),
        }
        head = ("mode", "test (Hz)", "model (Hz)", "difference (%)", "MAC", "test damping (%)", "model damping (%)")
        forms = (("test_hz", 1, ".2f"), ("model_hz", 1, ".2f"), ("relative_error", 100, ".2f"), ("mac", 1, ".3f"),
                 ("test_damping", 100, ".2f"), ("model_damping", 100, ".2f"))  # fmt: skip
        rows = []
        for _, row in self.per_mode.iterrows():
            cells = [f"{scale * row[name]:{form}}" if np.isfinite(row[name]) else "–" for name, scale, form in forms]
            rows += [(f"{row['mode']:.0f}", *cells)] if set(cells) != {"–"} else []
        return Overview(f"Comparison of FRFs at {len(sensors)} sensors", facts, [head, *rows] if rows else ())

    def plot(self) -> Figure:
        """Draw CSAC and CSF over frequency, with the test's modes, and all measures by sensor."""
        from .figures import comparison_figure

        return comparison_figure(self.correlation, self.per_sensor)

    @property
    def correlation(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, pd.Series]:
        """Lines, Hz, CSAC and CSF at them, (n,) each, and the natural frequencies of the test, Hz, nan if unknown."""
        return self.frequency, self.csac, self.csf, self.per_mode["test_hz"]

    def to_xarray(self) -> xr.Dataset:
        """Return the measures over frequency, response and mode, with labels and units.

        ``csac``, ``csf`` (frequency,), ``csac_per_sensor``, ``csf_per_sensor`` (response, frequency), and the columns
        of the tables: ``per_sensor_mre`` (response,), ``per_mode_test_hz`` (mode,) and so on.
        """
        variables: dict[str, Any] = {name: ("frequency", getattr(self, name), "1") for name in ("csac", "csf")}
        variables |= {name: (("response", "frequency"), getattr(self, name), "1") for name in SENSOR_MEASURES}
        for table, axis, head in TABLES:
            for name, column in getattr(self, table).drop(columns=head).items():
                units = "" if name == "why" else "Hz" if name.endswith("_hz") else "dB" if name.endswith("_db") else "1"
                variables[f"{table}_{name}"] = (axis, column.to_numpy(), units)
        variables["random_db"] = (("response", "frequency"), self.random_db, "dB")
        labels = {"response": self.per_sensor["sensor"], "mode": self.per_mode["mode"], "frequency": self.frequency}
        return labelled.dataset("comparison", variables, labels, {"random_words": self.random_words})

    @classmethod
    def from_xarray(cls, ds: xr.Dataset) -> Comparison:
        """Return the comparison of a dataset that `to_xarray` made; refuses others.

        Parameters
        ----------
        ds : xarray.Dataset
            The dataset.
        """
        labelled.require_kind(ds, "comparison")
        fields: dict[str, Any] = {name: labelled.values(ds, name, "frequency") for name in ("frequency", "csac", "csf")}
        fields |= {name: labelled.values(ds, name, "response", "frequency") for name in SENSOR_MEASURES}
        for table, axis, head in TABLES:
            first = labelled.labels(ds, axis) if axis == "response" else ds.get("mode", np.empty(0, dtype=int))
            columns = {str(name): ds[name].values for name in ds.data_vars if str(name).startswith(f"{table}_")}
            fields[table] = _frame({head: first} | {name[len(table) + 1 :]: v for name, v in columns.items()})
        if "random_db" in ds:
            fields["random_db"] = labelled.values(ds, "random_db", "response", "frequency")
        return cls(**fields, random_words=str(ds.attrs.get("random_words", "")))


@checks_kinds
def compare(
    test_frf: FRF, model_frf: FRF, per_mode: pd.DataFrame | None = None, repeat: FRF | None = None
) -> Comparison:  # fmt: skip
    """Compare the FRFs of a model with those of a test on the same lines and responses, over frequency and by sensor.

    Measures that are 1 by definition come out as nan: CSAC and MAC of one response, FRAC of one line. FRFs that were
    estimated from noise miss each other by their random errors even where rig and model are the same: the RMSE is
    given with that of these alone, if coherence and averages are known, and with that of a repeat of the test.

    Parameters
    ----------
    test_frf, model_frf : FRF
        Estimated in the same way; nothing is interpolated.
    per_mode : DataFrame, optional
        Table of modes, as `compare_modes` returns, of the comparison; without, it has no modes.
    repeat : FRF, optional
        The test's FRFs once more, from another record of the same level.

    Raises
    ------
    RecordError
        If the lines, the responses or the quantities differ.
    """
    _require_same(test_frf, model_frf)
    per_mode = mode_table(test_frf, model_frf, (NO_MODES, NO_MODES, []), 0) if per_mode is None else per_mode
    test, model = test_frf.functions, model_frf.functions
    if test_frf.quantities:  # shapes and levels across sensors in units of each one's RMS
        test, model = (functions / _rms(np.abs(test))[:, None] for functions in (test, model))
    n_sensors, n_f = test.shape
    # What is 1 by definition says nothing.
    by_line = csac(test, model) if n_sensors > 1 else np.full(n_f, np.nan)
    variant_csac = csac_per_sensor(test, model) if n_f > 1 else np.full((n_sensors, 1), np.nan)
    variant_csf = csf_per_sensor(test, model)
    per_sensor = {
        "sensor": test_frf.labels, "mre": mre(test, model), "rmse_db": rmse_db(test, model),
        "frac": frac(test, model) if n_f > 1 else np.full(n_sensors, np.nan),
        "csac": variant_csac.mean(axis=1), "csf": variant_csf.mean(axis=1),
    }  # fmt: skip
    by_line_db, words = _random_error(test_frf)
    model_db, _ = _random_error(model_frf)
    if by_line_db is not None:
        per_sensor["random_db"] = _rms(by_line_db)
    if by_line_db is not None and model_db is not None:
        per_sensor["random_both_db"] = _rms(np.hypot(by_line_db, model_db))
    if repeat is not None:
        _require_same(test_frf, repeat)
        per_sensor["repeat_db"] = rmse_db(test, repeat.functions)
    return Comparison(
        test_frf.frequency, by_line, csf(test, model), variant_csac, variant_csf, _frame(per_sensor), per_mode,
        by_line_db, words,
    )  # fmt: skip


def _random_error(frf: FRF) -> tuple[np.ndarray | None, str]:
    """Return the RMS level (n_functions, n_f), dB, that the random error alone makes, and its source in words."""
    if unknown := why_unknown(frf):
        return None, f"not known: there is {unknown}"
    error = dataclasses.replace(frf, value=random_db(frf), coherence=None).functions.real
    return error, f"from coherence and {frf.averages:.3g} averages"


def _rms(values: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt(np.mean(values**2, axis=-1)))


@checks_kinds
def compare_modes(test_frf: FRF, model_frf: FRF, n_modes: int = 4, test_modes: Modes | None = None) -> pd.DataFrame:
    """Extract the modes of a test's and of a model's FRFs, and pair them one to one by MAC and frequency.

    Poles of one peak are joined (`compared_modes.distinct_modes`). A mode that is hardly extracted is not compared.

    Parameters
    ----------
    test_frf, model_frf : FRF
        FRFs of the same lines and responses.
    n_modes : int
        Number of rows; where fewer modes are found, the rest is nan. 0: none are looked for.
    test_modes : Modes, optional
        The test's, of which there is a row each and no other; by default they are extracted.

    Returns
    -------
    DataFrame
        `Comparison.per_mode`.

    Raises
    ------
    RecordError
        If the lines, the responses or the quantities differ, or if modes cannot be looked for (a line is not finite,
        too few lines).
    """
    _require_same(test_frf, model_frf)
    modes = paired_modes(test_frf, model_frf, n_modes, test_modes) if n_modes else (NO_MODES, NO_MODES, [])
    return mode_table(test_frf, model_frf, modes, n_modes, only_test=test_modes is not None)


def _frame(data: dict[str, Any] | pd.DataFrame) -> pd.DataFrame:
    """Return a table; pandas is loaded with the first."""
    import pandas as pd

    return pd.DataFrame(data)


def _require_same(test_frf: FRF, model_frf: FRF) -> None:
    if test_frf.row_quantities != model_frf.row_quantities:
        raise RecordError(f"the test's FRF is {test_frf.quantity}, the model's {model_frf.quantity}")
    if test_frf.labels != model_frf.labels:
        of_test, of_model = (", ".join(frf.labels) for frf in (test_frf, model_frf))
        raise RecordError(f"the test's responses are {of_test}; the model's are {of_model}")
    lines = test_frf.frequency, model_frf.frequency
    if lines[0].shape != lines[1].shape or not np.allclose(*lines, rtol=1e-9, atol=0):
        raise RecordError("the test has {}; the model has {}".format(*map(_grid, lines)))


def _grid(frequency: np.ndarray) -> str:
    return f"{frequency.size} lines from {frequency[0]:.9g} to {frequency[-1]:.9g} Hz"
