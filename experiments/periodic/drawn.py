"""Drawn rigs of every kind of clearance: stable points of branches stay when they are marched, unstable ones leave.

The march by the modal engine begins with a point's place and velocity, which its harmonics say. Neither the engine's
steps nor its contacts share code with harmonic balance. A stable point is marched until what the start has disturbed
has died out; an unstable one until it has left, or would have by its multiplier.

    python -m experiments.periodic.drawn --count 200
"""

import sys
import time
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import clearance_mj as cm
from clearance_mj import ClearanceError, Modal, linear_model
from clearance_mj.rig.sensing import sensor_points
from experiments.periodic.drawn_rigs import KINDS, MODES, Drawn, draw
from experiments.script import run
from experiments.tables import markdown_table

RESOLVED = {False: ((41, None), (41, 2048), (81, 2048)), True: ((31, None), (61, 2048))}
"""Harmonics and samples of a period, of rigs along one direction, and of those that move along y and z; the next ones
where a point is not close: impacts begin between samples, and stiff ones have many harmonics"""
POINTS = 3  # of a branch
RANGE = 1.03  # last frequency of a branch over the first
CLOSE = 1e-3  # over the motion's size
LEFT = 0.05  # over the motion's size: a march that has left
GROWS = 1.05  # multiplier from which on a march must have left
SLOW = 0.985  # multiplier beyond which a point is not marched: its transient lasts for too long
DIED = 1e-5  # of what the start has disturbed
FEWEST, LONGEST = 6, 800  # periods that are marched
LEAVES_IN, BLOCK = 200, 20  # periods in which an unstable motion must leave, looked at after so many
RESOLUTIONS = (0.25, 0.06, 0.02)
"""rad per step of the modal engine: the next one where a point is not close, since steps miss when contacts begin"""


class Vibration(NamedTuple):
    """Vibrations by their harmonics, as those of a branch or a backbone, or of a march."""

    model: cm.Model
    kind: str
    periods: int
    n_modes: int
    frequency: np.ndarray
    """(n,) Hz"""
    level: np.ndarray
    """(n, n_levels) complex amplitudes"""
    displacement: np.ndarray
    """(n, n_sensors, H + 1) as of a branch"""
    clearance_displacement: np.ndarray
    """(n, n_rows, H + 1)"""


class Compared(NamedTuple):
    """A point of a branch and its march."""

    kind: str
    number: int  #: of the rig
    index: int
    multiplier: float
    off: float  #: largest difference of a clearance's displacement over its size
    periods: int  #: marched

    @property
    def passes(self) -> bool:
        """True if a stable motion has stayed, or an unstable one has left."""
        return self.off < CLOSE if self.multiplier < 1 else self.off > LEFT


class Outcome(NamedTuple):
    """Outcome for one rig."""

    drawn: Drawn
    points: list[Compared]
    refused: str  #: why there is no branch
    seconds: float


def state(branch: cm.periodic.Branch | Vibration, i: int, angle: float) -> np.ndarray:
    """Modal coordinates, velocities and accelerations (3, n) of a point at an angle of the excitation, rad."""
    rig = branch.model.rig
    model = linear_model(rig, branch.n_modes)
    along = np.array([sensor.unit_direction for sensor in rig.sensors]).reshape(-1, 3)
    rows = np.vstack((model.directed(sensor_points(rig), along), model.at_bushings))
    size = np.abs(rows).max(axis=1, keepdims=True)  # angles and displacements count alike
    known = np.vstack((branch.displacement[i], branch.clearance_displacement[i]))
    of_modes = np.linalg.lstsq(rows / size, known / size, rcond=1e-10)[0]
    order = np.arange(known.shape[1]) / branch.periods
    turning = 2j * np.pi * branch.frequency[i] * order
    of_modes = of_modes * np.exp(1j * angle * order)
    return np.array([(turning**order * of_modes).real.sum(axis=1) for order in range(3)])


def history(harmonics: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Values (n_rows, n) of harmonics (n_rows, H + 1) at angles of the first one, rad."""
    return (harmonics @ np.exp(1j * np.outer(np.arange(harmonics.shape[-1]), angle))).real


def begins(branch: cm.periodic.Branch | Vibration, i: int) -> float:
    """Angle of the excitation, rad, at which the clearances are farthest from their walls: contacts remember."""
    rig, angle = branch.model.rig, 2 * np.pi * branch.periods * np.arange(256) / 256
    place, beyond = history(branch.clearance_displacement[i], angle / branch.periods), np.zeros(256)
    for bushing, rows in zip(rig.bushings, rig.clearance_rows):
        middle = np.array([bushing.offset_y, bushing.offset])[-len(place[rows]) :]
        beyond = np.maximum(beyond, np.linalg.norm(place[rows] + middle[:, None], axis=0) / bushing.gap)
    return float(angle[beyond.argmin()])


def marches(branch: cm.periodic.Branch | Vibration, i: int, resolution: float, block: int) -> Iterator[float]:
    """Yield how far the last period of each block of a march is from the point, over each clearance's size."""
    rig, law = branch.model.rig, branch.model.law
    engine, period = Modal(branch.n_modes, resolution), branch.periods / branch.frequency[i]
    steps = max(int(np.ceil(period / engine.largest_step(rig, law))), 256)
    start, step = begins(branch, i), period / steps
    angle = start + 2 * np.pi * branch.periods * np.arange(steps) / steps
    run = engine.start(rig, law, branch.kind, step)
    q, v, a = state(branch, i, start)
    model = linear_model(rig, branch.n_modes)
    modal_damping = (
        0.0 if model.coupling.size or model.bearings else model.damping
    )  # damping that the modes' own motion has
    kick = a + modal_damping * v + model.omega**2 * q
    run.motion.q[:], run.motion.v[:] = q, v - step / 2 * kick  # velocities are those before the kick of the step
    run.motion.q_before[:] = state(branch, i, 2 * start - angle[1])[0]
    excitation = np.tile(history(np.pad(branch.level[i], (1, 0))[None], angle)[0], block)
    known = history(branch.clearance_displacement[i], angle / branch.periods)
    size = sizes(branch, known)
    n = len(rig.sensors)
    while True:
        marched = run.advance(excitation)[-steps:, n : n + len(known)].T
        yield float(np.max(np.abs(marched - known).max(axis=1) / size))


def sizes(branch: cm.periodic.Branch | Vibration, known: np.ndarray) -> np.ndarray:
    """Half of the way (n_rows,) of each clearance, of both coordinates the larger one, at least a hundredth of it."""
    rig, half = branch.model.rig, np.ptp(known, axis=1) / 2
    scales = np.concatenate([np.full(len(half[rows]), max(half[rows].max(), 0.01 * b.gap))
                          for b, rows in zip(rig.bushings, rig.clearance_rows)])  # fmt: skip
    return scales


def compared(drawn: Drawn, number: int, branch: cm.periodic.Branch, i: int) -> Compared | None:
    """March a point; None if its transient dies out or grows too slowly for that."""
    multiplier = float(np.abs(branch.multipliers[i, 0]))
    if SLOW < multiplier < GROWS:
        return None
    periods = int(np.clip(np.log(DIED) / np.log(multiplier), FEWEST, LONGEST)) if multiplier < 1 else LEAVES_IN
    for resolution in RESOLUTIONS:
        blocks = [periods] if multiplier < 1 else [BLOCK] * (LEAVES_IN // BLOCK)
        for done, off in zip(np.cumsum(blocks), marches(branch, i, resolution, blocks[0])):
            comparison = Compared(drawn.kind, number, i, multiplier, off, int(done))
            if comparison.passes:
                return comparison
    return comparison


def outcome(number: int, seed: int = 0) -> Outcome:
    """Draw a rig, follow its branch, and march three points of it."""
    begun, drawn, points = time.perf_counter(), draw(number, seed), []
    for harmonics, samples in RESOLVED[drawn.model.rig.moves_across]:
        try:
            ends = drawn.frequency, RANGE * drawn.frequency
            branch = cm.periodic.follow_response(drawn.model, drawn.level, ends, harmonics, samples, n_modes=MODES)
        except ClearanceError as refusal:
            return Outcome(drawn, [], str(refusal), time.perf_counter() - begun)
        at = np.unique(np.linspace(0, branch.frequency.size - 1, POINTS).round().astype(int))
        points = [point for i in at if (point := compared(drawn, number, branch, int(i)))]
        if all(point.passes for point in points):
            break
    return Outcome(drawn, points, "", time.perf_counter() - begun)


def table(outcomes: list[Outcome]) -> str:
    """Return rows by kind: rigs, points that stay or leave as they must, the worst one, seconds a rig."""
    lines = [("kind", "rigs", "no branch", "stable", "within 0.1 %", "worst", "unstable", "leave", "s a rig")]
    for kind in (*KINDS, "all"):
        group = [each for each in outcomes if kind in (each.drawn.kind, "all")]
        if not group:
            continue
        stable, others = (
            [p for each in group for p in each.points if (p.multiplier < 1) == stays] for stays in (True, False)
        )
        stay, leave = (f"{np.mean([p.passes for p in points]):.0%}" if points else "" for points in (stable, others))
        worst = f"{max(p.off for p in stable):.1e}" if stable else ""
        cells = stay, worst, len(others), leave, f"{np.mean([each.seconds for each in group]):.2f}"
        lines.append((kind, len(group), sum(bool(each.refused) for each in group), len(stable), *cells))
    return markdown_table(lines)


def main(count: int = 200, seed: int = 0) -> None:
    """Print the table, then what did not pass and why rigs have no branch."""
    outcomes = [outcome(number, seed) for number in range(count)]
    print(table(outcomes))
    for each in outcomes:
        for point in each.points:
            if not point.passes:
                print(f"{point.number} {point.kind}: point {point.index}, |μ| = {point.multiplier:.4f}, "
                      f"{point.off:.1e} after {point.periods} periods")  # fmt: skip
    for number, each in enumerate(outcomes):
        if each.refused:
            print(f"{number} {each.drawn.kind}: {each.refused}")


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
