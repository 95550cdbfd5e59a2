"""Finite elements of a space frame, and the synthetic frame of the tutorial on matrices, written as FE programs do.

Elements are Euler-Bernoulli beams with axial force and torsion, 12 x 12, with consistent mass (Przemieniecki, Theory of
Matrix Structural Analysis, 1968, chapters 5 and 11).
"""

import csv
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse

from experiments.script import run

DIRECTIONS = ("X", "Y", "Z", "RX", "RY", "RZ")


@dataclass(frozen=True)
class Bar:
    """A round bar or tube, in any one system of units."""

    diameter: float
    bore: float = 0.0
    young_modulus: float = 210e3
    density: float = 7.85e-9
    poisson_ratio: float = 0.3

    @property
    def area(self) -> float:
        """Cross-section."""
        return np.pi * (self.diameter**2 - self.bore**2) / 4

    @property
    def second_moment(self) -> float:
        """Second moment of area; the polar one is twice that."""
        return np.pi * (self.diameter**4 - self.bore**4) / 64


@dataclass
class Frame:
    """Nodes and beam elements."""

    nodes: list[np.ndarray] = field(default_factory=list)
    elements: list[tuple[int, int, Bar]] = field(default_factory=list)
    lumps: list[tuple[int, float]] = field(default_factory=list)

    def node(self, place: Sequence[float]) -> int:
        """Index of the node at a place, made if there is none."""
        for i, known in enumerate(self.nodes):
            if np.allclose(known, place, atol=1e-9):
                return i
        self.nodes.append(np.array(place, dtype=float))
        return len(self.nodes) - 1

    def line(self, start: Sequence[float], end: Sequence[float], count: int, bar: Bar) -> list[int]:
        """Elements from place to place; returns the nodes."""
        made = [self.node(place) for place in np.linspace(start, end, count + 1)]
        self.elements += [(a, b, bar) for a, b in zip(made, made[1:])]
        return made

    def matrices(self) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array]:
        """Mass and stiffness, six degrees of freedom a node."""
        rows, columns, masses, stiffnesses = [], [], [], []
        for a, b, bar in self.elements:
            mass, stiffness = element(self.nodes[a], self.nodes[b], bar)
            dofs = np.r_[6 * a : 6 * a + 6, 6 * b : 6 * b + 6]
            rows.append(np.repeat(dofs, 12))
            columns.append(np.tile(dofs, 12))
            masses.append(mass.ravel())
            stiffnesses.append(stiffness.ravel())
        size = 6 * len(self.nodes)
        place = np.concatenate(rows), np.concatenate(columns)
        mass = scipy.sparse.coo_array((np.concatenate(masses), place), (size, size)).tolil()
        for node, lump in self.lumps:
            for i in range(6 * node, 6 * node + 3):
                mass[i, i] += lump
        return mass.tocsr(), scipy.sparse.coo_array((np.concatenate(stiffnesses), place), (size, size)).tocsr()


def element(start: np.ndarray, end: np.ndarray, bar: Bar) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness (12, 12) of one element."""
    length = float(np.linalg.norm(end - start))
    axial = np.array([[1.0, -1.0], [-1.0, 1.0]])
    shared = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6
    bending, carried = _bending(length)
    shear = bar.young_modulus / (2 * (1 + bar.poisson_ratio))
    stiffness, mass = np.zeros((2, 12, 12))
    line = bar.density * bar.area
    for dofs, k, m in (((0, 6), bar.young_modulus * bar.area, line), ((3, 9), shear, bar.density)):
        polar = 2 * bar.second_moment if dofs[0] == 3 else 1.0
        stiffness[np.ix_(dofs, dofs)] += k * polar / length * axial
        mass[np.ix_(dofs, dofs)] += m * polar * length * shared
    for dofs, sign in (((1, 5, 7, 11), 1.0), ((2, 4, 8, 10), -1.0)):
        turn = np.diag([1.0, sign, 1.0, sign])
        stiffness[np.ix_(dofs, dofs)] += bar.young_modulus * bar.second_moment * turn @ bending @ turn
        mass[np.ix_(dofs, dofs)] += line * turn @ carried @ turn
    along = (end - start) / length
    side = np.cross([0.0, 0.0, 1.0] if abs(along[2]) < 0.9 else [0.0, 1.0, 0.0], along)
    side /= np.linalg.norm(side)
    turn = np.kron(np.eye(4), np.array([along, side, np.cross(along, side)]))
    return turn.T @ mass @ turn, turn.T @ stiffness @ turn


def _bending(h: float) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness for E I = 1 and consistent mass for ρ A = 1 of deflection and rotation at both ends."""
    stiffness = [
        [12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h], [-12, -6 * h, 12, -6 * h],
        [6 * h, 2 * h * h, -6 * h, 4 * h * h],
    ]  # fmt: skip
    mass = [
        [156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h], [54, 13 * h, 156, -22 * h],
        [-13 * h, -3 * h * h, -22 * h, 4 * h * h],
    ]  # fmt: skip
    return np.array(stiffness) / h**3, np.array(mass) * h / 420


def pump_frame() -> tuple[Frame, dict[str, int]]:
    """A table of tubes with a pump on it, and a pipe whose end passes a ring on a bracket: mm, t, s, N. Synthetic."""
    frame, named = Frame(), {}
    tube, pipe, bracket = Bar(40.0, 34.0), Bar(17.2, 13.2), Bar(22.0)
    corners = [(0.0, 0.0), (600.0, 0.0), (600.0, 400.0), (0.0, 400.0)]
    feet = [frame.node((*corner, 0.0)) for corner in corners]  # nodes 1 to 4
    for corner in corners:
        frame.line((*corner, 0.0), (*corner, 500.0), 3, tube)
    rails = [frame.line((*a, 500.0), (*b, 500.0), 4, tube) for a, b in zip(corners, corners[1:] + corners[:1])]
    named["pump"], named["bracket foot"], named["pipe foot"] = rails[0][2], rails[1][2], rails[3][2]
    frame.line((0.0, 200.0, 500.0), (0.0, 200.0, 650.0), 2, pipe)
    run = frame.line((0.0, 200.0, 650.0), (600.0, 200.0, 650.0), 6, pipe)
    arm = frame.line((600.0, 200.0, 500.0), (600.0, 200.0, 640.0), 2, bracket)
    named |= {"valve": run[3], "pipe end": run[-1], "ring": arm[-1]}
    frame.lumps += [(named["pump"], 8e-3), (named["valve"], 0.6e-3)]
    assert feet == [0, 1, 2, 3]
    return frame, named


def export(frame: Frame, folder: Path) -> None:
    """Write M.mtx, K.mtx (symmetric, the lower half) and dofs.csv, as FE programs export them."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, matrix in zip(("M", "K"), frame.matrices()):
        whole = matrix.tocoo()
        small = np.abs(whole.data) < 1e-12 * np.abs(whole.data).max()
        whole.data[small] = 0.0
        whole.eliminate_zeros()
        scipy.io.mmwrite(folder / f"{name}.mtx", whole, "synthetic, mm t s N", precision=12, symmetry="symmetric")
    with (folder / "dofs.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["node", "direction", "x", "y", "z"])
        for number, place in enumerate(frame.nodes, 1):
            table.writerows([number, direction, *(f"{x:g}" for x in place)] for direction in DIRECTIONS)


def main(out: Path = Path(__file__).parents[1] / "models" / "pump_frame") -> None:
    """Write the frame of the pump into a folder."""
    frame, places = pump_frame()
    export(frame, out)
    print({name: index + 1 for name, index in places.items()})


if __name__ == "__main__":
    sys.exit(run(main, __doc__))
