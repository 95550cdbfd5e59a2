"""Periodic vibrations against marches in time: every stable point by the modal engine, some by links, folds by the rig.

A march by the modal engine begins with the state that harmonic balance finds; one by links, and the virtual rig's
stepped sine, begin at rest where one vibration alone is possible, and come along the frequency. The virtual rig shares
no code with either: finite elements, an implicit integrator, forces of its own.
"""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

import clearance_mj as cm
from clearance_mj.clearance import ConstantLaw, ContactLaw, HuntCrossley, HuntCrossley1975, MaxwellSlip
from experiments.script import run
from experiments.testrig import Truth, simulate_rig

ROOT = Path(__file__).parents[2]
LEVELS = (2.0, 6.0, 8.0)  # m/s²
BAND = (25.0, 60.0)  # Hz
BOUC_WEN = cm.Grease(4369.0, 3.0, elastic_ratio=0.5, beta=9e6, gamma=3e6, film_height=6e-4)
SLIDERS = MaxwellSlip(springs=(1500.0, 1500.0), forces=(0.1, 0.25), elastic=1500.0, damping=3.0)
LAWS = {
    "Kelvin-Voigt": ConstantLaw(7.8e3, 4.0),
    "Hunt-Crossley": ContactLaw(HuntCrossley(5e5, 0.6, first_order=True)),
    "Bouc-Wen grease, squeeze film": ConstantLaw(7.8e3, 4.0, grease=BOUC_WEN),
    "Maxwell-slip grease": ConstantLaw(7.8e3, 4.0, grease=SLIDERS),
}
SETTLED = 1e-5  # relative change of every fundamental from one block of periods to the next
BLOCK, FEWEST, LONGEST = 100, 500, 3000
"""periods, over which amplitudes are means; that are marched at least; and at most"""
CLOSE = 1e-3  # relative difference of fundamentals that is asked for
STEEP = 50.0
"""relative change of a fundamental over that of the frequency: above, as about folds, 2e-5 of the latter are 0.1 %"""
RESOLUTIONS = (0.25, 0.05, 0.02)
"""rad per step of the modal engine: the next one where a point is not close, since steps miss when contacts begin"""
LEFT = 0.1  # relative difference of a march that has left for another vibration
BESIDE = 0.3  # Hz, from a fold to the nearest point that links march: there a small error of the model decides
FS = 2048.0
FOLDED = (6.0, 12.0)  # m/s², of the stepped sine
FINE, HOLD = 0.05, 3.0  # Hz and s of the steps of the stepped sine about a fold


class March(NamedTuple):
    """The last period of a march."""

    history: np.ndarray
    """(n_sensors + n_bushings, N) accelerations of sensors, m/s², and displacements of clearances, m"""
    fundamental: np.ndarray  #: (n_sensors + n_bushings,) mean amplitudes of the last block of periods
    periods: int  #: that were marched
    settled: bool  #: whether the fundamentals had stopped changing


def modal_state(branch: cm.periodic.Branch, i: int, angle: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Modal coordinates of a point's vibration and their velocities, at an angle of the excitation, rad.

    Those of which sensors and clearances know; what they do not know is stiff and soon forgotten.
    """
    model = cm.linear_model(branch.model.rig, branch.n_modes)
    places = [sensor.position for sensor in branch.model.rig.sensors]
    known = np.vstack((branch.displacement[i], branch.clearance_displacement[i], branch.end_displacement[i]))
    of_modes = np.linalg.lstsq(np.vstack((model.shapes(places), model.at_points)), known, rcond=1e-7)[0]
    order = np.arange(known.shape[1]) / branch.periods
    turned = of_modes * np.exp(1j * order * angle)
    return turned.real.sum(axis=1), (2j * np.pi * branch.frequency[i] * order * turned).real.sum(axis=1)


def march(branch: cm.periodic.Branch, i: int, resolution: float = 0.25, longest: int = LONGEST) -> March:
    """March a point of a branch by the modal engine until the fundamentals stay, or for the longest time.

    ``resolution`` is the engine's, rad per step; ``longest`` so many periods.
    """
    engine = cm.Modal(branch.n_modes, resolution)
    period = branch.periods / branch.frequency[i]
    steps = int(np.ceil(period / engine.largest_step(branch.model.rig, branch.model.law)))
    angle = 2 * np.pi * branch.periods * np.arange(steps) / steps
    level = np.pad(branch.level[i], (1, 0))
    excitation = np.tile((level @ np.exp(1j * np.outer(np.arange(level.size), angle))).real, BLOCK)
    run = engine.start(branch.model.rig, branch.model.law, branch.kind, period / steps)
    motion = run.motion
    motion.q[:], motion.v[:] = modal_state(branch, i)
    motion.q_before[:] = modal_state(branch, i, -angle[1])[0]
    rows = len(branch.model.rig.sensors) + len(branch.model.rig.bushings)
    before, settled, done = np.full(rows, np.inf), False, 0
    while (not settled or done < FEWEST) and done < longest:
        last = run.advance(excitation)[:, :rows].T
        now = 2 / last.shape[1] * np.abs(last @ np.exp(-1j * np.tile(angle, BLOCK)))
        settled, before, done = np.abs(now / before - 1).max() < SETTLED, now, done + BLOCK
    return March(last[:, -steps:], before, done, settled)


def fundamentals(branch: cm.periodic.Branch, i: int) -> np.ndarray:
    """Amplitudes of a point's fundamentals, the accelerations of sensors, then the displacements of clearances."""
    return np.abs(np.concatenate((branch.acceleration[i], branch.clearance_displacement[i])))[:, branch.periods]


def histories(branch: cm.periodic.Branch, i: int, samples: int) -> np.ndarray:
    """Return what a point's harmonics say of a period, as `March.history`."""
    harmonics = np.concatenate((branch.acceleration[i], branch.clearance_displacement[i]))
    angle = 2 * np.pi * np.arange(samples) / samples
    return (harmonics @ np.exp(1j * np.outer(np.arange(harmonics.shape[1]), angle))).real


def steep(branch: cm.periodic.Branch) -> np.ndarray:
    """(n,) whether a point's fundamentals change much faster than its frequency, as about folds."""
    amplitude = np.log([fundamentals(branch, i) for i in range(branch.frequency.size)])
    return np.abs(np.gradient(amplitude, axis=0)).max(axis=1) > STEEP * np.abs(np.gradient(np.log(branch.frequency)))


def marched(branch: cm.periodic.Branch, i: int) -> dict:
    """Return how far a stable point is from its march, by finer steps if it is not close."""
    for resolution in RESOLUTIONS:
        settled_motion = march(branch, i, resolution)
        fundamental = np.abs(fundamentals(branch, i) / settled_motion.fundamental - 1).max()
        if fundamental < CLOSE or steep(branch)[i]:
            break
    predicted, n = histories(branch, i, settled_motion.history.shape[1]), len(branch.model.rig.sensors)
    off = np.linalg.norm(predicted - settled_motion.history, axis=1) / np.linalg.norm(settled_motion.history, axis=1)
    return {
        "frequency": branch.frequency[i], "multiplier": abs(branch.multipliers[i, 0]), "steep": bool(steep(branch)[i]),
        "resolution": resolution, "fundamental": fundamental, "acceleration": off[:n].max(),
        "displacement": off[n:].max(), "periods": settled_motion.periods, "settled": settled_motion.settled,
    }  # fmt: skip


def by_links(branch: cm.periodic.Branch, i: int) -> float:
    """Largest relative difference of a stable point's fundamentals from a march by links along the frequency."""
    target = branch.frequency[i]
    folds = [point for point in branch.special if point.kind == "fold"]
    ends = (branch.frequency[0], branch.frequency[-1])
    if folds:
        ends = min(p.frequency for p in folds) - 1.0, max(p.frequency for p in folds) + 1.0
    start = target if not folds else ends[0] if i < folds[0].index else ends[1]
    if folds and (target - start) * (1 if i < folds[0].index else -1) < 0:
        start = target
    fs = 48 * target
    grow, move, hold = (int(s * fs) // 48 * 48 for s in (1.0, abs(target - start), 8.0))
    frequency = np.concatenate((np.full(grow, start), np.linspace(start, target, move), np.full(hold, target)))
    level = branch.level[i, 0].real * np.minimum(np.arange(frequency.size) / grow, 1)
    excitation = cm.Excitation(level * np.cos(2 * np.pi * np.cumsum(frequency) / fs), fs, kind=branch.kind)
    response = cm.simulate(branch.model.rig, excitation, branch.model.law, cm.Links(24))
    rows = np.vstack((response.acceleration, response.displacement))[:, -48 * 60 : -48 * 20]
    return float(np.abs(fundamentals(branch, i) / (2 * np.abs(np.fft.rfft(rows)[:, 40]) / rows.shape[1]) - 1).max())


def of_links(branch: cm.periodic.Branch) -> np.ndarray:
    """Three stable points that are not next to a fold."""
    folds = [point.frequency for point in branch.special if point.kind == "fold"]
    away = [all(abs(f - fold) > BESIDE for fold in folds) for f in branch.frequency]
    at = np.flatnonzero(branch.stable & away)
    return at[(at.size - 1) * np.array([2, 5, 8]) // 10]


def compare(rig: cm.Rig) -> list[dict]:
    """March every law and level; print a row of each."""
    rows = []
    print("| law | m/s² | points | fundamental | displacement | acceleration | beyond | finer | steep | left | links |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name, law in LAWS.items():
        for level in LEVELS:
            branch = cm.periodic.follow_response(cm.Model(rig, law), level, BAND)
            points = [marched(branch, i) for i in tqdm(np.flatnonzero(branch.stable), desc=f"{name}, {level:g} m/s²")]
            links = [{"frequency": branch.frequency[i], "off": by_links(branch, i)} for i in of_links(branch)]
            special = [(point.kind, point.frequency) for point in branch.special]
            rows.append({"law": name, "level": level, "special": special, "points": points, "links": links})
            away = [p for p in points if not p["steep"]]
            near = [p for p in points if p["steep"]]
            worst = [f"{max(p[key] for p in away):.1e}" for key in ("fundamental", "displacement", "acceleration")]
            beyond = sum(p["fundamental"] > CLOSE for p in away)
            finer = sum(p["resolution"] < RESOLUTIONS[0] for p in away)
            left = sum(p["fundamental"] > LEFT for p in near)
            print(
                f"| {name} | {level:g} | {len(away)} | {' | '.join(worst)} | {beyond} | {finer} | {len(near)} | {left} "
                f"| {max(p['off'] for p in links):.1e} |",
                flush=True,
            )
    return rows


def rig_s_law(truth: Truth) -> cm.Law:
    """The law that is what a bushing of the virtual rig really is."""
    contact = HuntCrossley1975(
        truth.contact_stiffness, 1.5 * truth.contact_dissipation * truth.contact_stiffness, truth.contact_exponent
    )
    grease = cm.Grease(
        truth.grease_stiffness, truth.film_damping, elastic_ratio=truth.elastic_ratio, beta=truth.hysteresis.beta,
        gamma=truth.hysteresis.gamma, film_height=truth.film_height, film_limit=truth.film_limit,
    )  # fmt: skip
    return ContactLaw(contact, grease=grease)


def stepped(rig: cm.Rig, truth: Truth, level: float, steps: np.ndarray) -> np.ndarray:
    """Amplitudes, m, of the first clearance's fundamental at the end of every step of the virtual rig's sine."""
    size = int(HOLD * FS)
    excitation = cm.excitation.stepped_sine(steps.size * HOLD, FS, steps, level)
    x = simulate_rig(rig, truth, excitation, seed=0).displacement[0].reshape(steps.size, size)[:, -int(FS) :]
    window, time = np.hanning(x.shape[1]), np.arange(x.shape[1]) / FS
    return 2 * np.abs(np.sum((window * np.exp(-2j * np.pi * np.outer(steps, time))) * x, axis=1)) / window.sum()


def jump(rig: cm.Rig, truth: Truth, level: float, fold: float, outside: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Step from a frequency outside of both folds over one of them; return steps, amplitudes, and where it jumps."""
    sign = np.sign(fold - outside)
    fine = fold + sign * np.arange(-8, 9) * FINE
    steps = np.concatenate((np.arange(outside, fine[0] - sign * 0.05, sign * 0.25), fine))
    amplitude = stepped(rig, truth, level, steps)
    at = int(np.argmax(np.abs(np.diff(np.log(amplitude)))))
    return steps, amplitude, float(steps[at : at + 2].mean())


TRUTHS = {
    "linear grease": Truth(elastic_ratio=1.0, film_damping=3.0, film_height=1e3, drift=0.0),
    "Bouc-Wen grease, film": Truth(elastic_ratio=0.9, film_damping=1.5, film_height=3e-3, drift=0.0),
}


def compare_folds(rig: cm.Rig, out: Path) -> list[dict]:
    """Step the virtual rig's sine over folds, up and down; print a row of each, and draw."""
    rows = []
    figure = Figure(figsize=(9, 4), layout="constrained")
    print("| virtual rig | m/s² | way | fold (Hz) | jump (Hz) | apart |\n|---|---|---|---|---|---|")
    for axes, (name, truth) in zip(figure.subplots(1, len(TRUTHS), sharey=True), TRUTHS.items()):
        for colour, level in enumerate(FOLDED):
            branch = cm.periodic.follow_response(cm.Model(rig, rig_s_law(truth)), level, (35.0, 60.0))
            gap, y = rig.bushings[0].gap, np.abs(branch.clearance_displacement[:, 0, 1])
            axes.plot(branch.frequency, y / gap, "--", color=f"C{colour}", lw=1)
            axes.plot(
                branch.frequency, np.where(branch.stable, y, np.nan) / gap, color=f"C{colour}", label=f"{level:g} m/s²"
            )
            folds = [point.frequency for point in branch.special if point.kind == "fold"]
            if len(folds) != 2:
                continue
            for way, fold, outside in (("up", max(folds), min(folds) - 1), ("down", min(folds), max(folds) + 1)):
                steps, amplitude, at = jump(rig, truth, level, fold, outside)
                axes.plot(steps, amplitude / gap, "^" if way == "up" else "v", color="k", mfc="none", ms=4, lw=0.5)
                rows.append({"rig": name, "level": level, "way": way, "fold": fold, "jump": at})
                print(f"| {name} | {level:g} | {way} | {fold:.3f} | {at:.3f} | {at / fold - 1:+.2%} |", flush=True)
        axes.set_title(name, fontsize=10)
        axes.set(xlabel="frequency (Hz)", xlim=(42, 54))
        axes.legend(fontsize=7)
    figure.axes[0].set_ylabel("displacement at the first bushing over its gap")
    figure.savefig(out, dpi=110)
    return rows


def main(
    out: Path = Path("results/periodic_verification.json"), figure: Path = ROOT / "docs" / "periodic_folds.png",
    parts: Sequence[Literal["marches", "folds"]] = ("marches", "folds"),
) -> None:  # fmt: skip
    """Print both tables; write every figure of them to a JSON file, and draw that of docs/periodic.md."""
    rig = cm.Rig.load(ROOT / "models" / "table1_rig.toml")
    results = {}
    if "folds" in parts:
        results["folds"] = compare_folds(rig, figure)
    if "marches" in parts:
        results["marches"] = compare(rig)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(results, indent=1, default=float) + "\n")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
