"""Shares of a production by `tolerance.production`'s way, beside brute force: rattle maps of every design, and marches.

``python -m experiments.productions maps`` computes whole rattle maps, 20 to 100 s of a core each, and keeps them;
``march`` marches six cells of each design that has a map; ``compare`` sets the shares beside both; ``judge`` marches
cells with one vibration by one way and several by the other, swept to from all sides. Only designs that
have a map count: ``--designs 200`` says up to which. ``rest`` needs no maps: it marches designs in the cells of a
production in which some touch and some do not, with the level raised slowly from rest and, where that ends without
contact, swept to from other levels and frequencies.

The production is of the Table 1 rig, synthetic: 15 numbers scatter, normally. Maps have 21 harmonics, and not more
samples where a branch ends early; cells that they lose do not count.
"""

import sys
import warnings
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.stats import norm, qmc

import clearance_mj as cm
from clearance_mj.core.files import replacing
from clearance_mj.core.plain_numbers import find_numbers, get_number
from clearance_mj.core.tasks import run_tasks
from clearance_mj.periodic import map_rattle
from clearance_mj.statistics import share_interval
from clearance_mj.tolerance.designs import Designs
from clearance_mj.tolerance.limits import Limit
from clearance_mj.tolerance.rattling import Batch, branches_of, rattling_of
from clearance_mj.tolerance.sines import Sines, settings_of
from experiments.script import run

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "results" / "productions"
MODEL = cm.Model(cm.Rig.load(ROOT / "models" / "table1_rig.toml"))
SCATTER = {
    "gap": 2e-5, "offset": 1.5e-5, "contact.stiffness": 780.0, "contact.damping": 0.8, "grease.stiffness": 437.0,
    "grease.damping": 0.5, "position": 2e-3,
}  # fmt: skip
"""Standard deviations of each bushing's numbers, SI units; that of Young's modulus is 2 %"""
SEED, MOST = 2026, 1024
LEVELS, FREQUENCIES = np.linspace(0.4, 10.0, 25), np.linspace(5.0, 220.0, 400)  # m/s², Hz
HARMONICS, SAMPLES = 21, 256  # of the maps
FORCES, ACCELERATIONS = (0.5, 1.0, 3.0, 6.0), (10.0, 20.0, 50.0)  # N, m/s²
CELLS, HIGHEST, LOW = 3, 62.0, 10.0  # marched cells of each design below 10 Hz, and above it up to 62 Hz
JUDGED, JUDGED_PERIODS = 80, 40  # cells of each kind, and periods of a sweep's half and after it
SWEEPS = ((1.0, 0.0), (0.8, 1.0), (0.93, 1.0), (1.07, 1.0), (1.25, 1.0), (1.0, 3.0), (0.93, 2.0), (1.07, 2.0))
"""Fraction of frequency and level from which a sweep comes"""
RESTED, RAISED = 60, 5.0  # cells of ``rest``; s over which a sweep goes, or 40 periods
STEADY, COUNTED, LEAST, RATE = 60.0, 20.0, 8.0, 8192.0  # periods before and while is looked; s at least; Hz


def designs() -> Designs:
    """Return the designs."""
    stds = {f"bushings[{j}].{name}": std for name, std in SCATTER.items() for j in range(2)}
    stds["beam.young_modulus"] = 0.02 * MODEL.rig.beam.young_modulus
    data = MODEL.rig.to_dict()
    keys = [find_numbers(data, name)[0] for name in stds]
    middle = np.array([get_number(data, key) or 0.0 for key in keys])
    shares = qmc.Sobol(len(keys), rng=np.random.default_rng(SEED)).random(MOST)
    values = middle + np.array([*stds.values()]) * norm.ppf(np.clip(shares, 1e-6, 1 - 1e-6))
    return Designs(MODEL, tuple(stds), values, tuple(("rig", *key) for key in keys))


def write_map(number: int) -> None:
    """Write the rattle map of a design, unless it is there."""
    path = OUT / "maps" / f"{number:04d}.npz"
    if path.exists():
        return
    rattle = map_rattle(
        designs().model(number), LEVELS, FREQUENCIES, n_harmonics=HARMONICS, n_samples=SAMPLES, workers=1
    )
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(
            file, touches=rattle.rattles[0], vibrations=rattle.vibrations[0],
            contact_force=np.nanmax(rattle.contact_force[:, 0], axis=(0, -1)).astype(np.float32),
            acceleration=np.nanmax(rattle.acceleration[:, 0], axis=(0, -1)).astype(np.float32),
        )  # fmt: skip


def over_level(number: int) -> dict[str, np.ndarray]:
    """Return the same of a design by branches over the level, (n_levels, n_frequencies)."""
    model, by_name = designs().model(number), {}
    for name in ("contact_force", "acceleration"):
        settings = settings_of(MODEL, Sines(LEVELS, FREQUENCIES, Limit(name, 1.0)))
        cells = [branch.crossings(LEVELS) for branch in branches_of(settings, model)]
        by_name[name] = np.array([values for _, _, (_, values) in cells]).T
        if name == "contact_force":
            by_name["vibrations"] = np.array([count for count, _, _ in cells]).T
            by_name["touches"] = np.array([depth > 0 for _, depth, _ in cells]).T
    return by_name


def known() -> list[int]:
    """Return the numbers of the designs that have a map."""
    return sorted(int(path.stem) for path in (OUT / "maps").glob("*.npz"))


def compare(workers: int | None) -> None:
    """Print how far shares by branches over the level are from those by maps, and what marches say."""
    numbers = known()
    asked = {"touch a wall": ("touches", 0.5), "have several vibrations": ("vibrations", 1.5)}
    asked |= {f"contact force > {limit:g} N": ("contact_force", limit) for limit in FORCES}
    asked |= {f"acceleration > {limit:g} m/s²": ("acceleration", limit) for limit in ACCELERATIONS}
    totals = {name: np.zeros((3, LEVELS.size, FREQUENCIES.size)) for name in asked}
    run = run_tasks(over_level, numbers, workers, processes=True, progress="branches over the level")
    marched = np.load(OUT / "marched.npz") if (OUT / "marched.npz").exists() else None
    rows, counts = [], []
    for number, ours in run:
        maps = np.load(OUT / "maps" / f"{number:04d}.npz")
        both = (maps["vibrations"] > 0) & (ours["vibrations"] > 0)
        counts.append((number, np.where(both, maps["vibrations"], 0), np.where(both, ours["vibrations"], 0)))
        for name, (key, limit) in asked.items():
            totals[name] += np.array([both & (maps[key] > limit), both & (ours[key] > limit), both])
        for row in marched["cells"][marched["cells"]["design"] == number] if marched is not None else ():
            at = row["level"], row["frequency"]
            rows.append((row, *(each[name][at] for name in ("vibrations", "touches", "contact_force")
                                for each in (maps, ours))))  # fmt: skip
    print(f"{len(numbers)} designs, {LEVELS.size} levels, {FREQUENCIES.size} frequencies; one design is "
          f"{100 / len(numbers):.2f} points")  # fmt: skip
    for name, (by_maps, by_ours, count) in totals.items():
        p, off = by_maps / count, 100 * np.abs(by_ours - by_maps) / count
        between = (p > 0.005) & (p < 0.995)
        beyond = int(np.sum(off[between] > 1.01 * 100 / len(numbers)))
        print(f"{name}: {off[between].max():.2f} points at most, RMS {np.sqrt(np.mean(off[between] ** 2)):.2f}, more "
              f"than one design in {beyond} of {between.sum()} cells")  # fmt: skip
    if rows:
        one = [each for each in rows if each[1] == each[2] == 1]
        alike = sum(bool(row["contact_force"] > 0) == bool(a) == bool(b) for row, _, _, a, b, *_ in one)
        print(f"marched: {len(rows)} cells, {len(one)} with one vibration, of which {alike} touch or not as both say")
        for i, name in ((5, "maps"), (6, "branches over the level")):
            off = [
                abs(each[i] / each[0]["contact_force"] - 1) for each in one if each[0]["contact_force"] > 0 < each[i]
            ]
            print(f"contact forces by {name}: {100 * np.median(off):.2g} % off (median), "
                  f"{100 * np.quantile(off, 0.9):.2g} % (90 %)")  # fmt: skip
    with replacing(OUT / "vibrations.npz") as temporary, temporary.open("wb") as file:
        number, by_maps, by_ours = (np.array(each) for each in zip(*sorted(counts, key=lambda each: each[0])))
        np.savez_compressed(file, number=number, maps=by_maps, ours=by_ours)


def judge(workers: int | None) -> None:
    """Print in how many cells where the two disagree on whether there are several vibrations a march finds several."""
    kept, rng = np.load(OUT / "vibrations.npz"), np.random.default_rng(SEED)
    maps, ours, known = kept["maps"], kept["ours"], (kept["maps"] > 0) & (kept["ours"] > 0)
    for name, cells in {
        "both several": known & (maps > 1) & (ours > 1), "maps alone": known & (maps > 1) & (ours == 1),
        "branches over the level alone": known & (maps == 1) & (ours > 1),
    }.items():  # fmt: skip
        where = np.argwhere(cells)
        chosen = where[rng.permutation(len(where))[:JUDGED]]
        tasks = [(int(kept["number"][i]), int(level), int(frequency)) for i, level, frequency in chosen]
        several = sum(
            differences for _, differences in run_tasks(differ, tasks, workers, processes=True, progress=name)
        )
        print(f"several vibrations by {name}: {len(where)} cells; marches find several in {several} of {len(chosen)}")


def differ(cell: tuple[int, int, int]) -> bool:
    """Return whether the motions of one cell differ that sweeps of frequency or level end in, steady or not."""
    number, level, i = cell
    duration = 2 * JUDGED_PERIODS / FREQUENCIES[i]
    forces = [swept_to(designs().model(number), level, i, sweep, duration) for sweep in SWEEPS]
    return bool(np.ptp(forces, axis=0).max() > 0.02 * np.max(forces))


def swept_to(model: cm.Model, level: int, i: int, sweep: tuple[float, float], duration: float) -> np.ndarray:
    """Return the largest contact forces (n_bushings,) of a cell, swept to from shares of its frequency and level."""
    frequency, (of_frequency, of_level) = float(FREQUENCIES[i]), sweep
    counted = COUNTED / frequency
    t = np.arange(int((duration + max(JUDGED_PERIODS / frequency, LEAST) + counted) * RATE)) / RATE
    fraction = np.minimum(t / duration, 1.0)
    phase = 2 * np.pi * np.cumsum(frequency * (of_frequency + (1 - of_frequency) * fraction)) / RATE
    value = LEVELS[level] * (of_level + (1 - of_level) * fraction) * np.sin(phase)
    force = cm.simulate(model, cm.Excitation(value, RATE), engine="modal").contact_force
    return np.abs(force[:, -int(counted * RATE) :]).max(axis=1)


def counts_of(number: int) -> np.ndarray:
    """Return whether a design is known, touches at all, and does if raised from rest, (3, n_levels, n_frequencies)."""
    settings = settings_of(MODEL, Sines(LEVELS, FREQUENCIES))
    return rattling_of(settings, Batch(number, designs()[number : number + 1])).counts[:3] > 0


def touching(task: tuple[int, list[tuple[int, int]]]) -> np.ndarray:
    """Return in which cells the marches of a design touch if raised from rest, and at all, (2, n_cells)."""
    number, cells = task
    model, touches = designs().model(number), np.zeros((2, len(cells)), dtype=bool)
    for k, (level, i) in enumerate(cells):
        slow = max(RAISED, 2 * JUDGED_PERIODS / FREQUENCIES[i])
        touches[0, k] = swept_to(model, level, i, SWEEPS[0], slow).any()
        touches[1, k] = touches[0, k] or any(swept_to(model, level, i, sweep, slow).any() for sweep in SWEEPS[1:])
    return touches


def rest(workers: int | None, n_designs: int) -> None:
    """Print how far shares that touch are from those of marches, in cells in which some of the designs do."""
    ours = np.empty((n_designs, 3, LEVELS.size, FREQUENCIES.size), dtype=bool)
    for number, counts in run_tasks(counts_of, range(n_designs), workers, processes=True, progress="branches"):
        ours[number] = counts
    known, *touch = ours.sum(axis=0)
    some = (known == n_designs) & np.any([(n > 0.05 * n_designs) & (n < 0.95 * n_designs) for n in touch], axis=0)
    cells = np.random.default_rng(SEED).choice(np.argwhere(some), RESTED, replace=False).tolist()
    marched, tasks = np.empty((n_designs, 2, len(cells)), dtype=bool), [(i, cells) for i in range(n_designs)]
    for (number, _), counts in run_tasks(touching, tasks, workers, processes=True, progress="marches"):
        marched[number] = counts
    for k, name in enumerate(("can touch", "touch if raised from rest")):
        by_branches = np.array([ours[:, 1 + k, level, i] for level, i in cells]).T
        by_marches = marched[:, 1 - k]
        fraction, other = by_branches.mean(axis=0), by_marches.mean(axis=0)
        low, high = share_interval(fraction, n_designs)
        off = np.sum((other < low) | (other > high))
        print(f"{name}: {off} of {len(cells)} cells off by more than their intervals; {n_designs} designs, largest "
              f"difference {100 * np.abs(fraction - other).max():.1f} points, branches and marches differ in "
              f"{np.sum(by_branches != by_marches)} of {by_marches.size} motions "
              f"({np.sum(by_branches & ~by_marches)} touch by branches alone)")  # fmt: skip
    with replacing(OUT / "rest.npz") as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, cells=cells, marched=marched, ours=ours)


def march(number: int) -> np.ndarray:
    """March a design under sines at some levels and frequencies; return the largest contact force once it is steady."""
    rng, model = np.random.default_rng([SEED, number]), designs().model(number)
    low, high = FREQUENCIES < LOW, (FREQUENCIES >= LOW) & (FREQUENCIES < HIGHEST)
    columns = [("design", int), ("level", int), ("frequency", int), ("contact_force", float)]
    records = np.empty(2 * CELLS, dtype=columns)
    chosen = [i for band in (low, high) for i in rng.choice(np.flatnonzero(band), CELLS)]
    for cell, i in enumerate(chosen):
        level, frequency = int(rng.integers(LEVELS.size)), float(FREQUENCIES[i])
        duration = max(STEADY / frequency, LEAST) + COUNTED / frequency
        sine = cm.excitation.stepped_sine(duration, RATE, frequency, float(LEVELS[level]))
        force = cm.simulate(model, sine, engine="modal").contact_force[:, -int(COUNTED / frequency * RATE) :]
        records[cell] = number, level, i, np.abs(force).max()
    return records


def main(
    part: Literal["maps", "march", "compare", "judge", "rest"], designs: int = 200, workers: int | None = None
) -> None:
    """Run a part."""
    (OUT / "maps").mkdir(parents=True, exist_ok=True)
    warnings.filterwarnings("ignore", "All-NaN")  # of cells that a map loses
    if part in ("compare", "judge"):
        {"compare": compare, "judge": judge}[part](workers)
    elif part == "rest":
        rest(workers, designs)
    elif part == "maps":
        for _ in run_tasks(write_map, range(designs), workers, processes=True, progress="rattle maps"):
            pass
    else:
        cells = [rows for _, rows in run_tasks(march, known(), workers, processes=True, progress="marches")]
        with replacing(OUT / "marched.npz") as temporary, temporary.open("wb") as file:
            np.savez_compressed(file, cells=np.concatenate(cells))


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
