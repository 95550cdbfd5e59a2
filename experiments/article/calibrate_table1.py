"""The rig out of the article's four test frequencies: found from several starts, and the family that fits as well."""

from dataclasses import replace

import numpy as np
import pandas as pd

from clearance_mj import Rig, mac
from clearance_mj.beam import mode_shapes, natural_frequencies
from clearance_mj.calibrate import Calibration, ModalTarget, calibrate, profile, value_of
from clearance_mj.report.calibration import draw
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table

from .published import Printed
from .result import BLACK, BLUE, VERMILION, Item, Result, panel, sheet, to_table

HELD = "bushings[0].position"
EQUAL = {
    HELD: None, "bushings[1].position": None, "bushings.grease.stiffness": (3e2, 3e4), "masses[0].mass": (0.02, 4.0),
}  # fmt: skip
DIAMETER = {"beam.diameter": (0.006, 0.012)}
MATERIAL = {"beam.young_modulus": None, "beam.density": None, "bushings.grease.stiffness": None, "masses[0].mass": None}
START = {HELD: 0.45, "bushings[1].position": 0.85, "bushings.grease.stiffness": 2000.0, "masses[0].mass": 0.2}
"""far from any of what is found"""
STEP = 0.05  # Hz, of the printed frequencies
SHAPE_STD = 0.03  # of a component of a shape of unit length, if shapes were measured
SEARCHED = 0.42, 0.70  # positions of the first bushing between which the family is looked for, m
WORDS = {
    "beam.diameter": "Diameter", "bushings[1].position": "Second bushing",
    "bushings.grease.stiffness": "Grease stiffness", "masses[0].mass": "Tip mass", "fifth_hz": "Fifth frequency",
    "least_mac": "Least MAC of four modes",
}  # fmt: skip
FITS = 1.0  # largest χ² of a rig that fits


def run(item: Item, rig: Rig, quick: bool, starts: int = 32, step: float = 0.01, seed: int = 1) -> Result:
    """Calibrate the rig to Table 1 from some starts, and find the family that fits, a step in m between its rigs.

    Quick: a quarter of the starts, three times the step.
    """
    starts, step = (starts // 4, 3 * step) if quick else (starts, step)
    target = _target()
    fit = calibrate(_started(rig), [target], EQUAL, starts, seed)
    family = _family(fit, target, step)
    material = calibrate(fit.rig, [target], MATERIAL, 1)
    with_shapes = calibrate(fit.rig, [_with_shapes(fit.rig, target)], DIAMETER | EQUAL, 1)
    parameters, members = _parameters(rig, fit), pd.DataFrame(_member(fit, member) for member in family)
    return Result(
        method=(
            "Free: positions of the two bushings, their grease stiffness (the same in both) and the mass at the tip; "
            "given: a steel shaft of 1 m and 8.617 mm diameter. Bounded least squares on the logarithms, "
            f"{starts} starts (Latin hypercube, seed {seed}). Standard deviation of a frequency: rounding to {STEP:g} "
            f"Hz, {STEP / 12**0.5:.4f} Hz. For the family the diameter is free too."
        ),
        shows=_shows(fit, parameters, members, material, with_shapes),
        drawings=(replace(draw(fit), name=item.name), _draw_family(rig, fit, members)),
        data={
            item.name: parameters, f"{item.name}_starts": _starts(fit), f"{item.name}_family": members,
        },
        tables=(_table(parameters, with_shapes), _family_table(members)),
    )  # fmt: skip


def _target() -> ModalTarget:
    frequency = Printed.load(1).numbers["test_hz"]
    return ModalTarget(frequency.to_numpy(), frequency.index.astype(int).to_numpy(), np.full(4, STEP / np.sqrt(12)))


def _started(rig) -> Rig:
    bushings = tuple(
        replace(b, position=START[f"bushings[{i}].position"],
                            grease=replace(b.grease, stiffness=START["bushings.grease.stiffness"]))
        for i, b in enumerate(rig.bushings)
    )  # fmt: skip
    return rig.replace(bushings=bushings, masses=(replace(rig.masses[0], mass=START["masses[0].mass"]),))


def _family(fit, target, step) -> list[Calibration]:
    """Rigs that fit, by the position of the first bushing, outwards from the one that was found."""
    free = DIAMETER | {path: bounds for path, bounds in EQUAL.items() if path != HELD}
    middle = round(fit.estimates.value[0], 2)
    ways = np.arange(middle + step, SEARCHED[1], step), np.arange(middle, SEARCHED[0], -step)
    members = [m for way in ways for m in _while_fitting(profile(fit.rig, [target], free, HELD, way, 1))]
    return sorted(members, key=lambda m: value_of(m.rig, HELD))


def _while_fitting(members) -> list[Calibration]:
    end = next((i for i, m in enumerate(members) if m.chi2 > FITS), len(members))
    return members[:end]


def _with_shapes(rig, target) -> ModalTarget:
    positions, nodes = zip(*((s.position, s.node) for s in rig.sensors))
    return replace(target, shape=mode_shapes(rig, positions, len(target.mode)), nodes=nodes, shape_std=SHAPE_STD)


def _parameters(rig, fit) -> pd.DataFrame:
    return pd.DataFrame(
        {"parameter": path, "start": value_of(fit.start, path), "calibrated": value, "std": std,
         "shipped_rig": value_of(rig, path)}
        for path, value, std in zip(fit.estimates.names, fit.estimates.value, fit.estimates.std)
    )  # fmt: skip


def _starts(fit) -> pd.DataFrame:
    values = pd.DataFrame([solution.value for solution in fit.solutions], columns=fit.estimates.names)
    chi2 = np.array([solution.chi2 for solution in fit.solutions])
    return values.assign(chi2=chi2, fits=chi2 <= FITS)


def _member(fit, member) -> dict:
    x = [s.position for s in fit.rig.sensors]
    alike = mac(mode_shapes(fit.rig, x, 4), mode_shapes(member.rig, x, 4)).diagonal()
    paths = (HELD, *member.estimates.names)
    values = {path: value_of(member.rig, path) for path in paths}
    fifth = natural_frequencies(member.rig, 5)[4]
    return values | {"chi2": member.chi2, "fifth_hz": float(fifth), "least_mac": float(alike.min())}


def _shows(fit, parameters, members, material, with_shapes) -> str:
    fitting = sum(s.chi2 <= FITS for s in fit.solutions)
    positions = "; ".join(f"bushings at {s.value[0]:.4f} and {s.value[1]:.4f} m" for s in fit.distinct)
    away = ((parameters["calibrated"] - parameters["shipped_rig"]).abs() / parameters["std"]).max()
    count = len(with_shapes.estimates.names)
    spread = 100 * (members["fifth_hz"].max() / members["fifth_hz"].min() - 1)
    return (
        f"{fitting} of {len(fit.solutions)} starts end in {len(fit.distinct)} different rigs with exactly the four "
        f"frequencies ({positions}); the others stop in local minima. The rig of the table, the one nearest to the "
        f"start, is at most {away:.2f} standard deviations from the shipped rig. With the diameter free, a family of "
        f"rigs fits as well; their fifth frequencies differ by up to {spread:.1f} %, and the least MAC with the "
        f"calibrated rig is {members['least_mac'].min():.3f}. With E, ρ, stiffness and mass free instead, "
        f"{material.warnings[0].partition(' (')[0]}: all may grow by the same factor. With shapes measured to "
        f"{100 * SHAPE_STD:g} % of their length, {count - len(with_shapes.unidentified)} of {count} parameters would "
        f"be identified, the mass to {100 * with_shapes.estimates.varied_std[-1]:.1f} %."
    )


def _table(parameters, with_shapes) -> Table:
    columns = (
        Column("Parameter"), Column("Start", "", ".4g"), Column("Calibrated", "", ".5g"), Column("Std", "", ".2g"),
        Column("Shipped rig", "", ".5g"), Column("Std, diameter free, with shapes", "", ".2g"),
    )  # fmt: skip
    std = dict(zip(with_shapes.estimates.names, with_shapes.estimates.std))
    shown = parameters.assign(with_shapes=parameters["parameter"].map(std))
    return to_table("parameters", "Parameters in SI units; standard deviations to first order", columns, shown)


def _family_table(members) -> Table:
    columns = (
        Column("First bushing", "m", ".3f"), Column("Diameter", "mm", ".4f"), Column("Second bushing", "m", ".4f"),
        Column("Grease stiffness", "N/m", ".0f"), Column("Tip mass", "kg", ".4f"),
        Column("Fifth frequency", "Hz", ".2f"), Column("Least MAC", "", ".4f"),
    )  # fmt: skip
    shown = members.iloc[::4].drop(columns="chi2").assign(**{"beam.diameter": 1e3 * members["beam.diameter"]})
    return to_table("family", "Some rigs of the family with the same four natural frequencies", columns, shown)


def _draw_family(rig, fit, members) -> Drawing:
    figure = sheet(4.2)
    units = {
        "beam.diameter": ("mm", 1e3), "bushings[1].position": ("m", 1), "bushings.grease.stiffness": ("kN/m", 1e-3),
    }  # fmt: skip
    units |= {"masses[0].mass": ("kg", 1), "fifth_hz": ("Hz", 1), "least_mac": ("1", 1)}
    for ax, (name, (unit, scale)) in zip(figure.subplots(2, 3, sharex=True).flat, units.items()):
        ax.plot(members[HELD], scale * members[name], color=BLUE, marker="o", ms=3, lw=1)
        names = fit.estimates.names
        if name in names or name in DIAMETER:
            i = names.index(name) if name in names else None
            for s in fit.distinct:
                y = value_of(rig, name) if i is None else s.value[i]
                ax.plot(s.value[0], scale * y, "D", color=VERMILION, ms=6, label="found with the diameter given")
            ax.plot(value_of(rig, HELD), scale * value_of(rig, name), "x", color=BLACK, ms=6, label="shipped rig")
        panel(ax, "", "First bushing (m)", f"{WORDS[name]} ({unit})")
    for ax in figure.axes[:3]:
        ax.set_xlabel("")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    named = dict(zip(labels, handles))
    figure.legend(named.values(), named.keys(), loc="outside upper center", ncols=2, fontsize=8, frameon=False)
    caption = (
        "Rigs with the four test frequencies of Table 1, over the position of their first bushing. The fifth frequency "
        "and the shapes at the eight sensors (MAC with the calibrated rig) would distinguish them."
    )
    return Drawing("calibrate_table1_family", figure, caption, "Parameters of the family of rigs that fit Table 1.")
