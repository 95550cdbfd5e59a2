"""The rig in slow motion as a GIF or MP4, its shaft drawn by MuJoCo off screen or by matplotlib."""

from __future__ import annotations

import contextlib
import math
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image
from tqdm import tqdm

from ..core.errors import ClearanceError
from ..core.files import replacing
from ..core.provenance import MARK
from .clip import Clip
from .rendering import Stroke, View, render
from .space_stage import SpaceStage
from .stage import CLAMP, DPI, HALF, MASS, PLATE, STEEL, WALL, Stage
from .style import COLOURS

__all__ = ["check", "write"]

RENDERERS = ("auto", "mujoco", "matplotlib")
BATCH = 30  # pictures that one process of MuJoCo draws
GIF_COLOURS = 64  # of a GIF
ELEVATION = -12.0  # degrees from which MuJoCo looks
AWAY = 30.0  # lengths of the shaft, so that nothing is foreshortened


def check(path: str | Path, renderer: str) -> None:
    """Refuse a kind of file or a renderer that is unknown or lacks its program, before anything is computed."""
    if Path(path).suffix not in _WRITERS:
        raise ClearanceError(f"{path}: animations are written as {' or '.join(_WRITERS)}")
    if Path(path).suffix == ".mp4" and not shutil.which("ffmpeg"):
        raise ClearanceError(f"{path}: .mp4 needs the program ffmpeg, which is not on this machine; .gif needs none")
    ClearanceError.require_known("renderer", renderer, RENDERERS)


def write(shown: Clip, path: str | Path, renderer: str = "auto", progress: bool = False, comment: str = MARK) -> str:
    """Write a ``.gif`` (Pillow) or ``.mp4`` (ffmpeg); return why MuJoCo did not draw it if it might have, else "".

    The file carries the ``comment``, such as what it comes from.
    Renderer "auto" is MuJoCo off screen where there is a GL library for it, else matplotlib, which draws what moves in
    space.
    """
    path = Path(path)
    check(path, renderer)
    stage, reason = _stage(shown, renderer, progress)
    numbers = tqdm(range(shown.time.size), desc="drawing", unit="picture", disable=not progress)
    with replacing(path) as temporary:
        _WRITERS[path.suffix](stage, numbers, temporary, comment)
    return reason


def _stage(shown: Clip, renderer: str, progress: bool) -> tuple[Stage | SpaceStage, str]:
    """The figure of an animation, and why MuJoCo did not draw it if it might have, else ""."""
    if shown.rig.moves_across:
        if renderer == "mujoco":
            raise ClearanceError("renderer mujoco draws planar rigs; leave it out, and matplotlib draws this one")
        return SpaceStage(shown), ""
    stage, reason = Stage(shown), ""
    if renderer != "matplotlib":
        images, reason = _rendered(shown, stage, progress)
        if renderer == "mujoco" and reason:
            raise ClearanceError(f"{reason}; renderer matplotlib needs none")
        stage.show_images(images)
    if not stage.images:
        stage.show_lines()
    return stage, reason


def _write_gif(stage: Stage | SpaceStage, numbers: Iterable[int], path: Path, comment: str) -> None:
    # One palette for all, out of two pictures: colours do not flicker, and what stands still costs nothing.
    two = np.vstack([stage.picture(i) for i in (0, stage.shown.time.size // 2)])
    palette = Image.fromarray(two).quantize(GIF_COLOURS)
    no_dots: dict[str, Any] = {"palette": palette, "dither": Image.Dither.NONE}
    first, *others = (Image.fromarray(stage.picture(i)).quantize(**no_dots) for i in numbers)
    duration, said = round(1000 / stage.shown.rate), comment.encode()
    first.save(path, save_all=True, append_images=others, duration=duration, loop=0, comment=said)


def _write_mp4(stage: Stage | SpaceStage, numbers: Iterable[int], path: Path, comment: str) -> None:
    height, width, _ = stage.picture(0).shape
    source = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {stage.shown.rate:g} -i -".split()
    # Players want half as many colours as pixels, and so an even number of these.
    target = "-vf pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white -pix_fmt yuv420p".split()
    command = ["ffmpeg", "-loglevel", "error", "-y", *source, *target, "-metadata", f"comment={comment}", str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # ffmpeg says below what it did not like
            for i in numbers:
                process.stdin.write(stage.picture(i).tobytes())
        _, complaint = process.communicate()
    if process.returncode:
        raise ClearanceError(f"ffmpeg did not write the animation: {complaint.decode(errors='replace').strip()}")


_WRITERS = {".gif": _write_gif, ".mp4": _write_mp4}


def _rendered(shown: Clip, stage: Stage, progress: bool) -> tuple[list[np.ndarray], str]:
    """Pictures of the shaft to the stage's scale; none, and the reason, where there is no GL."""
    distance = AWAY * shown.length
    opening = 2 * math.degrees(math.atan(stage.half_height / distance))
    size = round(DPI * stage.size[0]), round(DPI * stage.size[1])
    view = View(((stage.left + stage.right) / 2, 0.0, 0.0), distance, 90.0, ELEVATION, opening, 0.0, size)
    empty = mujoco.MjSpec()
    empty.stat.extent = distance  # what is far beyond it is cut off
    mjcf, strokes, images = empty.to_xml(), _strokes(shown, stage), []
    batches = [slice(i, i + BATCH) for i in range(0, shown.time.size, BATCH)]
    for batch in tqdm(batches, desc="rendering", unit=f"{BATCH} pictures", disable=not progress):
        of_batch = [replace(stroke, ends=stroke.ends[batch]) for stroke in strokes]
        found, reason = render(mjcf, [view] * shown.time[batch].size, of_batch)
        if reason:
            return [], reason
        images += found
    return images, ""


def _strokes(shown: Clip, stage: Stage) -> list[Stroke]:
    """The supports, the shafts with their point masses, the bushings' halves, the forces."""
    count, length, wide = shown.time.size, shown.length, 4 * stage.radius
    strokes = [Stroke("box", 0.0, to_rgb(CLAMP), solid) for solid in _held(stage, count, wide)]
    height = stage.height()
    for start, end in zip(range(shown.position.size - 1), range(1, shown.position.size)):
        if shown.shaft[start] == shown.shaft[end]:
            piece = _solid(count, shown.position[[start, end]], (0, 0), height[:, [start, end]].T)
            strokes.append(Stroke("capsule", float(stage.radii[[start, end]].mean()), to_rgb(STEEL), piece))
    for x, at in stage.masses_on_shafts():
        dot = _solid(count, x + 1e-3 * stage.radius * np.array([-1, 1]), (0, 0), (at, at))
        strokes.append(Stroke("capsule", 2.5 * stage.radius, to_rgb(MASS), dot))
    for bushing, (_, x), faces in zip(shown.rig.bushings, stage.places, np.moveaxis(stage.halves(), 1, 0)):
        ends = x - bushing.length / 2, x + bushing.length / 2
        for face, side in zip(faces.T, (-1, 1)):
            if np.isfinite(face).all():
                half = _solid(count, ends, (-wide, wide), (face, face + side * PLATE * length))
                strokes.append(Stroke("box", 0.0, to_rgb(HALF), half))
    for j, arrow in enumerate(np.moveaxis(stage.arrows(), 1, 0)):
        colour = to_rgb(COLOURS[j % len(COLOURS)])
        strokes.append(Stroke("arrow", stage.radius, colour, _solid(count, arrow[..., 0].T, (0, 0), arrow[..., 1].T)))
    return strokes


def _held(stage: Stage, count: int, wide: float) -> Iterator[np.ndarray]:
    """Boxes for the supports: walls at ends, blocks or feet between."""
    wall, half = WALL * stage.length, 0.01 * stage.length
    for support, i, side in stage.supports():
        x, level, radius = support.position, stage.level[i], stage.radius
        if support.kind in ("clamped", "guided") and side:
            edge = stage.left if side < 0 else stage.right
            yield _solid(count, sorted((x, edge)), (-wide, wide), (level - wall, level + wall))
        elif support.kind == "clamped":
            yield _solid(count, (x - half, x + half), (-wide, wide), (level - wall, level + wall))
        elif support.kind == "pinned" or support.translation:
            wide_x = half / 2 if support.kind == "pinned" else half / 4
            yield _solid(count, (x - wide_x, x + wide_x), (-wide, wide), (level - radius - wall, level - radius))


def _solid(count: int, x: Any, y: Any, z: Any) -> np.ndarray:
    """Ends of one solid in every picture; what leans back from the camera is made higher."""
    ends = np.empty((count, 1, 2, 3))
    for i in range(2):
        ends[:, 0, i, 0], ends[:, 0, i, 1] = x[i], y[i]
        ends[:, 0, i, 2] = z[i] / math.cos(math.radians(ELEVATION))
    return ends
