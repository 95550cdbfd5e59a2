"""The rig in slow motion as a GIF or MP4, its shaft drawn by MuJoCo off screen or by matplotlib."""

from __future__ import annotations

import contextlib
import itertools
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
from .scene import Scene
from .stage import ACROSS, CLAMP, DPI, HALF, MASS, STEEL, Stage
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
    stage, reason = _make_stage(shown, renderer, progress)
    numbers = tqdm(range(shown.time.size), desc="drawing", unit="picture", disable=not progress)
    with replacing(path) as temporary:
        _WRITERS[path.suffix](stage, numbers, temporary, comment)
    return reason


def _make_stage(shown: Clip, renderer: str, progress: bool) -> tuple[Stage, str]:
    """Return an animation's figure, and the reason if MuJoCo could not draw it, else ""."""
    scene = Scene(shown)
    if renderer == "mujoco" and not scene.is_plane:
        raise ClearanceError("renderer mujoco draws planar rigs; leave it out, and matplotlib draws this one")
    if renderer == "matplotlib" or not scene.is_plane:
        return Stage(scene), ""
    images, reason = _rendered(scene, progress)
    if renderer == "mujoco" and reason:
        raise ClearanceError(f"{reason}; renderer matplotlib needs none")
    return Stage(scene, images), reason


def _write_gif(stage: Stage, numbers: Iterable[int], path: Path, comment: str) -> None:
    # One palette for all, out of two pictures: colours do not flicker, and what stands still costs nothing.
    two = np.vstack([stage.picture(i) for i in (0, stage.shown.time.size // 2)])
    palette = Image.fromarray(two).quantize(GIF_COLOURS)
    no_dots: dict[str, Any] = {"palette": palette, "dither": Image.Dither.NONE}
    first, *others = (Image.fromarray(stage.picture(i)).quantize(**no_dots) for i in numbers)
    duration, said = round(1000 / stage.shown.rate), comment.encode()
    first.save(path, save_all=True, append_images=others, duration=duration, loop=0, comment=said)


def _write_mp4(stage: Stage, numbers: Iterable[int], path: Path, comment: str) -> None:
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


def _rendered(scene: Scene, progress: bool) -> tuple[list[np.ndarray], str]:
    """Return pictures of planar motion to the stage's scale; none, and the reason, without GL."""
    shown, distance, wide = scene.shown, AWAY * scene.length, scene.right - scene.left
    opening = 2 * math.degrees(math.atan(scene.half_height / distance))
    size = round(DPI * ACROSS), round(DPI * ACROSS * 2 * scene.half_height / wide)
    view = View((scene.left + wide / 2, 0.0, 0.0), distance, 90.0, ELEVATION, opening, 0.0, size)
    empty = mujoco.MjSpec()
    empty.stat.extent = distance  # what is far beyond it is cut off
    mjcf, strokes, images = empty.to_xml(), list(_strokes(scene)), []
    batches = [slice(i, i + BATCH) for i in range(0, shown.time.size, BATCH)]
    for batch in tqdm(batches, desc="rendering", unit=f"{BATCH} pictures", disable=not progress):
        of_batch = [replace(stroke, ends=stroke.ends[batch]) for stroke in strokes]
        frames, reason = render(mjcf, [view] * shown.time[batch].size, of_batch)
        if reason:
            return [], reason
        images += frames
    return images, ""


def _strokes(scene: Scene) -> Iterator[Stroke]:
    """Return strokes of supports, shafts with their discs, bushings' halves and forces."""
    shown, line = scene.shown, scene.line()
    for colour, boxes in ((CLAMP, scene.supports()), (HALF, scene.plates())):
        for box in boxes:
            yield _stroke(shown, "box", 0.0, colour, box.low, box.high)
    for start, end in itertools.pairwise(range(shown.position.size)):
        if shown.shaft[start] == shown.shaft[end]:
            radius = float(scene.radii[[start, end]].mean())
            yield _stroke(shown, "capsule", radius, STEEL, line[..., start], line[..., end])
    for disc in scene.discs:
        place, short = scene.at(disc.point), np.array([[1e-3 * scene.radius], [0.0], [0.0]])
        yield _stroke(shown, "capsule", disc.radius, MASS, place - short, place + short)
    for j, arrow in enumerate(np.moveaxis(scene.arrows(), 1, 0)):
        tail, tip = (np.array((x, 0 * x, z)) for x, z in np.moveaxis(arrow, 0, -1))
        yield _stroke(shown, "arrow", scene.radius, COLOURS[j % len(COLOURS)], tail, tip)


def _stroke(shown: Clip, shape: str, radius: float, colour: str, start: np.ndarray, end: np.ndarray) -> Stroke:
    """Return one solid between two ends (3,) or (3, n) in every picture, raised where it leans from the camera."""
    higher = np.array([[1.0], [1.0], [1 / math.cos(math.radians(ELEVATION))]])
    ends = [np.broadcast_to(higher * end.reshape(3, -1), (3, shown.time.size)).T for end in (start, end)]
    return Stroke(shape, radius, to_rgb(colour), np.stack(ends, axis=1)[:, None])
