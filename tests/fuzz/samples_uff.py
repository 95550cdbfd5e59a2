"""Universal files by hand, and what other programs put into them: small, so that one change is a large one."""

import functools
import math
import tempfile
from pathlib import Path

import numpy as np

from clearance_mj import Geometry, Spectra
from clearance_mj.structure.geometry import CoordinateSystem, Element
from tests.io.uff_by_hand import by_hand, units_by_hand
from tests.structure.test_modes import cantilever, normal_modes, units, write

N = 6


def spectra(turning=False):
    """Auto spectra, or cross spectra over uneven lines."""
    value = np.exp((1j if turning else 1) * np.arange(8)).reshape(2, 4)
    if turning:
        lines = np.array([1.0, 2.0, 4.0, 5.0])
        return Spectra("cross spectrum", lines, value, ("6:+Z", "7:+Z"), ("100:+Z", "100:+Z"), units=("g*N", ""))
    return Spectra(
        "auto spectrum", 1.0 + np.arange(4), value, ("6:+Z", "0:S"), names=("a", "b"),
        quantities=("acceleration", "unknown"), units=("(m/s²)²", "Pa^2"),
    )  # fmt: skip


def geometry():
    """Nodes, a line, a beam, a shell and a brick, and a local coordinate system."""
    position = np.array([(i & 1, i >> 1 & 1, i >> 2) for i in range(8)]) / 3
    elements = (Element(1, (1, 2), 21), Element(2, (1, 2, 4, 3), 94), Element(3, (1, 2, 4, 3, 5, 6, 8, 7), 115))
    turned = CoordinateSystem(3, (1.0, 0.0, 0.0), ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), "turned")
    return Geometry(tuple(range(1, 9)), position, ((1, 2, 0, 4),), elements, (turned,), (0, 3, 0, 0, 0, 0, 0, 0))


def uff() -> list[bytes]:
    row = "".join(f"{math.sin(i):13.5e}" for i in range(N))
    uneven = ["".join(f"{i / 64:13.5e}{i:13.5e}" for i in range(a, a + 3)) for a in (0, 3)]
    doubles = ["".join(f"{math.sin(i):20.11e}" for i in range(a, min(a + 4, N))) for a in (0, 4)]
    time = {"count": N, "dof": (6, 3, 100, 3), "step": f"{1 / 64:.5e}", "unit": "g"}
    frf = {"kind": 4, "ordinate": 5, "count": 3, "axis": 18, "denominator": 12, "dof": (6, 3, 100, 3)}
    return [
        by_hand([row], **time), by_hand(uneven, spacing=0, **time), by_hand(doubles, ordinate=4, **time),
        by_hand([row], **frf), units_by_hand(1e3, 1.0) + by_hand([row], **time | {"unit": "NONE"}),
        units_by_hand(0, 0) + by_hand([row], **time | {"numerator": 0, "unit": "V", "dof": (0, 0, -1, 0)}),
        by_hand([row], **frf) + by_hand([row[:39]], kind=6, count=3, axis=18, dof=(6, 3, 100, 3)),
        by_hand([row], kind=9, count=N, axis=0, unit="g^2/Hz") + by_hand([row], **frf | {"kind": 3}),
        *modes_uff(),
        *("".join(f"    -1\n{kind:6d}\n{body}\n    -1\n" for kind, body in sets).encode() for sets in GEOMETRIES),
    ]  # fmt: skip


_TRIAD = "{:10d}{:10d}{:10d}\nturned\n" + 4 * "{:25.16E}{:25.16E}{:25.16E}\n"
_NODES = "".join(f"{i:10d}{3:10d}{3:10d}{1:10d}{i:13.5E}{-i:13.5E}{0:13.5E}\n" for i in (1, 2, 3, 4))
_FULL = "".join(f"{i:10d}{0:10d}{3:10d}{1:10d}\n{i:25.16E}{-i:25.16E}{0:25.16E}\n" for i in (1, 2, 3))
_ELEMENTS = f"{1:10d}{21:10d}{1:10d}{1:10d}{7:10d}{2:10d}\n{0:10d}{1:10d}{1:10d}\n{1:10d}{2:10d}\n"
_ELEMENTS += f"{2:10d}{94:10d}{1:10d}{1:10d}{7:10d}{4:10d}\n{1:10d}{2:10d}{3:10d}{4:10d}\n"
_LINE = f"{1:10d}{4:10d}{1:10d}\nline\n{1:10d}{2:10d}{0:10d}{3:10d}{0:10d}{0:10d}{0:10d}{0:10d}\n"
_LOCAL = f"{3:10d}{1:10d}{0:10d}{8:10d}{1:10d}\nlocal\n" + 3 * f"{1:13.5E}{0:13.5E}"
_LOCAL += f"\n{0:13.5E}{1:13.5E}{0:13.5E}\n"
_PART = "1\npart\n" + _TRIAD.format(3, 0, 0, *(0, 1, 0), *(-1, 0, 0), *(0, 0, 1), *(1, 2, 3))
GEOMETRIES = (
    ((15, _NODES), (82, _LINE), (2412, _ELEMENTS), (18, _LOCAL)), ((2411, _FULL), (82, _LINE), (2420, _PART)),
    ((1858, "0"), (2467, "1")),
)  # fmt: skip
"""Kinds and records of data sets of geometry"""


@functools.cache
def modes_uff() -> list[bytes]:
    """Data sets 55 and 2414 of real modes with modal masses and of complex ones with modal A."""
    normal = {kind: [*normal_modes(cantilever(2), kind, 1e3)] for kind in (55, 2414)}
    from_a = {"data_type": 5, "analysis_type": 3, "eig": -2 + 90j, "modal_a": 3j, "modal_b": 0.0}
    complex_modes = [mode | from_a | {r: mode[r] * (1 + 0.1j) for r in ("r1", "r2", "r3")} for mode in normal[55]]
    with tempfile.TemporaryDirectory() as name:
        sets = ([units(1e3), *normal[55]], [units(1e3), *normal[2414]], [units(), *complex_modes], normal[55])
        return [write(Path(name) / "m.uff", mode_set).read_bytes() for mode_set in sets]
