"""Pictures of a model by MuJoCo, rendered in a separate process.

A GL backend is chosen when MuJoCo is loaded, and a broken one may take its process with it.
"""

from __future__ import annotations

import dataclasses
import itertools
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["Stroke", "View", "render"]

TIMEOUT = 120  # s


@dataclass(frozen=True)
class View:
    """Position of a camera."""

    look_at: tuple[float, float, float]  #: m
    distance: float  #: m
    azimuth: float  #: degrees
    elevation: float  #: degrees
    opening: float  #: vertical field of view, degrees
    sensor: float  #: radius of the sensors, m; less than the shaft's hides them
    size: tuple[int, int]  #: width and height, pixels


@dataclass(frozen=True, eq=False)
class Stroke:
    """Solids drawn in addition to the model, which differ from picture to picture."""

    shape: str  #: "capsule", "arrow" or "box"
    radius: float  #: m; of no meaning for a box
    colour: tuple[float, float, float]  #: red, green, blue, 0 to 1
    ends: np.ndarray
    """(n_views, n, 2, 3) where each begins and ends, m; one without length is left out; two corners of a box"""


def render(mjcf: str, views: Sequence[View], strokes: Sequence[Stroke] = ()) -> tuple[list[np.ndarray], str]:
    """Render a model (MJCF) at rest: images (height, width, 3), one for each view, and "".

    Where there is no GL backend: no images, and the reason.
    """
    backend = os.environ.get("MUJOCO_GL") or ("egl" if sys.platform == "linux" else "")
    environment = os.environ | ({"MUJOCO_GL": backend} if backend else {})
    with tempfile.TemporaryDirectory() as folder:
        job, pictures = Path(folder) / "job.json", Path(folder) / "pictures.npz"
        plain = [dataclasses.asdict(stroke) | {"ends": np.asarray(stroke.ends).tolist()} for stroke in strokes]
        job.write_text(json.dumps({"mjcf": mjcf, "views": list(map(dataclasses.asdict, views)), "strokes": plain}))
        command = [sys.executable, "-P", __file__, str(job), str(pictures)]  # this file alone: the package is slow
        options: dict[str, Any] = {"env": environment, "capture_output": True, "text": True, "timeout": TIMEOUT}
        try:
            process = subprocess.run(command, check=False, **options)
        except subprocess.TimeoutExpired:
            return [], f"MuJoCo's GL backend ({backend or 'default'}) did not answer within {TIMEOUT} s"
        if not pictures.exists():
            last = (process.stderr.strip().splitlines() or [f"the process ended with status {process.returncode}"])[-1]
            return [], f"MuJoCo has no GL backend here ({backend or 'default'}): {last}"
        with np.load(pictures) as stored:
            return [stored[name] for name in stored.files], ""


def _main(job: str, pictures: str) -> None:
    import mujoco
    from mujoco.rendering.classic.renderer import Renderer

    work = json.loads(Path(job).read_text())
    model = _light_model(mujoco.MjSpec.from_string(work["mjcf"])).compile()
    model.vis.global_.offwidth = max(view["size"][0] for view in work["views"])
    model.vis.global_.offheight = max(view["size"][1] for view in work["views"])
    model.vis.map.znear = 1e-3
    data, images = mujoco.MjData(model), []
    mujoco.mj_forward(model, data)
    for (width, height), views in itertools.groupby(enumerate(work["views"]), key=lambda item: item[1]["size"]):
        with Renderer(model, height=height, width=width) as renderer:
            for i, view in views:
                model.vis.global_.fovy, model.site_size[:, 0] = view["opening"], view["sensor"]
                renderer.update_scene(data, _camera(view))
                for stroke in work["strokes"]:
                    _draw(renderer.scene, stroke, stroke["ends"][i])
                images.append(renderer.render())
    np.savez(pictures, *images)


def _camera(view: dict) -> Any:
    import mujoco

    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance = view["look_at"], view["distance"]
    camera.azimuth, camera.elevation = view["azimuth"], view["elevation"]
    return camera


def _draw(scene: Any, stroke: dict, ends: list) -> None:
    """Add one picture's solids of a stroke to the scene."""
    import mujoco

    shape = getattr(mujoco.mjtGeom, f"mjGEOM_{stroke['shape'].upper()}")
    colour, upright = np.array([*stroke["colour"], 1], dtype=np.float32), np.eye(3).ravel()
    for start, end in np.array(ends):
        if np.array_equal(start, end):
            continue
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, shape, np.abs(end - start) / 2, (start + end) / 2, upright, colour)
        if stroke["shape"] != "box":
            mujoco.mjv_connector(geom, shape, stroke["radius"], start, end)
        if stroke["shape"] == "arrow":
            geom.size[2] *= 2  # an arrow is drawn half as long as it is said to be
        scene.ngeom += 1


def _light_model(spec: Any) -> Any:
    """Return a model before a white sky and in more light."""
    import mujoco

    white = {"rgb1": [1, 1, 1], "rgb2": [1, 1, 1], "width": 8, "height": 48}
    sky, flat = mujoco.mjtTexture.mjTEXTURE_SKYBOX, mujoco.mjtBuiltin.mjBUILTIN_FLAT
    spec.add_texture(name="sky", type=sky, builtin=flat, **white)
    spec.visual.headlight.ambient = [0.45, 0.45, 0.45]
    spec.visual.headlight.diffuse = [0.6, 0.6, 0.6]
    return spec


if __name__ == "__main__":
    _main(*sys.argv[1:])
