"""Uncertainty: FRF bands from the covariance of identified laws, beside a record that no identification has seen."""

import argparse
import sys
from pathlib import Path

from clearance_mj import Dataset, estimate_frf, rmse_db
from clearance_mj.errors import ClearanceError
from clearance_mj.identify.laws import get_method
from clearance_mj.io.files import replacing
from clearance_mj.report.tables import write_csv
from clearance_mj.report.uncertainty import draw
from clearance_mj.uncertainty import draw_laws, frf_band


def run(dataset, level, methods, draws, out):
    record = next((r for r in dataset.validate if r.level == level), None)
    if record is None:
        raise ClearanceError(f"no validation record has level {level:g}")
    test, bands, rows = estimate_frf(record.response()), {}, []
    for method in methods:
        found = get_method(method).run(dataset, f"identifying: {method}")
        laws = draw_laws(record.rig, method, found.parameters, draws)
        bands[method] = band = frf_band(record.rig, record.excitation(), found.law, laws, progress=f"band: {method}")
        low, high = band.limits
        for i, label in enumerate(test.responses):
            outside = (abs(test.value[i]) < low[i]) | (abs(test.value[i]) > high[i])
            row = {"law": method, "response": label, "half_width_db": float(band.half_width_db[i].mean())}
            row |= {"test_outside_share": float(outside.mean())}
            rows.append(row | {"rmse_db": float(rmse_db(test.value, band.fitted.value)[i])})
    drawing = draw(record.rig, bands, test)
    with replacing(out / "uncertainty.png") as temporary:
        temporary.write_bytes(drawing.png())
    write_csv(out / "uncertainty.csv", rows)
    print(drawing.caption)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path(__file__).parent.parent / "data" / "table1_rig")
    parser.add_argument("--level", type=float, default=2.0, help="m/s² or N")
    parser.add_argument("--methods", nargs="+", default=["constant", "output-error"])
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--out", type=Path, default=Path("results/uncertainty"))
    options = parser.parse_args()
    try:
        run(Dataset.load(options.data), options.level, options.methods, options.draws, options.out)
    except ClearanceError as error:
        sys.exit(print(f"uncertainty.py: {error}", file=sys.stderr) or 2)
