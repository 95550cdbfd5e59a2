"""Figure 5: the structure model, with sensors and base plate, drawn from its rig file."""

from __future__ import annotations

from dataclasses import replace

from clearance_mj.report.figures import rig_drawing
from clearance_mj.report.tables import Column, Table

from .context import Context
from .models import clearance_of
from .result import Result
from .texts import texts

__all__ = ["run"]


def run(context: Context) -> Result:
    """Draw the bench.

    Parameters
    ----------
    context : Context
        Gives the rig.
    """
    rig = context.dataset.rig
    rows = [{"sensor": s.node, "position_m": s.position, "clearance": clearance_of(rig, s)} for s in rig.sensors]
    columns = (Column("Sensor", "", "d"), Column("Distance from the clamp", "m", ".4f"), Column("Clearance", "", "d"))
    within = ", ".join(str(row["sensor"]) for row in rows if row["clearance"])
    return Result(
        **texts("figure_05"),
        method="Drawn from the dataset's rig.toml: to scale along the shaft; across it, and the gaps, drawn wide.",
        shows=f"{len(rows)} accelerometers; at the clearances: {within or 'none'}.",
        drawings=(replace(rig_drawing(rig), name="figure_05"),),
        data={"figure_05": rows},
        tables=(Table("sensors", "Sensors of the rig", columns, tuple(tuple(row.values()) for row in rows)),),
    )
