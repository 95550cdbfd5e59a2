"""Figures 5 and 6: the rig with its sensors and base plate, drawn from its file, and as MuJoCo renders it."""

from dataclasses import replace

import pandas as pd

from clearance_mj.engines import build_links
from clearance_mj.report.figures import rig_drawing
from clearance_mj.report.rendering import View, render
from clearance_mj.report.style import Drawing
from clearance_mj.report.tables import Column
from clearance_mj.rig import Rig

from .models import clearance_of
from .result import FONT, Item, Result, sheet, to_table


def structure(item: Item, rig: Rig) -> Result:
    """Draw the bench."""
    rows = pd.DataFrame(
        {"sensor": s.node, "position_m": s.position, "clearance": clearance_of(rig, s)} for s in rig.sensors
    ).astype({"clearance": "Int64"})
    columns = (Column("Sensor", "", "d"), Column("Distance from the clamp", "m", ".4f"), Column("Clearance", "", "d"))
    within = ", ".join(map(str, rows["sensor"][rows["clearance"].notna()]))
    return Result(
        method="Drawn from the dataset's rig.toml.",
        shows=f"{len(rows)} accelerometers, of which {within or 'none'} are at the clearances.",
        drawings=(replace(rig_drawing(rig), name=item.name),),
        data={item.name: rows},
        tables=(to_table("sensors", "Sensors of the rig", columns, rows),),
    )


def rendering(item: Item, rig: Rig) -> Result:
    """Render the rig off screen."""
    first, last = rig.linear.span
    middle, near = (first + last) / 2, rig.linear.place(rig.bushings[0].position)[1]
    views = {
        "(a) the whole rig": View((middle, 0.0, 0.0), 1.12 * (last - first), 90.0, -20.0, 8.0, 0.008, (1500, 220)),
        "(b) clearance 1": View((near, 0.0, 0.0), 0.12, 70.0, 0.0, 15.0, 0.001, (1500, 560)),
    }
    images, reason = render(build_links(rig).to_xml(), tuple(views.values()))
    rows = pd.DataFrame(
        {"view": title, "look_at_x_m": v.look_at[0], "distance_m": v.distance, "azimuth_deg": v.azimuth,
         "elevation_deg": v.elevation}
        for title, v in views.items()
    )  # fmt: skip
    shown = "The chain of links, the halves of the bushings and, in (a), the sensors."
    return Result(
        method="Rendered off screen by MuJoCo, which needs a GL backend.",
        shows=f"Not rendered: {reason}" if reason else shown,
        drawings=() if reason else (_drawing(item.name, dict(zip(views, images))),),
        data={item.name: rows},
    )


def _drawing(name: str, images: dict) -> Drawing:
    figure = sheet(3.9)
    ratios = [image.shape[0] for image in images.values()]
    for ax, (title, image) in zip(figure.subplots(len(images), 1, height_ratios=ratios), images.items()):
        ax.imshow(image)
        ax.set_axis_off()
        ax.set_title(title, fontsize=FONT, loc="left", pad=3)
    caption = "The rig as MuJoCo simulates it, in perspective, with gaps to scale."
    return Drawing(name, figure, caption, "Rendering of the rig and of its first bushing.")
