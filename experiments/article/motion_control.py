"""Motion control beyond the article: gap, misestimated gap, preview, plants, and what an identified law is worth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearance_mj.report.tables import Column, Table
from clearance_mj.report.vehicle import METRICS
from clearance_mj.vehicle.controllers.clearance_model import secant_stiffness
from clearance_mj.vehicle.experiment import CONTROLLERS, GAP, LENGTH_FACTORS, REGIMES, Case
from clearance_mj.vehicle.steering import Steering

from .context import Context
from .models import name_of
from .motion import comparison, knows, setting
from .motion_figures import curves
from .result import Result
from .texts import texts

__all__ = ["run"]

CONTROLLERS_SWEPT = ("smc", "smc-cm", "mpc", "mpc-cm")
GAPS = (0.0, 0.09, 0.18, 0.27, 0.36, 0.45)
"""degrees at the road wheel"""
TOLD = (0.5, 0.75, 1.0, 1.25, 1.5)
"""told gap over the true one"""
PREVIEWS = (0.0, 0.04, 0.07, 0.1, 0.2)
"""s"""
MOMENT = 135.0
"""N m, aligning moment at the peak of the lane change at 120 km/h"""


def run(context: Context) -> Result:
    """Drive the sweeps.

    Parameters
    ----------
    context : Context
        Gives the identified laws and says how much to do.
    """
    step = 4 if context.quick else 1
    gap, told, preview = _gap(context, GAPS[::-step]), _told(context, TOLD[::step]), _preview(context, PREVIEWS[::step])
    plants, identified = _plants(context), _identified(context)
    shown = "Peak lateral error over"
    return Result(
        **texts("motion_control"),
        method=" ".join(setting(speed) for speed in LENGTH_FACTORS) + " Nominal vehicle, seed 0. " + _METHOD,
        shows=_shows(plants, identified),
        drawings=(
            curves(
                gap,
                "motion_control_gap",
                "half_gap",
                "Half-gap at the road wheel (°)",
                f"{shown} the gap.",
                180 / np.pi,
            ),
            curves(
                told, "motion_control_told_gap", "told", "Told gap over true gap (1)", f"{shown} the gap that is told."
            ),
            curves(preview, "motion_control_preview", "preview", "Road known ahead (s)", f"{shown} the preview."),
        ),
        data={
            "motion_control_gap": gap,
            "motion_control_told_gap": told,
            "motion_control_preview": preview,
            "motion_control_plants": plants,
            "motion_control_identified": identified,
        },
        tables=(_plants_table(plants), _identified_table(identified)),
        knows=knows(),
    )


_METHOD = (
    "Identified laws: the steering's bushings are taken to be the rig's at scale, lengths by the gap, forces so that "
    "the datasheet contacts agree. The steering's contacts have the secant stiffness of the last law (the best "
    "knowledge of the rig; the virtual rig's own parameters are no model's to know) at the peak aligning moment; "
    "SMC-CM is told that of each law, all other controllers the datasheet's."
)


def _rows(context, cases: Sequence[Case], **columns) -> list[dict]:
    """Rows of the cases' outcomes, with more columns, one value for each case."""
    outcomes = context.drives(cases)
    return [o.row() | {key: values[i] for key, values in columns.items()} for i, o in enumerate(outcomes)]


def _gap(context, gaps):
    cases = [c for g in gaps for c in comparison(CONTROLLERS_SWEPT, half_gap=float(np.radians(g)))]
    return _rows(context, cases)


def _told(context, shares):
    cases = [c for share in shares for c in comparison(("smc", "smc-cm", "mpc-cm"), assumed_gap=share * GAP)]
    return _rows(context, cases, told=[c.assumed_gap / GAP for c in cases])


def _preview(context, previews):
    return _rows(context, [c for p in previews for c in comparison(CONTROLLERS_SWEPT, preview=p)])


def _plants(context):
    cases = [c for plant in ("multi-body", "single-track") for c in comparison(CONTROLLERS_SWEPT, plant=plant)]
    return _rows(context, cases)


def _laws(context) -> dict[str, float]:
    """Secant stiffness of each law over that of the datasheet, at the force that stands for the peak moment."""
    rig, last = context.dataset.rig, len(context.dataset.rig.bushings) - 1
    bushing = rig.bushings[last]
    force = MOMENT / (Steering().lost_motion.stiffness * GAP) * bushing.contact.stiffness * bushing.gap
    return {k.name: secant_stiffness(k.law, rig, last, force) / bushing.contact.stiffness for k in context.laws}


def _identified(context):
    laws = _laws(context)
    *_, true = laws.values()
    told = {"": ("smc", 1.0)} | {name: ("smc-cm", share) for name, share in laws.items()}
    cases, names = [], []
    for name, (controller, share) in told.items():
        cases += comparison((controller,), stiffness=true, assumed_stiffness=share)
        names += [name] * len(LENGTH_FACTORS) * len(REGIMES)
    return _rows(context, cases, law=names)


def _pick(rows, **values) -> dict:
    return next(r for r in rows if all(r[key] == value for key, value in values.items()))


def _shows(plants, identified) -> str:
    words = []
    for speed in LENGTH_FACTORS:
        apart = []
        for controller in CONTROLLERS_SWEPT:
            for regime in REGIMES:
                one, other = (
                    _pick(plants, plant=p, speed=speed, controller=controller, regime=regime)["peak_e_y"]
                    for p in ("multi-body", "single-track")
                )
                apart.append(abs(other / one - 1))
        words.append(f"Plants: peak e_y of the single track within {100 * max(apart):.0f} % at {speed:g} km/h.")
    laws = list(dict.fromkeys(r["law"] for r in identified if r["law"]))
    for speed in LENGTH_FACTORS:
        here = {law: _pick(identified, law=law, speed=speed, regime="torque")["peak_e_y"] for law in ("", *laws)}
        errors = ", ".join(f"{name_of(law)} {1e3 * here[law]:.1f}" for law in laws)
        words.append(f"Peak e_y told each law, torque-driven, {speed:g} km/h (mm): {errors}; SMC {1e3 * here['']:.1f}.")
    return " ".join(words)


def _plants_table(rows) -> Table:
    names = ("peak_e_y", "peak_e_psi", "peak_yaw_rate", "peak_lateral_acceleration")
    columns = [Column("Speed", "km/h", "g"), Column("Regime"), Column("Controller")]
    for name in names:
        q = METRICS[name]
        columns += [Column(plant, q.unit, q.form, q.label) for plant in ("multi-body", "single-track")]
    body = []
    for r in rows:
        if r["plant"] == "multi-body":
            other = _pick(rows, plant="single-track", **{k: r[k] for k in ("speed", "regime", "controller")})
            cells = [METRICS[n].scale * source[n] for n in names for source in (r, other)]
            body.append((r["speed"], r["regime"], CONTROLLERS[r["controller"]].label, *cells))
    return Table("plants", "Peaks of both plants", tuple(columns), tuple(body))


def _identified_table(rows) -> Table:
    columns = [Column("Speed", "km/h", "g"), Column("Regime"), Column("Controller"), Column("Told law")]
    columns += [Column("Told stiffness over datasheet", "", ".2f"), Column("Peak e_y", "mm", ".1f")]
    columns += [Column("RMS e_y", "mm", ".2f"), Column("RMS e_y above that of the last law", "mm", ".2f")]
    *_, last = (r["law"] for r in rows)
    body = []
    for r in rows:
        best = _pick(rows, law=last, speed=r["speed"], regime=r["regime"])
        words = r["speed"], r["regime"], CONTROLLERS[r["controller"]].label, name_of(r["law"]) if r["law"] else "none"
        told = r["assumed_stiffness"] if r["law"] else None
        errors = 1e3 * r["peak_e_y"], 1e3 * r["rms_e_y"], 1e3 * (r["rms_e_y"] - best["rms_e_y"])
        body.append((*words, told, *errors))
    return Table("identified", "Identified laws as the clearance model", tuple(columns), tuple(body))
