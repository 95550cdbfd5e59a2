"""Comparison of a model's FRFs with a test's: over frequency, by sensor and by mode."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.optimize

from ..core.errors import RecordError
from ..core.kinds import checks_kinds
from ..core.overview import Overview, Shown, few, span
from . import labelled
from .arrays import ArrayData, read_only
from .correlation import csac, csac_per_sensor, csf, csf_per_sensor, frac, mac, mre, relative_error, rmse_db
from .ema import NO_MODES, Modes, extract_modes
from .frf import FRF

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["Comparison", "compare", "compare_modes", "mac_of_modes"]

FREQUENCY_SCALE = 0.15  # relative difference in frequency at which two modes are e^-½ times as likely to be one
MIN_AFFINITY = 0.05
SENSOR_MEASURES = ("csac_per_sensor", "csf_per_sensor")  # measures by sensor and line
TABLES = (("per_sensor", "response", "sensor"), ("per_mode", "mode", "mode"))
"""Field, its dimension, and the column that labels it."""


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Shown, ArrayData):
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
    nan for frac and csac where there is one line"""
    per_mode: pd.DataFrame
    """n_modes rows of mode (from 1), test_hz, model_hz, relative_error, mac, test_damping, model_damping; a mode
    without a partner has nan in place of what is not there, and so have rows for which no mode was found; the MAC of
    one response is nan"""

    def __post_init__(self) -> None:
        self._set(**{name: read_only(getattr(self, name)) for name in ("frequency", "csac", "csf", *SENSOR_MEASURES)})
        self._set(per_sensor=_frame(self.per_sensor), per_mode=_frame(self.per_mode))

    def summary(self) -> dict[str, float]:
        """Return the means and modes in one flat dict.

        mre, rmse_db, frac: means over the sensors; csac, csf: over the lines; csac_per_sensor, csf_per_sensor: over
        both; relative_error, mac: over the modes that have a partner; mode_1_test_hz and so on for each mode.
        """
        found = {name: np.mean(self.per_sensor[name].to_numpy()) for name in ("mre", "rmse_db", "frac")}
        found |= {name: np.mean(getattr(self, name)) for name in ("csac", "csf", *SENSOR_MEASURES)}
        paired = self.per_mode[np.isfinite(self.per_mode["relative_error"])]
        for name in ("relative_error", "mac"):
            found[name] = np.mean(paired[name].to_numpy()) if len(paired) else np.nan
        for name in self.per_mode.columns.drop("mode"):
            found |= {f"mode_{mode}_{name}": v for mode, v in zip(self.per_mode["mode"], self.per_mode[name])}
        return {name: float(value) for name, value in found.items()}

    def _overview(self) -> Overview:
        mean = self.summary()
        sensors = list(self.per_sensor["sensor"])
        facts = {
            "lines": f"{self.frequency.size}: {span(self.frequency, 'Hz')}",
            "sensors": few(sensors),
            "by sensor": f"RMSE {mean['rmse_db']:.3g} dB, MRE {mean['mre']:.3g}, FRAC {mean['frac']:.3f} (means)",
            "by line": f"CSAC {mean['csac']:.3f}, CSF {mean['csf']:.3f} (means)",
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

        return comparison_figure(self)

    def to_xarray(self) -> xr.Dataset:
        """Return the measures over frequency, response and mode, with labels and units.

        ``csac``, ``csf`` (frequency,), ``csac_per_sensor``, ``csf_per_sensor`` (response, frequency), and the columns
        of the tables: ``per_sensor_mre`` (response,), ``per_mode_test_hz`` (mode,) and so on.
        """
        variables: dict[str, Any] = {name: ("frequency", getattr(self, name), "1") for name in ("csac", "csf")}
        variables |= {name: (("response", "frequency"), getattr(self, name), "1") for name in SENSOR_MEASURES}
        for table, axis, head in TABLES:
            for name, column in getattr(self, table).drop(columns=head).items():
                units = "Hz" if name.endswith("_hz") else "dB" if name.endswith("_db") else "1"
                variables[f"{table}_{name}"] = (axis, column.to_numpy(), units)
        labels = {"response": self.per_sensor["sensor"], "mode": self.per_mode["mode"]}
        return labelled.dataset("comparison", variables, labels | {"frequency": self.frequency})

    @classmethod
    def from_xarray(cls, ds: xr.Dataset) -> Comparison:
        """Return the comparison of a dataset that `to_xarray` made; refuses others.

        Parameters
        ----------
        ds : xarray.Dataset
            The dataset.
        """
        labelled.require_kind(ds, "comparison")
        found: dict[str, Any] = {name: labelled.values(ds, name, "frequency") for name in ("frequency", "csac", "csf")}
        found |= {name: labelled.values(ds, name, "response", "frequency") for name in SENSOR_MEASURES}
        for table, axis, head in TABLES:
            first = labelled.labels(ds, axis) if axis == "response" else ds.get("mode", np.empty(0, dtype=int))
            columns = {str(name): ds[name].values for name in ds.data_vars if str(name).startswith(f"{table}_")}
            found[table] = _frame({head: first} | {name[len(table) + 1 :]: v for name, v in columns.items()})
        return cls(**found)


@checks_kinds
def compare(test_frf: FRF, model_frf: FRF, per_mode: pd.DataFrame | None = None) -> Comparison:
    """Compare the FRFs of a model with those of a test on the same lines and responses, over frequency and by sensor.

    Measures that are 1 by definition come out as nan: CSAC and MAC of one response, FRAC of one line.

    Parameters
    ----------
    test_frf, model_frf : FRF
        Estimated in the same way; nothing is interpolated.
    per_mode : DataFrame, optional
        Table of modes, as `compare_modes` returns, to go into the comparison; without, it has no modes.

    Raises
    ------
    RecordError
        If the lines, the responses or the quantities differ.
    """
    _require_same(test_frf, model_frf)
    per_mode = _mode_table(NO_MODES, NO_MODES, [], 0) if per_mode is None else per_mode
    test, model = test_frf.functions, model_frf.functions
    n_sensors, n_f = test.shape
    # What is 1 by definition says nothing.
    by_line = csac(test, model) if n_sensors > 1 else np.full(n_f, np.nan)
    variant_csac = csac_per_sensor(test, model) if n_f > 1 else np.full((n_sensors, 1), np.nan)
    variant_csf = csf_per_sensor(test, model)
    per_sensor = {
        "sensor": test_frf.labels,
        "mre": mre(test, model),
        "rmse_db": rmse_db(test, model),
        "frac": frac(test, model) if n_f > 1 else np.full(n_sensors, np.nan),
        "csac": variant_csac.mean(axis=1),
        "csf": variant_csf.mean(axis=1),
    }
    by_sensor = _frame(per_sensor)
    return Comparison(test_frf.frequency, by_line, csf(test, model), variant_csac, variant_csf, by_sensor, per_mode)


@checks_kinds
def compare_modes(test_frf: FRF, model_frf: FRF, n_modes: int = 4) -> pd.DataFrame:
    """Extract the modes of a test's and of a model's FRFs, and pair them one to one by MAC and frequency.

    Parameters
    ----------
    test_frf, model_frf : FRF
        FRFs of the same lines and responses.
    n_modes : int
        Number of rows; where fewer modes are found, the rest is nan. 0: none are looked for.

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
    modes = _paired_modes(test_frf, model_frf, n_modes) if n_modes else (NO_MODES, NO_MODES, [])
    return _mode_table(*modes, n_modes)


def _frame(data: dict[str, Any] | pd.DataFrame) -> pd.DataFrame:
    """A table; pandas is loaded with the first."""
    import pandas as pd

    return pd.DataFrame(data)


def mac_of_modes(a: Modes, b: Modes) -> np.ndarray:
    """MAC (n_a, n_b) of each mode of one set with each of another; nan for one response, whose MAC is always 1."""
    if a.shape.shape[0] < 2:
        return np.full((a.frequency.size, b.frequency.size), np.nan)
    return mac(a.shape, b.shape)


def _require_same(test_frf: FRF, model_frf: FRF) -> None:
    if test_frf.quantity != model_frf.quantity:
        raise RecordError(f"the test's FRF is {test_frf.quantity}, the model's {model_frf.quantity}")
    if test_frf.labels != model_frf.labels:
        of_test, of_model = (", ".join(frf.labels) for frf in (test_frf, model_frf))
        raise RecordError(f"the test's responses are {of_test}; the model's are {of_model}")
    lines = test_frf.frequency, model_frf.frequency
    if lines[0].shape != lines[1].shape or not np.allclose(*lines, rtol=1e-9, atol=0):
        raise RecordError("the test has {}; the model has {}".format(*map(_grid, lines)))


def _grid(frequency: np.ndarray) -> str:
    return f"{frequency.size} lines from {frequency[0]:.9g} to {frequency[-1]:.9g} Hz"


Pairs = list[tuple[int, int]]  # numbers of the modes of test and model that are one


def _paired_modes(test_frf: FRF, model_frf: FRF, n_modes: int) -> tuple[Modes, Modes, Pairs]:
    """Modes of test and model, and the pairs of their numbers.

    Where a strong mode of the test has no partner among as many of the model, twice as many are looked at: it may be
    a weaker one there.
    """
    test, model = _modes_once(test_frf, n_modes), extract_modes(model_frf, n_modes)
    pairs = _pairs(test, model)
    if len(pairs) == test.frequency.size:
        return test, model, pairs
    more = extract_modes(model_frf, 2 * n_modes)
    more_pairs = _pairs(test, more)
    return (test, more, more_pairs) if len(more_pairs) > len(pairs) else (test, model, pairs)


@functools.lru_cache(maxsize=32)
def _modes_once(frf: FRF, n_modes: int) -> Modes:
    """Modes of a test, which is compared with many models; equal FRFs have equal modes."""
    return extract_modes(frf, n_modes)


def _pairs(test: Modes, model: Modes) -> Pairs:
    """One-to-one pairs with the largest sum of √MAC times a Gaussian of the frequency ratio's logarithm.

    Frequency keeps modes apart whose shapes the few sensors cannot, MAC those that are close.
    """
    ratio = np.log(model.frequency / test.frequency[:, None])
    affinity = np.sqrt(mac(test.shape, model.shape)) * np.exp(-0.5 * (ratio / FREQUENCY_SCALE) ** 2)
    rows, columns = scipy.optimize.linear_sum_assignment(affinity, maximize=True)
    return [(int(i), int(j)) for i, j in zip(rows, columns) if affinity[i, j] >= MIN_AFFINITY]


def _mode_table(test: Modes, model: Modes, pairs: Pairs, n_modes: int) -> pd.DataFrame:
    """n_modes rows: the test's modes, then the model's that have no partner, by frequency; then nan."""
    partner = dict(pairs)
    rows = [(i, partner.get(i, -1)) for i in range(test.frequency.size)]
    rows += [(-1, j) for j in range(model.frequency.size) if j not in partner.values()]
    rows += [(-1, -1)] * n_modes
    of_test, of_model = np.array(rows[:n_modes], dtype=int).reshape(-1, 2).T
    test_hz, model_hz = np.append(test.frequency, np.nan)[of_test], np.append(model.frequency, np.nan)[of_model]
    table = _frame(
        {
            "test_hz": test_hz,
            "model_hz": model_hz,
            "relative_error": relative_error(test_hz, model_hz),
            "mac": np.pad(mac_of_modes(test, model), (0, 1), constant_values=np.nan)[of_test, of_model],
            "test_damping": np.append(test.damping, np.nan)[of_test],
            "model_damping": np.append(model.damping, np.nan)[of_model],
        }
    )
    order = np.argsort(np.where(np.isnan(test_hz), model_hz, test_hz))
    return table.iloc[order].reset_index(drop=True).assign(mode=np.arange(1, n_modes + 1))[["mode", *table]]
