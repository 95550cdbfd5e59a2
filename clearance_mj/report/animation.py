"""The rig in slow motion: the shaft rattling in its bushings, and the contact forces.

A response holds the shaft's displacement at its bushings only. The rest of its shape follows from the forces: between
the bushings the shaft is linear, so its modes (`ritz_model`) under the excitation and the recorded grease and contact
forces move as the shaft did, whichever engine recorded them. Two things are lost: what the recorder's anti-alias
filter took from the forces, and how the two ends of a bushing shared the contact force; they get half each. What that
leaves between shape and record at the bushings is taken up by the static deflection under forces there. The shape is
then within 1 % (RMS, of the tip's) of the modal engine's own coordinates all along the shipped rig's shaft, from soft
contact to 2e5 N/m, at 2048 samples/s and above; without the last step it is up to 5 % off.

Deflections and gaps are drawn many times larger than they are, the shaft's length and thickness as they are. A half of
a bushing is drawn as yielding by as much as the shaft goes beyond the gap: what the law calls penetration. All motion
is relative to the base.
"""

from __future__ import annotations

import contextlib
import math
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import scipy.signal
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike
from PIL import Image
from tqdm import tqdm

from ..beam import ritz_model, static_deflection
from ..errors import ClearanceError, RecordError
from ..files import replacing
from ..rig import Rig
from ..signals.response import Response
from .rendering import Stroke, View, render
from .style import COLOURS, FONT, tidy

__all__ = ["Clip", "check", "clip", "deflection", "write"]

RENDERERS = ("auto", "mujoco", "matplotlib")
MODES = 16
"""cantilever modes of the shaft's shape"""
POINTS = 81
"""of the shaft's line"""
DPI, WIDTH = 100, 7.2
LEFT, RIGHT, TRACE, ABOVE, BETWEEN, BELOW = 0.62, 0.12, 1.1, 0.3, 0.62, 0.42
"""in: margins beside the drawing, height of the trace, room above, between and below the panels"""
DRAWN_LIFT = 0.22
"""largest lift as it is drawn, as a share of the shaft's length, if no exaggeration is asked for"""
MOST_LIFT, LEAST_HEIGHT = 0.4, 0.15
"""largest lift that is drawn, half the height of the picture, as shares of the shaft's length"""
ARROW, PLATE, WALL = 0.1, 0.015, 0.06
"""length of the arrow of the largest force, thickness of a bushing's halves, half height of the clamp, likewise"""
MOST_FRAMES = 600
BATCH = 30
"""pictures that one process of MuJoCo draws"""
GIF_COLOURS = 64
"""of a GIF"""
STEEL, MASS, HALF, CLAMP = "#8a949f", "#4d5660", "#3b3b3b", "#d0d0d0"


@dataclass(frozen=True, eq=False)
class Clip:
    """What an animation shows."""

    rig: Rig
    """the rig"""
    time: np.ndarray
    """(n,) s, of the pictures"""
    position: np.ndarray
    """(n_x,) m, points of the shaft's line"""
    lift: np.ndarray
    """(n, n_x) displacement of these points relative to the base, m"""
    force: np.ndarray
    """(n, n_bushings) contact force, N, positive where the shaft presses upwards"""
    trace_time: np.ndarray
    """(n_t,) s, of every sample from the first picture to the last"""
    trace: np.ndarray
    """(n_t, n_bushings) contact force of every sample, N"""
    exaggeration: float
    """how many times larger lifts and gaps are drawn than they are"""
    slow: float
    """how many times slower the motion is shown than it is"""
    rate: float
    """pictures per second"""


def deflection(rig: Rig, response: Response, x: ArrayLike) -> np.ndarray:
    """Displacement (n_t, n_x), m, of the shaft at x (m) relative to the base, from the forces of a response from rest.

    At the bushings it is as recorded. The modes' motion is exact for forces that are straight lines between samples
    (first-order hold). A RecordError says if the response has no forces or displacements, as a test record.
    """
    displacement, contact, grease = response.displacement, response.contact_force, response.grease_force
    if displacement is None or contact is None or grease is None:
        raise RecordError(
            "the shaft's shape needs displacements, contact and grease forces at the bushings, which only simulated "
            "responses have"
        )
    model, at = ritz_model(rig, MODES), [b.position for b in rig.bushings]
    middles = model.shapes(at)
    ends = model.shapes([end for b in rig.bushings for end in b.ends]).reshape(-1, 2, model.size)
    drive = -model.participation if response.kind == "base" else model.shapes([rig.shaker.position])[0]
    force = np.outer(response.excitation, drive)
    force -= grease.T @ middles + contact.T @ ends.mean(axis=1)
    motion = np.empty_like(force)
    for i, (omega, damping) in enumerate(zip(model.omega, model.damping)):
        oscillator = ([1.0], [1.0, damping, omega**2])
        (b,), a, _ = scipy.signal.cont2discrete(oscillator, 1 / response.fs, method="foh")
        motion[:, i] = scipy.signal.lfilter(b, a, force[:, i])
    left = displacement.T - motion @ middles.T
    per_force = static_deflection(rig.beam, x, at), static_deflection(rig.beam, at, at)
    return motion @ model.shapes(x).T + left @ np.linalg.solve(per_force[1], per_force[0].T)


def clip(rig: Rig, response: Response, start: float | None = None, seconds: float = 0.15, slow: float = 60.0,
         exaggeration: float | None = None, rate: float = 20.0) -> Clip:  # fmt: skip
    """Cut a response from rest to what an animation shows: ``seconds`` from ``start`` (s), ``slow`` times slower.

    Default: the strongest contact is in the middle, and lifts fill the picture. A ClearanceError says what could be
    shown of a rig and response, if what is asked for cannot.
    """
    if not rig.bushings:
        raise ClearanceError(f"rig {rig.name!r} has no bushings in which its shaft could rattle")
    count = _count(seconds, slow, rate)
    position = np.linspace(0, rig.beam.length, POINTS)
    lift = deflection(rig, response, position)
    first, last = _window(response, start, seconds)
    shown = np.linspace(first, last, count).round().astype(int)
    largest = max(np.abs(lift[first : last + 1]).max(), max(b.gap for b in rig.bushings))
    length = rig.beam.length
    if exaggeration is None:
        exaggeration = float(f"{DRAWN_LIFT * length / largest:.2g}")
    if not 0 < exaggeration * largest <= MOST_LIFT * length:
        most = MOST_LIFT * length / largest
        raise ClearanceError(
            f"exaggeration {exaggeration:g}: must be > 0 and at most {most:.3g}, at which the largest lift, "
            f"{1e3 * largest:.3g} mm, is drawn as {MOST_LIFT:g} of the shaft's length"
        )
    trace, contact = slice(first, last + 1), np.asarray(response.contact_force).T
    return Clip(rig, response.time[shown], position, lift[shown], contact[shown], response.time[trace], contact[trace],
                exaggeration, slow, rate)  # fmt: skip


def _count(seconds: float, slow: float, rate: float) -> int:
    """Number of pictures."""
    for name, value in (("seconds", seconds), ("slow", slow), ("rate", rate)):
        if not 0 < value < math.inf:
            raise ClearanceError(f"{name} {value:g}: must be above 0")
    count = round(seconds * slow * rate)
    if not 2 <= count <= MOST_FRAMES:
        raise ClearanceError(
            f"{seconds:g} s shown {slow:g} times slower are {count} pictures at {rate:g} per second; from 2 to "
            f"{MOST_FRAMES} can be shown"
        )
    return count


def _window(response: Response, start: float | None, seconds: float) -> tuple[int, int]:
    """First and last sample that is shown."""
    if seconds > response.duration:
        raise ClearanceError(f"{seconds:g} s cannot be shown of a response of {response.duration:g} s")
    if start is None:
        strongest = np.argmax(np.abs(np.asarray(response.contact_force)).max(axis=0)) / response.fs
        start = np.clip(strongest - seconds / 2, 0, response.duration - seconds)
    if not 0 <= start <= response.duration - seconds + 0.5 / response.fs:
        raise ClearanceError(
            f"start {start:g} s: with {seconds:g} s shown of {response.duration:g} s it must be in 0 to "
            f"{response.duration - seconds:g} s"
        )
    last = response.excitation.size - 1
    return min(round(start * response.fs), last - 1), min(round((start + seconds) * response.fs), last)


def check(path: str | Path, renderer: str) -> None:
    """Refuse a kind of file or a renderer that is unknown or lacks its program, before anything is computed."""
    if Path(path).suffix not in _WRITERS:
        raise ClearanceError(f"{path}: animations are written as {' or '.join(_WRITERS)}")
    if Path(path).suffix == ".mp4" and not shutil.which("ffmpeg"):
        raise ClearanceError(f"{path}: .mp4 needs the program ffmpeg, which is not on this machine; .gif needs none")
    if renderer not in RENDERERS:
        raise ClearanceError(f'renderer "{renderer}" is unknown; use {", ".join(RENDERERS)}')


def write(shown: Clip, path: str | Path, renderer: str = "auto", progress: bool = True) -> str:
    """Write a ``.gif`` (Pillow) or ``.mp4`` (ffmpeg); return why MuJoCo did not draw it if it might have, else "".

    Renderer "auto" is MuJoCo off screen where there is a GL library for it, else matplotlib.
    """
    path = Path(path)
    check(path, renderer)
    stage, reason = _Stage(shown), ""
    if renderer != "matplotlib":
        images, reason = _rendered(shown, stage, progress)
        if renderer == "mujoco" and reason:
            raise ClearanceError(f"{reason}; renderer matplotlib needs none")
        stage.show_images(images)
    if not stage.images:
        stage.show_lines()
    numbers = tqdm(range(shown.time.size), desc="drawing", unit="picture", disable=not progress)
    with replacing(path) as temporary:
        _WRITERS[path.suffix](stage, numbers, temporary)
    return reason


def _write_gif(stage: _Stage, numbers: Iterable[int], path: Path) -> None:
    # One palette for all, out of two pictures: colours do not flicker, and what stands still costs nothing.
    two = np.vstack([stage.picture(i) for i in (0, stage.shown.time.size // 2)])
    palette = Image.fromarray(two).quantize(GIF_COLOURS)
    no_dots: dict[str, Any] = {"palette": palette, "dither": Image.Dither.NONE}
    first, *others = (Image.fromarray(stage.picture(i)).quantize(**no_dots) for i in numbers)
    first.save(path, save_all=True, append_images=others, duration=round(1000 / stage.shown.rate), loop=0)


def _write_mp4(stage: _Stage, numbers: Iterable[int], path: Path) -> None:
    height, width, _ = stage.picture(0).shape
    source = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {stage.shown.rate:g} -i -".split()
    # Players want half as many colours as pixels, and so an even number of these.
    target = "-vf pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white -pix_fmt yuv420p".split()
    command = ["ffmpeg", "-loglevel", "error", "-y", *source, *target, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # ffmpeg says below what it did not like
            for i in numbers:
                process.stdin.write(stage.picture(i).tobytes())
        _, complaint = process.communicate()
    if process.returncode:
        raise ClearanceError(f"ffmpeg did not write the animation: {complaint.decode(errors='replace').strip()}")


_WRITERS = {".gif": _write_gif, ".mp4": _write_mp4}


class _Stage:
    """The figure that becomes one picture after the other: the shaft above, the trace of contact forces below.

    Above, x is in m and y in mm, with the aspect that the exaggeration makes: what MuJoCo draws to the same scale
    lies under the same axes.
    """

    def __init__(self, shown: Clip):
        self.shown = shown
        self.images: list[np.ndarray] = []
        rig, length = shown.rig, shown.rig.beam.length
        self.radius = (rig.beam.diameter or rig.beam.height or 0.0) / 2
        highest = shown.exaggeration * max(np.abs(shown.lift).max(), *(b.gap for b in rig.bushings))
        self.per_newton = ARROW * length / max(np.abs(shown.trace).max(), 1e-12)
        self.half_height = max(LEAST_HEIGHT * length, 1.1 * highest, 1.05 * np.abs(self.arrows()[..., 1]).max())
        self.left, self.right = -0.04 * length, 1.03 * length
        across = WIDTH - LEFT - RIGHT
        self.size = across, across * 2 * self.half_height / (self.right - self.left)
        self.figure = Figure(facecolor="white", dpi=DPI)
        self.canvas, self.background = FigureCanvasAgg(self.figure), None
        self.above, below = self._axes()
        self._label(self.above)
        self.cursor = self._trace(below)
        self.words = self.above.set_title("", fontsize=FONT, loc="left", pad=4)
        self.moving = [self.cursor, self.words, *self._gaps(self.above)]

    def _axes(self) -> tuple[Axes, Axes]:
        whole = BELOW + TRACE + BETWEEN + self.size[1] + ABOVE
        self.figure.set_size_inches(WIDTH, whole)
        across = LEFT / WIDTH, self.size[0] / WIDTH
        below = self.figure.add_axes((across[0], BELOW / whole, across[1], TRACE / whole))
        place = (across[0], (BELOW + TRACE + BETWEEN) / whole, across[1], self.size[1] / whole)
        return self.figure.add_axes(place), below

    def _label(self, ax: Axes) -> None:
        tidy(ax, ylabel="Lift (mm)", xlabel="Distance from the clamp (m)")
        ax.grid(False)
        ax.set_xlim(self.left, self.right)
        height = self.millimetres(self.half_height)
        ax.set_ylim(-height, height)
        words = f"lifts and gaps drawn {self.shown.exaggeration:.3g} times larger; relative to the base"
        ax.set_title(words, fontsize=FONT, loc="right", pad=4)

    def _gaps(self, ax: Axes) -> Iterator[Artist]:
        """Lines where the shaft's surface touches a bushing."""
        for bushing in self.shown.rig.bushings:
            ends = np.array(bushing.ends) + 0.015 * self.shown.rig.beam.length * np.array([-1, 1])
            touch = 1e3 * bushing.gap + self.millimetres(self.radius)
            yield ax.hlines([-touch, touch], *ends, color=HALF, lw=0.7)

    def millimetres(self, drawn: Any) -> Any:
        """What a drawn height in m stands for, in mm."""
        return 1e3 * drawn / self.shown.exaggeration

    def _trace(self, ax: Axes) -> Line2D:
        for j, force in enumerate(self.shown.trace.T):
            ax.plot(self.shown.trace_time, force, color=COLOURS[j % len(COLOURS)], lw=1, label=f"bushing {j + 1}")
        tidy(ax, ylabel="Contact force (N)", xlabel="Time (s)")
        ax.set_xlim(*self.shown.trace_time[[0, -1]])
        ax.legend(fontsize=FONT - 1, frameon=False, loc="lower right", bbox_to_anchor=(1, 0.97), ncols=4)
        self.figure.align_ylabels()
        return ax.axvline(0, color="black", lw=0.8)

    def arrows(self) -> np.ndarray:
        """(n, n_bushings, 2, 2) where each arrow begins and ends: x and drawn height, m. It ends on its half."""
        shown = self.shown
        thickness = PLATE * shown.rig.beam.length
        below, above = np.moveaxis(self.halves(), -1, 0)
        tip = np.where(shown.force > 0, above + thickness, below - thickness)
        tail = tip + self.per_newton * shown.force
        along = np.broadcast_to([b.position for b in shown.rig.bushings], tip.shape)
        return np.stack((np.stack((along, tail), axis=-1), np.stack((along, tip), axis=-1)), axis=2)

    def halves(self) -> np.ndarray:
        """(n, n_bushings, 2) drawn height of the inner faces of the lower and the upper halves, m."""
        shown = self.shown
        at, gap = np.array([(b.position, b.gap) for b in shown.rig.bushings]).T
        lift = np.array([np.interp(at, shown.position, lift) for lift in shown.lift])
        faces = np.stack((np.minimum(lift, -gap), np.maximum(lift, gap)), axis=-1)
        return shown.exaggeration * faces + self.radius * np.array([-1, 1])

    def show_images(self, images: list[np.ndarray]) -> None:
        """Let pictures of MuJoCo, if there are any, be shown under the axes."""
        if images:
            edges = self.left, self.right, *self.above.get_ylim()
            self.images = images
            self.image = self.above.imshow(images[0], extent=edges, aspect="auto", interpolation="none")
            self.moving = [self.image, *self.above.spines.values(), *self.moving]

    def show_lines(self) -> None:
        """Let matplotlib draw the rig."""
        ax, rig, length = self.above, self.shown.rig, self.shown.rig.beam.length
        wall, plate = self.millimetres(WALL * length), self.millimetres(PLATE * length)
        ax.add_patch(Rectangle((self.left, -wall), -self.left, 2 * wall, facecolor=CLAMP, hatch="////", lw=0))
        self.shaft = ax.fill_between(self.shown.position, 0, 0, color=STEEL, lw=0)
        (self.masses,) = ax.plot([m.position for m in rig.masses], [0] * len(rig.masses), "o", color=MASS, ms=9)
        self.plates = [
            [ax.add_patch(Rectangle((b.ends[0], 0), b.length, side * plate, facecolor=HALF, lw=0)) for side in (-1, 1)]
            for b in rig.bushings
        ]
        look: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.005, "minlength": 0}
        start = self.arrows()[0, :, 0]
        colours = [COLOURS[j % len(COLOURS)] for j in range(len(rig.bushings))]
        self.force = ax.quiver(*start.T, 0 * start[:, 0], 0 * start[:, 0], color=colours, **look)
        self.moving += [self.shaft, self.masses, *(half for pair in self.plates for half in pair), self.force]

    def picture(self, i: int) -> np.ndarray:
        """(height, width, 3) pixels of one picture. Only what moves is drawn anew."""
        if self.background is None:
            for artist in self.moving:
                artist.set_animated(True)
            self.canvas.draw()
            self.background = self.canvas.copy_from_bbox(self.figure.bbox)
        self.canvas.restore_region(self.background)
        self._move(i)
        for artist in self.moving:
            self.figure.draw_artist(artist)
        return np.array(self.canvas.buffer_rgba())[..., :3]

    def _move(self, i: int) -> None:
        shown = self.shown
        self.words.set_text(f"t = {shown.time[i]:.4f} s, {shown.slow:g} times slower")
        self.cursor.set_xdata([shown.time[i]] * 2)
        if self.images:
            self.image.set_data(self.images[i])
            return
        line, half = 1e3 * shown.lift[i], self.millimetres(self.radius)
        self.shaft.set_data(shown.position, line - half, line + half)
        self.masses.set_ydata(np.interp(np.asarray(self.masses.get_xdata()), shown.position, line))
        for pair, faces in zip(self.plates, self.millimetres(self.halves()[i])):
            for half, face in zip(pair, faces):
                half.set(y=face)
        tail, tip = np.moveaxis(self.arrows()[i], 1, 0) * (1, self.millimetres(1))
        self.force.set_offsets(tail)
        self.force.set_UVC(*(tip - tail).T)


# By MuJoCo: far away, so that nothing is foreshortened, and from a little above.

ELEVATION = -12.0
"""degrees"""
AWAY = 30.0
"""lengths of the shaft"""


def _rendered(shown: Clip, stage: _Stage, progress: bool) -> tuple[list[np.ndarray], str]:
    """Pictures of the shaft to the stage's scale; none, and the reason, where there is no GL."""
    distance = AWAY * shown.rig.beam.length
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


def _strokes(shown: Clip, stage: _Stage) -> list[Stroke]:
    """The clamp, the shaft with its point masses, the bushings' halves, the forces."""
    count, length, radius = shown.time.size, shown.rig.beam.length, stage.radius
    wide = 4 * radius
    height = shown.exaggeration * shown.lift
    wall = _solid(count, (stage.left, 0), (-wide, wide), (-WALL * length, WALL * length))
    strokes = [Stroke("box", 0.0, to_rgb(CLAMP), wall)]
    for start, end in zip(range(POINTS - 1), range(1, POINTS)):
        piece = _solid(count, shown.position[[start, end]], (0, 0), height[:, [start, end]].T)
        strokes.append(Stroke("capsule", radius, to_rgb(STEEL), piece))
    for mass in shown.rig.masses:
        at = np.array([np.interp(mass.position, shown.position, z) for z in height])
        dot = _solid(count, mass.position + 1e-3 * radius * np.array([-1, 1]), (0, 0), (at, at))
        strokes.append(Stroke("capsule", 2.5 * radius, to_rgb(MASS), dot))
    for bushing, faces in zip(shown.rig.bushings, np.moveaxis(stage.halves(), 1, 0)):
        for face, side in zip(faces.T, (-1, 1)):
            half = _solid(count, bushing.ends, (-wide, wide), (face, face + side * PLATE * length))
            strokes.append(Stroke("box", 0.0, to_rgb(HALF), half))
    for j, arrow in enumerate(np.moveaxis(stage.arrows(), 1, 0)):
        colour = to_rgb(COLOURS[j % len(COLOURS)])
        strokes.append(Stroke("arrow", radius, colour, _solid(count, arrow[..., 0].T, (0, 0), arrow[..., 1].T)))
    return strokes


def _solid(count: int, x: Any, y: Any, z: Any) -> np.ndarray:
    """Ends of one solid in every picture; what leans back from the camera is made higher."""
    ends = np.empty((count, 1, 2, 3))
    for i in range(2):
        ends[:, 0, i, 0], ends[:, 0, i, 1] = x[i], y[i]
        ends[:, 0, i, 2] = z[i] / math.cos(math.radians(ELEVATION))
    return ends
