"""Records of rigs whose points are named degrees of freedom in any direction, in every format and in datasets."""

import dataclasses

import numpy as np
import pytest

import clearance_mj as cm
from clearance_mj.io import formats
from clearance_mj.io.uff import rig_geometry
from clearance_mj.structure import Material, Matrices, Section, Shaft, Shafts, Support

FS = 1024.0


def bushing(position, to=None, length=0.0):
    return cm.Bushing(position, 1e-4, length, cm.Grease(1e3, 1.0), cm.Contact(1e5, 5.0), to=to)


def frame():
    """Three masses in a chain, which move along X and across it: two stops at one of them, one between two."""
    chain = np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    matrices = Matrices(units="m-kg-s", mass=np.eye(6).tolist(),
                        stiffness=(4e4 * np.kron(np.diag([1.0, 0.5]), chain)).tolist(),
                        dofs=["1:X", "2:X", "3:X", "1:Z", "2:Z", "3:Z"], damping_ratios=(0.02,))  # fmt: skip
    return cm.Rig("frame", None, (bushing("3:-X"), bushing("3:+Z"), bushing("2:X", to="3:X")),
                  (cm.Sensor(3, "3:-X"), cm.Sensor(3, "3:Z"), cm.Sensor(301, "2:X")),
                  shaker=cm.Shaker("base", direction=(-1.0, 0.0, 0.5)), structure=matrices)  # fmt: skip


@pytest.fixture(scope="module")
def run():
    rig = frame()
    return rig, cm.simulate(rig, cm.excitation.random(0.5, FS, (5, 200), 5.0, 1), cm.ConstantLaw(1e5, 5.0), "modal")


def test_every_probe_has_a_channel_of_its_own():
    """Nodes from 301 on that no sensor has; the sensor's node in a bushing around a shaft, once."""
    assert frame().probe_labels == ["302:-X", "303:+Z", "304:+X"]
    assert frame().sensor_labels == ["3:-X", "3:+Z", "301:+X"]
    tube, rod = (
        Shaft((Section(1.0, diameter=d),), (Support(0.0, "clamped"),), (), Material(2e11, 7850.0), name=name)
        for d, name in ((0.03, "tube"), (0.01, "rod"))
    )
    bushings = bushing("rod@0.5", length=0.02), bushing("rod@0.8", length=0.02), bushing("rod@0.6", to="tube@0.6")
    sensors = cm.Sensor(1, "rod@0.505"), cm.Sensor(2, "rod@0.499"), cm.Sensor(3, "tube@0.8"), cm.Sensor(4, "rod@0.6")
    rig = cm.Rig("two", None, bushings, sensors, structure=Shafts((tube, rod)))
    assert rig.probe_labels == ["2:+Z", "301:+Z", "302:+Z"]
    assert rig_geometry(rig).lines == ((2, 1, 4, 302, 301), (3,))


def test_one_node_may_have_sensors_in_several_directions_but_not_in_both_signs():
    rig = frame()
    with pytest.raises(Exception, match=r"sensors\[1\]\.node 3 is used twice"):
        rig.replace(sensors=(cm.Sensor(3, "3:-X"), cm.Sensor(3, "3:+X")))


@pytest.mark.parametrize("suffix", [".uff", ".csv", ".mat", ".nc"])
def test_responses_come_back_from_files(tmp_path, run, suffix):
    rig, response = run
    assert response.reference == "100:-X" and response.responses == ("3:-X", "3:+Z", "301:+X")
    path = tmp_path / f"run{suffix}"
    formats.write(path, response, rig)
    record = formats.read_record(path, rig, "identify")
    again = record.response()
    for name in ("excitation", "acceleration", "displacement"):
        rtol = np.finfo(np.float32 if suffix == ".uff" else np.float64).eps  # universal files are of single precision
        np.testing.assert_allclose(getattr(again, name), getattr(response, name), rtol=2 * rtol)
    assert (again.reference, again.responses) == (response.reference, response.responses)
    assert record.excitation().kind == "base"


def test_channels_of_the_other_sign_are_turned_round(run):
    rig, response = run
    other = str.maketrans("+-", "-+")
    channels = [
        dataclasses.replace(c, direction=c.direction.translate(other), value=-c.value)
        for c in formats.to_channels(response, rig)
    ]
    again = cm.Record("turned", "identify", rig, FS, channels).response()
    np.testing.assert_array_equal(again.acceleration, response.acceleration)
    np.testing.assert_array_equal(again.displacement, response.displacement)
    np.testing.assert_array_equal(again.excitation, response.excitation)


def test_what_a_record_lacks_is_named(run):
    rig, response = run
    channels = formats.to_channels(response, rig)
    for lost, what in (
        ("3:-X", "has no acceleration at node 3 along X, a sensor of the rig"),
        ("100:-X", "has no acceleration at node 100 along X, the excitation of a record of kind"),
    ):
        with pytest.raises(cm.RecordError, match=what):
            cm.Record("r", "identify", rig, FS, [c for c in channels if c.label != lost])
    without = cm.Record("r", "identify", rig, FS, [c for c in channels if c.label != "303:+Z"])
    assert without.response().displacement is None


def test_a_dataset_is_complete(tmp_path, run):
    """A structure of two files; the folder is moved and the files are removed."""
    rig, response = run
    mass, stiffness = (np.array(m) for m in (rig.structure.mass, rig.structure.stiffness))
    for name, matrix in (("mass", mass), ("stiffness", stiffness)):
        (tmp_path / name).mkdir()
        np.save(tmp_path / name / "matrix.npy", matrix)
    files = {name: str(tmp_path / name / "matrix.npy") for name in ("mass", "stiffness")}
    rig = rig.replace(structure=dataclasses.replace(rig.structure, **files))
    record = cm.Record("one", "identify", rig, FS, formats.to_channels(response, rig))
    cm.write_dataset(tmp_path / "there", rig, [record])
    (tmp_path / "there").rename(tmp_path / "moved")
    for path in files.values():
        (tmp_path / path).unlink()
    again = cm.Dataset.load(tmp_path / "moved")
    assert {p.name for p in (tmp_path / "moved" / "structure").iterdir()} == {"matrix.npy", "stiffness_matrix.npy"}
    assert again.rig.linear.total_mass == frame().linear.total_mass
    np.testing.assert_allclose(again.records[0].response().displacement, response.displacement, rtol=1e-6)
    cm.write_dataset(tmp_path / "moved", again.rig, again.records)  # over itself
    assert cm.Dataset.load(tmp_path / "moved").rig == again.rig


def test_geometry_is_where_the_structure_says(tmp_path):
    """Nodes at the positions of the degrees of freedom's table; nothing is known of lines between them."""
    rows = ["node,direction,x,y,z", *(f"{node},{d},{0.1 * node},{0.2},{-0.3}" for d in "XZ" for node in (1, 2, 3))]
    (tmp_path / "dofs.csv").write_text("\n".join(rows) + "\n")
    rig = frame()
    rig = rig.replace(structure=dataclasses.replace(rig.structure, dofs=str(tmp_path / "dofs.csv")))
    geometry = rig_geometry(rig)
    assert geometry.nodes[100] == (0.0, 0.0, 0.0) and geometry.lines == ()
    np.testing.assert_allclose(geometry.nodes[3], (0.3, 0.2, -0.3))
    np.testing.assert_allclose(geometry.nodes[304], (0.2, 0.2, -0.3))
