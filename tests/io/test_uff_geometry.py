"""Geometry of universal files by hand: nodes, elements and coordinate systems in the columns of the format."""

import numpy as np
import pytest

from clearance_mj import Geometry, RecordError, write_uff
from clearance_mj.io.uff import FileWarning, read_geometry
from clearance_mj.structure.geometry import CoordinateSystem, Element

from .uff_by_hand import units_by_hand


def sets(*parts):
    """Data sets of (kind, records)."""
    return "".join(f"    -1\n{kind:6d}\n" + "\n".join(rows) + "\n    -1\n" for kind, rows in parts).encode()


def integers(*values):
    return "".join(f"{value:10d}" for value in values)


def node(number, place, system=0, width=13):
    return integers(number, system, 0, 1) + "".join(f"{x:{width}.5E}" for x in place)


def local(kind=0, reference=0, points=((1, 0, 0), (1, 2, 0), (0, 0, 0))):
    """Data set 18: system 5, its origin, a point on its x axis and one in its plane xz."""
    words = ["".join(f"{x:13.5E}" for x in point) for point in points]
    return 18, [integers(5, kind, reference, 8, 1), "local", words[0] + words[1], words[2]]


def test_double_precision_nodes_in_mm(write):
    """2411 and 781: 4I10 and 1P3D25.16; positions are global, whatever the system of definition."""
    place = (100 / 3, -2e3, 0.0)
    rows = [integers(7, 5, 5, 8), "".join(f"{x:25.16E}" for x in place).replace("E", "D")]
    for kind in (2411, 781):
        got = read_geometry(write(units_by_hand(1e3, 1.0) + sets((kind, rows))))
        np.testing.assert_allclose(got.position, [np.array(place) / 1e3], rtol=1e-15)
        assert (got.numbers, got.displacement_systems) == ((7,), (5,))


def test_positions_in_a_local_system(write):
    """Origin (1, 0, 0), x along the global y, the plane xz holds the global origin: z = -x, y = z × x = -z."""
    got = read_geometry(write(sets((15, [node(1, (2, 3, 4), system=5)]), local())))
    (system,) = got.systems
    np.testing.assert_allclose(system.axes, [(0, 1, 0), (0, 0, -1), (-1, 0, 0)], atol=1e-15)
    np.testing.assert_allclose(got.position, [(1 - 4, 2, -3)], atol=1e-15)
    assert (system.number, system.name, system.kind) == (5, "local", "cartesian")
    flat = ((0, 0, 0), (1, 0, 0), (1, 0, 1))
    with pytest.warns(FileWarning, match="node 1 is defined in a cylindrical system; its angles are taken for degrees"):
        got = read_geometry(write(sets((15, [node(1, (2, 90, 4), system=5)]), local(1, points=flat))))
    np.testing.assert_allclose(got.position, [(0, 2, 4)], atol=1e-15)
    with pytest.warns(FileWarning, match="spherical"):
        got = read_geometry(write(sets((15, [node(1, (2, 90, 90), system=5)]), local(2, points=flat))))
    np.testing.assert_allclose(got.position, [(0, 2, 0)], atol=1e-15)
    with pytest.warns(FileWarning, match="system 5 is defined in system 2, which is taken for the global"):
        read_geometry(write(sets(local(reference=2))))


def test_part_with_a_coordinate_system(write):
    """2420: part, its name; label, kind, colour; name; unit vectors along the axes, and the origin."""
    rows = ["".join(f"{x:25.16E}" for x in row) for row in ((0, 1, 0), (-1, 0, 0), (0, 0, 1), (500, 0, 0))]
    got = read_geometry(
        write(units_by_hand(1e3, 1.0) + sets((2420, [integers(1), "part", integers(2, 0, 8), "cs", *rows])))
    )
    assert got.systems == (CoordinateSystem(2, (0.5, 0.0, 0.0), ((0, 1, 0), (-1, 0, 0), (0, 0, 1)), "cs"),)


def test_elements_with_and_without_orientation(write):
    """A beam has a record of its orientation, a rod with some writers; ten nodes need two records."""
    rows = [*(integers(1, 21, 1, 1, 7, 2), integers(0, 1, 1), integers(3, 4)),
            *(integers(2, 11, 1, 1, 7, 2), integers(0, 1, 1), integers(4, 5)),
            *(integers(3, 11, 1, 1, 7, 2), integers(5, 6)),
            *(integers(4, 24, 1, 1, 7, 3), integers(0, 1, 1), integers(1, 2, 3)),
            *(integers(5, 118, 1, 1, 7, 10), integers(*range(1, 9)), integers(9, 10))]  # fmt: skip
    got = read_geometry(write(sets((2412, rows))))
    assert got.elements == (
        Element(1, (3, 4), 21), Element(2, (4, 5), 11), Element(3, (5, 6), 11), Element(4, (1, 2, 3), 24),
        Element(5, tuple(range(1, 11)), 118),
    )  # fmt: skip


def test_line_filled_with_zeros_and_node_of_two_sets(write):
    line = (82, [integers(1, 3, 1), "line", integers(1, 0, 2, 0, 0, 0, 0, 0)])
    with pytest.warns(FileWarning, match="data set 2: node 1 comes twice; its first place is taken"):
        g = read_geometry(write(sets((15, [node(1, (1, 0, 0)), node(2, (2, 0, 0))]), (15, [node(1, (9, 9, 9))]), line)))
    assert g == Geometry((1, 2), [(1, 0, 0), (2, 0, 0)], ((1, 0, 2),))


@pytest.mark.parametrize("part, said", [
    ((2412, [integers(1, 94, 1, 1, 7, 4), integers(1, 2)]), "element 1 declares 4 nodes, but 2 follow"),
    ((2412, [integers(1, 94, 1, 1, 7, 0)]), "element 1 has 0 nodes"),
    ((2412, ["one"]), "element is 'one', needs a whole number"),
    (local(points=((0, 0, 0), (1, 0, 0), (2, 0, 0))), "system 5: its three points must not lie on one line"),
    ((18, [integers(5, 0, 0, 8, 1), "x"]), "is cut short; needs 3 records"),
    (local(kind=7), "coordinate system 5 is of kind 7; needs 0, 1 or 2"),
    ((2411, [integers(1, 0, 0, 1), "up"]), "position of node 1 is 'UP'"),
    ((82, [integers(1, 2, 1), "line", integers(1, 2, 3)]), "declares 2 nodes, but 3 follow"),
])  # fmt: skip
def test_damaged(write, part, said):
    with pytest.raises(RecordError, match=said) as caught:
        read_geometry(write(sets(part)))
    assert "data set 1" in str(caught.value) and "\n" not in str(caught.value)


def test_six_digits_or_all_of_them(tmp_path):
    """Data set 15 where its six digits are the places, which more programs read, otherwise 2411."""
    for place, kind in (((0.5, 0.0, 0.25), 15), ((1 / 3, 0.0, 0.0), 2411)):
        write_uff(tmp_path / "g.uff", Geometry((1,), [place]))
        assert f"    -1\n{kind:6d} ".encode() in (tmp_path / "g.uff").read_bytes()
        assert read_geometry(tmp_path / "g.uff").nodes == {1: place}
