"""Universal files laid out by hand from the published format, and what is written to be read again."""

import numpy as np

from clearance_mj import FRF, Channel

RNG = np.random.default_rng(20261120)


def channels(n=64, fs=2048.0):
    def noise():
        return RNG.standard_normal(n).astype(np.float32)

    return [
        Channel("base plate", 100, "+Z", "acceleration", noise(), fs),
        Channel("accelerometer 3", 3, "-Z", "acceleration", noise(), fs),
        Channel("probe 6", 6, "+Z", "displacement", 1e-4 * noise(), fs),
        Channel("Bürste 7", 7, "+RX", "velocity", noise(), fs),
        Channel("stinger", 200, "S", "force", noise(), fs),
    ]


def frf(frequency=None, coherence=True, n=3):
    frequency = np.arange(10, 440) * 0.5 if frequency is None else frequency
    shape = (n, len(frequency))
    value = RNG.standard_normal(shape) + 1j * RNG.standard_normal(shape)
    labels = ("1:+Z", "2:-X", "8:+RY")[:n]
    return FRF(frequency, value, RNG.random(shape) if coherence else None, labels, "100:+Z")


def assert_same_channels(a, b):
    assert len(a) == len(b)
    for one, other in zip(a, b):
        np.testing.assert_array_equal(one.value, other.value)
        for name in ("name", "node", "direction", "quantity", "fs", "start", "size"):
            assert getattr(one, name) == getattr(other, name)


def by_hand(rows, *, kind=1, ordinate=2, count=12, spacing=1, first="0.00000E+00", step="1.00000E-02",
            axis=17, numerator=12, denominator=0, dof=(3, 3, 0, 0), unit="NONE", binary=""):  # fmt: skip
    """One data set 58 in the columns of the published format; ``rows`` is its body (str or bytes)."""
    node, direction, reference, reference_direction = dof
    lines = [
        "    -1",
        f"    58{binary}",
        *(f"{t:<80}" for t in ("tip", "NONE", "NONE", "NONE", "NONE")),
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {'NONE':10}{node:10d}{direction:4d}"
        f" {'NONE':10}{reference:10d}{reference_direction:4d}",
        f"{ordinate:10d}{count:10d}{spacing:10d}{first:>13}{step:>13}{'0.00000E+00':>13}",
        f"{axis:10d}    0    0    0 {'NONE':20} {'NONE':20}",
        f"{numerator:10d}    0    0    0 {'NONE':20} {unit:20}",
        f"{denominator:10d}    0    0    0 {'NONE':20} {'NONE':20}",
        f"{0:10d}    0    0    0 {'NONE':20} {'NONE':20}",
    ]
    head = "\n".join([*lines, ""]).encode()
    return head + (rows if binary else "".join(r + "\n" for r in rows).encode()) + b"    -1\n"


def units_by_hand(length, force):
    def d(value):
        return f"{value:25.17E}".replace("E", "D")

    return (f"    -1\n   164\n{9:10d}{'some':20}{1:10d}\n{d(length)}{d(force)}{d(1)}\n{d(0)}\n    -1\n").encode()


ROWS = ["".join(f"{v:13.5E}" for v in range(i, i + 6)) for i in (0, 6)]  # 0 to 11 as 6E13.5


def frf_by_hand(**changes):
    rows = [f"{1:20.12E}{2:20.12E}{3:20.12E}{-4:20.12E}"]
    values = {"kind": 4, "ordinate": 6, "count": 2, "axis": 18, "denominator": 13, "dof": (8, 3, 5, 3)}
    return by_hand(rows, **(values | changes))


def coherence_by_hand(response, reference):
    return by_hand([f"{0.5:20.12E}{1:20.12E}"], kind=6, ordinate=4, count=2, axis=18, dof=(response, 3, reference, 3))
