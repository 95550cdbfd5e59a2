"""Records and rig files that lie, and what identification says of each; of those that pass, what they do to FRFs.

    python -m experiments.benches.lying_records --page docs/robustness.md

Every lie is put into all records to identify of `data/table1_rig`, or into its rig file. What is said is what
``identify`` prints as warnings or refuses with. Where nothing is said, rig and law are identified and FRFs of the
records to validate, which do not lie, are predicted: as well as without the lie, or the lie matters in silence.
"""

import csv
import io
import json
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.interpolate
import scipy.signal
from tqdm import tqdm

from clearance_mj import Channel, ClearanceError, Dataset, Record, Rig, estimate_frf, rmse_db, simulate
from clearance_mj.core.files import to_json, write_text
from clearance_mj.identify.channels.check import check_places
from clearance_mj.identify.methods.bench import fit_bench
from clearance_mj.identify.records.checks import IdentifiabilityWarning, check_records
from clearance_mj.identify.records.prepared import prepare
from clearance_mj.identify.structure.examination import examine
from experiments.script import run
from experiments.tables import markdown_table, put_between_marks

DATA = Path(__file__).parents[2] / "data" / "table1_rig"
LEVEL = 1.0  # m/s², of the records whose FRFs are predicted where nothing is said
LONGEST = 240  # characters of a message in the file of all messages
CASES = "robustness_records.csv"  # next to the page: every message or effect

Lie = Callable[[Dataset], Dataset]
Change = Callable[[np.ndarray, float], np.ndarray]  # Takes samples and samples per second
Key = tuple[int, str]  # Node and quantity
PROBE, OTHER_PROBE = (6, "displacement"), (7, "displacement")
ACCELEROMETER, OTHER = (3, "acceleration"), (2, "acceleration")
EXCITATION = (100, "acceleration")


def changed(*keys: Key, by: Change) -> Lie:
    """Samples of some channels, other ones."""

    def one(channel: Channel) -> Channel:
        if (channel.node, channel.quantity) not in keys:
            return channel
        return replace(channel, value=by(channel.value.copy(), channel.fs))

    return with_channels(lambda channels: [one(c) for c in channels])


def swapped(first: Key, second: Key) -> Lie:
    """Samples of one channel in the place of those of another."""
    partner = {first: second, second: first}

    def swap(channels: Sequence[Channel]) -> list[Channel]:
        held = {(c.node, c.quantity): c.value for c in channels}
        return [replace(c, value=held[partner.get((c.node, c.quantity), (c.node, c.quantity))]) for c in channels]

    return with_channels(swap)


def with_channels(change: Callable[[Sequence[Channel]], list[Channel]]) -> Lie:
    """Channels of all records to identify."""

    def lie(dataset: Dataset) -> Dataset:
        records = [replace(r, channels=change(r.channels)) for r in dataset.records]
        return Dataset(dataset.rig, tuple(records), dataset.path)

    return lie


def told(change: Callable[[Rig], Rig]) -> Lie:
    """A rig file that says something else."""

    def lie(dataset: Dataset) -> Dataset:
        rig = change(dataset.rig)
        return Dataset(rig, tuple(replace(r, rig=rig) for r in dataset.records), dataset.path)

    return lie


def delayed(seconds: float) -> Change:
    """Later by a time."""
    return lambda x, fs: np.concatenate((np.full(round(seconds * fs), x[0]), x))[: x.size]


def clipped_and_filtered(x: np.ndarray, fs: float) -> np.ndarray:
    """Cut at a third of its extreme, then rounded by a low-pass, so that no flat top is left."""
    most = np.abs(x).max() / 3
    return scipy.signal.sosfiltfilt(scipy.signal.butter(4, 0.2 * fs, fs=fs, output="sos"), np.clip(x, -most, most))


def noise(x: np.ndarray, fs: float) -> np.ndarray:
    """Of the same level."""
    return x.std() * np.random.default_rng(3).standard_normal(x.size)


def backwards(x: np.ndarray, fs: float) -> np.ndarray:
    """Another signal with the same spectrum."""
    return x[::-1].copy()


def dropout(seconds: float) -> Change:
    """Zero for a while in the middle."""

    def lose(x: np.ndarray, fs: float) -> np.ndarray:
        first = x.size // 2
        x[first : first + round(seconds * fs)] = 0.0
        return x

    return lose


def spike(x: np.ndarray, fs: float) -> np.ndarray:
    """One sample."""
    x[x.size // 3] += 40 * x.std()
    return x


def hum(x: np.ndarray, fs: float) -> np.ndarray:
    """Of the mains, a fifth of the level."""
    return x + 0.2 * np.sqrt(2) * x.std() * np.sin(2 * np.pi * 50.0 * np.arange(x.size) / fs)


def offset(by: float) -> Change:
    """A wrong zero."""
    return lambda x, fs: x + by


def drift(by: float) -> Change:
    """A zero that moves."""
    return lambda x, fs: x + by * np.linspace(0, 1, x.size)


def other_clock(factor: float) -> Change:
    """Sampled by a clock that is too fast by a factor, as of another logger that began at the same instant."""

    def resample(x: np.ndarray, fs: float) -> np.ndarray:
        at = np.arange(x.size)
        return np.asarray(scipy.interpolate.CubicSpline(at, x)(at / factor))

    return resample


def slower(factor: float) -> Lie:
    """A sampling rate that is told too low by a factor, of all channels."""

    def lie(dataset: Dataset) -> Dataset:
        def one(record: Record) -> Record:
            channels = [replace(c, fs=c.fs / factor) for c in record.channels]
            return replace(record, channels=channels, fs=record.fs / factor)

        return Dataset(dataset.rig, tuple(one(r) for r in dataset.records), dataset.path)

    return lie


def times(factor: float) -> Change:
    """A wrong gain, unit or sign."""
    return lambda x, fs: factor * x


def quantised(x: np.ndarray, fs: float) -> np.ndarray:
    """A converter of 8 bits."""
    step = 2 * np.abs(x).max() / 2**8
    return step * np.round(x / step)


def scaled(part: Any, factor: float, name: str) -> Any:
    """A part of a rig with a number times a factor."""
    return replace(part, **{name: factor * getattr(part, name)})


def beam(factor: float, name: str) -> Lie:
    """A number of the shaft times a factor."""
    return told(lambda rig: rig.replace(beam=scaled(rig.beam, factor, name)))


def bushings(**changes: Callable) -> Lie:
    """Fields of all bushings."""

    def one(bushing):
        return replace(bushing, **{name: new(getattr(bushing, name)) for name, new in changes.items()})

    return told(lambda rig: rig.replace(bushings=tuple(one(b) for b in rig.bushings)))


def moved_sensor(rig: Rig) -> Rig:
    """Accelerometer 3, 80 mm from where it is."""
    sensors = [replace(s, position=s.position + 0.08) if s.node == 3 else s for s in rig.sensors]
    return rig.replace(sensors=tuple(sensors))


def without_masses(rig: Rig) -> Rig:
    """No point mass told."""
    return rig.replace(masses=())


LIES: dict[str, Lie] = {
    "none": lambda dataset: dataset,
    "probes swapped": swapped(PROBE, OTHER_PROBE),
    "probe reversed": changed(PROBE, by=times(-1.0)),
    "probe 5 ms late": changed(PROBE, by=delayed(5e-3)),
    "probe 1 ms late": changed(PROBE, by=delayed(1e-3)),
    "probe in mm": changed(PROBE, by=times(1e3)),
    "both probes in mm": changed(PROBE, OTHER_PROBE, by=times(1e3)),
    "probe reads 20 % too much": changed(PROBE, by=times(1.2)),
    "probe clipped, then filtered": changed(PROBE, by=clipped_and_filtered),
    "probe: noise": changed(PROBE, by=noise),
    "probe: another signal": changed(PROBE, by=backwards),
    "probe drops out for 1 s": changed(PROBE, by=dropout(1.0)),
    "probe drops out for 10 ms": changed(PROBE, by=dropout(0.01)),
    "probe: spike": changed(PROBE, by=spike),
    "probe: offset of 0.15 mm": changed(PROBE, by=offset(1.5e-4)),
    "probe: offset of 0.03 mm": changed(PROBE, by=offset(3e-5)),
    "probe: offset of 0.005 mm": changed(PROBE, by=offset(5e-6)),
    "probe drifts by 0.3 mm": changed(PROBE, by=drift(3e-4)),
    "probe: mains hum of 20 %": changed(PROBE, by=hum),
    "probe of 8 bits": changed(PROBE, by=quantised),
    "accelerometers swapped": swapped(ACCELEROMETER, OTHER),
    "accelerometer reversed": changed(ACCELEROMETER, by=times(-1.0)),
    "accelerometer 5 ms late": changed(ACCELEROMETER, by=delayed(5e-3)),
    "accelerometer one sample late": changed(ACCELEROMETER, by=delayed(1 / 2048)),
    "accelerometer in g": changed(ACCELEROMETER, by=times(1 / 9.80665)),
    "all accelerometers in g": changed(*((n, "acceleration") for n in range(1, 9)), by=times(1 / 9.80665)),
    "accelerometer reads 20 % too much": changed(ACCELEROMETER, by=times(1.2)),
    "accelerometer clipped, then filtered": changed(ACCELEROMETER, by=clipped_and_filtered),
    "accelerometer: noise": changed(ACCELEROMETER, by=noise),
    "accelerometer: another signal": changed(ACCELEROMETER, by=backwards),
    "accelerometer drops out for 1 s": changed(ACCELEROMETER, by=dropout(1.0)),
    "accelerometer: spike": changed(ACCELEROMETER, by=spike),
    "accelerometer: offset of 5 m/s²": changed(ACCELEROMETER, by=offset(5.0)),
    "accelerometer drifts by 5 m/s²": changed(ACCELEROMETER, by=drift(5.0)),
    "accelerometer: mains hum of 20 %": changed(ACCELEROMETER, by=hum),
    "accelerometer: clock 0.1 % fast": changed(ACCELEROMETER, by=other_clock(1.001)),
    "accelerometer: clock 0.01 % fast": changed(ACCELEROMETER, by=other_clock(1.0001)),
    "both probes: clock 0.1 % fast": changed(PROBE, OTHER_PROBE, by=other_clock(1.001)),
    "excitation: clock 0.1 % fast": changed(EXCITATION, by=other_clock(1.001)),
    "all channels: stated rate 0.1 % too low": slower(1.001),
    "accelerometer of 8 bits": changed(ACCELEROMETER, by=quantised),
    "excitation reversed": changed(EXCITATION, by=times(-1.0)),
    "excitation 5 ms late": changed(EXCITATION, by=delayed(5e-3)),
    "excitation in g": changed(EXCITATION, by=times(1 / 9.80665)),
    "excitation reads 20 % too much": changed(EXCITATION, by=times(1.2)),
    "excitation clipped, then filtered": changed(EXCITATION, by=clipped_and_filtered),
    "excitation: noise": changed(EXCITATION, by=noise),
    "excitation drops out for 1 s": changed(EXCITATION, by=dropout(1.0)),
    "excitation: offset of 5 m/s²": changed(EXCITATION, by=offset(5.0)),
    "excitation and accelerometer 1 swapped": swapped(EXCITATION, (1, "acceleration")),
    "rig file: rod 10 % too long": beam(1.1, "length"),
    "rig file: diameter 15 % too large": beam(1.15, "diameter"),
    "rig file: modulus a third too small": beam(2 / 3, "young_modulus"),
    "rig file: density twice too large": beam(2.0, "density"),
    "rig file: masses missing": told(without_masses),
    "rig file: gaps three times too small": bushings(gap=lambda gap: gap / 3),
    "rig file: gaps three times too large": bushings(gap=lambda gap: 3 * gap),
    "rig file: gaps 30 % too large": bushings(gap=lambda gap: 1.3 * gap),
    "rig file: bushings 60 mm too near to the clamp": bushings(position=lambda x: x - 0.06),
    "rig file: accelerometer 3 at 80 mm from its place": told(moved_sensor),
    "rig file: contact ten times too stiff": bushings(contact=lambda c: scaled(c, 10.0, "stiffness")),
    "rig file: grease ten times too soft": bushings(grease=lambda g: replace(g, stiffness=g.stiffness / 10)),
    "rig file: damping ten times too small": told(
        lambda rig: rig.replace(beam=replace(rig.beam, rayleigh=tuple(0.1 * r for r in rig.beam.rayleigh)))
    ),
}  # fmt: skip
"""Faults of records, by name"""


def sound() -> Dataset:
    """The records to identify from, as they are."""
    dataset = Dataset.load(DATA)
    return Dataset(dataset.rig, tuple(dataset.to_identify()), dataset.path)


def said(dataset: Dataset) -> list[str]:
    """Return what identification says of a dataset: the refusal, or warnings and likeliest causes; none: nothing."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", IdentifiabilityWarning)
        try:
            check_places(check_records(dataset.records))
            update, diagnosis = examine(dataset.rig, prepare(dataset))
            words = (*map(str, update.structure.accepted), *diagnosis.words)
        except ClearanceError as error:
            return [f"refused: {error}"]
    warned = [str(w.message) for w in caught if isinstance(w.message, IdentifiabilityWarning)]
    return [*dict.fromkeys([*warned, *words])]


def predicted(dataset: Dataset, validate: Sequence[Record]) -> float:
    """Return by how many dB FRFs are missed that rig and law identified from a dataset predict, RMS over records."""
    fit = fit_bench(dataset)
    missed = []
    for record in validate:
        model = simulate(fit.rig, record.excitation(), fit.law, "modal")
        frfs = [estimate_frf(response, resolution=0.5) for response in (record.response(), model)]
        low, high = record.band or (5.0, 220.0)
        test, ours = (f.value[:, 0, (f.frequency >= low) & (f.frequency <= high)] for f in frfs)
        missed.append(np.mean(np.square(rmse_db(test, ours))))
    return float(np.sqrt(np.mean(missed)))


def judge(name: str, dataset: Dataset, validate: Sequence[Record]) -> dict:
    """Return what is said of a lie; where nothing is, what it does to FRFs."""
    lied = LIES[name](dataset)
    words = said(lied)
    return {"lie": name, "said": words, "rmse_db": None if words else predicted(lied, validate)}


Outcome = tuple[str, str]  # What is wrong, and the message or the effect
RESULTS = {
    "refused; channels are named": "refused: ", "channel and fault are named": "record ",
    "no single cause; the likeliest is named": "no single cause", "accepted; RMSE of the predicted FRFs, dB": "nothing",
    "cause and value are named": "",
}  # fmt: skip
"""Kinds of outcome, by how the message begins."""


def markdown(outcomes: Sequence[Outcome]) -> str:
    """Return a table with one line for each kind of outcome, which lists what is wrong."""
    wrong: dict[str, list[str]] = {result: [] for result in RESULTS}
    for name, words in outcomes:
        result = next(result for result, begin in RESULTS.items() if words.startswith(begin))
        missed = re.fullmatch(r"nothing; .* ([\d.]+) dB", words)
        wrong[result].append(f"{name}: {missed[1]}" if missed else name)
    return "\n" + markdown_table([("outcome", "errors"), *((k, "; ".join(v)) for k, v in wrong.items() if v)]) + "\n"


def to_csv(outcomes: Sequence[Outcome]) -> str:
    """Return every message or effect as CSV."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([("error", "message or effect"), *outcomes])
    return out.getvalue()


def from_csv(path: Path) -> dict[str, str]:
    """Return message or effect by what is wrong."""
    with path.open(encoding="utf-8", newline="") as file:
        return {name: words for name, words in [*csv.reader(file)][1:]}


def table_cell(row: dict) -> str:
    if row["rmse_db"] is not None:
        return f"nothing; FRFs are predicted within {row['rmse_db']:.2f} dB"
    words = "; ".join(row["said"])
    return words if len(words) <= LONGEST else f"{words[:LONGEST].rsplit(' ', 1)[0]} ..."


def main(out: Path = Path("results/lying_records"), lie: Sequence[str] | None = None, page: Path | None = None) -> None:
    """Judge lies, write lying_records.json, the table of a page and the CSV file next to it."""
    dataset = sound()
    validate = [r for r in Dataset.load(DATA).records if r.role == "validate" and r.level == LEVEL]
    path = out / "lying_records.json"
    known = {row["lie"]: row for row in json.loads(path.read_text(encoding="utf-8"))} if path.exists() else {}
    for name in tqdm(lie or LIES):
        known[name] = judge(name, dataset, validate)
        tqdm.write(f"{name}: {table_cell(known[name])}")
        write_text(path, to_json([known[n] for n in LIES if n in known]))
    if page:
        outcomes = [(name, table_cell(known[name])) for name in LIES if name in known]
        write_text(page.with_name(CASES), to_csv(outcomes))
        put_between_marks(page, "lies", markdown(outcomes))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
