"""Modal against links against rig: shapes, backbones, harmonics, jumps and best linear approximations."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from clearance_mj.clearance.law import ConstantLaw
from clearance_mj.engines import simulate
from clearance_mj.report.figures import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.signals.correlation import compare, mac
from clearance_mj.signals.ema import Modes, extract_modes
from clearance_mj.signals.excitation import Excitation, multisine, stepped_sine
from clearance_mj.signals.nonlinear import BestLinear, best_linear, stepped_harmonics
from clearance_mj.signals.response import Response
from clearance_mj.testrig import Truth
from clearance_mj.testrig.plans import BAND, FS, Plan
from clearance_mj.testrig.records import take

from .context import Context
from .modal_links_rig_figures import (
    draw_backbones,
    draw_best_linear,
    draw_harmonics,
    draw_jumps,
    draw_shapes,
)
from .result import Result

__all__ = ["FULL", "QUICK", "Setup", "run"]

NAME = "modal_links_rig"
PERIOD = 2.0  # s, of the multisines
N_MODES = 4
ORDERS = 5
BUSHING = 1  # index of the one that closes first under mode 1
REDUCED = {"stiffness": 1300.0, "damping": 1.2}  # N/m, N s/m
GREASE_ONLY = "modal, no contact"


@dataclass(frozen=True)
class Setup:
    """How much is measured."""

    engines: tuple[str, ...]
    """names"""
    levels: tuple[float, ...]
    """m/s² RMS of the multisines, rising"""
    shown: tuple[float, ...]
    """levels whose best linear approximation is drawn"""
    realisations: int
    """multisines of each level"""
    periods: int
    """kept of each realisation"""
    drop: int
    """periods before them"""
    amplitudes: tuple[float, ...]
    """m/s², of the sine whose harmonics are looked at"""
    sweeps: Mapping[str, tuple[float, ...]]
    """Hz, steps upwards by the grease: "as it is" or "reduced" """
    dwell: float
    """s, of each step"""


FULL = Setup(
    engines=("links", "modal", "modal-mj"),
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
    engines=("modal",),
    levels=(0.5, 4.0),
    shown=(0.5, 4.0),
    realisations=2,
    periods=2,
    drop=1,
    amplitudes=(0.1, 0.8),
    sweeps={"reduced": (8.0, 9.0, 9.5, 10.0, 11.0)},
    dwell=1.5,
)
SINE = 9.25  # Hz, mode 1 in the gap
SWEEP_AMPLITUDE = 1.0  # m/s²

System = Callable[[Excitation, int], Response]
"""Rig or engine: response to an excitation; the seed is that of drift and noise"""


def run(context: Context, setup: Setup | None = None) -> Result:
    """Shake the rig and the engines alike.

    Parameters
    ----------
    context : Context
        Gives rig and law.
    setup : Setup, optional
        How much is measured; default: `FULL`, or `QUICK` for a quick context.
    """
    setup = setup or (QUICK if context.quick else FULL)
    knowledge, row = context.laws[-1], _row(context.dataset.rig, BUSHING)
    systems = _systems(context, knowledge.law, setup)
    approximations = _approximations(context, systems, setup)
    modes = {key: extract_modes(found.frf, N_MODES) for key, found in approximations.items()}
    backbones, macs = _backbones(approximations, setup), _macs(modes, setup)
    harmonics, jumps = _harmonics(context, systems, knowledge.law, setup), _jumps(context, systems, setup)
    figures = {
        "shapes": draw_shapes(context.dataset.rig, modes, macs, setup),
        "backbones": draw_backbones(backbones),
        "harmonics": draw_harmonics(harmonics, context.dataset.rig.bushings[BUSHING].gap),
        "jumps": draw_jumps(jumps),
        "best_linear": draw_best_linear(approximations, setup.shown, row, context.dataset.rig.sensors[row].node),
    }
    return Result(
        title="Modal against links against rig",
        article=ARTICLE,
        method=_method(setup, knowledge.name),
        shows=" ".join(
            (
                _shapes_in_words(macs, setup),
                _backbones_in_words(backbones, setup),
                _scatter_in_words(approximations, setup, row),
                _harmonics_in_words(harmonics, setup),
                _jumps_in_words(jumps, setup),
            )
        ),
        differs=DIFFERS,
        drawings=[Drawing(f"{NAME}_{key}", figure, *CAPTIONS[key]) for key, figure in figures.items()],
        data={
            NAME: backbones,
            f"{NAME}_mac": macs,
            f"{NAME}_harmonics": harmonics,
            f"{NAME}_jumps": jumps,
            f"{NAME}_best_linear": _best_linear_rows(approximations, setup, context.dataset.rig),
        },
        tables=(_backbone_table(backbones), _scatter_table(approximations, row), _jump_table(jumps)),
        knows={
            "rig": "nothing: it is the virtual test rig (synthetic), measured with 1 % noise and 24 bits",
            "engines": f"{knowledge.prior_information}; driven by the commanded excitation, not the measured one",
            "engines, grease reduced": (
                "in addition the stiffness and damping of the grease that the rig was given; sliding share, yield, "
                "film and contact stay as identified with the other grease"
            ),
            GREASE_ONLY: "the same law with the contact's force left out",
        },
    )


# Measuring.


def _systems(context, law, setup) -> dict[tuple[str, str], System]:
    """Rig and engines by (grease, name)."""
    rig = context.dataset.rig
    reduced = Truth(grease_stiffness=REDUCED["stiffness"], film_damping=REDUCED["damping"])
    reduced_law = replace(law, grease=tuple(replace(g, **REDUCED) for g in law.grease))
    systems = {}
    for state, truth, its_law in (("as it is", Truth(), law), ("reduced", reduced, reduced_law)):
        systems[state, "rig"] = _rig(rig, truth)
        systems |= {(state, engine): _engine(rig, its_law, engine) for engine in setup.engines}
    return systems


def _rig(rig, truth) -> System:
    def measure(excitation, seed):
        return take(Plan(NAME, "validate", excitation, NAME, seed), rig, truth, NAME).response()

    return measure


def _engine(rig, law, engine) -> System:
    return lambda excitation, seed: simulate(rig, excitation, law, engine)


def _shake(jobs) -> list[Response]:
    """Responses of (system, excitation, seed); compiled loops release the interpreter's lock."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda job: job[0](*job[1:]), jobs))


def _approximations(context, systems, setup) -> dict[tuple[str, float], BestLinear]:
    """Best linear approximations by (system, level); all are shaken by the same multisines."""
    found = {}
    for level in setup.levels:
        context.stage(f"multisines of {level:g} m/s²")
        names = [name for state, name in systems if state == "as it is"]
        jobs = [
            (systems["as it is", name], _multisine(level, m, setup), m)
            for name in names
            for m in range(setup.realisations)
        ]
        responses = iter(_shake(jobs))
        for name in names:
            records = [next(responses) for _ in range(setup.realisations)]
            found[name, level] = best_linear(records, PERIOD, setup.drop)
    return found


def _multisine(level, seed, setup) -> Excitation:
    duration = PERIOD * (setup.drop + setup.periods)
    return multisine(duration, FS, BAND, level, seed, period=PERIOD)


def _harmonics(context, systems, law, setup) -> list[dict]:
    """Harmonics of the motion in a bushing under a sine whose amplitude steps upwards."""
    context.stage("sine of rising amplitude")
    size = len(setup.amplitudes)
    shake = stepped_sine(size * setup.dwell, FS, SINE, setup.amplitudes)
    tried = {name: system for (state, name), system in systems.items() if state == "as it is"}
    tried[GREASE_ONLY] = _engine(context.dataset.rig, ConstantLaw(0.0, 0.0, grease=law.grease), "modal")
    rows = []
    for name, response in zip(tried, _shake([(system, shake, 0) for system in tried.values()])):
        values = stepped_harmonics(response.displacement[:, BUSHING], FS, [SINE] * size, ORDERS)
        for amplitude, of_step in zip(setup.amplitudes, np.abs(values)):
            row = {"system": name, "amplitude_m_s2": amplitude}
            rows += [row | {"harmonic": k, "displacement_m": float(v)} for k, v in enumerate(of_step, 1)]
    return rows


def _jumps(context, systems, setup) -> list[dict]:
    """First harmonic of the motion in a bushing under a sine that steps up and down in frequency."""
    context.stage("stepped sine up and down")
    steps = {state: (*up, *reversed(up)) for state, up in setup.sweeps.items()}
    tried = {key: system for key, system in systems.items() if key[0] in steps}
    jobs = [
        (system, stepped_sine(len(steps[state]) * setup.dwell, FS, steps[state], SWEEP_AMPLITUDE), 0)
        for (state, _), system in tried.items()
    ]
    rows = []
    for (state, name), response in zip(tried, _shake(jobs)):
        values = stepped_harmonics(response.displacement[:, BUSHING], FS, steps[state], 1)
        for i, (frequency, value) in enumerate(zip(steps[state], np.abs(values[:, 0]))):
            direction = "up" if i < len(setup.sweeps[state]) else "down"
            row = {"grease": state, "system": name, "direction": direction}
            rows.append(row | {"frequency_hz": frequency, "displacement_m": float(value)})
    return rows


# What the measurements tell.


def _row(rig, bushing) -> int:
    """Row of the sensor that sits in a bushing."""
    return int(np.argmin([abs(s.position - rig.bushings[bushing].position) for s in rig.sensors]))


def _backbones(approximations, setup) -> list[dict]:
    """Frequency and damping of each mode over level, paired with the rig's modes at the lowest level."""
    reference, rows = approximations["rig", setup.levels[0]].frf, []
    for (name, level), found in approximations.items():
        of = compare(reference, found.frf, N_MODES).per_mode
        for i, mode in enumerate(of["mode"]):
            if np.isfinite(of["test_hz"][i]):
                row = {"system": name, "level_m_s2": level, "mode": int(mode)}
                values = of["model_hz"][i], of["model_damping"][i], of["mac"][i]
                rows.append(row | dict(zip(("frequency_hz", "damping", "mac_with_rig_at_lowest"), map(float, values))))
    return rows


def _macs(modes: Mapping[tuple[str, float], Modes], setup) -> list[dict]:
    """MAC of every system's modes with the rig's, and of the rig's with themselves, at each level."""
    rows = []
    for (name, level), found in modes.items():
        matrix = mac(modes["rig", level].shape, found.shape)
        for (i, j), value in np.ndenumerate(matrix):
            hz = {"rig_hz": float(modes["rig", level].frequency[i]), "system_hz": float(found.frequency[j])}
            place = {"level_m_s2": level, "system": name, "rig_mode": i + 1, "system_mode": j + 1}
            rows.append(place | hz | {"mac": float(value)})
    return rows


def _best_linear_rows(approximations, setup, rig) -> list[dict]:
    """The drawn approximations and the standard deviations of their scatter at the sensors in the bushings, as text."""
    rows = []
    for (name, level), found in approximations.items():
        if level not in setup.shown:
            continue
        columns = np.abs(found.frf.value), np.sqrt(found.noise_variance), np.sqrt(found.distortion_variance)
        for i in (_row(rig, bushing) for bushing in range(len(rig.bushings))):
            place = {"system": name, "level_m_s2": level, "sensor": rig.sensors[i].node}
            for frequency, *values in zip(found.frf.frequency, *(column[i] for column in columns)):
                texts = (f"{value:.6g}" for value in values)
                curves = zip(("magnitude", "noise_std_of_mean", "distortion_std_of_one"), texts)
                rows.append(place | {"frequency_hz": float(frequency)} | dict(curves))
    return rows


def _scatter(found: BestLinear, row: int) -> tuple[float, float]:
    """Noise of the mean and distortion of one realisation at a sensor, over the band, in dB of the FRF."""
    power = np.sum(np.abs(found.frf.value[row]) ** 2)
    sums = np.sum(found.noise_variance[row]), np.sum(found.distortion_variance[row])
    return tuple(float(10 * np.log10(max(value, 1e-30) / power)) for value in sums)


def _hysteresis(jumps, state, name) -> tuple[float, float, float]:
    """Largest ratio of the motions on the way up and down, lowest and highest frequency at which it is above 1.2."""
    values = {
        direction: {
            r["frequency_hz"]: r["displacement_m"]
            for r in jumps
            if (r["grease"], r["system"], r["direction"]) == (state, name, direction)
        }
        for direction in ("up", "down")
    }
    ratio = {f: values["up"][f] / values["down"][f] for f in values["up"]}
    apart = [f for f, value in ratio.items() if max(value, 1 / value) > 1.2]
    largest = max(max(value, 1 / value) for value in ratio.values())
    return largest, min(apart, default=float("nan")), max(apart, default=float("nan"))


# Words and tables.

ARTICLE = (
    "The article models the shaft by assumed modes (Eqs 1-8) and compares one FRF per position with its test. It says "
    "nothing of level, harmonics, jumps, or how far an FRF of a rig with clearance holds; its Section 2 says that "
    "energy loss is nonlinear at re-contact, and its Section 4.2 ascribes what is left at the fourth mode to noise."
)
DIFFERS = (
    "An FRF of a rig with clearance belongs to the level and kind of excitation it was measured with: frequencies and "
    "damping move with level, so one column of natural frequencies as in the article's Table 1 is that of one level. "
    "Scatter from one realisation of the phases to the next is not noise but grease and clearance, and averaging more "
    "periods of one realisation does not show it. The article's bench may have had any of this; its tables cannot "
    "tell. The virtual rig's physics are of the family that the identified law has, which those of a bench need not "
    "be: agreement this close is of the engines with each other and with an independent solution, not a promise."
)
CAPTIONS = {
    "shapes": (
        "(a)-(d): mode shapes at the lowest level, accelerations relative to the largest; (e)-(j): MAC of the rig's "
        "modes with themselves, with links and with modal, at the lowest and the highest level.",
        "Mode shapes and MAC matrices.",
    ),
    "backbones": (
        "Natural frequency and damping ratio of each mode over the level of the multisines. Where a mode is missing, "
        "it does not stand out of the FRFs at that level.",
        "Frequency and damping over level for four modes.",
    ),
    "harmonics": (
        f"Motion in bushing 2 under a sine of {SINE:g} Hz: harmonics 1 to {ORDERS} over its amplitude. Dotted: the "
        "modal engine with the same grease and no contact; the thin line is the radial gap. Even harmonics of the rig "
        "are its noise floor.",
        "Amplitude of five harmonics over level.",
    ),
    "jumps": (
        f"Motion in bushing 2 (first harmonic) under a sine of {SWEEP_AMPLITUDE:g} m/s² that steps up (filled) and "
        "down (open) in frequency without a pause, with the grease as it is and reduced.",
        "Amplitude over frequency, up and down.",
    ),
    "best_linear": (
        "Best linear approximation at the sensor in bushing 2 over levels. Dark band: ± one standard deviation of its "
        "noise; light band: ± one of the nonlinear distortion of a single realisation; below, both by themselves, "
        "variances averaged over five lines. Engines have no noise: what changes from period to period there is the "
        "rest of the transient, or a motion that does not repeat itself; below -80 dB it is off the scale.",
        "FRFs with bands of noise and nonlinear distortion.",
    ),
}


def _method(setup, law) -> str:
    states = " and ".join(setup.sweeps)
    return (
        f"Rig and engines ({', '.join(setup.engines)}) are shaken alike at the base; the engines use the law “{law}”, "
        "identified from the records with role identify. Best linear approximations: random-phase multisines of "
        f"{BAND[0]:g}-{BAND[1]:g} Hz, {1 / PERIOD:g} Hz apart, {setup.realisations} realisations of {setup.periods} "
        f"periods after {setup.drop} for the transient, at {', '.join(f'{level:g}' for level in setup.levels)} m/s² "
        "RMS; the scatter over periods is noise, what the scatter over realisations exceeds it by is nonlinear "
        "distortion (Pintelon and Schoukens, robust method). Modes are extracted from them; shapes and backbones are "
        f"those. Harmonics: a sine of {SINE:g} Hz whose amplitude steps up. Jumps: a sine of {SWEEP_AMPLITUDE:g} m/s² "
        f"that steps up and down in frequency as one record, {setup.dwell:g} s a step, grease {states}; harmonics by "
        f"least squares over the second half of each step. Reduced grease: {REDUCED['stiffness']:g} N/m and "
        f"{REDUCED['damping']:g} N s/m at each bushing, another rig than the shipped one."
    )


def _shapes_in_words(macs, setup) -> str:
    low = setup.levels[0]
    pairs = [r["mac"] for r in macs if r["level_m_s2"] == low and r["rig_mode"] == r["system_mode"]]
    return f"At {low:g} m/s² the shapes of rig and engines differ by 1 - MAC <= {1 - min(pairs):.1g}."


def _backbones_in_words(backbones, setup) -> str:
    low, high = setup.levels[0], setup.levels[-1]
    value = {(r["system"], r["level_m_s2"], r["mode"]): r for r in backbones}
    first = [value["rig", level, 1] for level in (low, high)]
    errors = {
        engine: [
            abs(r["frequency_hz"] / value["rig", r["level_m_s2"], r["mode"]]["frequency_hz"] - 1)
            for r in backbones
            if r["system"] == engine
        ]
        for engine in setup.engines
    }
    worst = ", ".join(f"{engine} {100 * np.nanmax(values):.2f} %" for engine, values in errors.items())
    return (
        f"From {low:g} to {high:g} m/s² mode 1 of the rig goes from {first[0]['frequency_hz']:.2f} to "
        f"{first[1]['frequency_hz']:.2f} Hz and its damping from {100 * first[0]['damping']:.1f} to "
        f"{100 * first[1]['damping']:.1f} %. Largest error of a natural frequency at any level: {worst}."
    )


def _scatter_in_words(approximations, setup, row) -> str:
    high = setup.levels[-1]
    noise, distortion = _scatter(approximations["rig", high], row)
    engines = ", ".join(f"{name} {_scatter(approximations[name, high], row)[1]:.1f} dB" for name in setup.engines)
    return (
        f"At {high:g} m/s² the nonlinear distortion of one realisation at the sensor in bushing 2 is {distortion:.1f} "
        f"dB of the FRF ({engines}), the noise of the mean {noise:.0f} dB."
    )


def _harmonics_in_words(harmonics, setup) -> str:
    value = {(r["system"], r["amplitude_m_s2"], r["harmonic"]): r["displacement_m"] for r in harmonics}
    top = setup.amplitudes[-1]

    def third(name):
        return 100 * value[name, top, 3] / value[name, top, 1]

    engines = ", ".join(f"{engine} {third(engine):.1f} %" for engine in setup.engines)
    return (
        f"Under a sine of {top:g} m/s² the third harmonic of the motion in bushing 2 is {third('rig'):.1f} % of the "
        f"first ({engines}; without contact {third(GREASE_ONLY):.1f} %)."
    )


def _jumps_in_words(jumps, setup) -> str:
    words = []
    for state in setup.sweeps:
        parts = []
        for name in ("rig", *setup.engines):
            largest, low, high = _hysteresis(jumps, state, name)
            width = f" at {low:g}-{high:g} Hz" if np.isfinite(low) else ""
            parts.append(f"{name} {largest:.2f}{width}")
        words.append(f"Largest ratio between the ways up and down, grease {state}: {', '.join(parts)}.")
    return " ".join(words)


def _backbone_table(backbones) -> Table:
    columns = (
        Column("System"),
        Column("Level", "m/s²", "g"),
        *(Column(f"Mode {m}", "Hz", ".2f", "Natural frequency") for m in range(1, N_MODES + 1)),
        *(Column(f"Mode {m}", "%", ".2f", "Damping ratio") for m in range(1, N_MODES + 1)),
    )
    found = {(r["system"], r["level_m_s2"], r["mode"]): r for r in backbones}
    missing = {"frequency_hz": float("nan"), "damping": float("nan")}
    rows = []
    for name, level in dict.fromkeys((r["system"], r["level_m_s2"]) for r in backbones):
        of = [found.get((name, level, mode), missing) for mode in range(1, N_MODES + 1)]
        rows.append((name, level, *(r["frequency_hz"] for r in of), *(100 * r["damping"] for r in of)))
    return Table("backbones", "Natural frequencies and damping over level", columns, tuple(rows))


def _scatter_table(approximations, row) -> Table:
    columns = (
        Column("System"),
        Column("Level", "m/s²", "g"),
        Column("Noise of the mean", "dB", ".1f"),
        Column("Distortion of one realisation", "dB", ".1f"),
    )
    rows = tuple((*key, *_scatter(found, row)) for key, found in approximations.items())
    return Table("scatter", "Scatter of the FRF in bushing 2 over the band, relative to the FRF", columns, rows)


def _jump_table(jumps) -> Table:
    columns = (
        Column("Grease"),
        Column("System"),
        Column("Largest ratio up / down", "", ".2f"),
        Column("From", "Hz", ".2f"),
        Column("To", "Hz", ".2f"),
    )
    keys = dict.fromkeys((r["grease"], r["system"]) for r in jumps)
    rows = tuple((*key, *_hysteresis(jumps, *key)) for key in keys)
    return Table("jumps", "Two motions at one frequency: where they differ by more than a fifth", columns, rows)
