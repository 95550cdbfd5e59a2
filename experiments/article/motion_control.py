"""Motion control beyond the article: gap, misestimated gap, preview, plants, and what an identified law is worth."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import scipy.optimize

from clearance_mj import ContactLaw, Law, Rig
from clearance_mj.core.errors import ManoeuvreError
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column, Table
from clearance_mj.report.vehicle import METRICS, look
from clearance_mj.study import Study
from clearance_mj.vehicle.experiment import CONTROLLERS, GAP, LENGTH_FACTORS, REGIMES
from clearance_mj.vehicle.steering import Steering

from .inputs import Runs
from .models import name_of
from .motion import comparison, prior_information
from .result import FONT, Item, Result, panel, sheet, to_table

CONTROLLERS_SWEPT = ("smc", "smc-cm", "mpc", "mpc-cm")
GAPS = (0.0, 0.09, 0.18, 0.27, 0.36, 0.45)  # degrees at the road wheel
ASSUMED = (0.5, 0.75, 1.0, 1.25, 1.5, 2.0)  # assumed gap over the true one
NOISES = 4  # over which the median is taken where the gap is misestimated
PREVIEWS = (0.0, 0.04, 0.07, 0.1, 0.2)  # s
MOMENT = 135.0  # N m, aligning moment at the peak of the lane change at 120 km/h


def run(item: Item, study: Study, runs: Runs, quick: bool) -> Result:
    """Run the sweeps; quick: every fourth value."""
    step = 4 if quick else 1
    sweeps = {
        "gap": _sweep(runs, CONTROLLERS_SWEPT, "half_gap", [float(np.radians(gap)) for gap in GAPS[::-step]]),
        "assumed_gap": _sweep(
            runs, ("smc-cm", "mpc-cm"), "assumed_gap", [fraction * GAP for fraction in ASSUMED[:: step // 2 or 1]],
            range(1 if quick else NOISES),
        ),
        "preview": _sweep(runs, CONTROLLERS_SWEPT, "preview", PREVIEWS[::step]),
        "plants": _sweep(runs, CONTROLLERS_SWEPT, "plant", ("multi-body", "single-track")),
        "identified": _identified(runs, study),
    }  # fmt: skip
    sweeps["assumed_gap"]["assumed"] = sweeps["assumed_gap"]["assumed_gap"] / GAP
    curves_of = {
        "gap": ("half_gap", "Half-gap at the road wheel (°)", "the gap.", 180 / np.pi),
        "assumed_gap": ("assumed", "Assumed gap over true gap (1)", "the gap that the controller assumes.", 1.0),
        "preview": ("preview", "Road known ahead (s)", "the preview.", 1.0),
    }
    return Result(
        method=_METHOD,
        shows=_shows(sweeps["plants"]),
        drawings=[
            _curves(
                sweeps[name], f"{item.name}_{name}", column, label,
                f"Peak lateral error over {words}", scale,
            )
            for name, (column, label, words, scale) in curves_of.items()
        ],
        data={f"{item.name}_{name}": rows for name, rows in sweeps.items()},
        tables=(_assumed_table(sweeps["assumed_gap"]), _identified_table(sweeps["identified"])),
        prior_information=prior_information(),
    )  # fmt: skip


_METHOD = (
    "As for Figure 11, at 72 and 120 km/h, nominal vehicle, seed 0 except for the assumed gap. Identified laws: the "
    "steering's bushings are the rig's to scale, lengths by the gap, forces such that the datasheet contacts agree. "
    "The steering's contacts have the secant stiffness of the last law at the peak aligning moment; SMC-CM assumes "
    "that of each law."
)


def _sweep(
    runs: Runs, controllers: Sequence[str], setting: str, values: Sequence, seeds: Sequence[int] = (0,)
) -> pd.DataFrame:
    """Rows of what comes out with each value of a setting."""
    cases = [c for seed in seeds for value in values for c in comparison(controllers, seed=seed, **{setting: value})]
    return pd.DataFrame(outcome.row() for outcome in runs(cases))


def _laws(study: Study) -> dict[str, float]:
    """Secant stiffness of each law over that of the datasheet, at the force that stands for the peak moment."""
    rig, last = study.dataset.rig, len(study.dataset.rig.bushings) - 1
    bushing = rig.bushings[last]
    force = MOMENT / (Steering().lost_motion.stiffness * GAP) * bushing.contact.stiffness * bushing.gap
    return {k.name: secant_stiffness(k.law, rig, last, force) / bushing.contact.stiffness for k in study.laws}


def _identified(runs: Runs, study: Study) -> pd.DataFrame:
    laws = _laws(study)
    *_, true = laws.values()
    assumed = {"": ("smc", 1.0)} | {name: ("smc-cm", fraction) for name, fraction in laws.items()}
    frames = []
    for name, (controller, fraction) in assumed.items():
        cases = comparison((controller,), stiffness=true, assumed_stiffness=fraction)
        frames.append(pd.DataFrame(outcome.row() for outcome in runs(cases)).assign(law=name))
    return pd.concat(frames, ignore_index=True)


def _curves(rows: pd.DataFrame, name: str, column: str, label: str, caption: str, scale: float) -> Drawing:
    """Peak lateral error of each controller over a column of the rows, one panel per speed and regime."""
    panels = list(rows.groupby(["speed", "regime"], sort=False))
    figure = sheet(2.1 * -(-len(panels) // 2) + 0.5)
    axes = figure.subplots(-(-len(panels) // 2), 2, squeeze=False, sharex=True)
    for ax, letter, ((speed, regime), here) in zip(axes.flat, "abcdefgh", panels):
        for controller, points in here.sort_values(column, kind="stable").groupby("controller", sort=False):
            peaks = 1e3 * points.groupby(column)["peak_e_y"].median()
            ax.plot(scale * peaks.index, peaks, marker="o", ms=3, **look(controller))
        panel(ax, f"({letter}) {speed:g} km/h, {regime}-driven")
        ax.set_ylim(bottom=0)
    for ax in axes[:, 0]:
        ax.set_ylabel("Peak |e_y| (mm)", fontsize=FONT)
    for ax in axes[-1]:
        ax.set_xlabel(label, fontsize=FONT)
    handles, _ = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles=handles, loc="outside upper center", ncols=4, fontsize=FONT - 0.5, frameon=False)
    return Drawing(name, figure, caption, caption)


def _assumed_table(rows: pd.DataFrame) -> Table:
    ratios = sorted(rows["assumed"].unique())
    columns = [Column("Speed", "km/h", "g"), Column("Regime"), Column("Controller")]
    columns += [Column(f"{ratio:g}", "mm", ".1f") for ratio in ratios]
    body = []
    for (speed, regime, controller), of_controller in rows.groupby(["speed", "regime", "controller"], sort=False):
        peaks = 1e3 * of_controller.groupby("assumed")["peak_e_y"].median()
        body.append((speed, regime, CONTROLLERS[controller].label, *peaks))
    caption = f"Peak e_y by the assumed over the true gap; medians over noises ({rows['seed'].nunique()})"
    return to_table("assumed_gap", caption, columns, body)


def _shows(plants: pd.DataFrame) -> str:
    peaks = plants.pivot(index=["speed", "controller", "regime"], columns="plant", values="peak_e_y")
    apart = (peaks["single-track"] / peaks["multi-body"] - 1).abs().groupby("speed").max()
    words = " and ".join(f"{100 * apart[speed]:.0f} % at {speed:g} km/h" for speed in LENGTH_FACTORS)
    return f"Peak e_y of a single-track plant is within {words} of the multi-body plant's."


def _identified_table(rows: pd.DataFrame) -> Table:
    q, runs = METRICS["peak_e_y"], [(speed, regime) for speed in LENGTH_FACTORS for regime in REGIMES]
    columns = [Column("Controller"), Column("Assumed law"), Column("Stiffness over datasheet", "", ".2f")]
    columns += [Column(f"{speed:g} km/h, {regime}", q.unit, q.form) for speed, regime in runs]
    body = []
    for (controller, law), of_law in rows.groupby(["controller", "law"], sort=False):
        peaks = of_law.set_index(["speed", "regime"])["peak_e_y"]
        assumed = of_law["assumed_stiffness"].iloc[0] if law else None
        cells = (q.scale * peaks[run] for run in runs)
        body.append((CONTROLLERS[controller].label, name_of(law) if law else "none", assumed, *cells))
    return to_table("identified", "Peak e_y with identified laws as the clearance model", columns, body)


def secant_stiffness(law: Law, rig: Rig, bushing: int, force: float) -> float:
    """Contact force over penetration of a bushing under a steady force, N: a clearance model's k, N/m, from a law.

    Of a schedule in time the mean stiffness is taken, of one in amplitude that at gap plus penetration.
    """
    table, gap = law.table(len(rig.bushings)), rig.bushings[bushing].gap
    k = table.parameters[:, bushing, 0]

    def excess(penetration: float) -> float:
        if isinstance(law, ContactLaw):
            return law.contact[bushing % len(law.contact)].force(penetration, 0.0) - force
        now = np.interp(gap + penetration, table.abscissa, k) if table.by_amplitude else np.mean(k)
        return float(now * penetration - force)

    deepest = 1e3 * gap
    if excess(deepest) < 0:
        raise ManoeuvreError(f"the law's contact at bushings[{bushing}] does not carry {force:g} N")
    return force / scipy.optimize.brentq(excess, 0.0, deepest, xtol=1e-12)
