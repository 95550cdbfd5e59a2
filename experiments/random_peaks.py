"""Peaks over an hour of random excitation, predicted from 60 s, against ten hours that are marched.

``python -m experiments.random_peaks march`` marches the hours (about 15 minutes of one core) and keeps their counts and
largest values; ``python -m experiments.random_peaks compare`` predicts from records of 60 s and compares. Both the
hours' seeds and the records' are other ones than those on which the method was chosen, and so are level and spectrum.
``python -m experiments.random_peaks rare`` looks at rare contact alone, with five more hours, of which each minute is a
record: twenty records leave the typical median open by a tenth.

Contact and grease of the Table 1 rig are linear, so its response at level L is L times that at level 1 of the rig whose
gaps are L times as narrow: all levels are marched side by side under one noise. The records of 60 s are marched at
their own level.
"""

import itertools
import sys
import time
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from tqdm import tqdm

import clearance_mj as cm
from clearance_mj.beam import natural_frequencies
from clearance_mj.clearance.modelled import rig_and_law, rig_in_gap
from clearance_mj.core.drawing import COLOURS, REPEAT, canvas, key, of_curves, tidy
from clearance_mj.core.files import replacing
from clearance_mj.report.tables import write_csv
from clearance_mj.signals.psd import PSD
from clearance_mj.tolerance.extremes import LEAST_PEAKS, largest_value
from clearance_mj.tolerance.impacts import march
from clearance_mj.tolerance.peaks import noise_of, peaks_of_record
from experiments.script import run

ROOT = Path(__file__).resolve().parents[1]
RIG = cm.Rig.load(ROOT / "models" / "table1_rig.toml")
SPECTRUM = PSD([5.0, 20.0, 80.0, 220.0], [0.5, 1.0, 1.0, 0.2])  # breakpoints; scaled to each level
LEVELS = (0.5, 2.0, 4.0, 6.0)  # m/s² RMS: rare contact of one bushing to hard rattling of both
HOURS = range(101, 111)  # seeds
RECORDS = range(201, 221)
RARE, RARE_HOURS = ((0.5, 1), (0.55, 1), (2.0, 0), (2.3, 0)), range(301, 306)  # level and row of a bushing; seeds
HOUR, RECORD, SETTLING, FS = 3600.0, 60.0, 5.0, 2048.0
QUANTITIES = {"penetration": "depth", "contact_force": "contact_force", "acceleration": "acceleration"}
"""quantities, and what blocks call them"""


def marched_hour(seed: int) -> pd.DataFrame:
    """Return impacts and largest values of an hour: a row per level, quantity and bushing or sensor."""
    cases = [rig_and_law(RIG.with_gap(RIG.bushings[0].gap / level)) for level in LEVELS]
    noise = cm.excitation.from_psd_blocks(SPECTRUM.scaled(1.0), HOUR + SETTLING, FS, seed)
    peaks: dict[tuple[int, str], np.ndarray] = {}
    for blocks in march(cases, noise, cm.Modal(), SETTLING):
        for lane, block in enumerate(blocks):
            for name, kept in QUANTITIES.items():
                largest = getattr(block, kept).max(axis=1, initial=-np.inf)
                peaks[lane, name] = np.maximum(peaks.get((lane, name), -np.inf), largest)
            peaks[lane, "impacts"] = peaks.get((lane, "impacts"), 0) + block.impacts.sum(axis=1)
    rows = []
    for (lane, name), values in peaks.items():
        scale = 1.0 if name == "impacts" else LEVELS[lane]
        rows += [(seed, LEVELS[lane], name, i, scale * float(v)) for i, v in enumerate(values)]
    return pd.DataFrame(rows, columns=["seed", "level", "quantity", "row", "value"])


def march_hours(path: Path) -> None:
    """March the hours that a file does not hold yet, and add each to it."""
    known = pd.read_csv(path) if path.exists() else pd.DataFrame({"seed": []})
    for seed in HOURS:
        if seed in set(known["seed"]):
            continue
        started = time.process_time()
        known = pd.concat([known, marched_hour(seed)], ignore_index=True)
        with replacing(path) as temporary:
            known.to_csv(temporary, index=False)
        print(f"hour of seed {seed}: {time.process_time() - started:.0f} s of one core", flush=True)


def predicted() -> pd.DataFrame:
    """Return what records of 60 s say of an hour: a row per seed, level, quantity and bushing or sensor."""
    rig, law = rig_and_law(RIG)
    rows = []
    for seed, level in itertools.product(RECORDS, LEVELS):
        noise = noise_of(SPECTRUM.scaled(level), RECORD + SETTLING, seed)
        blocks = [block for (block,) in march([(rig, law)], [noise], cm.Modal(), SETTLING)]
        for name in QUANTITIES:
            prediction = peaks_of_record(rig, law, blocks, noise, name, 1.0)
            fits = zip(prediction.median, *prediction.interval.T)
            rows += [(seed, level, name, i, *fit) for i, fit in enumerate(fits)]
        rows += [(seed, level, "impacts", i, r.value, r.low, r.high) for i, r in enumerate(prediction.impacts)]
    return pd.DataFrame(rows, columns=["seed", "level", "quantity", "row", "median", "low", "high"])


def rare_contact() -> pd.DataFrame:
    """Return what each minute of hours with rare contact says of an hour: a row for each level and bushing."""
    cases = [rig_and_law(RIG.with_gap(RIG.bushings[0].gap / level)) for level, _ in RARE]
    run = round(FS / float(natural_frequencies(rig_in_gap(*cases[0]), 1)[0]))
    hours, fits = np.empty((len(RARE), len(RARE_HOURS))), [[] for _ in RARE]
    for i, seed in enumerate(tqdm(RARE_HOURS, desc="hours")):
        noise = cm.excitation.from_psd_blocks(SPECTRUM.scaled(1.0), HOUR + SETTLING, FS, seed)
        blocks = [
            [level * each.contact_force[row] for (level, row), each in zip(RARE, lanes)]
            for lanes in march(cases, noise, cm.Modal(), SETTLING)
        ]
        for j, force in enumerate(np.concatenate([np.array(block) for block in blocks], axis=1)):
            hours[j, i] = force.max()
            minutes = force[: force.size // round(RECORD * FS) * round(RECORD * FS)].reshape(-1, round(RECORD * FS))
            fits[j] += [largest_value(minute, run, HOUR / RECORD, 0.0) for minute in minutes]
    rows = []
    for (level, row), largest, group in zip(RARE, hours, fits):
        median, low, high = np.array([(fit.median, fit.low, fit.high) for fit in group if fit.peaks >= LEAST_PEAKS]).T
        rows.append({
            "level": level, "row": row, "records": len(group), "without": len(group) - median.size,
            "hours_least": largest.min(), "hours_median": np.median(largest), "hours_largest": largest.max(),
            "median": np.median(median), "error": 1.25 * median.std() / np.sqrt(median.size),
            "inside": share((low[:, None] <= largest) & (largest <= high[:, None])),
        })  # fmt: skip
    return pd.DataFrame(rows)


def compared(hours: pd.DataFrame, records: pd.DataFrame) -> pd.DataFrame:
    """Return, for each level, quantity and row, how often intervals hold the hours, and medians lie in their range."""
    keys, rows = ["level", "quantity", "row"], []
    marched = dict(list(hours.groupby(keys)["value"]))
    for place, each in records.groupby(keys):
        value = np.maximum(marched[place].to_numpy(), 0.0) / (HOUR if place[1] == "impacts" else 1.0)
        value = np.array([value.mean()]) if place[1] == "impacts" else value  # an interval of the rate itself
        fitted = each.dropna()
        low, high, median = (fitted[name].to_numpy()[:, None] for name in ("low", "high", "median"))
        rows.append({
            **dict(zip(keys, place)), "records": len(fitted), "of": len(each),
            "hours_least": value.min(), "hours_median": np.median(value), "hours_largest": value.max(),
            "median": np.median(median) if len(fitted) else np.nan,
            "low": np.median(low) if len(fitted) else np.nan, "high": np.median(high) if len(fitted) else np.nan,
            "inside": share((low <= value) & (value <= high)), "hour_below": share(value < low),
            "hour_above": share(value > high),
            "medians_in_range": share((value.min() <= median) & (median <= value.max())),
            "hours_below_median": share(value <= median),
        })  # fmt: skip
    return pd.DataFrame(rows)


def share(true: np.ndarray) -> float:
    """Return which share of an array is true; nan of an empty one."""
    return float(true.mean()) if true.size else np.nan


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with the sensors of an acceleration taken together, shares weighted by records."""
    shares = ["inside", "hour_below", "hour_above", "medians_in_range", "hours_below_median"]
    return table[table["quantity"] == "acceleration"].groupby("level")[shares].mean().round(3)


def drawn(hours: pd.DataFrame, records: pd.DataFrame) -> Figure:
    """Draw the hours' largest contact forces of the second bushing beside what each record predicts, by level."""
    figure = canvas(2.6)
    for i, (ax, level) in enumerate(zip(figure.subplots(1, len(LEVELS)), LEVELS)):
        of_level = {"level": level, "quantity": "contact_force", "row": 1}
        marched, predicted = (
            frame[np.all([frame[name] == value for name, value in of_level.items()], axis=0)]
            for frame in (hours, records)
        )
        ax.hlines(marched["value"], 0.5, len(predicted) + 0.5, color=REPEAT, lw=0.8)
        place = np.arange(1, len(predicted) + 1)
        ax.vlines(place, predicted["low"], predicted["high"], color=COLOURS[0], lw=1.2)
        ax.plot(place, predicted["median"], "o", ms=3, color=COLOURS[0])
        tidy(ax, f"{level:g} m/s²", "" if i else "Largest contact force of an hour (N)", "Record of 60 s")
        ax.set_ylim(0)
    looks = {
        "ten hours, marched": {"color": REPEAT, "lw": 0.8},
        "predicted, 5 to 95 %": {"color": COLOURS[0], "lw": 1.2, "marker": "o", "ms": 3},
    }
    key(figure, of_curves(looks))
    return figure


def main(part: Literal["march", "compare", "rare"], out: Path = ROOT / "results" / "random_peaks") -> None:
    """Run a part."""
    if part == "rare":
        print(rare_contact().round(3).to_string(index=False))
        return
    if part == "march":
        march_hours(out / "hours.csv")
        return
    hours, records = pd.read_csv(out / "hours.csv"), predicted()
    table = compared(hours, records)
    drawn(hours, records).savefig(ROOT / "docs" / "random_excitation.png", dpi=150)
    for name, frame in (("records", records), ("compared", table)):
        write_csv(out / f"{name}.csv", frame)
    shown = table[table["quantity"] != "acceleration"]
    print(shown.to_string(index=False, float_format="{:.3g}".format), summary(table), sep="\n\n")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
