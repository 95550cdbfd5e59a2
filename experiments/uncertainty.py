"""Uncertainty: FRF bands from the covariance of identified laws, beside records that no identification has seen.

Every validation record is predicted twice: under its own excitation, and under that of the level's other record.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from clearance_mj import ClearanceError, Dataset, estimate_frf, rmse_db
from clearance_mj.identify import identify
from clearance_mj.report.figures import band_drawing
from clearance_mj.signals.frf_error import random_error
from clearance_mj.statistics.frf_bands import frf_band, inside, paired_error
from experiments.script import run

ENGINE = "modal"


def _row(method, record, records, tests, bands, errors) -> dict:
    """Mean half width in dB and share of the record's lines inside: parameters alone, and two predictions."""
    test, band = tests[record.name], bands[record.name]
    limits = {"parameters": band.limits, "same_excitation": band.prediction(errors[record.name])}
    for other in records:
        if other.level == record.level and other is not record:
            chance = np.hypot(random_error(test), random_error(bands[other.name].fitted))
            limits["other_excitation"] = bands[other.name].prediction(chance)
    row = {"law": method, "record": record.name, "level": record.level}
    row["rmse_db"] = float(rmse_db(test.value, band.fitted.value).mean())
    for name, (low, high) in limits.items():
        row |= {f"{name}_half_width_db": float(np.mean(10 * np.log10(high / low)))}
        row |= {f"{name}_inside": inside((low, high), test)}
    return row


def main(
    data: Path = Path(__file__).parents[1] / "data" / "table1_rig", level: float = 2.0,
    methods: Sequence[str] = ("constant", "output-error"), draws: int = 40, out: Path = Path("results/uncertainty"),
) -> None:  # fmt: skip
    """Predict the validation records with bands, and draw those of a level, m/s² or N."""
    dataset = Dataset.load(data)
    if level not in {record.level for record in dataset.validate}:
        raise ClearanceError(f"no validation record has level {level:g}")
    tests = {record.name: estimate_frf(record.response()) for record in dataset.validate}
    shown, rows = {}, []
    for method in methods:
        model = identify(dataset, method, f"identifying: {method}").model
        drawn = model.draw(draws)
        bands, errors = {}, {}
        for record in dataset.validate:
            bands[record.name] = frf_band(model, record.excitation(), drawn)
            errors[record.name] = paired_error(record.response(), model.simulate(record.excitation(), ENGINE))
        rows += [_row(method, record, dataset.validate, tests, bands, errors) for record in dataset.validate]
        shown[method] = bands, errors
    record = next(record for record in dataset.validate if record.level == level)
    bands, errors = ({method: pair[i][record.name] for method, pair in shown.items()} for i in (0, 1))
    drawing = band_drawing(record.rig, bands, errors, tests[record.name])
    drawing.write(out)
    pd.DataFrame(rows).to_csv(out / "uncertainty.csv", index=False)
    print(drawing.caption)
    for row in rows:
        print(", ".join(f"{key} {value:.3g}" if isinstance(value, float) else value for key, value in row.items()))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
