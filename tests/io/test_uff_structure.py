"""Modes, nodes, trace lines and units of universal files, against the published format, pyuff and sdypy-EMA.

Blocks "by hand" are laid out from the text of the format, which pyuff prints (``pyuff.get_structure_55``).
"""

import dataclasses

import numpy as np
import pytest
import pyuff

from clearance_mj import FRF, Geometry, RecordError, Shaker, extract_modes, read, read_uff, write_uff
from clearance_mj.beam import linear_frf
from clearance_mj.io.uff import FileWarning, read_geometry
from clearance_mj.rig import BASE_NODE, SHAKER_NODE
from clearance_mj.signals import Modes

from .refusals import assert_refused
from .uff_by_hand import ROWS, by_hand, frf_by_hand, units_by_hand

FREQUENCY = np.arange(2.0, 120.0, 0.25)
POLES_HZ, DAMPING = np.array([12.5, 40.2, 90.7]), np.array([0.02, 0.015, 0.01])


def modal_frf(quantity="acceleration/force"):
    """Accelerance of three modes with real shapes: H = Σ -ω² φφ_1 / (ω_r² - ω² + 2jζω_rω); receptance without -ω²."""
    shape = np.array([[1.0, 1.0, 1.0], [0.7, -0.4, -1.2], [0.3, -1.1, 0.8]])
    omega, omega_r = 2 * np.pi * FREQUENCY, 2 * np.pi * POLES_HZ[:, None]
    receptance = 1 / (omega_r**2 - omega**2 + 2j * DAMPING[:, None] * omega_r * omega)
    power = {"displacement": 0, "velocity": 1, "acceleration": 2}[quantity.split("/")[0]]
    value = (1j * omega) ** power * (shape * shape[0] @ receptance)
    return FRF(FREQUENCY, value, None, ("1:+Z", "2:+Z", "3:+Z"), "1:+Z", quantity)


# Units


OF_ACCELERATION = {"g": 9.80665, "G": 9.80665, "mm/s^2": 1e-3, "(mm/s²)": 1e-3, "MM/S**2": 1e-3, "m/s/s": 1.0,
                   "NONE": 1.0, "": 1.0, "m/s^2": 1.0, "m/s2": 1.0, "(m/s²)": 1.0, "[M/S**2]": 1.0}  # fmt: skip


@pytest.mark.parametrize("data, si", [
    *((by_hand(ROWS, unit=label), si) for label, si in OF_ACCELERATION.items()),
    (by_hand(ROWS, numerator=13, unit="mN"), 1e-3), (by_hand(ROWS, numerator=13, unit="MN"), 1e6),
    (units_by_hand(1e3, 1.0) + by_hand(ROWS, unit="mm/s^2"), 1e-3),  # mm in label and file: scaled once
], ids=[*OF_ACCELERATION, "mN", "MN", "label and file"])  # fmt: skip
def test_unit_label_of_a_time_function(write, data, si):
    """1 g = 9.80665 m/s²: BIPM, The International System of Units."""
    (tip,) = read_uff(write(data))
    np.testing.assert_allclose(tip.value, si * np.arange(12), rtol=1e-15)


@pytest.mark.parametrize(("label", "si"), [("g/N", 9.80665), ("(mm/s^2)/kN", 1e-6), ("g", 9.80665), ("NONE", 1.0)])
def test_unit_label_of_an_frf(write, label, si):
    got = read_uff(write(frf_by_hand(unit=label)))
    np.testing.assert_allclose(got.functions, si * np.array([[1 + 2j, 3 - 4j]]), rtol=1e-15)


def test_ratio_of_accelerations_with_one_unit(write):
    """g over what? Taken for m/s² it would be 20 dB off, and not seen: the quantity is not known then."""
    with pytest.warns(FileWarning, match='unit "g" of acceleration/acceleration is not known'):
        got = read_uff(write(frf_by_hand(unit="g", denominator=12)))
    assert (got.quantity, got.unit) == ("unknown/unknown", "g")
    np.testing.assert_array_equal(got.functions, [[1 + 2j, 3 - 4j]])
    got = read_uff(write(frf_by_hand(unit="g/g", denominator=12)))
    np.testing.assert_array_equal(got.functions, [[1 + 2j, 3 - 4j]])


# Geometry


def test_nodes_and_lines_of_a_rig(tmp_path, rig):
    write_uff(tmp_path / "h.uff", modal_frf(), rig)
    got = read_geometry(tmp_path / "h.uff")
    assert got.nodes[BASE_NODE] == (0.0, 0.0, 0.0)
    for sensor in rig.sensors:
        assert got.nodes[sensor.node] == pytest.approx((sensor.position, 0, 0), rel=1e-5)
    (line,) = got.lines
    along = [got.nodes[node][0] for node in line]
    assert along == sorted(along) and set(line) == set(got.nodes)
    np.testing.assert_array_equal(read_uff(tmp_path / "h.uff").value, modal_frf().value)
    both = read(tmp_path / "h.uff")
    assert both.geometry == got
    np.testing.assert_array_equal(both.frf.value, modal_frf().value)


def test_pyuff_reads_the_structure(tmp_path, rig):
    driven = dataclasses.replace(rig, shaker=Shaker("force", 0.3))
    write_uff(tmp_path / "h.uff", modal_frf(), driven)
    sets = pyuff.UFF(str(tmp_path / "h.uff")).read_sets()
    assert [s["type"] for s in sets] == [151, 164, 15, 82, 58, 58, 58]
    nodes, line = sets[2], sets[3]
    assert nodes["node_nums"] == [BASE_NODE, *(s.node for s in rig.sensors), SHAKER_NODE]
    np.testing.assert_allclose(nodes["x"], [0, *(s.position for s in rig.sensors), 0.3], rtol=1e-5)
    assert line["n_nodes"] == len(rig.sensors) + 2 and sorted(line["nodes"]) == sorted(nodes["node_nums"])


def test_geometry_by_hand(write):
    """Columns of the format; data set 164 says mm. A trace line of nine nodes needs two records, 0 lifts the pen."""
    rows = [f"{i:10d}{0:10d}{0:10d}{1:10d}{100.0 * i:13.5E}{-1.0:13.5E}{0.0:13.5E}" for i in range(1, 9)]
    joined = (1, 2, 3, 4, 0, 5, 6, 7, 8)
    lines = [f"{1:10d}{9:10d}{1:10d}", "shaft", "".join(f"{n:10d}" for n in joined[:8]), f"{joined[8]:10d}"]
    text = "".join(f"    -1\n{kind:6d}\n" + "\n".join(body) + "\n    -1\n" for kind, body in ((15, rows), (82, lines)))
    got = read_geometry(write(units_by_hand(1e3, 1.0) + text.encode()))
    assert got == Geometry(tuple(range(1, 9)), [(i / 10, -1e-3, 0.0) for i in range(1, 9)], (joined,))


@pytest.mark.parametrize("kind, body, part", [
    (15, f"{1:10d}{0:10d}{0:10d}{1:10d}{'up':>13}", "position of node 1 is 'UP'"),
    (15, 2 * f"{1:10d}{0:10d}{0:10d}{1:10d}{0.0:13.5E}{0.0:13.5E}{0.0:13.5E}\n", "node 1 comes twice"),
    (15, f"{0:10d}", "node 0 must be > 0"),
    (82, f"{1:10d}{3:10d}{1:10d}\nshaft\n{1:10d}{2:10d}", "declares 3 nodes, but 2 follow"),
    (82, f"{1:10d}{3:10d}{1:10d}", "declares 3 nodes, but 0 follow"),
    (55, "NONE", "is cut short; needs"),
    (58, "", "header is cut short"),
])  # fmt: skip
def test_damaged_geometry(write, kind, body, part):
    with pytest.raises(RecordError, match=part) as caught:
        (read_uff if kind == 55 else read_geometry)(write(f"    -1\n{kind:6d}\n{body}\n    -1\n".encode()))
    assert "\n" not in str(caught.value) and "data set 1" in str(caught.value)


def test_file_without_nodes(write):
    assert_refused(r"holds no geometry \(data sets 15 \(nodes\), 18 ", read_geometry, write(by_hand(ROWS)))


# Modes


def modes(complex_shape=True):
    shape = np.array([[1.0, 0.5], [0.3, -1.0], [-0.25, 0.125]], dtype=complex)
    shape = shape * np.exp(0.2j) if complex_shape else shape
    return Modes(np.array([9.25, 39.75]), np.array([0.034, 0.0125]), shape, ("1:+Z", "2:-Z", "8:+X"))


def test_modes_come_back_with_the_digits_of_the_format(tmp_path):
    write_uff(tmp_path / "m.uff", modes())
    got = read_uff(tmp_path / "m.uff")
    np.testing.assert_allclose(got.frequency, modes().frequency, rtol=1e-5)
    np.testing.assert_allclose(got.damping, modes().damping, rtol=1e-5)
    # Of each node, every axis that moves anywhere; 2:-Z comes back along +Z.
    rows = [got.responses.index(label) for label in ("1:+Z", "2:+Z", "8:+X")]
    np.testing.assert_allclose(got.shape[rows], modes().shape * [[1], [-1], [1]], atol=1e-5)
    assert not got.shape[[i for i in range(len(got.responses)) if i not in rows]].any()


def test_pyuff_reads_our_modes(tmp_path, rig):
    sent = modes()
    write_uff(tmp_path / "m.uff", sent, rig)
    sets = pyuff.UFF(str(tmp_path / "m.uff")).read_sets()
    assert [s["type"] for s in sets] == [151, 164, 15, 82, 55, 55]
    for mode, frequency, damping, column in zip(sets[4:], sent.frequency, sent.damping, sent.shape.T):
        assert abs(mode["eig"]) == pytest.approx(2 * np.pi * frequency, rel=1e-5)
        assert -mode["eig"].real / abs(mode["eig"]) == pytest.approx(damping, rel=1e-5)
        np.testing.assert_array_equal(mode["node_nums"], [1, 2, 8])
        np.testing.assert_allclose(mode["r3"], [column[0], -column[1], 0], atol=1e-5)
        np.testing.assert_allclose(mode["r1"], [0, 0, column[2]], atol=1e-5)


@pytest.mark.parametrize("kind", [2, 3, 7])
def test_we_read_pyuffs_modes(tmp_path, kind):
    """Analysis type 2 holds frequency and damping ratio, 3 and 7 the eigenvalue -ζω + jω√(1-ζ²)."""
    omega, zeta = 2 * np.pi * 50.0, 0.02
    fields = {"freq": 50.0, "modal_m": 1.0, "modal_damp_vis": zeta, "modal_damp_his": 0.0}
    shape = np.array([1.0, -0.5])
    if kind != 2:
        fields, shape = {"eig": omega * complex(-zeta, np.sqrt(1 - zeta**2))}, shape * (1 + 1j)
    sets = {"type": 55, "model_type": 1, "analysis_type": kind, "data_ch": 2, "spec_data_type": 8, "load_case": 1,
            "mode_n": 1, "node_nums": [4, 7], "r1": 0 * shape, "r2": shape, "r3": 0 * shape, **fields}  # fmt: skip
    pyuff.UFF(str(tmp_path / "m.uff")).write_sets([sets], mode="overwrite")
    got = read_uff(tmp_path / "m.uff")
    assert got.frequency == pytest.approx([50.0], rel=1e-5)
    assert got.damping == pytest.approx([zeta], rel=1e-5)
    np.testing.assert_allclose(got.shape[:, 0], shape, atol=1e-5)
    assert got.responses == ("4:+Y", "7:+Y")


def test_modes_that_the_format_cannot_hold(tmp_path):
    with pytest.raises(RecordError, match="cannot be written: mode shape at 8:S"):
        write_uff(tmp_path / "m.uff", dataclasses.replace(modes(), responses=("1:+Z", "2:+Z", "8:S")))
    assert_refused("there is no mode", write_uff, tmp_path / "m.uff", Modes(np.empty(0), np.empty(0), np.empty((3, 0))))
    assert not list(tmp_path.iterdir())


# Other people's readers on our files


@pytest.mark.parametrize("quantity", ["acceleration/force", "displacement/force"])
def test_sdypy_ema_finds_our_modes_in_our_file(tmp_path, quantity):
    """sdypy-EMA reads the universal file itself; natural frequencies against the model's and against ours."""
    ema = pytest.importorskip("sdypy.EMA")
    write_uff(tmp_path / "h.uff", modal_frf(quantity))
    model = ema.Model(lower=2, upper=119, pol_order_high=30)
    model.read_uff(str(tmp_path / "h.uff"))
    assert model.frf_form == {"acceleration": "accelerance", "displacement": "receptance"}[quantity.split("/")[0]]
    model.get_poles(show_progress=False)
    ours = extract_modes(modal_frf(), 3)
    # Near the peaks; a window that reaches down to 0 Hz would catch the poles that sdypy-EMA masks with zeros.
    model.select_closest_poles([13, 40, 90], f_window=10, fn_temp=0.01, xi_temp=0.1)
    np.testing.assert_allclose(model.nat_freq, POLES_HZ, rtol=1e-3)
    np.testing.assert_allclose(model.nat_freq, ours.frequency, rtol=1e-3)
    np.testing.assert_allclose(model.nat_xi, DAMPING, rtol=0.02)


def test_sdypy_ema_finds_a_cantilever_in_our_file(tmp_path, rig):
    """The linear model of a bare cantilever through a universal file: λ² √(EI/ρA) / (2π l²), undamped frequencies."""
    ema = pytest.importorskip("sdypy.EMA")
    frequency = np.arange(2.0, 240.0, 0.25)
    bare = dataclasses.replace(rig, bushings=(), masses=(), shaker=Shaker("force", 0.3))
    value = linear_frf(bare, frequency)
    write_uff(tmp_path / "h.uff", FRF(frequency, value, None, bare.sensor_labels, "200:+Z", "acceleration/force"), bare)
    model = ema.Model(lower=2, upper=239, pol_order_high=40)
    model.read_uff(str(tmp_path / "h.uff"))
    model.get_poles(show_progress=False)
    beam = bare.beam
    scale = np.sqrt(beam.young_modulus * (beam.diameter / 4) ** 2 / beam.density) / (2 * np.pi * beam.length**2)
    closed = np.array([1.8751041, 4.6940911, 7.8547574, 10.9955407]) ** 2 * scale
    model.select_closest_poles(list(closed.round()), f_window=5, fn_temp=0.01, xi_temp=0.1)
    np.testing.assert_allclose(model.nat_freq, closed, rtol=1e-3)


def test_pyfrf_makes_our_frf_of_our_record(tmp_path, rig):
    """The record through a universal file and pyuff into pyFRF, against our FRF through a file; no window in either."""
    pyfrf = pytest.importorskip("pyFRF")
    from clearance_mj.io.formats import to_channels
    from clearance_mj.signals.frf import estimate_frf
    from clearance_mj.signals.response import Response

    x = np.random.default_rng(4).standard_normal(4096)
    resp = Response(512.0, x, np.stack([np.convolve(x, [0, 1, -0.5])[:4096], np.roll(x, 3)]), kind="force",
                    responses=("1:+Z", "2:+Z"), reference="200:+Z")  # fmt: skip
    write_uff(tmp_path / "r.uff", to_channels(resp), rig)
    write_uff(tmp_path / "h.uff", estimate_frf(resp, resolution=1.0, window="boxcar"), rig)
    force, *responses = (s["data"] for s in pyuff.UFF(str(tmp_path / "r.uff")).read_sets() if s["type"] == 58)
    other = pyfrf.FRF(512, exc_type="f", resp_type="a", window="none", nperseg=512, fft_len=512, noverlap=256)
    other.add_data(force[None, None], np.array(responses)[None])
    theirs = np.squeeze(other.get_FRF(frf_form="accelerance"))
    # Records are stored in single precision.
    ours = read_uff(tmp_path / "h.uff", what="frf").functions
    np.testing.assert_allclose(ours[:, 1:], theirs[:, 1:], rtol=2e-5, atol=2e-6)
