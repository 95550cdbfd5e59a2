"""Modal engine, links engine and virtual rig: shapes, backbones, harmonics, jumps and best linear approximations."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from clearance_mj import ConstantLaw, Law, Response, Rig, compare_modes, mac, simulate
from clearance_mj.core.tasks import run_tasks
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.signals.ema import Modes, extract_modes
from clearance_mj.signals.excitation import Excitation, multisine, stepped_sine
from clearance_mj.signals.nonlinear import BestLinear, best_linear, stepped_harmonics
from clearance_mj.study import Study
from experiments.testrig import Truth
from experiments.testrig.records import BAND, FS, Plan, take

from .modal_links_rig_figures import draw_backbones, draw_best_linear, draw_harmonics, draw_jumps, draw_shapes
from .result import Item, Result, rounded, to_table

NAME = "modal_links_rig"
PERIOD = 2.0  # s, of the multisines
N_MODES = 4
ORDERS = 5
BUSHING = 1  # index of the one that closes first under mode 1
REDUCED = {"stiffness": 1300.0, "damping": 1.2}  # N/m, N s/m
GREASE_ONLY = "modal, no contact"


@dataclass(frozen=True)
class Setup:
    """Engines, levels and realisations of a measurement."""

    engines: tuple[str, ...]  #: names
    levels: tuple[float, ...]  #: m/s² RMS of the multisines, rising
    shown: tuple[float, ...]  #: levels whose best linear approximation is drawn
    realisations: int  #: multisines of each level
    periods: int  #: kept of each realisation
    drop: int  #: periods before them
    amplitudes: tuple[float, ...]  #: m/s², of the sine whose harmonics are looked at
    sweeps: Mapping[str, tuple[float, ...]]  #: Hz, steps upwards by the grease: "as it is" or "reduced"
    dwell: float  #: s, of each step


FULL = Setup(
    engines=("links", "modal"),
    levels=(0.25, 0.5, 1.0, 2.0, 4.0, 8.0),
    shown=(0.25, 2.0, 8.0),
    realisations=6,
    periods=2,
    drop=2,
    amplitudes=tuple(0.05 * 2.0**i for i in range(8)),
    sweeps={
        "as it is": tuple(round(10.4 + 0.05 * i, 2) for i in range(13)),
        "reduced": tuple(8.0 + 0.25 * i for i in range(13)),
    },
    dwell=3.0,
)
QUICK = Setup(
    engines=("modal",), levels=(0.5, 4.0), shown=(0.5, 4.0), realisations=2, periods=2, drop=1, amplitudes=(0.1, 0.8),
    sweeps={"reduced": (8.0, 9.0, 9.5, 10.0, 11.0)}, dwell=1.5,
)  # fmt: skip
SINE = 9.25  # Hz, mode 1 in the gap
SWEEP_AMPLITUDE = 1.0  # m/s²

System = Callable[[Excitation, int], Response]
"""Rig or engine: response to an excitation; the seed is that of drift and noise"""


Approximations = Mapping[tuple[str, float], BestLinear]  # By system and level


def run(item: Item, study: Study, quick: bool, setup: Setup | None = None) -> Result:
    """Shake the rig and the engines alike, with the study's last law; default setup: `FULL`, or `QUICK` if quick."""
    setup = setup or (QUICK if quick else FULL)
    rig, law = study.dataset.rig, study.laws[-1]
    row, systems = _row(rig, BUSHING), _systems(rig, law.law, setup)
    approximations = _approximations(systems, setup)
    modes = {key: extract_modes(bla.frf, N_MODES) for key, bla in approximations.items()}
    backbones, macs = _backbones(approximations, setup), _macs(modes)
    harmonics, jumps = _harmonics(rig, systems, law.law, setup), _jumps(systems, setup)
    figures = {
        "shapes": draw_shapes(rig, modes, macs, setup), "backbones": draw_backbones(backbones),
        "harmonics": draw_harmonics(harmonics, rig.bushings[BUSHING].gap), "jumps": draw_jumps(jumps),
        "best_linear": draw_best_linear(approximations, setup.shown, row, rig.sensors[row].node),
    }  # fmt: skip
    words = (
        _shapes_in_words(macs, setup), _backbones_in_words(backbones, setup), _harmonics_in_words(harmonics, setup)
    )  # fmt: skip
    return Result(
        method=_method(setup, law.name),
        shows=" ".join(words),
        drawings=[Drawing(f"{item.name}_{key}", figure, *CAPTIONS[key]) for key, figure in figures.items()],
        data={
            item.name: backbones, f"{item.name}_mac": macs, f"{item.name}_harmonics": harmonics,
            f"{item.name}_jumps": jumps, f"{item.name}_best_linear": _over_frequency(approximations, setup, rig),
        },
        tables=(_backbone_table(backbones, setup), _scatter_table(approximations, setup, row), _jump_table(jumps)),
        prior_information={
            "rig": "none: the virtual test rig (synthetic), measured with 1 % noise and 24 bits",
            "engines": f"{law.prior_information}; driven by the commanded excitation",
            "engines, grease reduced": "in addition the stiffness and damping of the reduced grease",
            GREASE_ONLY: "the same law without contact force",
        },
    )  # fmt: skip


# Measuring.


def _systems(rig: Rig, law: Law, setup: Setup) -> dict[tuple[str, str], System]:
    """Rig and engines by (grease, name)."""
    reduced = Truth(grease_stiffness=REDUCED["stiffness"], film_damping=REDUCED["damping"])
    reduced_law = replace(law, grease=tuple(replace(g, **REDUCED) for g in law.grease))
    systems = {}
    for state, truth, its_law in (("as it is", Truth(), law), ("reduced", reduced, reduced_law)):
        systems[state, "rig"] = _rig(rig, truth)
        systems |= {(state, engine): _engine(rig, its_law, engine) for engine in setup.engines}
    return systems


def _rig(rig: Rig, truth: Truth) -> System:
    def measure(excitation, seed):
        return take(Plan(NAME, "validate", excitation, NAME, seed), rig, truth, NAME).response()

    return measure


def _engine(rig: Rig, law: Law, engine: str) -> System:
    return lambda excitation, seed: simulate(rig, excitation, law, engine)


def _shake(jobs: Sequence[tuple[System, Excitation, int]]) -> list[Response]:
    """Responses in the jobs' order; compiled loops release the interpreter's lock."""
    results = dict(run_tasks(lambda i: jobs[i][0](*jobs[i][1:]), range(len(jobs))))
    return [results[i] for i in range(len(jobs))]


def _approximations(systems: Mapping[tuple[str, str], System], setup: Setup) -> Approximations:
    """All are shaken by the same multisines."""
    names = [name for state, name in systems if state == "as it is"]
    shakes = [(name, level, seed) for level in setup.levels for name in names for seed in range(setup.realisations)]
    responses = _shake([(systems["as it is", n], _multisine(level, seed, setup), seed) for n, level, seed in shakes])
    records: dict[tuple[str, float], list[Response]] = {}
    for (name, level, _), response in zip(shakes, responses):
        records.setdefault((name, level), []).append(response)
    return {key: best_linear(record, PERIOD, setup.drop) for key, record in records.items()}


def _multisine(level: float, seed: int, setup: Setup) -> Excitation:
    return multisine(PERIOD * (setup.drop + setup.periods), FS, BAND, level, seed, period=PERIOD)


def _harmonics(rig: Rig, systems: Mapping[tuple[str, str], System], law: Law, setup: Setup) -> pd.DataFrame:
    """Harmonics of the motion in a bushing under a sine whose amplitude steps upwards."""
    size = len(setup.amplitudes)
    shake = stepped_sine(size * setup.dwell, FS, SINE, setup.amplitudes)
    tried = {name: system for (state, name), system in systems.items() if state == "as it is"}
    tried[GREASE_ONLY] = _engine(rig, ConstantLaw(0.0, 0.0, grease=law.grease), "modal")
    rows = []
    for name, response in zip(tried, _shake([(system, shake, 0) for system in tried.values()])):
        values = stepped_harmonics(_motion(response), FS, [SINE] * size, ORDERS)
        for amplitude, of_step in zip(setup.amplitudes, np.abs(values)):
            rows += [(name, amplitude, k, v) for k, v in enumerate(of_step, 1)]
    return pd.DataFrame(rows, columns=["system", "amplitude_m_s2", "harmonic", "displacement_m"])


def _motion(response: Response) -> np.ndarray:
    return response.displacement[BUSHING]


def _jumps(systems: Mapping[tuple[str, str], System], setup: Setup) -> pd.DataFrame:
    """First harmonic of the motion in a bushing under a sine that steps up and down in frequency."""
    steps = {state: (*up, *reversed(up)) for state, up in setup.sweeps.items()}
    tried = {key: system for key, system in systems.items() if key[0] in steps}
    jobs = [
        (system, stepped_sine(len(steps[state]) * setup.dwell, FS, steps[state], SWEEP_AMPLITUDE), 0)
        for (state, _), system in tried.items()
    ]
    frames = []
    for (state, name), response in zip(tried, _shake(jobs)):
        values = stepped_harmonics(_motion(response), FS, steps[state], 1)
        directions = np.repeat(["up", "down"], len(setup.sweeps[state]))
        moves = {"frequency_hz": steps[state], "displacement_m": np.abs(values[:, 0])}
        frames.append(pd.DataFrame({"grease": state, "system": name, "direction": directions} | moves))
    return pd.concat(frames, ignore_index=True)


# What the measurements tell.


def _row(rig: Rig, bushing: int) -> int:
    """Row of the sensor that sits in a bushing."""
    return int(np.argmin([abs(s.position - rig.bushings[bushing].position) for s in rig.sensors]))


def _backbones(approximations: Approximations, setup: Setup) -> pd.DataFrame:
    """Frequency and damping of each mode over level, paired with the rig's modes at the lowest level."""
    reference, frames = approximations["rig", setup.levels[0]].frf, []
    for (name, level), bla in approximations.items():
        of = compare_modes(reference, bla.frf, N_MODES).dropna(subset="test_hz")
        frames.append(of.assign(system=name, level_m_s2=level))
    new = {"model_hz": "frequency_hz", "model_damping": "damping", "mac": "mac_with_rig_at_lowest"}
    return pd.concat(frames, ignore_index=True)[["system", "level_m_s2", "mode", *new]].rename(columns=new)


def _macs(modes: Mapping[tuple[str, float], Modes]) -> pd.DataFrame:
    """MAC of every system's modes with the rig's, and of the rig's with themselves, at each level."""
    rows = []
    for (name, level), extracted in modes.items():
        rig = modes["rig", level]
        for (i, j), value in np.ndenumerate(mac(rig.shape, extracted.shape)):
            rows.append((level, name, i + 1, j + 1, rig.frequency[i], extracted.frequency[j], value))
    columns = ["level_m_s2", "system", "rig_mode", "system_mode", "rig_hz", "system_hz", "mac"]
    return pd.DataFrame(rows, columns=columns)


def _over_frequency(approximations: Approximations, setup: Setup, rig: Rig) -> pd.DataFrame:
    """The drawn approximations and the standard deviations of their scatter at the sensors in the bushings."""
    frames = []
    for (name, level), bla in approximations.items():
        for i in (_row(rig, bushing) for bushing in range(len(rig.bushings)) if level in setup.shown):
            curves = {
                "magnitude": np.abs(bla.frf.functions[i]),
                "noise_std_of_mean": np.sqrt(bla.noise_variance[i, 0]),
                "distortion_std_of_one": np.sqrt(bla.distortion_variance[i, 0]),
            }
            frame = rounded(pd.DataFrame({"frequency_hz": bla.frf.frequency} | curves), 6)
            for column, value in (("sensor", rig.sensors[i].node), ("level_m_s2", level), ("system", name)):
                frame.insert(0, column, value)
            frames.append(frame)
    return pd.concat(frames, ignore_index=True)


def _scatter(bla: BestLinear, row: int) -> tuple[float, float]:
    """Noise of the mean and distortion of one realisation at a sensor, over the band, in dB of the FRF."""
    power = np.sum(np.abs(bla.frf.functions[row]) ** 2)
    sums = np.sum(bla.noise_variance[row]), np.sum(bla.distortion_variance[row])
    return tuple(float(10 * np.log10(max(value, 1e-30) / power)) for value in sums)


def _hysteresis(jumps: pd.DataFrame) -> pd.DataFrame:
    """Largest ratio of the motions on the way up and down, lowest and highest frequency at which it is above 1.2."""
    keys = ["grease", "system"]
    wide = jumps.pivot(index=[*keys, "frequency_hz"], columns="direction", values="displacement_m")
    ratio = np.maximum(wide["up"] / wide["down"], wide["down"] / wide["up"]).rename("ratio").reset_index()
    largest_ratio = ratio.groupby(keys)["ratio"].max().to_frame()
    largest_ratio[["low", "high"]] = ratio[ratio["ratio"] > 1.2].groupby(keys)["frequency_hz"].agg(["min", "max"])
    return largest_ratio.reindex(pd.MultiIndex.from_frame(jumps[keys].drop_duplicates()))


# Words and tables.

CAPTIONS = {
    "shapes": (
        "(a)-(d): mode shapes at the lowest level; (e)-(j): MAC of the rig's modes with themselves, with links and "
        "with modal, at the lowest and the highest level.",
        "Mode shapes and MAC matrices.",
    ),
    "backbones": (
        "Natural frequency and damping ratio of each mode over the level of the multisines: both move with level.",
        "Frequency and damping over level for four modes.",
    ),
    "harmonics": (
        f"Harmonics 1 to {ORDERS} of the motion in bushing 2 under a sine of {SINE:g} Hz. Dotted: without contact; "
        "thin line: radial gap. Even harmonics of the rig are its noise floor.",
        "Amplitude of five harmonics over level.",
    ),
    "jumps": (
        f"Motion in bushing 2 (first harmonic) under a sine of {SWEEP_AMPLITUDE:g} m/s² that steps up (filled) and "
        "down (open) in frequency: with reduced grease the motion jumps.",
        "Amplitude over frequency, up and down.",
    ),
    "best_linear": (
        "Best linear approximation at the sensor in bushing 2. Dark band: ± one standard deviation of its noise; light "
        "band: ± one of the nonlinear distortion of a single realisation, which grows with level; below, both alone.",
        "FRFs with bands of noise and nonlinear distortion.",
    ),
}


def _method(setup, law) -> str:
    return (
        f"Rig and engines ({', '.join(setup.engines)}, law “{law}”) are shaken alike at the base. Best linear "
        f"approximations: random-phase multisines of {BAND[0]:g}-{BAND[1]:g} Hz, {1 / PERIOD:g} Hz apart, "
        f"{setup.realisations} realisations of {setup.periods} periods after {setup.drop} for the transient, at "
        f"{', '.join(f'{level:g}' for level in setup.levels)} m/s² RMS; the scatter over periods is noise, the excess "
        "of the scatter over realisations nonlinear distortion (Pintelon and Schoukens, robust method). Harmonics: a "
        f"sine of {SINE:g} Hz with rising amplitude. Jumps: a sine of {SWEEP_AMPLITUDE:g} m/s² that steps up and down "
        f"in frequency, {setup.dwell:g} s a step. Reduced grease: {REDUCED['stiffness']:g} N/m and "
        f"{REDUCED['damping']:g} N s/m at each bushing."
    )


def _shapes_in_words(macs: pd.DataFrame, setup: Setup) -> str:
    low = setup.levels[0]
    pairs = macs["mac"][(macs["level_m_s2"] == low) & (macs["rig_mode"] == macs["system_mode"])]
    return f"At {low:g} m/s² the shapes of rig and engines differ by 1 - MAC <= {1 - pairs.min():.1g}."


def _backbones_in_words(backbones: pd.DataFrame, setup: Setup) -> str:
    indexed = backbones.set_index(["system", "level_m_s2", "mode"])
    low, high = (indexed.loc[("rig", level, 1)] for level in (setup.levels[0], setup.levels[-1]))
    hz = indexed["frequency_hz"]
    errors = {engine: 100 * (hz[engine] / hz["rig"] - 1).abs().max() for engine in setup.engines}
    worst = ", ".join(f"{engine} {error:.2f} %" for engine, error in errors.items())
    return (
        f"From {setup.levels[0]:g} to {setup.levels[-1]:g} m/s² mode 1 of the rig goes from {low['frequency_hz']:.2f} "
        f"to {high['frequency_hz']:.2f} Hz and its damping from {100 * low['damping']:.1f} to "
        f"{100 * high['damping']:.1f} %. Largest error of a natural frequency at any level: {worst}."
    )


def _harmonics_in_words(harmonics: pd.DataFrame, setup: Setup) -> str:
    top = harmonics[harmonics["amplitude_m_s2"] == setup.amplitudes[-1]]
    wide = top.pivot(index="system", columns="harmonic", values="displacement_m")
    third = 100 * wide[3] / wide[1]
    engines = ", ".join(f"{engine} {third[engine]:.1f} %" for engine in setup.engines)
    return (
        f"Under a sine of {setup.amplitudes[-1]:g} m/s² the third harmonic of the motion in bushing 2 is "
        f"{third['rig']:.1f} % of the first ({engines}; without contact {third[GREASE_ONLY]:.1f} %)."
    )


def _backbone_table(backbones: pd.DataFrame, setup: Setup) -> Table:
    backbones = backbones[backbones["level_m_s2"].isin((setup.levels[0], setup.levels[-1]))]
    keys, modes = ["system", "level_m_s2"], range(1, N_MODES + 1)
    columns = (
        Column("System"), Column("Level", "m/s²", "g"), *(Column(f"f{m}", "Hz", ".2f") for m in modes),
        *(Column(f"ζ{m}", "%", ".2f") for m in modes),
    )  # fmt: skip
    values = ["frequency_hz", "damping"]
    wide = backbones.assign(damping=100 * backbones["damping"]).pivot(index=keys, columns="mode", values=values)
    order = pd.MultiIndex.from_frame(backbones[keys].drop_duplicates())
    wide = wide.reindex(index=order, columns=pd.MultiIndex.from_product([values, modes]))
    caption = "Natural frequencies f and damping ratios ζ of four modes over level"
    return to_table("backbones", caption, columns, wide.reset_index())


def _scatter_table(approximations: Approximations, setup: Setup, row: int) -> Table:
    columns = (
        Column("System"), Column("Level", "m/s²", "g"), Column("Noise of the mean", "dB", ".1f"),
        Column("Distortion of one realisation", "dB", ".1f"),
    )  # fmt: skip
    ends = setup.levels[0], setup.levels[-1]
    rows = [(*key, *_scatter(bla, row)) for key, bla in approximations.items() if key[1] in ends]
    return to_table("scatter", "Scatter of the FRF in bushing 2 over the band, relative to the FRF", columns, rows)


def _jump_table(jumps: pd.DataFrame) -> Table:
    columns = (
        Column("Grease"), Column("System"), Column("Largest ratio", "", ".2f"), Column("From", "Hz", ".2f"),
        Column("To", "Hz", ".2f"),
    )  # fmt: skip
    caption = "Ratio of the motions on the way up and down, and where it exceeds 1.2"
    return to_table("jumps", caption, columns, _hysteresis(jumps).reset_index())
