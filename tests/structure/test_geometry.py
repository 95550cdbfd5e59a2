"""Geometry as data: edges, mode shapes on it, labelled arrays, figures."""

import numpy as np

from clearance_mj.core.errors import RecordError
from clearance_mj.io import formats
from clearance_mj.signals.ema import Modes
from clearance_mj.structure.geometry import CoordinateSystem, Element, Geometry
from tests.fuzz import samples_uff

from ..refusals import assert_refused

TURNED = CoordinateSystem(3, (1.0, 0.0, 0.0), ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), "turned")


def square():
    """Nodes 1 to 4 around a square of 2 m; node 3 moves along the axes of a system turned by 90° about z."""
    position = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
    return Geometry((1, 2, 3, 4), position, ((1, 2, 0, 3, 4, 9),), (), (TURNED,), (0, 0, 3, 0))


def test_edges():
    """0 lifts the pen, node 9 has no place, an edge that two elements share is one."""
    assert square().edges == ((1, 2), (3, 4))
    brick = Element(1, tuple(range(1, 9)), 115)
    assert len(brick.edges) == 12 and (4, 1) in brick.edges and (1, 5) in brick.edges and (5, 6) in brick.edges
    assert [len(Element(1, tuple(range(1, n + 1)), kind).edges) for n, kind in ((4, 111), (6, 112))] == [6, 9]
    assert Element(1, (1, 2), 21).edges == ((1, 2),)
    assert Element(1, (1, 2, 3), 91).edges == ((1, 2), (2, 3), (3, 1))
    shells = (Element(1, (1, 2, 3), 91), Element(2, (1, 3, 4), 91))
    assert Geometry((1, 2, 3, 4), np.zeros((4, 3)), (), shells).edges == ((1, 2), (2, 3), (1, 3), (3, 4), (1, 4))


def test_mode_shape_along_local_axes():
    """Node 3's x is the global y, its y the global -x; -Z turns the sign; a rotation moves nothing."""
    responses = ("1:-Z", "3:+X", "3:+Y", "2:+RX", "7:+Z")
    modes = Modes([10.0], [0.01], np.array([[1.0], [2.0], [3.0], [4.0], [5.0]]), responses)
    np.testing.assert_array_equal(square().displacement(modes, 1), [[0, 0, -1], [0, 0, 0], [-3, 2, 0], [0, 0, 0]])
    assert square().missing(responses) == ("7:+Z",)
    (ax,) = square().plot(modes, scale=1.0).axes
    assert ax.get_title() == "mode 1: 10 Hz, damping 1 %; without a place: 7:+Z"
    drawn = np.array([line.get_data_3d() for line in ax.lines][-1])
    np.testing.assert_array_equal(drawn[:, :2].T, [(0, 0, -1), (2, 0, 0)])  # the edge from node 1 to node 2
    for mode, part in ((2, "mode 2 is not there; there are 1 modes"), (0, "mode 0 is not there")):
        assert_refused(RecordError, part, square().plot, modes, mode)
    words = r"no response of the modes is a translation at a node .* the modes have 7:\+Z"
    assert_refused(RecordError, words, square().plot, Modes([1.0], [0.0], [[1.0]], ("7:+Z",)))


def test_shape_is_drawn_at_its_largest_phase():
    """A real shape times j is drawn as the shape itself, a tenth of the extent of 2 m."""
    shape = np.array([[1.0], [-0.5]])
    for factor in (1.0, 1j):
        (ax,) = square().plot(Modes([1.0], [0.0], factor * shape, ("1:+Z", "2:+Z"))).axes
        np.testing.assert_allclose(np.abs(np.array(ax.lines[-1].get_data_3d())[2, :2]), [0.2, 0.1], rtol=1e-12)


def test_labelled_arrays_and_files(tmp_path):
    sent = samples_uff.geometry()
    ds = sent.to_xarray()
    assert ds["position"].dims == ("node", "axis") and float(ds["position"].sel(node="2", axis="x")) == 1 / 3
    assert Geometry.from_xarray(ds) == sent
    for suffix in (".nc", ".h5", ".uff"):
        formats.write(tmp_path / f"g{suffix}", sent)
        assert formats.read(tmp_path / f"g{suffix}") == sent
    none = Geometry((), np.empty((0, 3)), ((1, 2),))
    formats.write(tmp_path / "none.nc", none)
    assert formats.read(tmp_path / "none.nc") == none and len(none.plot().axes) == 1
    assert_refused(RecordError, "its elements is not JSON", Geometry.from_xarray, ds.assign_attrs(elements="["))
    words = "its lines, elements or systems are no geometry"
    assert_refused(RecordError, words, Geometry.from_xarray, ds.assign_attrs(elements="[[1]]"))


def test_overview():
    text = repr(samples_uff.geometry())
    for part in ("Geometry of 8 nodes", "0 to 0.3333 m", "3 of kinds 21, 94, 115", "3 turned"):
        assert part in text


def test_impossible():
    assert_refused(RecordError, "node 1 comes twice", Geometry, (1, 1), np.zeros((2, 3)))
    assert_refused(RecordError, "2 nodes with 1 positions", Geometry, (1, 2), np.zeros((1, 3)))
