"""Errors of identified benches in space, and how often 90 % intervals hold the truth.

    python -m experiments.benches.space.coverage steering-1 rotor-1 pump-1 --out results/benches/space.csv

A bench's records are made if the folder beside the table does not hold them yet; those to validate only with
--validate. One row for each number that its rig file left open, and for FRFs and orbits. truth.toml and the records to
validate are read only to judge. Benches that the table already holds are not identified again.
"""

import math
import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import clearance_mj as cm
from clearance_mj import Dataset, estimate_frf
from clearance_mj.identify.methods.bench import BenchFit, fit_bench
from clearance_mj.identify.records.in_test import in_test
from clearance_mj.identify.records.prepared import PreparedRecord, prepared
from clearance_mj.identify.records.run_out import TURNS, run_out, run_out_at
from clearance_mj.signals.orbits import Orbits, orbits_by_turn
from clearance_mj.study.orbit_measures import onset_of_contact
from clearance_mj.study.whirl_in_test import measured_whirl, simulated_whirl, without_run_out
from experiments.script import run
from experiments.tables import judged, markdown_table

from ..coverage import RESOLUTION, WIDEST
from .make import find_bench
from .records import write_bench

TARGETS = {"gap": 0.03, "friction": 0.1, "viscosity": 0.05, "offset": 2e-5, "onset": 0.01}
"""Relative errors, and m"""
HARMONICS = 4  # of the turns, in orbits whose onset of contact is looked for: noise reaches the wall before the shaft
MADE = ("identify", "orbit")


def made(name: str, folder: Path, roles: Sequence[str]) -> Path:
    """Return the folder of a bench such as "rotor-3", whose records of some roles are made if they are not there.

    Names are those of `make.find_bench`.
    """
    where = folder / name
    if not (where / "truth.toml").exists():
        write_bench(find_bench(name), where, roles=roles)
    return where


def judge(folder: Path) -> pd.DataFrame:
    """Identify one bench and compare it with its truth, and with the records to validate that are there."""
    dataset, start = Dataset.load(folder), time.perf_counter()
    truth = tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8"))
    fit = fit_bench(dataset)
    seconds = round(time.perf_counter() - start, 1)
    rows = [*_parameters(fit, truth), *_frfs(fit, dataset), *_orbits(fit, dataset)]
    rows += _onsets(fit, dataset, truth)
    about = {
        "bench": folder.name,
        "seconds": seconds,
        "family": "; ".join(dict.fromkeys(of_one[0].name for of_one in fit.families)),
        "widening": fit.misfit.widening,
    }
    return pd.DataFrame(rows).assign(**about)


def _parameters(fit: BenchFit, truth: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a row for each gap, offset, friction, viscosity and unbalance."""
    for j, bushing in enumerate(truth["bushings"]):
        path, rig = f"bushings[{j}]", fit.rig.bushings[j]
        pairs = {"gap": (rig.gap, bushing["gap"], f"{path}.gap")}
        pairs["offset_y"] = rig.offset_y, bushing["offset_y"], f"{path}.offset_y"
        pairs["offset_z"] = rig.offset, bushing["offset_z"], f"{path}.offset"
        if rig.friction:
            pairs["friction"] = rig.friction.coefficient, bushing["friction"], f"{path}.friction"
        if rig.film:
            pairs["viscosity"] = rig.film.viscosity, bushing["viscosity"], f"grease viscosity, {path}"
        for what, (value, true, name) in pairs.items():
            yield {"what": what, "where": j, "value": value, "truth": true} | _held(fit, name, value, true)
    for i, (unbalance, true) in enumerate(zip(fit.rig.unbalances, truth["unbalances"])):
        turned = math.remainder(unbalance.phase - true["phase"], 2 * math.pi)
        for what, value, known in (("moment", unbalance.moment, true["moment"]), ("phase", turned, 0.0)):
            row = {"what": "unbalance" + " phase" * (what == "phase"), "value": value, "truth": known}
            yield row | _held(fit, f"unbalances[{i}].{what}", value, known)


def _held(fit: BenchFit, name: str, value: float, true: float) -> dict[str, Any]:
    """Return the error of an estimate in standard deviations, and whether its interval holds the truth."""
    if name not in fit.estimates.names:
        return {}
    at = fit.estimates.names.index(name)
    p, std = fit.estimates.parameters[at], float(fit.estimates.varied_std[at])
    z = (p.to_varied(value) - p.to_varied(true)) / std
    return {"z": z, "std": std, "held": float(abs(z) < WIDEST), "only_prior": name in fit.estimates.only_prior}


def _pairs(dataset: Dataset, kind: str) -> Iterator[tuple[PreparedRecord, PreparedRecord]]:
    """Records to validate of a kind and their repeats."""
    by_name = {r.name: r for r in dataset.validate if (r.excitation_kind == "spin") == (kind == "spin")}
    for name, record in by_name.items():
        other = by_name.get(f"{name[:-1]}b") if name.endswith("_a") else by_name.get(name.replace("_a_", "_b_"))
        if other is not None and other is not record:
            yield prepared(record), prepared(other)


def _frfs(fit: BenchFit, dataset: Dataset) -> Iterator[dict[str, Any]]:
    """RMSE in dB of each level and direction beside that of the repeat."""
    for first, second in _pairs(dataset, "base"):
        model = cm.simulate(in_test(fit.model, first.tested, first.turning), first.excitation(), engine="modal")
        test, repeat, predicted = (
            estimate_frf(r, resolution=RESOLUTION) for r in (first.response(), second.response(), model)
        )
        rmse, floor = (float(cm.compare(test, other).summary()["rmse_db"]) for other in (predicted, repeat))
        yield {"what": "FRF", "where": first.name, "value": rmse, "truth": floor, "held": float(rmse <= floor)}


def _orbits(fit: BenchFit, dataset: Dataset) -> Iterator[dict[str, Any]]:
    """RMS distance of mean orbits from the test's, beside that of the repeat, over the test's RMS radius.

    Of each, what its own slow turning shows over the shaft's angle is subtracted.
    """
    slow = next((prepared(r) for r in dataset.identify if r.name == "slow_roll"), None)
    if slow is None:
        return
    turning, measured = slow.turning, slow.displacement
    assert turning is not None and measured is not None
    settled = slice(len(turning.angle) // 2, None)
    of_test = run_out(turning.angle, measured)
    of_model = run_out(turning.angle[settled], _predicted(fit, slow)[:, settled])
    for first, second in _pairs(dataset, "spin"):
        if first.tested.spin is None or first.tested.spin.rate:
            continue
        assert first.displacement is not None and second.displacement is not None
        test, repeat = (_mean_orbits(r, r.displacement, of_test) for r in (first, second))
        predicted = _mean_orbits(first, _predicted(fit, first), of_model)
        for j, tested in enumerate(test):
            centred = [o - o.mean(axis=1, keepdims=True) for o in (tested, repeat[j], predicted[j])]
            size = np.sqrt(np.mean(centred[0] ** 2))
            floor, rms = (float(np.sqrt(np.mean((other - centred[0]) ** 2)) / size) for other in centred[1:])
            yield {"what": "orbit", "where": first.name, "value": rms, "truth": floor, "held": float(rms <= floor)}


def _onsets(fitted: BenchFit, dataset: Dataset, truth: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Spin, rev/min, at which each clearance begins to be touched in a run-up that no fit saw.

    Of the test with the true hole and the true place of the shaft, of the model with what was found: up to there its
    motion does not depend on how far the hole is out of round.
    """
    for record in dataset.validate:
        spin = record.tested_rig.spin
        if record.excitation_kind != "spin" or not (spin and spin.rate and record.name.endswith("_a")):
            continue
        test = without_run_out(measured_whirl(record), _true_run_out(truth["probes"]))
        model = simulated_whirl("found", fitted.model, record, "modal", None)
        model_rest = _along_y_and_z(model.rest, [bushing.probe_angle for bushing in fitted.rig.bushings])
        for j, (hole, fit) in enumerate(zip(truth["bushings"], (of_one[0].fit for of_one in fitted.families))):
            gap, twice = hole["gap"], 2 * hole["axis"]
            oval = gap * hole["oval"] * np.array([math.cos(twice), math.sin(twice)])
            rest = np.array([hole["offset_y"], hole["offset_z"] - hole["sag_without_bushings"]])
            pair = truth["probes"][j]
            true = _onset(test.orbits(j), pair["angle"], pair["gains"], rest, gap, oval)
            bushing_fit, wall = fit.bushing, fit.case.bushing.wall or {}
            hole_of_fit = np.array([wall.get(name, 0.0) for name in ("wide", "across")])
            value = _onset(
                model.motion.orbits(j), bushing_fit.probe_angle, (1.0, 1.0), model_rest[j], bushing_fit.gap, hole_of_fit
            )
            if not math.isnan(true):
                yield {"what": "onset", "where": record.name, "value": value, "truth": true}


def _along_y_and_z(rest: np.ndarray, angles: Sequence[float]) -> np.ndarray:
    """Places (n_bushings, 2) along the axes of probes that are turned by angles, rad."""
    turned = (rest[:, 0] + 1j * rest[:, 1]) * np.exp(1j * np.array(angles))
    return np.column_stack((turned.real, turned.imag))


def _true_run_out(probes: Sequence[dict[str, Any]]) -> np.ndarray:
    """Run-out as `run_out` returns it: of a bent shaft, slow turning shows more."""
    harmonics = np.zeros((2, TURNS, 2 * len(probes)))
    for i, pair in enumerate(probes):
        for axis, gain in enumerate(pair["gains"]):
            for k, (size, phase) in enumerate(pair["runout"], 1):
                at = k * (axis * math.pi / 2 + pair["angle"]) + phase
                harmonics[:, k - 1, 2 * i + axis] = gain * size * np.array([math.cos(at), math.sin(at)])
    return harmonics.reshape(2 * TURNS, -1)


def _onset(
    orbits: Orbits, angle: float, gains: Sequence[float], rest: np.ndarray, gap: float, oval: np.ndarray
) -> float:
    """`onset_of_contact` of probes with gains, turned by an angle, rad, in a hole that is out of round.

    ``oval``: (2,) m, by which the hole is wider than its gap per cos 2θ and sin 2θ. Of each turn four harmonics count.
    """
    spectrum = np.fft.rfft(orbits.position / np.array(gains)[:, None], axis=2)
    spectrum[:, :, HARMONICS + 1 :] = 0.0
    first, second = np.moveaxis(np.fft.irfft(spectrum, orbits.position.shape[2], axis=2), 1, 0)
    cos, sin = math.cos(angle), math.sin(angle)
    y, z = cos * first - sin * second + rest[0], sin * first + cos * second + rest[1]
    twice = 2 * np.arctan2(z, y)
    narrowed = gap / (gap + oval[0] * np.cos(twice) + oval[1] * np.sin(twice))
    moved = np.stack((narrowed * y, narrowed * z), axis=1) - rest[:, None]
    return onset_of_contact(replace(orbits, position=moved), rest, gap)


def _predicted(fit: BenchFit, record: PreparedRecord) -> np.ndarray:
    """(2 n_bushings, n_t) m that the probes read, with their gains, of the identified rig that turns as in a record."""
    model = in_test(fit.model, record.tested, record.turning)
    moved = cm.simulate(model, record.excitation(), engine="modal").displacement
    assert moved is not None
    return moved * np.array([[fit.update.values.get(f"probes[{i}].gain", 1.0)] for i in range(len(moved))])


def _mean_orbits(record: PreparedRecord, displacement: np.ndarray, run: np.ndarray) -> list[np.ndarray]:
    """Mean of the last turns' orbits of each bushing, without run-out."""
    assert record.turning is not None
    moved = displacement - run_out_at(record.turning.angle, run)
    return [
        orbits_by_turn(*pair, record.fs, record.turning.angle).last(50).position.mean(axis=0)
        for pair in moved.reshape(-1, 2, moved.shape[1])
    ]


def summary(rows: pd.DataFrame) -> str:
    """Return a line for each number: typical and largest error, how often it is on target and the interval holds."""
    lines = [
        ("quantity", "number", "median error", "largest", "within the limit, %", "true value in the 90 % interval, %")
    ]
    for what, all_ in rows.groupby("what", sort=False):
        of = all_[~all_["only_prior"].eq(True)]  # of others the records tell nothing
        ratio = of["value"] / of["truth"]
        if what in ("FRF", "orbit"):
            met = f"{100 * (ratio <= 1).mean():.0f}"
            lines.append((f"{what} over repeat", len(of), f"{ratio.median():.2f}", f"{ratio.max():.2f}", met, ""))
            continue
        absolute = what.startswith("offset") or what == "unbalance phase"
        error = (of["value"] - of["truth"]).abs() if absolute else (ratio - 1).abs()
        target = TARGETS.get(what.partition("_")[0], np.nan)
        shown = (f"{1e6 * v:.1f} µm" if what.startswith("offset") else f"{v:.3g}" if absolute else f"{100 * v:.2f} %"
                 for v in (error.median(), error.max()))  # fmt: skip
        held = f"{100 * of['held'].mean():.0f}" if "held" in of and of["held"].notna().any() else ""
        number = f"{len(of)}" if len(of) == len(all_) else f"{len(of)} of {len(all_)}"
        lines.append((what, number, *shown, f"{100 * (error <= target).mean():.0f}" if target == target else "", held))
    return markdown_table(lines)


def main(benches: Sequence[str], out: Path = Path("results/benches/space.csv"), validate: bool = False) -> None:
    """Judge benches that the table does not hold yet, write it, print the summary."""
    roles = (*MADE, "validate") if validate else MADE
    print(summary(judged(out, "bench", benches, lambda name: judge(made(name, out.parent / "space", roles)))))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
