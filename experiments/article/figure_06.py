"""Figure 6: the test model, as MuJoCo renders it."""

from __future__ import annotations

from clearance_mj.engines import mjcf
from clearance_mj.report.figures import Drawing
from clearance_mj.report.rendering import View, render

from .context import Context
from .result import Result
from .style import FONT, sheet
from .texts import texts

__all__ = ["run"]


def run(context: Context) -> Result:
    """Render the rig.

    Parameters
    ----------
    context : Context
        Gives the rig.
    """
    rig = context.dataset.rig
    middle, near = 0.5 * rig.beam.length, rig.bushings[0].position if rig.bushings else 0.5 * rig.beam.length
    views = {
        "(a) the whole rig": View((middle, 0.0, 0.0), 1.12 * rig.beam.length, 90.0, -20.0, 8.0, 0.008, (1500, 220)),
        "(b) clearance 1": View((near, 0.0, 0.0), 0.12, 70.0, 0.0, 15.0, 0.001, (1500, 560)),
    }
    context.stage("rendering")
    images, reason = render(mjcf(rig)["links"], tuple(views.values()))
    rows = [
        {"view": title, "look_at_x_m": v.look_at[0], "distance_m": v.distance, "azimuth_deg": v.azimuth}
        | {"elevation_deg": v.elevation}
        for title, v in views.items()
    ]
    shows = f"Not rendered: {reason}" if reason else "The chain of links, the bushings’ halves, and in (a) the sensors."
    return Result(
        **texts("figure_06"),
        method="The rig's MJCF, rendered off screen by MuJoCo. Without a GL backend there is no figure, but a reason.",
        shows=shows,
        drawings=() if reason else (_drawing(dict(zip(views, images))),),
        data={"figure_06": rows},
    )


def _drawing(images) -> Drawing:
    figure = sheet(3.9)
    ratios = [image.shape[0] for image in images.values()]
    for ax, (title, image) in zip(figure.subplots(len(images), 1, height_ratios=ratios), images.items()):
        ax.imshow(image)
        ax.set_axis_off()
        ax.set_title(title, fontsize=FONT, loc="left", pad=3)
    caption = "The rig as MuJoCo simulates it. Perspective; gaps as they are."
    return Drawing("figure_06", figure, caption, "Rendering of the rig and of its first bushing.")
